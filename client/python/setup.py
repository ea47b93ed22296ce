"""Packs the client with its generated protocol, and with the decoder when
RILIEVO_DECODER_LIBRARY names it. Everything else stands in pyproject.toml."""
import os
import pathlib
import shutil

from setuptools import setup
from setuptools.command.build_py import build_py

from generate_protocol import generate


class BuildWithProtocol(build_py):
    def run(self) -> None:
        super().run()
        package = pathlib.Path(self.build_lib) / "rilievo"
        generate(package)
        library = os.environ.get("RILIEVO_DECODER_LIBRARY")
        if library:
            shutil.copyfile(library, package / "librilievo_decoder.so")


setup(cmdclass={"build_py": BuildWithProtocol})
