"""docker/software_bill.sh: what it prints of a made-up set of packages is SPDX, and says what they are.

    software_bill_test.py SOURCE
"""
import json
import pathlib
import subprocess
import sys
import tempfile

script = pathlib.Path(sys.argv[1]) / "docker" / "software_bill.sh"
with tempfile.TemporaryDirectory() as folder:
    libraries = pathlib.Path(folder)
    status = libraries / "var/lib/dpkg/status.d"
    status.mkdir(parents=True)
    (libraries / "etc").mkdir()
    (libraries / "etc/os-release").write_text("ID=debian\n")
    known = {"libgrpc++1.51": "1.51.1-3+b1", "libc6": "2.36-9+deb12u10", "libodd1": "1:2.0~rc1-1"}
    for name, version in known.items():
        (status / name).write_text(f"Package: {name}\nArchitecture: amd64\nVersion: {version}\n")
    make = lambda: subprocess.run([script, libraries, "rilievod 1.2.3"], check=True, capture_output=True).stdout
    printed = make()
    assert printed == make(), "the same files make the same bill"
    bill = json.loads(printed)
    (status / "libnew").write_text("Package: libnew\nArchitecture: amd64\nVersion: 1\n")
    other = json.loads(make())

assert bill["spdxVersion"] == "SPDX-2.3" and bill["dataLicense"] == "CC0-1.0"
assert bill["creationInfo"]["created"].endswith("Z")
packages = {package["name"]: package for package in bill["packages"]}
assert {name: package["versionInfo"] for name, package in packages.items()} == {"rilievod": "1.2.3", **known}
locator = lambda name: packages[name]["externalRefs"][0]["referenceLocator"]
assert locator("libgrpc++1.51") == "pkg:deb/debian/libgrpc%2B%2B1.51@1.51.1-3%2Bb1?arch=amd64"
assert locator("libodd1") == "pkg:deb/debian/libodd1@1%3A2.0%7Erc1-1?arch=amd64"
ids = [package["SPDXID"] for package in bill["packages"]]
assert len(set(ids)) == len(ids) and all(i.replace(".", "").replace("-", "").isalnum() for i in ids)
related = {r["relatedSpdxElement"] for r in bill["relationships"] if r["relationshipType"] == "DEPENDS_ON"}
assert related == set(ids) - {"SPDXRef-program"}
assert bill["relationships"][0]["relationshipType"] == "DESCRIBES"
assert other["documentNamespace"] != bill["documentNamespace"]
