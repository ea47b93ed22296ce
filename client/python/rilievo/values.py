"""What a surface is made of, as values: meshes, the control mesh, its place, its errors."""
import importlib
from dataclasses import dataclass, field
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from .errors import InvalidArgument

MEASURED, SMOOTHED, FILLED = 0, 1, 2
"""Flags of a vertex: where its height comes from. Smoothed show once the whole file is there."""


@dataclass(frozen=True)
class Mesh:
    """Triangles; the arrays are read-only views of the decoder's memory."""
    vertices: npt.NDArray[np.float64]
    """(n, 3), scan frame."""
    faces: npt.NDArray[np.uint32]
    """(m, 3) vertex numbers, counter-clockwise seen from outside."""
    normals: npt.NDArray[np.float32]
    """(n, 3), unit."""
    flags: npt.NDArray[np.uint8]
    """(n,) MEASURED, SMOOTHED or FILLED."""
    colors: Optional[npt.NDArray[np.uint8]] = None
    """(n, 3) red, green, blue, sRGB; None where the surface has no colours."""

    def to_open3d(self) -> Any:
        """An open3d.geometry.TriangleMesh with vertex normals and, where there are any, colours.
        ImportError without Open3D, as from the next two without their libraries."""
        open3d = _library_of("open3d", "python3-open3d of Debian, or `pip install open3d`")
        vectors = open3d.utility.Vector3dVector
        made = open3d.geometry.TriangleMesh(
            vectors(np.array(self.vertices)),  # which must be writable
            open3d.utility.Vector3iVector(self.faces.astype(np.int32)))
        made.vertex_normals = vectors(self.normals.astype(np.float64))
        if self.colors is not None:
            made.vertex_colors = vectors(self.colors / 255.0)
        return made

    def to_trimesh(self) -> Any:
        """A trimesh.Trimesh with vertex normals and, where there are any, colours; its vertices are
        those of this mesh, in the same order."""
        trimesh = _library_of("trimesh", "`pip install trimesh`")
        return trimesh.Trimesh(
            vertices=np.array(self.vertices), faces=self.faces.astype(np.int64), process=False,
            vertex_normals=self.normals.astype(np.float64), vertex_colors=self.colors)

    def to_pyvista(self) -> Any:
        """A pyvista.PolyData. Its point data are "Normals", "flags" and, where there are any,
        "colors"."""
        pyvista = _library_of("pyvista", "`pip install pyvista`")
        corners = np.full((len(self.faces), 4), 3, np.int64)
        corners[:, 1:] = self.faces
        made = pyvista.PolyData(np.array(self.vertices), corners.ravel())
        made.point_data["Normals"] = np.array(self.normals)
        made.point_data["flags"] = np.array(self.flags)
        if self.colors is not None:
            made.point_data["colors"] = np.array(self.colors)
        return made


def _library_of(name: str, install: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"{name} cannot be loaded ({error}); install it: {install}",
                          name=name) from error


@dataclass(frozen=True)
class ControlMesh:
    """Whatever NumPy makes arrays of may be given; InvalidArgument where these are of another shape
    or are no numbers."""
    vertices: npt.NDArray[np.float64]
    """(n, 3) control points, scan frame."""
    faces: npt.NDArray[np.uint32]
    """(m, 3); of a Catmull-Clark surface the halves of quads, see diagonals."""
    creases: npt.NDArray[np.uint32]
    """(k, 2) ends of sharp edges; those on a border are sharp without being named."""
    sharpness: npt.NDArray[np.float32]
    """(k,); 10 and more: sharp at every level."""
    corners: npt.NDArray[np.uint32]
    """Vertices that stay where they are."""
    diagonals: npt.NDArray[np.uint32] = field(
        default_factory=lambda: np.empty((0, 2), np.uint32))
    """(m / 2, 2) ends of the edges that cut the quads of a Catmull-Clark surface in two; (0, 2) of a
    Loop surface, whose faces are whole."""

    def __post_init__(self) -> None:
        made = {"vertices": _floats(self.vertices, "vertices", 3).astype(np.float64, copy=False),
                "faces": vertex_numbers(self.faces, "faces", 3),
                "creases": vertex_numbers(self.creases, "creases", 2),
                "sharpness": _floats(self.sharpness, "sharpness", 1).astype(np.float32, copy=False),
                "corners": vertex_numbers(self.corners, "corners", 1),
                "diagonals": vertex_numbers(self.diagonals, "diagonals", 2)}
        for name, array in made.items():
            object.__setattr__(self, name, array)

    def to_obj(self) -> str:
        """The text of an OBJ, as `rilievo export --cage` writes it and `rilievo deform --cage` reads
        it; numbers read back the same."""
        lines = [_obj_line("v", vertex) for vertex in self.vertices]
        lines += [_obj_line("f", face + 1) for face in self.faces.astype(np.int64)]
        lines += [f"t crease 2/1/0 {a} {b} {sharpness!r}" for (a, b), sharpness in
                  zip(self.creases.tolist(), self.sharpness.tolist())]
        lines += [f"t corner 1/1/0 {corner} 10" for corner in self.corners.tolist()]
        if len(self.creases) + len(self.corners) == 0:
            lines.append("t crease 0/1/0 10")  # of no edge: nothing is sharp
        return "\n".join(lines) + "\n"


