#!/usr/bin/env python3
"""Generates the Python of the protocol into a package folder with protoc and grpc_python_plugin.

    generate_protocol.py PACKAGE_FOLDER    writes v1/ and google_rpc/generated/ there
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

PROTOCOL = pathlib.Path(__file__).resolve().parent.parent.parent / "proto"
SERVICES = ["rilievo/v1/reconstruction.proto", "rilievo/v1/jobs.proto"]
MESSAGES = ["rilievo/v1/options.proto", "rilievo/v1/report.proto"]
DETAILS = ["google/rpc/status.proto", "google/rpc/error_details.proto"]


def program(name: str) -> str:
    path = shutil.which(name)
    if path is None:
        sys.exit(f"{name} is not installed; on Debian: apt-get install protobuf-compiler "
                 "protobuf-compiler-grpc")
    return path


def generate(package: pathlib.Path) -> None:
    protoc, plugin = program("protoc"), program("grpc_python_plugin")
    with tempfile.TemporaryDirectory() as folder:
        common = [protoc, "-I", str(PROTOCOL), f"--python_out={folder}", f"--pyi_out={folder}"]
        subprocess.run(common + MESSAGES + DETAILS, check=True)
        subprocess.run(common + [f"--plugin=protoc-gen-grpc={plugin}", f"--grpc_out={folder}"] +
                       SERVICES, check=True)
        for source, target in (("rilievo/v1", "v1"), ("google/rpc", "google_rpc/generated")):
            place(pathlib.Path(folder) / source, package / target)


# google.rpc may be installed already, in other words of the same protocol: the package
# rilievo.google_rpc takes what is there.
def place(source: pathlib.Path, target: pathlib.Path) -> None:
    target.mkdir(parents=True, exist_ok=True)
    (target / "__init__.py").write_text("")
    for path in source.iterdir():
        text = path.read_text()
        text = re.sub(r"^from google\.rpc import", "from rilievo.google_rpc import", text,
                      flags=re.M)
        new = target / (path.name + ".new")
        new.write_text(text)
        os.replace(new, target / path.name)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    generate(pathlib.Path(sys.argv[1]))
