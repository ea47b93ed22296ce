"""lib3MF, the reference implementation of 3MF, as the reader of a file (Debian's lib3mf1, 1.8.1)."""
import ctypes
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

UNITS = ("micron", "millimeter", "centimeter", "inch", "foot", "meter")
LIBRARY = "lib3MF.so.1"


class Model(NamedTuple):
    vertices: npt.NDArray[np.float32]
    triangles: npt.NDArray[np.uint32]
    unit: str
    is_closed: bool
    warnings: int


def load() -> ctypes.CDLL:
    """OSError where it is not installed."""
    return ctypes.CDLL(LIBRARY)


class _Library:
    def __init__(self) -> None:
        self._library = load()

    def call(self, name: str, *arguments: Any) -> None:
        result = getattr(self._library, name)(*arguments)
        if result != 0:
            raise ValueError(f"{name}: error {result & 0xffffffff:#x}")

    def number(self, name: str, *arguments: Any) -> int:
        value = ctypes.c_uint32()
        self.call(name, *arguments, ctypes.byref(value))
        return value.value

    def thing(self, name: str, *arguments: Any) -> ctypes.c_void_p:
        value = ctypes.c_void_p()
        self.call(name, *arguments, ctypes.byref(value))
        return value


def read(path: str) -> Model:
    """The one mesh of a file. ValueError for what the library does not take."""
    library = _Library()
    model = library.thing("lib3mf_createmodel")
    reader = library.thing("lib3mf_model_queryreader", model, b"3mf")
    library.call("lib3mf_reader_readfromfileutf8", reader, path.encode())
    warnings = library.number("lib3mf_reader_getwarningcount", reader)
    meshes = library.thing("lib3mf_model_getmeshobjects", model)
    if library.number("lib3mf_resourceiterator_movenext", meshes) == 0:
        raise ValueError(f"{path}: no mesh")
    mesh = library.thing("lib3mf_resourceiterator_getcurrent", meshes)
    vertices = np.empty((library.number("lib3mf_meshobject_getvertexcount", mesh), 3), np.float32)
    triangles = np.empty((library.number("lib3mf_meshobject_gettrianglecount", mesh), 3), np.uint32)
    for array, name in ((vertices, "vertex"), (triangles, "triangle")):
        for i in range(len(array)):
            row = (ctypes.c_uint32 * 3)()
            library.call(f"lib3mf_meshobject_get{name}", mesh, i, ctypes.byref(row))
            array[i] = np.frombuffer(row, array.dtype)
    closed = library.number("lib3mf_meshobject_ismanifoldandoriented", mesh) != 0
    return Model(vertices, triangles, UNITS[library.number("lib3mf_model_getunit", model)], closed,
                 warnings)
