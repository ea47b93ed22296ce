"""The bill of materials of a release names each of its files with its checksum, and what is in them.

    check_bill.py DIST"""
import hashlib
import json
import pathlib
import re
import sys

dist = pathlib.Path(sys.argv[1])
bill = json.loads(next(dist.glob("*.spdx.json")).read_text())
packages = {package["SPDXID"]: package for package in bill["packages"]}
assert len(packages) == len(bill["packages"]), "identifiers are not unique"
assert all(re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", identifier) for identifier in packages)
for relation in bill["relationships"]:
    assert {relation["spdxElementId"], relation["relatedSpdxElement"]} <= packages.keys() | {"SPDXRef-DOCUMENT"}

files = {package["packageFileName"]: identifier for identifier, package in packages.items()
         if "packageFileName" in package}
expected = {path.name for path in dist.iterdir() if path.suffix != ".json" and path.name != "SHA256SUMS"}
assert files.keys() == expected, files.keys() ^ expected
for name, identifier in files.items():
    digest = hashlib.sha256((dist / name).read_bytes()).hexdigest()
    assert packages[identifier]["checksums"] == [{"algorithm": "SHA256", "checksumValue": digest}], name


def related(start, kind):
    file = next(identifier for name, identifier in files.items() if re.match(start, name))
    return {packages[r["relatedSpdxElement"]]["name"] for r in bill["relationships"]
            if r["spdxElementId"] == file and r["relationshipType"] == kind}


assert "libgrpc++1.51" in related(r"rilievo_.*\.deb", "DEPENDS_ON")
assert {"three", "@connectrpc/connect"} <= related("rilievo-viewer_", "CONTAINS")
assert not {"vite", "typescript"} & related("rilievo-viewer_", "CONTAINS")
assert related(r".*\.whl", "STATIC_LINK") == {"libeigen3-dev"}
assert related(r".*\.whl", "DEPENDS_ON") == {"numpy", "grpcio", "protobuf"}
assert "wasi-libc" in related(r".*\.tgz", "STATIC_LINK")
assert {"libc6", "libgrpc++1.51"} <= related(r"rilievod-.*\.oci\.tar", "CONTAINS")
