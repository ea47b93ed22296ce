"""Scans made here, and where the tests find the programs of the build."""
import os
import pathlib
import subprocess
import tempfile
from typing import Any, List

import numpy as np

GOLDEN = pathlib.Path(__file__).parent.parent / "golden" / "sheet_and_octahedron_v2.dss"


def program(variable: str) -> str:
    """Named by ctest."""
    return os.environ[variable]


def sphere(count: int, seed: int = 1) -> Any:
    """A bumpy sphere of radius about 2 about (1, 2, 3)."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    bumps = 1 + 0.03 * np.sin(9 * directions[:, 0]) * np.cos(7 * directions[:, 1])
    return 2 * bumps[:, None] * directions + [1, 2, 3]


def sheet(count: int, offset: Any = (0, 0, 0)) -> Any:
    """An open terrain of 10 by 10."""
    rng = np.random.default_rng(7)
    xy = rng.uniform(0, 10, size=(count, 2))
    return np.column_stack([xy, np.sin(xy[:, 0]) * np.cos(xy[:, 1])]) + offset


def command_line(points: Any, arguments: List[str]) -> bytes:
    """The .dss that the command `rilievo` makes of the points."""
    with tempfile.TemporaryDirectory() as folder:
        scan, surface = f"{folder}/scan.xyz", f"{folder}/surface.dss"
        with open(scan, "w") as file:
            file.writelines(f"{float(x)!r} {float(y)!r} {float(z)!r}\n" for x, y, z in points)
        subprocess.run([program("RILIEVO_PROGRAM"), "reconstruct", scan, "-o", surface, "--quiet"] +
                       arguments, check=True, stdout=subprocess.DEVNULL)
        return pathlib.Path(surface).read_bytes()
