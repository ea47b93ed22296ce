"""Displaced subdivision surfaces from point scans and meshes, as NumPy arrays.

    surface = rilievo.reconstruct(points, max_error=1e-3)
    vertices, faces = surface.vertices(), surface.faces()
    surface = rilievo.convert(vertices, faces)
    rilievo.combine(surface, (vertices, faces), "difference")
    rilievo.trim(surface, plane=(0, 0, 1, 0.5), keep="inside")
    rilievo.update(surface, new_points)
    rilievo.read("owl.dss").mesh(level=2)
    rilievo.read("owl.dss").to_open3d()

Surfaces are decoded by the same library as everywhere else, so their vertices are the same bits.
Reading needs NumPy alone; making surfaces needs gRPC.
"""
from typing import TYPE_CHECKING, Any

from .cages import interpolate, subdivide
from .errors import (Cancelled, DataLoss, DeadlineExceeded, FailedPrecondition, FieldViolation,
                     InvalidArgument, LimitExceeded, NotFound, PermissionDenied, ResourceExhausted,
                     RilievoError, ServerDefect, Unavailable)
from .surface import Surface, read
from .values import (FILLED, MEASURED, SMOOTHED, Certificate, Closest, ControlMesh, Distance, Frame,
                     Jet, Mesh, Place, Voxels)

if TYPE_CHECKING:
    from .connection import Server
    from .jobs import Job, Jobs
    from .merging import merge
    from .options import UNITS
    from .private_server import PrivateServer
    from .reconstruction import Progress, combine, convert, reconstruct, trim, update

__version__ = "0.2.0"
__all__ = [
    "Cancelled", "Certificate", "Closest", "ControlMesh", "DataLoss", "DeadlineExceeded",
    "Distance", "FILLED", "FailedPrecondition", "FieldViolation", "Frame", "InvalidArgument",
    "Jet", "Job", "Jobs", "LimitExceeded", "MEASURED", "Mesh", "NotFound", "PermissionDenied",
    "Place", "PrivateServer",
    "Progress", "ResourceExhausted", "RilievoError", "SMOOTHED", "Server", "ServerDefect",
    "Surface", "UNITS", "Unavailable", "Voxels", "combine", "convert", "interpolate", "merge", "read",
    "reconstruct", "subdivide", "trim", "update",
]

_WITH_GRPC = {
    "Job": "jobs", "Jobs": "jobs", "PrivateServer": "private_server", "Progress": "reconstruction",
    "Server": "connection", "UNITS": "options", "combine": "reconstruction",
    "convert": "reconstruction", "merge": "merging", "reconstruct": "reconstruction",
    "trim": "reconstruction", "update": "reconstruction",
}


# gRPC is loaded when it is first needed.
def __getattr__(name: str) -> Any:
    if name not in _WITH_GRPC:
        raise AttributeError(f"module 'rilievo' has no attribute {name!r}")
    import importlib
    value = getattr(importlib.import_module(f"rilievo.{_WITH_GRPC[name]}"), name)
    globals()[name] = value
    return value
