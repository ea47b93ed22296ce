"""Meshes whose vertices count one by one: refined by the schemes of the literature, and
interpolated."""
import operator
from typing import Any, List, Literal, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _library
from .errors import InvalidArgument
from .values import ControlMesh

Scheme = Literal["loop", "catmull-clark", "doo-sabin", "butterfly", "sqrt3"]
Faces = Union[npt.NDArray[np.uint32], List[npt.NDArray[np.uint32]]]


def subdivide(vertices: Any, faces: Any, scheme: Scheme = "loop",
              levels: int = 1) -> Tuple[npt.NDArray[np.float64], Faces]:
    """A mesh, open or closed, after `levels` steps of a subdivision scheme, 0 to 8.

    vertices  (n, 3) numbers
    faces     (m, k) integers, or a sequence of faces of any numbers of corners, counted from 0,
              counter-clockwise seen from outside
    scheme    "loop", "butterfly" and "sqrt3", of triangles; "catmull-clark" and "doo-sabin"

    Returns vertices (n, 3) and faces: (m, k), or a list of arrays where they have different numbers
    of corners. InvalidArgument for faces that are not an oriented manifold.
    """
    positions, corners, counts = _arrays_of(vertices, faces)
    handle = _library.subdivide(positions, corners, counts, str(scheme), operator.index(levels))
    refined = handle.array("rilievo_polygons_corners")
    sizes = handle.array("rilievo_polygons_corner_counts")
    points: npt.NDArray[np.float64] = handle.array("rilievo_polygons_vertices", 3)
    if np.all(sizes == sizes[0]):
        return points, refined.reshape(-1, int(sizes[0]))
    return points, np.split(refined, np.cumsum(sizes)[:-1])


def interpolate(vertices: Any, faces: Any) -> ControlMesh:
    """The control mesh of a Loop surface through all vertices of a triangle mesh, open or closed.

    vertices  (n, 3) numbers
    faces     (m, 3) integers, as of subdivide()

    Each face is split into four. Control points 0 to n - 1 are those whose limit positions are the
    given vertices; one for each edge follows. InvalidArgument as of subdivide().
    """
    positions, corners, counts = _arrays_of(vertices, faces)
    if np.any(counts != 3):
        raise InvalidArgument("faces: triangles alone are interpolated; split the others")
    handle = _library.interpolate(positions, corners)
    return ControlMesh(handle.array("rilievo_mesh_vertices", 3),
                       handle.array("rilievo_mesh_faces", 3), np.empty((0, 2), np.uint32),
                       np.empty(0, np.float32), np.empty(0, np.uint32))


def _arrays_of(vertices: Any, faces: Any) -> Tuple[
        npt.NDArray[np.float64], npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    positions = np.ascontiguousarray(vertices, np.float64)
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise InvalidArgument(f"vertices has the shape {positions.shape}: must be (n, 3)")
    rows = [np.asarray(face).ravel() for face in faces]
    corners = np.concatenate(rows) if rows else np.empty(0, np.uint32)
    if corners.size and (corners.dtype.kind not in "iu" or corners.min() < 0
                         or corners.max() >= len(positions)):
        raise InvalidArgument(f"faces: must be whole numbers from 0 to {len(positions) - 1}")
    return (positions, np.ascontiguousarray(corners, np.uint32),
            np.array([len(row) for row in rows], np.uint32))
