"""The programs of rilievo that this package runs."""
import os
import pathlib
import shutil
import subprocess
import tempfile
from typing import List

from .errors import InvalidArgument, RilievoError, ServerDefect, Unavailable
from .values import ControlMesh

_REFUSED = (2, 3)
"""Exit codes of an option, and of a file that cannot be read or used."""


def find(name: str, variable: str, otherwise: str = "") -> str:
    """Named by the environment variable, in PATH, or in the bin folder of the place where this
    package is installed. Unavailable if it is in none of them; `otherwise`: what else would do."""
    named = os.environ.get(variable)
    if named:
        return named
    found = shutil.which(name)
    if found:
        return found
    for folder in pathlib.Path(__file__).resolve().parents:
        if os.access(folder / "bin" / name, os.X_OK):
            return str(folder / "bin" / name)
    raise Unavailable(f"{name} is not found: install it, or name its file in the environment "
                      f"variable {variable}{otherwise}")


def deform(dss: bytes, cage: ControlMesh) -> bytes:
    """The .dss with the control points and tags of `cage`, by `rilievo deform`. Unavailable when
    that is not installed."""
    command = [find("rilievo", "RILIEVO_PROGRAM"), "deform", "-", "-o", "-", "--cage"]
    with tempfile.NamedTemporaryFile("w", suffix=".obj", encoding="ascii") as file:
        file.write(cage.to_obj())
        file.flush()
        command.append(file.name)
        return _run(command, dss)


def view(dss: bytes, options: List[str]) -> bytes:
    """A PNG of the .dss, drawn by `rilievo view`. Unavailable when that is not installed."""
    return _run([find("rilievo", "RILIEVO_PROGRAM"), "view", "-", "-o", "-", *options], dss)


def _run(command: List[str], given: bytes) -> bytes:
    """What the program makes of its standard input."""
    try:
        done = subprocess.run(command, input=given, capture_output=True, check=False)
    except OSError as error:
        raise Unavailable(f"{command[0]} cannot be started: {error.strerror}; name the program "
                          "in the environment variable RILIEVO_PROGRAM") from None
    if done.returncode == 0:
        return done.stdout
    # The program names itself in what it says.
    reason = (done.stderr.decode("utf-8", "replace").strip() or
              f"{command[0]} {command[1]} ended with {done.returncode}")
    kind = InvalidArgument if done.returncode in _REFUSED else \
        ServerDefect if done.returncode < 2 else RilievoError
    raise kind(reason)