def vertex_numbers(values: npt.ArrayLike, name: str, columns: int) -> npt.NDArray[np.uint32]:
    """(n, columns), or (n,) for one column, of vertex numbers."""
    numbers = _rows(values, name, columns, "iu", "whole numbers")
    if numbers.size and not (0 <= numbers.min() and numbers.max() < 2**32):
        raise InvalidArgument(f"{name} holds {numbers.min()} to {numbers.max()}: must be numbers "
                              "of vertices")
    return np.ascontiguousarray(numbers, np.uint32)


def _floats(values: npt.ArrayLike, name: str, columns: int) -> "npt.NDArray[Any]":
    return _rows(values, name, columns, "fiu", "numbers")


def _rows(values: npt.ArrayLike, name: str, columns: int, kinds: str,
          wanted: str) -> "npt.NDArray[Any]":
    """(n, columns), or (n,) for one column, with elements of one of `kinds`."""
    shape = f"(n, {columns})" if columns > 1 else "(n,)"
    try:
        array = np.asarray(values)
    except ValueError:
        raise InvalidArgument(f"{name} has rows of different lengths: must be {wanted}, "
                              f"{shape}") from None
    if array.size == 0:
        array = np.empty((0, columns), np.uint32)
    if columns == 1 and array.ndim == 2 and array.shape[1] == 1:
        array = array.ravel()
    if array.shape[1:] != ((columns,) if columns > 1 else ()) or array.ndim == 0 or \
            array.dtype.kind not in kinds:
        raise InvalidArgument(f"{name} has the shape {array.shape} and elements of type "
                              f"{array.dtype}: must be {wanted}, {shape}")
    return array


def _obj_line(kind: str, numbers: "npt.NDArray[Any]") -> str:
    return " ".join([kind] + [repr(number) for number in numbers.tolist()])


@dataclass(frozen=True)
class Frame:
    """point = unit * diagonal + center."""
    center: npt.NDArray[np.float64]
    diagonal: float


@dataclass(frozen=True)
class Place:
    """What the coordinates stand for; None where the file does not say it."""
    metres_per_unit: Optional[float]
    up: Optional[str]
    """"x", "y", "z", "-x", "-y" or "-z"."""
    crs: Optional[str]
    """Coordinate reference system: well-known text, or "EPSG:" and a number."""


@dataclass(frozen=True)
class Distance:
    """One direction; fractions of the diagonal, None where unknown."""
    rms: Optional[float]
    mean: Optional[float]
    p95: Optional[float]
    max: Optional[float]


@dataclass(frozen=True)
class Certificate:
    """Errors of the decoded surface against its scan, measured when it was made. Distances are
    fractions of Frame.diagonal; None where unknown."""
    scan_to_surface: Distance
    """The error: how far the scan's points are from the surface."""
    surface_to_scan: Distance
    error_rms: Optional[float]
    """Of both ways together, as the next three."""
    error_mean: Optional[float]
    error_p95: Optional[float]
    error_max: Optional[float]
    measured_share: Optional[float]
    smoothed_share: Optional[float]
    filled_share: Optional[float]
    folds: Optional[int]
    error_across: Optional[float] = None
    """The larger RMS of both ways, of the surface's samples the part across it: what max_error
    promises."""


@dataclass(frozen=True)
class Jet:
    """The surface at n parameters, scan frame. Where a parameter is that of an irregular vertex, du
    and dv span the tangent plane, and second derivatives and curvatures are NaN."""
    positions: npt.NDArray[np.float64]
    """(n, 3)."""
    du: npt.NDArray[np.float64]
    """(n, 3) derivatives by u; dv, duu, duv and dvv likewise."""
    dv: npt.NDArray[np.float64]
    duu: npt.NDArray[np.float64]
    duv: npt.NDArray[np.float64]
    dvv: npt.NDArray[np.float64]
    normals: npt.NDArray[np.float64]
    """(n, 3), unit, outward."""
    curvatures: npt.NDArray[np.float64]
    """(n, 2) least and greatest principal curvature; positive where the surface bends away from its
    normal."""


@dataclass(frozen=True)
class Closest:
    """The closest points of the surface to n places; at(faces, u, v) gives the same positions."""
    faces: npt.NDArray[np.uint32]
    """(n,) control faces."""
    u: npt.NDArray[np.float64]
    v: npt.NDArray[np.float64]
    distances: npt.NDArray[np.float64]
    """(n,), unit of the scan."""
    positions: npt.NDArray[np.float64]
    """(n, 3), scan frame."""


@dataclass(frozen=True)
class Voxels:
    """Cubes of one size; the array is a read-only view of the decoder's memory."""
    values: npt.NDArray[Any]
    """(nx, ny, nz). uint8 of a shell or a solid: 1 for its voxels, 0 for the others; float32
    distances of the centres, unit of the scan, negative inside of a closed surface."""
    origin: npt.NDArray[np.float64]
    """(3,) corner of voxel (0, 0, 0) with the least coordinates, scan frame. The centre of voxel i
    lies at origin + (i + 0.5) * voxel."""
    voxel: float
    """Edge length, unit of the scan."""
