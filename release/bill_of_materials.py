"""Prints what the files of a release are made of as SPDX 2.3 JSON.

    bill_of_materials.py VERSION REVISION DIST PACKAGE_LOCK IMAGE_BILLS

DIST: the folder with the files. PACKAGE_LOCK: of the viewer, whose npm packages are bundled into
it. IMAGE_BILLS: the folder with NAME.spdx.json of each image. The time is SOURCE_DATE_EPOCH."""
import datetime
import email
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import urllib.parse
import zipfile

# What the compilers put into the decoder of the wheel and into its WebAssembly.
IN_WHEEL = ["libeigen3-dev"]
IN_WASM = ["libeigen3-dev", "libc++-14-dev-wasm32", "wasi-libc"]


def field(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


class Bill:
    def __init__(self):
        self.packages, self.relations = {}, []

    def add(self, name, version, locator, licence="NOASSERTION", **more):
        """The identifier of a package; the same one for the same locator."""
        identifier = "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", locator.removeprefix("pkg:"))
        entry = {"SPDXID": identifier, "name": name, "downloadLocation": "NOASSERTION",
                 "filesAnalyzed": False, "licenseDeclared": licence,
                 "licenseConcluded": "NOASSERTION", "copyrightText": "NOASSERTION",
                 "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                                   "referenceLocator": locator}], **more}
        if version:
            entry["versionInfo"] = version
        self.packages.setdefault(identifier, entry)
        return identifier

    def relate(self, element, kind, related):
        self.relations.append({"spdxElementId": element, "relationshipType": kind,
                               "relatedSpdxElement": related})

    def debian(self, name, version=""):
        at = "@" + urllib.parse.quote(version) if version else ""
        return self.add(name, version, f"pkg:deb/debian/{urllib.parse.quote(name)}{at}")


def installed(name):
    return field("dpkg-query", "-W", "-f=${Version}", name)


def add_debian_package(bill, file, path, lock):
    for choice in field("dpkg-deb", "-f", str(path), "Depends").split(","):
        name = choice.split("|")[0].split("(")[0].strip()
        if name:
            bill.relate(file, "DEPENDS_ON", bill.debian(name))
    if path.name.startswith("rilievo-viewer_"):
        for place, package in lock["packages"].items():
            if not place or package.get("dev") or package.get("devOptional"):
                continue
            name = place.rpartition("node_modules/")[2]
            bill.relate(file, "CONTAINS", bill.add(
                name, package["version"],
                f"pkg:npm/{urllib.parse.quote(name)}@{package['version']}",
                package.get("license", "NOASSERTION")))


def add_wheel(bill, file, path):
    with zipfile.ZipFile(path) as wheel:
        metadata = next(name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
        needs = email.message_from_bytes(wheel.read(metadata)).get_all("Requires-Dist", [])
    for need in needs:
        name = re.match(r"[\w.-]+", need)[0]
        bill.relate(file, "DEPENDS_ON", bill.add(name, "", f"pkg:pypi/{name}"))
    for name in IN_WHEEL:
        bill.relate(file, "STATIC_LINK", bill.debian(name, installed(name)))


def add_image(bill, file, path):
    for package in json.loads(path.read_text())["packages"]:
        locator = package["externalRefs"][0]["referenceLocator"]
        if locator.startswith("pkg:deb/"):
            bill.relate(file, "CONTAINS",
                        bill.add(package["name"], package["versionInfo"], locator))


def main():
    version, revision, dist, lock, image_bills = sys.argv[1:]
    lock = json.loads(pathlib.Path(lock).read_text())
    bill = Bill()
    source = bill.add("rilievo", version, f"pkg:generic/rilievo@{version}", "Apache-2.0",
                      sourceInfo=f"git commit {revision}")
    sums = hashlib.sha256()
    for path in sorted(pathlib.Path(dist).iterdir()):
        if path.suffix == ".json":
            continue
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        sums.update(f"{digest}  {path.name}\n".encode())
        file = bill.add(path.name, version, f"pkg:generic/{urllib.parse.quote(path.name)}@{version}",
                        "Apache-2.0", packageFileName=path.name,
                        checksums=[{"algorithm": "SHA256", "checksumValue": digest}])
        bill.relate("SPDXRef-DOCUMENT", "DESCRIBES", file)
        bill.relate(file, "GENERATED_FROM", source)
        if path.suffix == ".deb":
            add_debian_package(bill, file, path, lock)
        elif path.suffix == ".whl":
            add_wheel(bill, file, path)
        elif path.suffix == ".tgz":
            for name in IN_WASM:
                bill.relate(file, "STATIC_LINK", bill.debian(name, installed(name)))
        elif path.name.endswith(".oci.tar"):
            name = path.name.partition(f"-{version}")[0]
            add_image(bill, file, pathlib.Path(image_bills) / f"{name}.spdx.json")
    created = datetime.datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]),
                                              datetime.timezone.utc)
    print(json.dumps({
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"rilievo-{version}",
        "documentNamespace": f"https://rilievo.dev/spdx/rilievo-{version}-{sums.hexdigest()}",
        "creationInfo": {"created": created.strftime("%Y-%m-%dT%H:%M:%SZ"),
                         "creators": ["Tool: rilievo-release"]},
        "packages": list(bill.packages.values()), "relationships": bill.relations}, indent=1))


if __name__ == "__main__":
    main()
