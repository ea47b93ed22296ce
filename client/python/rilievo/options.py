"""What can be asked of a reconstruction, as keyword arguments."""
import operator
import re
from fractions import Fraction
from typing import Any, Dict, Literal, Optional, Tuple, TypedDict, Union

from .scan import pack_control_mesh, refuse
from .v1 import options_pb2
from .values import ControlMesh

Topology = Literal["auto", "planar", "spherical", "arbitrary"]
Boundary = Literal["keep", "close"]
MeshBoundary = Literal["keep", "exact"]
Creases = Literal["auto", "off"]
Scheme = Literal["loop", "catmull-clark"]
SightRule = Literal["auto", "use", "ignore"]
Fit = Literal["suzuki", "least-squares"]
Outliers = Literal["remove", "keep"]
Up = Literal["x", "y", "z", "-x", "-y", "-z"]

UNITS: Dict[str, Fraction] = {
    "km": Fraction(1000), "m": Fraction(1), "dm": Fraction(1, 10), "cm": Fraction(1, 100),
    "mm": Fraction(1, 1000), "um": Fraction(1, 1_000_000), "in": Fraction(254, 10_000),
    "ft": Fraction(3048, 10_000), "us-ft": Fraction(1200, 3937)}
"""Metres of each unit of length."""


class MeshOptions(TypedDict, total=False):
    """What is left out, or None, is the server's default. A length is a number, a fraction of the
    diagonal of the points' bounding box, or a text: "0.1%" of that, "2cm", "0.5mm" or another of
    UNITS, or "0.02u" in the points' own units. Ranges: options.proto."""
    max_error: Union[float, str, None]
    """RMS error of the surface, coding included. At most one of this, max_bytes, height_step."""
    max_bytes: Optional[int]
    """Bytes of the .dss, as good as they allow."""
    height_step: Union[float, str, None]
    """Step of the height quantiser."""
    creases: Optional[Creases]
    """Whether sharp edges become creases of the surface."""
    scheme: Optional[Scheme]
    """Of the smooth surface: of triangles, or of quads."""
    close_holes_below: Union[float, str, None]
    """Holes whose rim is shorter are closed, whatever the boundary; others stay as they are."""
    bridge_gaps_below: Union[float, str, None]
    """Pieces whose borders run along each other less than this apart are joined."""
    control_faces: Optional[int]
    """About how many."""
    fit: Optional[Fit]
    """Suzuki's update (fast), or robust least squares (closer)."""
    max_level: Optional[int]
    """Levels of heights above the control mesh; default: as dense as the points."""
    unit: Optional[str]
    """What one unit of the points' coordinates is, one of UNITS; kept in the .dss."""
    up: Optional[Up]
    """The axis that points up; kept in the .dss."""
    crs: Optional[str]
    """Coordinate reference system, "EPSG:25832" or well-known text; kept in the .dss."""
    seed: Optional[int]
    """Of all random choices; the same seed gives the same bytes."""
    threads: Optional[int]
    """The result does not depend on it."""
    measure: Optional[bool]
    """Measure the error at the end, for the report and the certificate."""


class ConvertOptions(MeshOptions, total=False):
    """Of a mesh that is converted as it is."""
    boundary: Optional[MeshBoundary]
    """Keep borders, or meet them exactly: within 1e-5 of the diagonal, in a larger file."""


class Options(MeshOptions, total=False):
    """Of a scan, beside those of a mesh."""
    topology: Optional[Topology]
    """The topology of the control mesh."""
    outliers: Optional[Outliers]
    """Whether points off all others, and points that fill volumes as leaves do, are left out or are
    part of the surface."""
    stations: Optional[SightRule]
    """Whether the surface faces the places that its points were seen from: "auto", when these are
    known and believable; "use", without a check; or "ignore"."""
    normals: Optional[SightRule]
    """The same for the side of the given normals."""
    boundary: Optional[Boundary]
    """Keep an open scan open, or close it."""
    control_mesh: Union[None, Tuple[Any, Any], ControlMesh]
    """Start from these vertices (n, 3) and faces (m, 3), scan frame; or from a ControlMesh with its
    creases and corners."""


_SIGHT_RULES: Dict[str, int] = {
    "auto": options_pb2.SIGHT_RULE_AUTO, "use": options_pb2.SIGHT_RULE_USE,
    "ignore": options_pb2.SIGHT_RULE_IGNORE}
