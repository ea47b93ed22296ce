"""The decoder's C interface (rilievo_decoder.h) by ctypes."""
import ctypes
import ctypes.util
import os
import pathlib
import threading
from typing import Any, Optional, Tuple, Type

import numpy as np
import numpy.typing as npt

from .errors import (DataLoss, FailedPrecondition, InvalidArgument, ResourceExhausted,
                     RilievoError, ServerDefect)

_NAMES = ("librilievo_decoder.so.1", "librilievo_decoder.so", "librilievo_decoder.dylib")
_ERRORS = {3: InvalidArgument, 8: ResourceExhausted, 9: FailedPrecondition, 12: RilievoError,
           13: ServerDefect, 15: DataLoss}
_ELEMENTS = {
    "rilievo_surface_info": ctypes.c_char, "rilievo_surface_frame": ctypes.c_double,
    "rilievo_surface_heights": ctypes.c_float, "rilievo_surface_height_changes": ctypes.c_float,
    "rilievo_control_vertices": ctypes.c_double,
    "rilievo_control_faces": ctypes.c_uint32, "rilievo_control_creases": ctypes.c_uint32,
    "rilievo_control_sharpness": ctypes.c_float, "rilievo_control_corners": ctypes.c_uint32,
    "rilievo_control_diagonals": ctypes.c_uint32,
    "rilievo_mesh_vertices": ctypes.c_double, "rilievo_mesh_faces": ctypes.c_uint32,
    "rilievo_mesh_normals": ctypes.c_float, "rilievo_mesh_flags": ctypes.c_uint8,
    "rilievo_surface_colors": ctypes.c_uint8, "rilievo_mesh_colors": ctypes.c_uint8,
    "rilievo_voxels_frame": ctypes.c_double, "rilievo_voxels_size": ctypes.c_uint32,
    "rilievo_voxels_filled": ctypes.c_uint8, "rilievo_voxels_distances": ctypes.c_float,
    "rilievo_polygons_vertices": ctypes.c_double, "rilievo_polygons_corners": ctypes.c_uint32,
    "rilievo_polygons_corner_counts": ctypes.c_uint32,
}


def _load() -> ctypes.CDLL:
    named = os.environ.get("RILIEVO_DECODER_LIBRARY")
    if named:
        return ctypes.CDLL(named)
    for name in _NAMES:
        beside = pathlib.Path(__file__).parent / name
        if beside.exists():
            return ctypes.CDLL(str(beside))
    found = ctypes.util.find_library("rilievo_decoder")
    for name in ((found,) if found else ()) + _NAMES:
        try:
            return ctypes.CDLL(name)
        except OSError:
            pass
    raise ImportError(
        "the decoder librilievo_decoder.so is not found: install it, or name its file in the "
        "environment variable RILIEVO_DECODER_LIBRARY (in a build tree: lib/librilievo_decoder.so)")


