"""Arrays as the protocol carries them."""
from typing import Any, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from .errors import FieldViolation, InvalidArgument
from .surface import Surface
from .v1 import options_pb2, reconstruction_pb2
from .values import ControlMesh

# Large enough that messages cost little, small enough that progress and cancel are prompt.
MESSAGE_BYTES = 384 << 10


# At most so many places of the sensor are told apart; the number of one that is not known.
MOST_STATIONS, NO_STATION = 4096, 65535


class Packed(NamedTuple):
    """Points as they travel: a record each, of the field `point` (three float32 where that loses
    nothing, else float64) and, where they are known, `station`, `normal` and `color`. Those of a
    mesh are its vertices."""
    points: npt.NDArray[Any]
    format: int
    stations: npt.NDArray[np.float64] = np.empty((0, 3))
    """(n, 3), scan frame."""
    triangles: npt.NDArray[np.uint32] = np.empty((0, 3), np.uint32)
    """(m, 3): of a mesh, the vertices of each."""
    base: bytes = b""
    """The .dss file of a surface that the points bring up to date."""
    base_surface: Any = None
    """What the header says of it."""

    def header(self, options: Any) -> Any:
        return reconstruction_pb2.ReconstructHeader(
            point_count=len(self.points),
            coordinate_format=reconstruction_pb2.CoordinateFormat.Name(self.format),
            stations=self.stations.astype("<f8").tobytes(),
            normals="normal" in (self.points.dtype.names or ()),
            colors="color" in (self.points.dtype.names or ()),
            triangle_count=len(self.triangles), base_surface=self.base_surface, options=options)

    def pieces(self, begin: int = 0) -> Iterator[bytes]:
        """Whole points a piece, from byte `begin` on."""
        return _pieces(self.points.view(np.uint8).data, self.points.dtype.itemsize, begin)

    def triangle_pieces(self) -> Iterator[bytes]:
        """Whole triangles a piece."""
        return _pieces(self.triangles.astype("<u4", copy=False).reshape(-1).view(np.uint8).data, 12)

    def base_pieces(self) -> Iterator[bytes]:
        return _pieces(memoryview(self.base), 1)


def _pieces(data: memoryview, size: int, begin: int = 0) -> Iterator[bytes]:
    step = MESSAGE_BYTES // size * size
    for at in range(begin, len(data), step):
        yield data[at:at + step].tobytes()


def refuse(parameter: str, description: str) -> InvalidArgument:
    return InvalidArgument(f"{parameter}: {description}",
                           [FieldViolation(parameter, "", description)])


def coordinates(points: Any, parameter: str = "points") -> npt.NDArray[np.float64]:
    """(n, 3) float64 of whatever holds points: rows of x, y, z, or a structured array with fields
    x, y and z. Masked points become NaN, which the server drops and counts."""
    names = getattr(getattr(points, "dtype", None), "names", None)
    if names is not None:
        missing = [axis for axis in "xyz" if axis not in names]
        if missing:
            raise refuse(parameter, f"the fields are {', '.join(names)}; x, y and z are needed")
        points = np.stack([points[axis] for axis in "xyz"], axis=-1)
    masked: Any = np.ma  # NumPy has no types for it
    if masked.isMaskedArray(points):
        points = masked.filled(points.astype(np.float64), np.nan)
    array = np.asarray(points)
    if array.dtype.kind not in "fiub":
        raise refuse(parameter, f"the elements are {array.dtype}, numbers are needed")
    if array.ndim != 2 or array.shape[1] != 3:
        hint = ("; pass the first three columns, points[:, :3]"
                if array.ndim == 2 and array.shape[1] > 3 else "")
        raise refuse(parameter, f"the shape is {array.shape}, (n, 3) is needed{hint}")
    return np.ascontiguousarray(array, np.float64)


def _fields(points: Any, names: Sequence[str]) -> Any:
    """(n, 3) of a structured array that has these fields, else None."""
    present = getattr(getattr(points, "dtype", None), "names", None) or ()
    if not all(name in present for name in names):
        return None
    return np.stack([points[name] for name in names], axis=-1)


