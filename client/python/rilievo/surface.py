"""A decoded .dss: its control mesh, its heights, and its triangles at any level."""
import json
import operator
import os
import threading
from collections import OrderedDict
from typing import Any, Callable, Dict, List, Optional, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _library, _programs
from .errors import InvalidArgument, RilievoError
from .values import (Certificate, Closest, ControlMesh, Distance, Frame, Jet, Mesh, Place, Voxels,
                     vertex_numbers)

_KEPT_LEVELS = 2
_VOXEL_KINDS = ("shell", "solid", "distance")


class Surface:
    """Made by read(), reconstruct() or Surface.from_bytes(). May be used by many threads."""

    def __init__(self, data: bytes, size: int, report: Optional[Dict[str, Any]] = None,
                 threads: int = 0) -> None:
        self._open(_library.decode(data, size, threads), report, threads)
        self._file = data[:size]
        self._moved = False

    def _open(self, handle: _library.Handle, report: Optional[Dict[str, Any]],
              threads: int) -> None:
        self._handle = handle
        self._threads = threads
        self._lock = threading.Lock()
        self._meshes: "OrderedDict[int, Mesh]" = OrderedDict()
        self._tools: Dict[Tuple[str, bool], _library.Handle] = {}
        self.info: Dict[str, Any] = json.loads(self._handle.text("rilievo_surface_info"))
        """All that the file says of itself."""
        self.report = report
        """The report of the reconstruction (report.proto); None for a surface that was read."""

    @classmethod
    def from_bytes(cls, data: Union[bytes, bytearray, memoryview],
                   max_level: Optional[int] = None, partial: bool = False,
                   threads: int = 0) -> "Surface":
        """Of the bytes of a .dss file. `max_level`: decode no finer level. `partial`: the bytes may
        end anywhere behind the control mesh; what is whole is decoded. `threads`: 0: all."""
        data = bytes(data)
        size = len(data)
        if max_level is not None or partial:
            level = -1 if max_level is None else _level(max_level)
            whole = _library.whole_bytes(data, level)
            if partial and whole == 0:
                raise InvalidArgument(f"the first {size} bytes do not hold the control mesh yet")
            size = whole if partial or whole < size and _ends(data, level) else size
        return cls(data, size, threads=threads)

    def with_cage(self, vertices: npt.ArrayLike, creases: Optional[npt.ArrayLike] = None,
                  sharpness: Optional[npt.ArrayLike] = None,
                  corners: Optional[npt.ArrayLike] = None) -> "Surface":
        """The surface with other control points: it follows them, its heights and colours ride
        along. Nothing is encoded before to_bytes() or write(), which run `rilievo deform`
        (Unavailable when that is not installed) and round the control points to 1e-7 of the
        diagonal.

        vertices   (n, 3) control points, scan frame, in the order of control_mesh.vertices
        creases    (k, 2) vertices of edges; None: as they are
        sharpness  one number for all creases, or (k,), above 0, kept in 1/16; 10 and more: sharp at
                   every level; None: as they are, of other creases 10
        corners    (c,) vertices; None: as they are

        The new surface has no certificate and no report. InvalidArgument where the control points
        are not finite or of another number, and for a crease that is not an edge.
        """
        own = self.control_mesh
        points = np.ascontiguousarray(vertices, np.float64)
        if points.shape != own.vertices.shape:
            raise InvalidArgument(f"vertices has the shape {points.shape}: must be "
                                  f"{own.vertices.shape}, the control points of this surface")
        edges = own.creases if creases is None else vertex_numbers(creases, "creases", 2)
        sharp: npt.NDArray[np.float32] = np.array(10, np.float32)
        if sharpness is not None:
            sharp = np.array(sharpness, np.float32)
        elif creases is None:
            sharp = own.sharpness
        if sharp.shape not in ((), (len(edges),)):
            raise InvalidArgument(f"sharpness has the shape {sharp.shape}: must be one number, or "
                                  f"one for each of {len(edges)} creases")
        moved = Surface.__new__(Surface)
        moved._open(_library.with_cage(
            self._handle, points, edges,
            np.ascontiguousarray(np.broadcast_to(sharp, len(edges)), np.float32),
            own.corners if corners is None else vertex_numbers(corners, "corners", 1)),
            None, self._threads)
        moved._file = self._file
        moved._moved = True
        return moved

    def to_bytes(self) -> bytes:
        """The .dss file, as it was read; of a surface with_cage(), as `rilievo deform` makes it."""
        if self._moved:
            return _programs.deform(self._file, self.control_mesh)
        return self._file

    def write(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """The .dss file; one that is there already is replaced at once or not at all. The name ends
        in .dss or has no extension, so that no scan or mesh is replaced by mistake."""
        if os.path.splitext(os.fspath(path))[1].lower() not in ("", ".dss"):
            raise InvalidArgument(f"{os.fspath(path)}: write() makes a .dss file; give it that "
                                  "extension. `rilievo export` makes meshes of it")
        data = self.to_bytes()
        temporary = f"{os.fspath(path)}.{os.getpid()}.part"
        try:
            with open(temporary, "wb") as file:
                file.write(data)
            os.replace(temporary, path)
        except BaseException:
            if os.path.exists(temporary):
                os.unlink(temporary)
            raise

    def picture(self, size: Tuple[int, int] = (640, 480), turn: float = 35, elevation: float = 25,
                colors: Optional[str] = None, level: Optional[int] = None,
                edges: bool = False) -> bytes:
        """A PNG, drawn by `rilievo view` (Unavailable when that is not installed); in a notebook a
        surface shows itself so.

        size       width and height, pixels
        turn       of the camera around the axis that points up, degrees
        elevation  of the camera above the horizon, [-90, 90], degrees
        colors     "shade", "own" (those of the surface), "displacement", "change" (by
                   the last update), "flags" or "normals";
                   None: "own" where the surface has colours, else "shade"
        level      [0, max_level]; None: max_level
        edges      draws the edges of the triangles
        """
        if colors is None:
            colors = "shade" if self.colors is None else "own"
        width, height = (operator.index(side) for side in size)
        options = [f"--size={width}x{height}", f"--turn={float(turn)!r}",
                   f"--elevation={float(elevation)!r}", f"--colors={colors}"]
        if level is not None:
            options.append(f"--level={_level(level)}")
        if edges:
            options.append("--edges")
        return _programs.view(self.to_bytes(), options)

    def _repr_png_(self) -> Optional[bytes]:
        """What Jupyter shows; its text alone where no program draws."""
        try:
            return self.picture()
        except RilievoError:
            return None

    def __reduce__(self) -> Tuple[Callable[..., "Surface"], Tuple[Any, ...]]:
        if self._moved:
            cage = self.control_mesh
            return _with_cage, (self._file, self._threads, np.array(cage.vertices),
                                np.array(cage.creases), np.array(cage.sharpness),
                                np.array(cage.corners))
        return Surface, (self._file, len(self._file), self.report, self._threads)

    def __repr__(self) -> str:
        finest = self.info["levels"][-1]
        error, metres = self.error, self.place.metres_per_unit
        told = "" if error is None else f"scan to surface {error:.3g}, " if metres is None else \
            f"scan to surface {error * metres:.3g} m, "
        return (f"<rilievo.Surface: {told}{self.info['control']['faces']} control faces, "
                f"max_level {self.max_level}, {finest['vertices']} vertices, "
                f"{'another cage' if self._moved else f'{len(self._file)} bytes'}>")

    @property
    def max_level(self) -> int:
        """The finest level of heights that is there."""
        return int(self.info["max_level"])

    @property
    def declared_max_level(self) -> int:
        """The finest level of the whole file."""
        return int(self.info["declared_max_level"])

    @property
    def levels(self) -> List[Dict[str, int]]:
        """For each level its number of vertices and faces."""
        return list(self.info["levels"])

    @property
    def frame(self) -> Frame:
        values = self._handle.array("rilievo_surface_frame")
        return Frame(values[:3], float(values[3]))

    @property
    def error(self) -> Optional[float]:
        """RMS distance of the scan's points to the surface, measured when it was made, in the unit
        of the scan; None where unknown. More figures: certificate."""
        share = self.certificate.scan_to_surface.rms
        return None if share is None else share * float(self.info["frame"]["diagonal"])

    @property
    def place(self) -> Place:
        """Unit, way up and coordinate reference system of the coordinates, as far as known."""
        # Libraries of older versions do not know it.
        values = self.info.get("place", {})
        return Place(values.get("metres_per_unit"), values.get("up"), values.get("crs"))

    @property
    def heights(self) -> npt.NDArray[np.float32]:
        """(n,) displacements of the vertices of max_level along their limit normals, fractions of
        the diagonal. The vertices of a coarser level come first."""
        return self._handle.array("rilievo_surface_heights")

    @property
    def height_changes(self) -> Optional[npt.NDArray[np.float32]]:
        """(n,) by which the last update() changed the heights, fractions of the diagonal; None
        where the file has no updates, or the decoder library is older than 9."""
        if _library.library().rilievo_decoder_abi_version() < 9:
            return None
        changes = self._handle.array("rilievo_surface_height_changes")
        return changes if len(changes) > 0 else None

    @property
    def colors(self) -> Optional[npt.NDArray[np.uint8]]:
        """(n, 3) red, green and blue (sRGB) of the vertices of max_level, as heights; None where
        the surface has no colours."""
        return self._handle.colors("rilievo_surface_colors")

    @property
    def control_mesh(self) -> ControlMesh:
        """Its faces are triangles; of a Catmull-Clark surface two make a quad, which `diagonals`
        tell."""
        array = self._handle.array
        return ControlMesh(array("rilievo_control_vertices", 3), array("rilievo_control_faces", 3),
                           array("rilievo_control_creases", 2), array("rilievo_control_sharpness"),
                           array("rilievo_control_corners"), self._handle.diagonals())

    @property
    def certificate(self) -> Certificate:
        values = dict(self.info["certificate"])
        for name in ("surface_to_scan", "scan_to_surface"):
            values[name] = Distance(**{k: values[name][k] for k in ("rms", "mean", "p95", "max")})
        # Libraries of older versions know fewer of them.
        known: Dict[str, Any] = {k: values.get(k) for k in Certificate.__dataclass_fields__}
        return Certificate(**known)

    def mesh(self, level: Optional[int] = None) -> Mesh:
        """The triangles of a level, [0, max_level + 2]; None: max_level. The last two levels asked
        for are kept."""
        number = self.max_level if level is None else _level(level)
        with self._lock:
            mesh = self._meshes.pop(number, None)
            if mesh is None:
                mesh = _mesh(_library.tessellate(self._handle, number, self._threads))
            self._meshes[number] = mesh
            if len(self._meshes) > _KEPT_LEVELS:
                self._meshes.popitem(last=False)
            return mesh

    def _finest(self, threads: int) -> _library.Handle:
        """The triangles of max_level, for the decoder."""
        return _library.tessellate(self._handle, self.max_level, threads)

    def vertices(self, level: Optional[int] = None) -> npt.NDArray[np.float64]:
        """(n, 3), scan frame."""
        return self.mesh(level).vertices

    def faces(self, level: Optional[int] = None) -> npt.NDArray[np.uint32]:
        """(m, 3) vertex numbers, counter-clockwise seen from outside."""
        return self.mesh(level).faces

    def normals(self, level: Optional[int] = None) -> npt.NDArray[np.float32]:
        """(n, 3), unit."""
        return self.mesh(level).normals

    def flags(self, level: Optional[int] = None) -> npt.NDArray[np.uint8]:
        """(n,) MEASURED, SMOOTHED or FILLED."""
        return self.mesh(level).flags

    def to_open3d(self, level: Optional[int] = None) -> Any:
        """mesh(level).to_open3d()."""
        return self.mesh(level).to_open3d()

    def to_trimesh(self, level: Optional[int] = None) -> Any:
        """mesh(level).to_trimesh()."""
        return self.mesh(level).to_trimesh()

    def to_pyvista(self, level: Optional[int] = None) -> Any:
        """mesh(level).to_pyvista()."""
        return self.mesh(level).to_pyvista()

    def adaptive_mesh(self, tolerance: Optional[float] = None,
                      triangles: Optional[int] = None) -> Tuple[Mesh, float]:
        """As few triangles as stay within `tolerance` (fraction of the diagonal) of the finest
        level, or at most `triangles` of them; and the largest distance, fraction of the
        diagonal."""
        if (tolerance is None) == (triangles is None):
            raise InvalidArgument("give either tolerance or triangles")
        if triangles is not None and triangles < 1:
            raise InvalidArgument(f"triangles = {triangles}: must be 1 or more")
        handle, error = _library.tessellate_adaptively(
            self._handle, tolerance or 0.0, operator.index(triangles or 0), self._threads)
        return _mesh(handle), error

    def at(self, faces: npt.ArrayLike, u: npt.ArrayLike, v: npt.ArrayLike,
           smooth: bool = False) -> Jet:
        """The surface at parameters of control faces: u weighs the second corner of
        control_mesh.faces[face], v the third; u >= 0, v >= 0, u + v <= 1. The arguments are numbers
        or arrays, broadcast against each other. `smooth`: of the smooth surface, without heights.
        The first call prepares the surface."""
        numbers, first, second = (array.ravel() for array in np.broadcast_arrays(
            np.asarray(faces), np.asarray(u, np.float64), np.asarray(v, np.float64)))
        if numbers.dtype.kind not in "iu":
            raise InvalidArgument(f"faces has elements of type {numbers.dtype}: must be whole "
                                  "numbers")
        count = self.info["control"]["faces"]
        if numbers.size and not (0 <= numbers.min() and numbers.max() < count):
            raise InvalidArgument(f"faces holds {numbers.min()} to {numbers.max()}: this surface "
                                  f"has control faces 0 to {count - 1}")
        jets = _library.evaluate(
            self._tool("evaluator", smooth), np.ascontiguousarray(numbers, np.uint32),
            np.ascontiguousarray(np.stack([first, second], axis=1)), self._threads)
        return Jet(*(np.ascontiguousarray(part)
                     for part in np.split(jets, range(3, 22, 3), axis=1)))

    def closest(self, points: npt.ArrayLike, smooth: bool = False) -> Closest:
        """The closest point of the surface to each of `points`, (n, 3), scan frame, finite.
        `smooth` as for at(). The first call prepares the surface."""
        places = np.ascontiguousarray(points, np.float64)
        if places.ndim != 2 or places.shape[1] != 3:
            raise InvalidArgument(f"points has the shape {places.shape}: must be (n, 3)")
        faces, parameters, distances, positions = _library.find_closest(
            self._tool("finder", smooth), places, self._threads)
        return Closest(faces, parameters[:, 0].copy(), parameters[:, 1].copy(), distances,
                       positions)

    def voxels(self, resolution: Optional[int] = None, voxel: Optional[float] = None,
               kind: str = "shell", level: Optional[int] = None, band: int = 3) -> Voxels:
        """The triangles of `level`, by default the finest, as voxels: `resolution` of them, [1,
        2048], along the longest side of the bounding box, or voxels of edge length `voxel`, unit of
        the scan. `kind`: "shell", the voxels that the surface meets; "solid", those whose centre is
        inside of a closed one; "distance", exact up to `band` voxels and that far beyond."""
        if (resolution is None) == (voxel is None):
            raise InvalidArgument("give either resolution or voxel")
        if kind not in _VOXEL_KINDS:
            raise InvalidArgument(f"kind = {kind!r}: must be one of {', '.join(_VOXEL_KINDS)}")
        if resolution is not None and not 1 <= operator.index(resolution) <= 2048:
            raise InvalidArgument(f"resolution = {resolution}: must be in [1, 2048]")
        handle = _library.voxelize(
            self._handle, -1 if level is None else _level(level), _VOXEL_KINDS.index(kind),
            operator.index(resolution or 0), float(voxel or 0), operator.index(band), self._threads)
        name = "rilievo_voxels_distances" if kind == "distance" else "rilievo_voxels_filled"
        size, frame = handle.array("rilievo_voxels_size"), handle.array("rilievo_voxels_frame")
        # x runs fastest in memory.
        return Voxels(handle.array(name).reshape(size[::-1]).T, frame[:3], float(frame[3]))

    def _tool(self, kind: str, smooth: bool) -> _library.Handle:
        with self._lock:
            key = (kind, bool(smooth))
            if key not in self._tools:
                self._tools[key] = getattr(_library, kind)(self._handle, key[1], self._threads)
            return self._tools[key]


def read(path: Union[str, "os.PathLike[str]"], max_level: Optional[int] = None,
         partial: bool = False, threads: int = 0) -> Surface:
    """Reads a .dss file; see Surface.from_bytes()."""
    with open(path, "rb") as file:
        data = file.read()
    try:
        return Surface.from_bytes(data, max_level, partial, threads)
    except RilievoError as error:
        raise type(error)(f"{os.fspath(path)}: {error}") from None


def _with_cage(file: bytes, threads: int, *cage: npt.NDArray[Any]) -> Surface:
    return Surface(file, len(file), threads=threads).with_cage(*cage)


def _level(level: int) -> int:
    number = operator.index(level)
    if not 0 <= number <= 100:
        raise InvalidArgument(f"level = {number}: must be in [0, max_level + 2]")
    return number


def _ends(data: bytes, level: int) -> bool:
    # Cut for the level, not because the file is cut off: then there is more that is whole.
    return _library.whole_bytes(data, -1) > _library.whole_bytes(data, level)


def _mesh(handle: _library.Handle) -> Mesh:
    return Mesh(handle.array("rilievo_mesh_vertices", 3), handle.array("rilievo_mesh_faces", 3),
                handle.array("rilievo_mesh_normals", 3), handle.array("rilievo_mesh_flags"),
                handle.colors("rilievo_mesh_colors"))