def _declare(library: ctypes.CDLL) -> ctypes.CDLL:
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    out, count = ctypes.POINTER(pointer), ctypes.POINTER(size)
    library.rilievo_last_error.restype = ctypes.c_char_p
    library.rilievo_decoder_version.restype = ctypes.c_char_p
    library.rilievo_whole_bytes.argtypes = [pointer, size, ctypes.c_int, count]
    library.rilievo_decode.argtypes = [pointer, size, ctypes.c_int, out]
    library.rilievo_tessellate.argtypes = [pointer, ctypes.c_int, ctypes.c_int, out]
    library.rilievo_tessellate_adaptively.argtypes = [
        pointer, ctypes.c_double, ctypes.c_int64, ctypes.c_int, out,
        ctypes.POINTER(ctypes.c_double)]
    if library.rilievo_decoder_abi_version() >= 3:
        for name in ("rilievo_evaluator_create", "rilievo_finder_create"):
            getattr(library, name).argtypes = [pointer, ctypes.c_int, ctypes.c_int, out]
        library.rilievo_evaluate.argtypes = [pointer, pointer, pointer, size, ctypes.c_int, pointer]
        library.rilievo_find_closest.argtypes = [pointer, pointer, size, ctypes.c_int, pointer,
                                                 pointer, pointer, pointer]
        for name in ("rilievo_evaluator_free", "rilievo_finder_free"):
            getattr(library, name).argtypes = [pointer]
            getattr(library, name).restype = None
    if library.rilievo_decoder_abi_version() >= 5:
        library.rilievo_voxelize.argtypes = [pointer] + 3 * [ctypes.c_int] + [
            ctypes.c_double, ctypes.c_int, ctypes.c_int, out]
        library.rilievo_voxels_free.argtypes = [pointer]
        library.rilievo_voxels_free.restype = None
    if library.rilievo_decoder_abi_version() >= 6:
        library.rilievo_mesh_create.argtypes = [pointer, size, pointer, size, ctypes.c_int, out]
        library.rilievo_combine.argtypes = [pointer, pointer, ctypes.c_int, ctypes.c_int, out]
    if library.rilievo_decoder_abi_version() >= 7:
        library.rilievo_surface_with_cage.argtypes = [pointer, pointer, size, pointer, pointer, size,
                                                      pointer, size, out]
    if library.rilievo_decoder_abi_version() >= 8:
        library.rilievo_trim.argtypes = [pointer, ctypes.c_int, pointer, size] + 3 * [
            ctypes.c_int] + [out]
        library.rilievo_subdivide.argtypes = [
            pointer, size, pointer, size, pointer, size, ctypes.c_char_p, ctypes.c_int, out]
        library.rilievo_interpolate.argtypes = [pointer, size, pointer, size, out]
        library.rilievo_polygons_free.argtypes = [pointer]
        library.rilievo_polygons_free.restype = None
    for name in ("rilievo_surface_free", "rilievo_mesh_free"):
        getattr(library, name).argtypes = [pointer]
        getattr(library, name).restype = None
    for name in ("rilievo_surface_max_level", "rilievo_surface_declared_max_level"):
        getattr(library, name).argtypes = [pointer]
    for name in _ELEMENTS:
        since = 4 if name.endswith("_colors") else 5 if "_voxels_" in name else \
            8 if "_polygons_" in name else 9 if name.endswith("_height_changes") else \
            10 if name.endswith("_diagonals") else 1
        if library.rilievo_decoder_abi_version() < since:
            continue
        getattr(library, name).argtypes = [pointer, count]
        getattr(library, name).restype = pointer
    return library


_lock = threading.Lock()
_library: Optional[ctypes.CDLL] = None


def library() -> ctypes.CDLL:
    """Loaded when it is first needed."""
    global _library
    with _lock:
        if _library is None:
            _library = _declare(_load())
        return _library


def check(code: int) -> None:
    """Raises what a RilievoCode stands for."""
    if code == 0:
        return
    error: Type[RilievoError] = _ERRORS.get(code, ServerDefect)
    raise error(library().rilievo_last_error().decode("utf-8", "replace"))


class Handle:
    """An object of the library, freed with this one. Arrays of it hold on to it."""

    def __init__(self, address: int, free: str) -> None:
        self.address = address
        self._free = getattr(library(), free)

    def __del__(self) -> None:
        if self.address:
            self._free(self.address)
            self.address = 0

    def text(self, name: str) -> str:
        address, count = self._elements(name)
        return ctypes.string_at(address, count).decode("utf-8")

    def array(self, name: str, columns: int = 1) -> npt.NDArray[Any]:
        """The elements behind a pointer without a copy, read-only; (n, columns), or (n,)."""
        address, count = self._elements(name)
        element: Any = _ELEMENTS[name]
        if count == 0:
            flat = np.empty(0, element)
        else:
            memory = (element * count).from_address(address)
            memory._owner = self  # NumPy keeps `memory`
            flat = np.frombuffer(memory, element)
        flat.flags.writeable = False
        return flat if columns == 1 else flat.reshape(-1, columns)

    def colors(self, name: str) -> "Optional[npt.NDArray[np.uint8]]":
        """(n, 3); None where there are none. Libraries of older versions know of none."""
        if library().rilievo_decoder_abi_version() < 4:
            return None
        colors = self.array(name, 3)
        return colors if len(colors) > 0 else None

    def diagonals(self) -> npt.NDArray[Any]:
        """(n, 2); none of a Loop surface. Libraries of older versions know of none."""
        if library().rilievo_decoder_abi_version() < 10:
            return np.empty((0, 2), np.uint32)
        return self.array("rilievo_control_diagonals", 2)

    def _elements(self, name: str) -> "tuple[int, int]":
        count = ctypes.c_size_t()
        address = getattr(library(), name)(self.address, ctypes.byref(count))
        return address or 0, count.value


