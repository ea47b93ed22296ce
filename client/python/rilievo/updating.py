"""A surface brought up to date by a new scan."""
from typing import Any

import numpy as np

from . import _programs
from .errors import InvalidArgument
from .surface import Surface


def update(surface: Surface, points: Any, *, whole: bool = False, threads: int = 0) -> Surface:
    """The surface with heights made anew where a new scan contradicts it, by `rilievo update`.

    surface   at its finest level, as the whole file has it
    points    (n, 3) numbers in the frame and unit of the surface: a scan of all of it, or of the
              part that changed
    whole     the scan shows all there is to see: heights that were measured where it has no points
              become filled ones; else they stay as they are
    threads   of the decoder of the new surface; 0: all

    The bytes of the new surface begin with those of the old one. InvalidArgument where the points
    do not fit, or changes are larger than heights reach; Unavailable when the program `rilievo` is
    not installed.
    """
    array = np.asarray(points)
    if array.dtype.kind not in "fiu" or array.ndim != 2 or array.shape[1] != 3:
        raise InvalidArgument(f"points: {array.dtype} numbers of the shape {array.shape}; "
                              "(n, 3) numbers are needed")
    data = _programs.update(surface.to_bytes(), np.ascontiguousarray(array, np.float64), whole)
    return Surface.from_bytes(data, threads=threads)
