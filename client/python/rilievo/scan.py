"""Arrays as the protocol carries them."""
from typing import Any, Iterator, NamedTuple, Optional, Tuple

import numpy as np
import numpy.typing as npt

from .errors import FieldViolation, InvalidArgument
from .v1 import options_pb2, reconstruction_pb2

# Large enough that messages cost little, small enough that progress and cancel are prompt.
MESSAGE_BYTES = 384 << 10


class Packed(NamedTuple):
    """Points as they travel: (n, 3) float32 where that loses nothing, else float64."""
    points: npt.NDArray[Any]
    format: int

    def header(self, options: Any) -> Any:
        return reconstruction_pb2.ReconstructHeader(
            point_count=len(self.points),
            coordinate_format=reconstruction_pb2.CoordinateFormat.Name(self.format),
            options=options)

    def pieces(self, begin: int = 0) -> Iterator[bytes]:
        """Whole points a piece, from byte `begin` on."""
        data = self.points.reshape(-1).view(np.uint8).data
        size = self.points.dtype.itemsize * 3
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


def pack(points: Any) -> Packed:
    wide = coordinates(points)
    with np.errstate(over="ignore", invalid="ignore"):
        narrow = wide.astype(np.dtype("<f4"))
        same = (narrow == wide) | ~np.isfinite(wide)
    if bool(same.all()):
        return Packed(narrow, reconstruction_pb2.COORDINATE_FORMAT_FLOAT32_LE)
    return Packed(wide.astype(np.dtype("<f8"), copy=False),
                  reconstruction_pb2.COORDINATE_FORMAT_FLOAT64_LE)


def pack_control_mesh(mesh: Tuple[Any, Any]) -> Any:
    """`mesh`: (vertices (n, 3), faces (m, 3))."""
    try:
        vertices, faces = mesh
    except (TypeError, ValueError):
        raise refuse("control_mesh", "must be a pair: vertices (n, 3), faces (m, 3)") from None
    positions = coordinates(vertices, "control_mesh").astype("<f8", copy=False)
    numbers = np.asarray(faces)
    if numbers.ndim != 2 or numbers.shape[1] != 3 or numbers.dtype.kind not in "iu":
        raise refuse("control_mesh", f"the faces are {numbers.dtype} of shape {numbers.shape}, "
                     "integers of shape (m, 3) are needed")
    if numbers.size and (numbers.min() < 0 or numbers.max() >= len(positions)):
        raise refuse("control_mesh", f"a face names vertex {_beyond(numbers, len(positions))}, "
                     f"there are {len(positions)}, counted from 0")
    return options_pb2.ControlMesh(positions=positions.tobytes(),
                                   faces=numbers.reshape(-1).tolist())


def _beyond(numbers: npt.NDArray[Any], count: int) -> Optional[int]:
    return next((int(n) for n in numbers.flat if n < 0 or n >= count), None)