_WORDS: Dict[str, Dict[str, Optional[int]]] = {
    "outliers": {"remove": None, "keep": 0},
    "stations": _SIGHT_RULES, "normals": _SIGHT_RULES,
    "topology": {"auto": options_pb2.TOPOLOGY_AUTO, "planar": options_pb2.TOPOLOGY_PLANAR,
                 "spherical": options_pb2.TOPOLOGY_SPHERICAL,
                 "arbitrary": options_pb2.TOPOLOGY_ARBITRARY},
    "boundary": {"keep": options_pb2.BOUNDARY_KEEP, "close": options_pb2.BOUNDARY_CLOSE,
                 "exact": options_pb2.BOUNDARY_EXACT},
    "creases": {"auto": options_pb2.CREASES_AUTO, "off": options_pb2.CREASES_OFF},
    "scheme": {"loop": options_pb2.SCHEME_LOOP, "catmull-clark": options_pb2.SCHEME_CATMULL_CLARK},
    "fit": {"suzuki": options_pb2.FIT_METHOD_SUZUKI,
            "least-squares": options_pb2.FIT_METHOD_LEAST_SQUARES},
    "up": {"x": options_pb2.UP_DIRECTION_X, "y": options_pb2.UP_DIRECTION_Y,
           "z": options_pb2.UP_DIRECTION_Z, "-x": options_pb2.UP_DIRECTION_MINUS_X,
           "-y": options_pb2.UP_DIRECTION_MINUS_Y, "-z": options_pb2.UP_DIRECTION_MINUS_Z},
}
# Parameter: message within ReconstructOptions ("" for itself), field, type.
_FIELDS = {
    "max_bytes": ("encode", "max_bytes", int), "topology": ("control", "topology", str),
    "outliers": ("scan", "outlier_distance_factor", str),
    "stations": ("scan", "stations", str), "normals": ("scan", "normals", str),
    "boundary": ("control", "boundary", str), "creases": ("control", "creases", str),
    "scheme": ("control", "scheme", str),
    "up": ("place", "up", str),
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


_LENGTH = re.compile(r"\s*(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)\s*(%|[a-z-]*)\s*")


def _set_length(message: Any, parameter: str, value: Any, unit: Optional[str]) -> None:
    """A fraction of the diagonal, or a length in the unit of the points."""
    field, word = "ratio", ""
    if isinstance(value, str):
        match = _LENGTH.fullmatch(value)
        if match is None or match[2] not in ("", "%", "u", *UNITS):
            raise refuse(parameter, f"{value!r} is not a length: write a fraction of the diagonal "
                         f"(0.001 or '0.1%'), a number with a unit ('2cm'; one of "
                         f"{', '.join(UNITS)}) or one in the points' own units ('0.02u')")
        value, word = match[1], match[2]
    number: float = _converted(parameter, float, value)
    if word == "%":
        number /= 100
    elif word:
        field = "length"
        if word in UNITS:
            if unit is None:
                raise refuse(parameter, f"'{value}{word}' needs the unit of the points: say it "
                             "with unit='m', or write a fraction of the diagonal ('0.1%') or a "
                             "length in their own units ('0.02u')")
            metres = UNITS[word]
            number = number * metres.numerator / metres.denominator / float(UNITS[unit])
    setattr(message, f"{parameter}_{field}", number)


def as_message(options: Union[Options, MeshOptions], function: str = "reconstruct",
               known: Any = Options) -> Any:
    """The protocol's ReconstructOptions. Ranges are left to the server. TypeError in the name of
    `function` for what is not among those `known`."""
    for parameter in options:
        if parameter not in known.__annotations__:
            raise TypeError(f"{function}() got an unexpected keyword argument {parameter!r}")
    message = options_pb2.ReconstructOptions()
    given: Dict[str, Any] = {name: value for name, value in options.items() if value is not None}
    mesh: Any = given.pop("control_mesh", None)
    if mesh is not None:
        if "topology" in given:
            raise refuse("topology", "a given control_mesh has its own; leave it out")
        message.control.control_mesh.CopyFrom(pack_control_mesh(mesh))
        message.control.topology = options_pb2.TOPOLOGY_GIVEN
    unit = given.pop("unit", None)
    if unit is not None:
        if unit not in UNITS:
            raise refuse("unit", f"{unit!r} is not one of {', '.join(map(repr, UNITS))}")
        message.place.metres_per_unit = float(UNITS[unit])
    crs = given.pop("crs", None)
    if crs is not None:
        message.place.crs = str(crs)
    for parameter, target in (("max_error", message.encode), ("height_step", message.encode),
                              ("close_holes_below", message.control),
                              ("bridge_gaps_below", message.control)):
        if parameter in given:
            _set_length(target, parameter, given.pop(parameter), unit)
    for parameter, value in given.items():
        group, field, kind = _FIELDS[parameter]
        target = getattr(message, group) if group else message
        converted = _converted(parameter, kind, value)
        if converted is None:  # the server's default
            continue
        try:
            setattr(target, field, converted)
        except ValueError:  # of protobuf: not within 32 or 64 bits
            raise refuse(parameter, f"{value!r} is out of range") from None
    return message