def whole_bytes(data: bytes, max_level: int) -> int:
    whole = ctypes.c_size_t()
    check(library().rilievo_whole_bytes(data, len(data), max_level, ctypes.byref(whole)))
    return whole.value


def decode(data: bytes, size: int, threads: int) -> Handle:
    surface = ctypes.c_void_p()
    check(library().rilievo_decode(data, size, threads, ctypes.byref(surface)))
    return Handle(surface.value or 0, "rilievo_surface_free")


def with_cage(surface: Handle, vertices: npt.NDArray[np.float64],
              creases: "npt.NDArray[np.uint32]", sharpness: "npt.NDArray[np.float32]",
              corners: "npt.NDArray[np.uint32]") -> Handle:
    if library().rilievo_decoder_abi_version() < 7:
        raise RilievoError("this decoder library is of an older version and takes no other cage; "
                           "install the one of this version")
    moved = ctypes.c_void_p()
    # NULL stands for the surface's own, which no tags are not.
    none = ctypes.create_string_buffer(1)
    tags, sharp, pinned = (array.ctypes.data if array.size else ctypes.addressof(none)
                           for array in (creases, sharpness, corners))
    check(library().rilievo_surface_with_cage(
        surface.address, vertices.ctypes.data, len(vertices), tags, sharp, len(creases), pinned,
        len(corners), ctypes.byref(moved)))
    return Handle(moved.value or 0, "rilievo_surface_free")


def tessellate(surface: Handle, level: int, threads: int) -> Handle:
    mesh = ctypes.c_void_p()
    check(library().rilievo_tessellate(surface.address, level, threads, ctypes.byref(mesh)))
    return Handle(mesh.value or 0, "rilievo_mesh_free")


def tessellate_adaptively(surface: Handle, tolerance: float, triangles: int,
                          threads: int) -> "tuple[Handle, float]":
    mesh, error = ctypes.c_void_p(), ctypes.c_double()
    check(library().rilievo_tessellate_adaptively(surface.address, tolerance, triangles, threads,
                                                  ctypes.byref(mesh), ctypes.byref(error)))
    return Handle(mesh.value or 0, "rilievo_mesh_free"), error.value


def mesh_of_arrays(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.uint32],
                   threads: int) -> Handle:
    _need(6, "combines nothing")
    mesh = ctypes.c_void_p()
    check(library().rilievo_mesh_create(vertices.ctypes.data, len(vertices), faces.ctypes.data,
                                        len(faces), threads, ctypes.byref(mesh)))
    return Handle(mesh.value or 0, "rilievo_mesh_free")


def combine(a: Handle, b: Handle, operation: int, threads: int) -> Handle:
    """Of two meshes."""
    _need(6, "combines nothing")
    mesh = ctypes.c_void_p()
    check(library().rilievo_combine(a.address, b.address, operation, threads, ctypes.byref(mesh)))
    return Handle(mesh.value or 0, "rilievo_mesh_free")


