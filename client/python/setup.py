"""Packs the client with its generated protocol, and with the decoder when
RILIEVO_DECODER_LIBRARY names it. Everything else stands in pyproject.toml."""
import os
import pathlib
import shutil
import sys

from setuptools import setup
from setuptools.command.build_py import build_py

# Builds run by pip do not look beside this file.
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from generate_protocol import generate  # noqa: E402


class BuildWithProtocol(build_py):
    def run(self) -> None:
        super().run()
        package = pathlib.Path(self.build_lib) / "rilievo"
        generate(package)
        library = os.environ.get("RILIEVO_DECODER_LIBRARY")
        if library:
            shutil.copyfile(library, package / "librilievo_decoder.so")


setup(cmdclass={"build_py": BuildWithProtocol})
