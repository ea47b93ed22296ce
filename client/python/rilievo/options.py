"""What can be asked of a reconstruction, as keyword arguments."""
import operator
from typing import Any, Dict, Literal, Optional, Tuple, TypedDict

from .scan import pack_control_mesh, refuse
from .v1 import options_pb2

Topology = Literal["auto", "planar", "spherical", "arbitrary"]
Boundary = Literal["keep", "close"]
Creases = Literal["auto", "off"]
SightRule = Literal["auto", "use", "ignore"]
Fit = Literal["suzuki", "least-squares"]


class Options(TypedDict, total=False):
    """What is left out, or None, is the server's default. Lengths are fractions of the diagonal of
    the points' bounding box. Ranges: options.proto."""
    max_error: Optional[float]
    """RMS error of the surface, coding included. At most one of this, max_bytes, height_step."""
    max_bytes: Optional[int]
    """Bytes of the .dss, as good as they allow."""
    height_step: Optional[float]
    """Step of the height quantiser."""
    topology: Optional[Topology]
    """The topology of the control mesh."""
    stations: Optional[SightRule]
    """Whether the surface faces the places that its points were seen from: "auto", when these are
    known and believable; "use", without a check; or "ignore"."""
    normals: Optional[SightRule]
    """The same for the side of the given normals."""
    boundary: Optional[Boundary]
    """Keep an open scan open, or close it."""
    creases: Optional[Creases]
    """Whether sharp edges of the scan become creases of the surface."""
    control_faces: Optional[int]
    """About how many."""
    control_mesh: Optional[Tuple[Any, Any]]
    """Start from these vertices (n, 3) and faces (m, 3), scan frame."""
    fit: Optional[Fit]
    """Suzuki's update (fast), or robust least squares (closer)."""
    max_level: Optional[int]
    """Levels of heights above the control mesh; default: as dense as the points."""
    seed: Optional[int]
    """Of all random choices; the same seed gives the same bytes."""
    threads: Optional[int]
    """The result does not depend on it."""
    measure: Optional[bool]
    """Measure the error at the end, for the report and the certificate."""


_SIGHT_RULES = {"auto": options_pb2.SIGHT_RULE_AUTO, "use": options_pb2.SIGHT_RULE_USE,
                "ignore": options_pb2.SIGHT_RULE_IGNORE}
_WORDS: Dict[str, Dict[str, int]] = {
    "stations": _SIGHT_RULES, "normals": _SIGHT_RULES,
    "topology": {"auto": options_pb2.TOPOLOGY_AUTO, "planar": options_pb2.TOPOLOGY_PLANAR,
                 "spherical": options_pb2.TOPOLOGY_SPHERICAL,
                 "arbitrary": options_pb2.TOPOLOGY_ARBITRARY},
    "boundary": {"keep": options_pb2.BOUNDARY_KEEP, "close": options_pb2.BOUNDARY_CLOSE},
    "creases": {"auto": options_pb2.CREASES_AUTO, "off": options_pb2.CREASES_OFF},
    "fit": {"suzuki": options_pb2.FIT_METHOD_SUZUKI,
            "least-squares": options_pb2.FIT_METHOD_LEAST_SQUARES},
}
# Parameter: message within ReconstructOptions ("" for itself), field, type.
_FIELDS = {
    "max_error": ("encode", "max_error_ratio", float), "max_bytes": ("encode", "max_bytes", int),
    "height_step": ("encode", "height_step_ratio", float), "topology": ("control", "topology", str),
    "stations": ("scan", "stations", str), "normals": ("scan", "normals", str),
    "boundary": ("control", "boundary", str), "creases": ("control", "creases", str),
    "control_faces": ("control", "control_faces", int), "fit": ("fit", "method", str),
    "max_level": ("", "max_level", int), "seed": ("", "seed", int), "threads": ("", "threads", int),
    "measure": ("", "measure", bool),
}


def _converted(parameter: str, kind: type, value: Any) -> Any:
    if kind is str:
        words = _WORDS[parameter]
        if value not in words:
            raise refuse(parameter, f"{value!r} is not one of {', '.join(map(repr, words))}")
        return words[value]
    try:
        return operator.index(value) if kind is int else kind(value)
    except (TypeError, ValueError):
        article = "an integer" if kind is int else "a number"
        raise refuse(parameter, f"{value!r} is not {article}") from None


def as_message(options: Options) -> Any:
    """The protocol's ReconstructOptions. Ranges are left to the server."""
    message = options_pb2.ReconstructOptions()
    given = {name: value for name, value in options.items() if value is not None}
    mesh: Any = given.pop("control_mesh", None)
    if mesh is not None:
        if "topology" in given:
            raise refuse("topology", "a given control_mesh has its own; leave it out")
        message.control.control_mesh.CopyFrom(pack_control_mesh(mesh))
        message.control.topology = options_pb2.TOPOLOGY_GIVEN
    for parameter, value in given.items():
        if parameter not in _FIELDS:
            raise TypeError(f"reconstruct() got an unexpected keyword argument {parameter!r}")
        group, field, kind = _FIELDS[parameter]
        target = getattr(message, group) if group else message
        converted = _converted(parameter, kind, value)
        try:
            setattr(target, field, converted)
        except ValueError:  # of protobuf: not within 32 or 64 bits
            raise refuse(parameter, f"{value!r} is out of range") from None
    return message