def _each(values: Any, count: int, parameter: str) -> npt.NDArray[np.float64]:
    array = coordinates(np.atleast_2d(values), parameter)
    if parameter == "sensor" and len(array) == 1:
        array = np.broadcast_to(array, (count, 3))
    if len(array) != count:
        raise refuse(parameter, f"{len(array)} rows for {count} points; give one for each")
    return array


def _stations(sensor: npt.NDArray[np.float64]) -> Tuple[npt.NDArray[np.float64],
                                                        npt.NDArray[np.uint16]]:
    """The places of a sensor, each once, and the number of each point's. More than MOST_STATIONS
    become one where they lie in one cell of a grid."""
    known = np.isfinite(sensor).all(axis=1)
    numbers = np.full(len(sensor), NO_STATION, np.uint16)
    places = np.unique(sensor[known], axis=0)
    if len(places) == 0:
        return np.empty((0, 3)), numbers
    cell = float(np.ptp(places, axis=0).max()) / 2048
    keys = sensor[known]
    while len(places) > MOST_STATIONS:
        cell *= 2
        keys = np.floor(sensor[known] / cell)
        places = np.unique(keys, axis=0)
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    numbers[known] = which.reshape(-1)
    return sensor[known][first], numbers


def _colors(colors: Any, count: int,
            parameter: str = "point_colors") -> npt.NDArray[np.uint8]:
    """Of bytes as they are, of 16 bits the upper 8 unless all are 0, as in many LAS files, of real
    numbers from 0 to 1."""
    array = np.asarray(colors)
    if array.shape != (count, 3):
        raise refuse(parameter, f"the shape is {array.shape}, ({count}, 3) is needed")
    if array.dtype == np.uint8:
        return array
    if array.dtype == np.uint16:
        return (array >> (8 if np.any(array > 255) else 0)).astype(np.uint8)
    if array.dtype.kind == "f" and np.all((array >= 0) & (array <= 1)):
        return (255 * array + 0.5).astype(np.uint8)
    raise refuse(parameter, f"the elements are {array.dtype}; give uint8, uint16, or real "
                 "numbers from 0 to 1")


def pack(points: Any, sensor: Any = None, point_normals: Any = None,
         point_colors: Any = None) -> Packed:
    """`sensor`: (3,) or (n, 3), places in the frame of the points; NaN: not known. `point_normals`:
    (n, 3); zero: not known. `point_colors`: (n, 3), sRGB, uint8, uint16, or real numbers from 0 to
    1. A structured array may have them itself: sensor_x, sensor_y, sensor_z; nx, ny, nz; red,
    green, blue."""
    wide = coordinates(points)
    if sensor is None:
        sensor = _fields(points, ("sensor_x", "sensor_y", "sensor_z"))
    if point_normals is None:
        point_normals = _fields(points, ("nx", "ny", "nz"))
    if point_colors is None:
        point_colors = _fields(points, ("red", "green", "blue"))
    columns: List[Tuple[str, Any, str]] = []
    places = np.empty((0, 3))
    if sensor is not None:
        places, numbers = _stations(_each(sensor, len(wide), "sensor"))
        if len(places) > 0:
            columns.append(("station", numbers, "<u2"))
    if point_normals is not None:
        columns.append(("normal", _each(point_normals, len(wide), "point_normals"), "<f4"))
    if point_colors is not None:
        columns.append(("color", _colors(point_colors, len(wide)), "u1"))
    return Packed(*_records(wide, columns), stations=places)


def _records(wide: npt.NDArray[np.float64],
             columns: Sequence[Tuple[str, Any, str]]) -> Tuple[npt.NDArray[Any], int]:
    """The points, then `columns`: names, values and types; and the format of the points."""
    with np.errstate(over="ignore", invalid="ignore"):
        narrow = wide.astype(np.dtype("<f4"))
        same = (narrow == wide) | ~np.isfinite(wide)
    is_narrow = bool(same.all())
    columns = [("point", narrow if is_narrow else wide, "<f4" if is_narrow else "<f8"), *columns]
    records = np.empty(len(wide), [(name, kind, values.shape[1:])
                                   for name, values, kind in columns])
    for name, values, _ in columns:
        records[name] = values
    return records, (reconstruction_pb2.COORDINATE_FORMAT_FLOAT32_LE if is_narrow
                     else reconstruction_pb2.COORDINATE_FORMAT_FLOAT64_LE)