def trim(mesh: Handle, shape: int, numbers: npt.NDArray[np.float64], outside: bool, cap: bool,
         threads: int) -> Handle:
    _need(8, "trims nothing")
    trimmed = ctypes.c_void_p()
    check(library().rilievo_trim(mesh.address, shape, numbers.ctypes.data, len(numbers), outside,
                                 cap, threads, ctypes.byref(trimmed)))
    return Handle(trimmed.value or 0, "rilievo_mesh_free")


def subdivide(vertices: npt.NDArray[np.float64], corners: npt.NDArray[np.uint32],
              corner_counts: npt.NDArray[np.uint32], scheme: str, levels: int) -> Handle:
    _need(8, "subdivides nothing")
    polygons = ctypes.c_void_p()
    check(library().rilievo_subdivide(vertices.ctypes.data, len(vertices), corners.ctypes.data,
                                      len(corners), corner_counts.ctypes.data, len(corner_counts),
                                      scheme.encode(), levels, ctypes.byref(polygons)))
    return Handle(polygons.value or 0, "rilievo_polygons_free")


def interpolate(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.uint32]) -> Handle:
    _need(8, "interpolates nothing")
    cage = ctypes.c_void_p()
    check(library().rilievo_interpolate(vertices.ctypes.data, len(vertices), faces.ctypes.data,
                                        len(faces) // 3, ctypes.byref(cage)))
    return Handle(cage.value or 0, "rilievo_mesh_free")


def _need(version: int, otherwise: str) -> None:
    if library().rilievo_decoder_abi_version() < version:
        raise RilievoError(f"this decoder library is of an older version and {otherwise}; install "
                           "the one of this version")


def evaluator(surface: Handle, smooth: bool, threads: int) -> Handle:
    return _made(surface, "evaluator", smooth, threads)


def finder(surface: Handle, smooth: bool, threads: int) -> Handle:
    return _made(surface, "finder", smooth, threads)


def _made(surface: Handle, kind: str, smooth: bool, threads: int) -> Handle:
    if library().rilievo_decoder_abi_version() < 3:
        raise RilievoError("this decoder library is of an older version and cannot evaluate; "
                           "install the one of this version")
    made = ctypes.c_void_p()
    create = getattr(library(), f"rilievo_{kind}_create")
    check(create(surface.address, int(smooth), threads, ctypes.byref(made)))
    return Handle(made.value or 0, f"rilievo_{kind}_free")


def evaluate(of: Handle, faces: npt.NDArray[np.uint32], parameters: npt.NDArray[np.float64],
             threads: int) -> npt.NDArray[np.float64]:
    """(n, 23) numbers of n parameters, in the order of rilievo_decoder.h."""
    jets = np.empty((len(faces), 23))
    check(library().rilievo_evaluate(of.address, faces.ctypes.data, parameters.ctypes.data,
                                     len(faces), threads, jets.ctypes.data))
    return jets


def find_closest(of: Handle, places: npt.NDArray[np.float64], threads: int) -> Tuple[
        npt.NDArray[np.uint32], npt.NDArray[np.float64], npt.NDArray[np.float64],
        npt.NDArray[np.float64]]:
    """Faces, parameters, distances and positions of the closest points of n places."""
    count = len(places)
    faces, parameters = np.empty(count, np.uint32), np.empty((count, 2))
    distances, positions = np.empty(count), np.empty((count, 3))
    check(library().rilievo_find_closest(
        of.address, places.ctypes.data, count, threads, faces.ctypes.data, parameters.ctypes.data,
        distances.ctypes.data, positions.ctypes.data))
    return faces, parameters, distances, positions


def voxelize(surface: Handle, level: int, kind: int, resolution: int, voxel: float, band: int,
             threads: int) -> Handle:
    if library().rilievo_decoder_abi_version() < 5:
        raise RilievoError("this decoder library is of an older version and makes no voxels; "
                           "install the one of this version")
    voxels = ctypes.c_void_p()
    check(library().rilievo_voxelize(surface.address, level, kind, resolution, voxel, band, threads,
                                     ctypes.byref(voxels)))
    return Handle(voxels.value or 0, "rilievo_voxels_free")
