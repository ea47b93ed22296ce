"""Packs the client with its generated protocol, and with the decoder when
RILIEVO_DECODER_LIBRARY names it. Everything else stands in pyproject.toml."""
import os
import pathlib
import shutil
import sys

from setuptools import Distribution, setup
from setuptools.command.build_py import build_py
from wheel.bdist_wheel import bdist_wheel

# Builds run by pip do not look beside this file.
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from generate_protocol import generate  # noqa: E402

LIBRARY = os.environ.get("RILIEVO_DECODER_LIBRARY")


class BuildWithProtocol(build_py):
    def run(self) -> None:
        super().run()
        package = pathlib.Path(self.build_lib) / "rilievo"
        generate(package)
        if LIBRARY:
            shutil.copyfile(LIBRARY, package / "librilievo_decoder.so")


class WithLibrary(Distribution):
    def has_ext_modules(self) -> bool:
        return bool(LIBRARY)


class WheelOfOnePlatform(bdist_wheel):
    """With the decoder in it a wheel is for one kind of machine and, as the library was linked with
    it, for this C library and newer ones (PEP 600). It is for any Python: ctypes loads the decoder."""

    def get_tag(self) -> "tuple[str, str, str]":
        if not LIBRARY:
            return super().get_tag()
        name, _, version = os.confstr("CS_GNU_LIBC_VERSION").partition(" ")
        machine = os.uname().machine
        if name != "glibc":
            return "py3", "none", f"linux_{machine}"
        major, minor = version.split(".")[:2]
        return "py3", "none", f"manylinux_{major}_{minor}_{machine}"


setup(distclass=WithLibrary,
      cmdclass={"build_py": BuildWithProtocol, "bdist_wheel": WheelOfOnePlatform})