def pack_update(points: Any, surface: Surface, whole: bool) -> Packed:
    """Coordinates alone, and the surface that they bring up to date."""
    base = surface.to_bytes()
    said = reconstruction_pb2.BaseSurface(bytes=len(base), whole=bool(whole),
                                          vertices=_vertices_of(surface))
    return Packed(*_records(coordinates(points), []), base=base, base_surface=said)


def _vertices_of(surface: Surface) -> int:
    """Of the finest level of the whole file, however much of it was read."""
    faces = surface.control_mesh.faces.astype(np.int64)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    counts = [len(surface.control_mesh.vertices), len(np.unique(edges, axis=0)), len(faces)]
    for _ in range(surface.declared_max_level):
        counts = [counts[0] + counts[1], 2 * counts[1] + 3 * counts[2], 4 * counts[2]]
    return counts[0]


def pack_mesh(vertices: Any, faces: Any, vertex_colors: Any = None) -> Packed:
    """`vertices`, `vertex_colors`: as points and colours of pack(). `faces`: (m, 3) integers."""
    if vertex_colors is None:
        vertex_colors = _fields(vertices, ("red", "green", "blue"))
    wide = coordinates(vertices, "vertices")
    columns = []
    if vertex_colors is not None:
        columns.append(("color", _colors(vertex_colors, len(wide), "vertex_colors"), "u1"))
    triangles = _corners(faces, len(wide), "faces")
    if len(triangles) == 0:
        raise refuse("faces", "there are none; a mesh has at least one. Points alone are a scan, "
                     "for reconstruct()")
    return Packed(*_records(wide, columns), triangles=triangles.astype(np.uint32))


def arrays_of_mesh(mesh: Tuple[Any, Any],
                   parameter: str) -> Tuple[npt.NDArray[np.float64], npt.NDArray[Any]]:
    """`mesh`: (vertices (n, 3), faces (m, 3))."""
    try:
        vertices, faces = mesh
    except (TypeError, ValueError):
        raise refuse(parameter, "must be a pair: vertices (n, 3), faces (m, 3)") from None
    positions = coordinates(vertices, parameter)
    return positions, _corners(faces, len(positions), parameter)


def pack_control_mesh(mesh: Any) -> Any:
    """`mesh`: a ControlMesh, or (vertices (n, 3), faces (m, 3))."""
    tags = mesh if isinstance(mesh, ControlMesh) else None
    positions, numbers = arrays_of_mesh((tags.vertices, tags.faces) if tags else mesh,
                                        "control_mesh")
    packed = options_pb2.ControlMesh(positions=positions.astype("<f8", copy=False).tobytes(),
                                     faces=numbers.reshape(-1).tolist())
    if tags is not None:
        if len(tags.diagonals):
            raise refuse("control_mesh", f"it has {len(tags.diagonals)} quads, and only triangles "
                         "can be started from; give (vertices, faces) to take the halves as these")
        packed.creases.extend(tags.creases.reshape(-1).tolist())
        packed.sharpness.extend(tags.sharpness.tolist())
        packed.corners.extend(tags.corners.tolist())
    return packed


def _corners(faces: Any, count: int, parameter: str) -> npt.NDArray[Any]:
    """(m, 3) integers, each one of `count` vertices."""
    try:
        numbers = np.asarray(faces)
    except ValueError:  # of rows of different lengths
        raise refuse(parameter, "the faces have different numbers of corners; split polygons into "
                     "triangles") from None
    if numbers.size == 0:
        return np.empty((0, 3), np.uint32)
    if numbers.ndim != 2 or numbers.shape[1] != 3 or numbers.dtype.kind not in "iu":
        hint = ("; split polygons into triangles"
                if numbers.ndim == 2 and numbers.shape[1] > 3 else "")
        raise refuse(parameter, f"the faces are {numbers.dtype} of shape {numbers.shape}, "
                     f"integers of shape (m, 3) are needed{hint}")
    if numbers.min() < 0 or numbers.max() >= count:
        raise refuse(parameter, f"a face names vertex {_beyond(numbers, count)}, there are "
                     f"{count}, counted from 0")
    return numbers


def _beyond(numbers: npt.NDArray[Any], count: int) -> Optional[int]:
    return next((int(n) for n in numbers.flat if n < 0 or n >= count), None)
