"""Several scans of one thing as one scan."""
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from .scan import _colors, _each, _fields, coordinates, refuse

_SENSOR = ("sensor_x", "sensor_y", "sensor_z")
_NORMAL = ("nx", "ny", "nz")
_COLOR = ("red", "green", "blue")


def merge(scans: Sequence[Any], *, sensors: Optional[Sequence[Any]] = None) -> npt.NDArray[Any]:
    """The points of all scans, which share a frame, in their order: a structured array for
    reconstruct(), with the fields x, y, z and those that the scans have.

    scans      each (n, 3), or a structured array with fields x, y, z and, where known, sensor_x,
               sensor_y, sensor_z; nx, ny, nz; red, green, blue
    sensors    where each scan was seen from: one place (3,), or (n, 3), or None

    As `rilievo reconstruct --merge` does: points of a scan without a sensor or without normals have
    none (NaN) where another scan has them, and colours stay where every scan has them. Scans that
    are not yet where they belong are brought there by `rilievo align`. InvalidArgument names the
    scan.
    """
    if len(scans) == 0:
        raise refuse("scans", "there are none; give at least one")
    if sensors is not None and len(sensors) != len(scans):
        raise refuse("sensors", f"{len(sensors)} for {len(scans)} scans; give one for each, or None")
    points = [coordinates(scan, f"scans[{i}]") for i, scan in enumerate(scans)]
    places = [_fields(scan, _SENSOR) for scan in scans]
    for i, given in enumerate(sensors or ()):
        if given is not None:
            rows = np.atleast_2d(given)
            if len(rows) == 1:
                rows = np.broadcast_to(rows, (len(points[i]), rows.shape[1]))
            places[i] = _each(rows, len(points[i]), f"sensors[{i}]")
    normals = [_fields(scan, _NORMAL) for scan in scans]
    colors = [_fields(scan, _COLOR) for scan in scans]

    counts = [len(part) for part in points]
    columns: List[Tuple[Tuple[str, ...], str, List[Any]]] = [
        (("x", "y", "z"), "<f8", points)]
    if any(part is not None for part in places):
        columns.append((_SENSOR, "<f8", _filled(places, counts)))
    if any(part is not None for part in normals):
        columns.append((_NORMAL, "<f4", _filled(normals, counts)))
    if all(part is not None for part in colors):
        columns.append((_COLOR, "u1", [_colors(part, count, f"scans[{i}]")
                                       for i, (part, count) in enumerate(zip(colors, counts))]))
    merged = np.empty(sum(counts), [(name, kind) for names, kind, _ in columns for name in names])
    for names, _, parts in columns:
        for axis, name in enumerate(names):
            merged[name] = np.concatenate([part[:, axis] for part in parts])
    return merged


def _filled(parts: Sequence[Any], counts: Sequence[int]) -> List[Any]:
    """NaN in the place of what a scan does not have."""
    return [np.full((count, 3), np.nan) if part is None else part
            for part, count in zip(parts, counts)]
