"""Points, a mesh or two solids in, surface out, in one call."""
import contextlib
import hashlib
import threading
from dataclasses import dataclass
from typing import (TYPE_CHECKING, Any, Callable, Dict, Iterator, Literal, Optional, Sequence, Tuple,
                    Union, cast)

import grpc
import numpy as np
import numpy.typing as npt

from . import _library
from .connection import Server, as_server, error_of
from .errors import DataLoss, InvalidArgument, RilievoError
from .options import UNITS, ConvertOptions, MeshOptions, Options, as_message
from .private_server import PrivateServer
from .scan import Packed, arrays_of_mesh, coordinates, pack, pack_mesh, pack_update, refuse
from .surface import Surface
from .v1 import options_pb2, reconstruction_pb2, reconstruction_pb2_grpc, report_pb2
from .values import Place

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(frozen=True)
class Progress:
    stage: str
    """"sending", "queued", "check", "neighbors", "normals", "control-mesh", "domain-fit",
    "displacement", "measure" or "encode"."""
    fraction: float
    """Of this stage, [0, 1]."""
    stage_seconds: float
    total_seconds: float
    """Since the points were complete."""


ProgressCallback = Callable[[Progress], Any]
LayerCallback = Callable[[Surface], Any]
Operation = Literal["union", "intersection", "difference"]
_OPERATIONS = ("union", "intersection", "difference")
Side = Literal["inside", "outside"]
_SHAPE_NUMBERS = {"plane": 4, "box": 6, "sphere": 4}


def reconstruct(points: Any, *, sensor: Any = None, point_normals: Any = None,
                point_colors: Any = None,
                server: Optional[Union[str, Server]] = None,
                progress: Optional[ProgressCallback] = None,
                layer: Optional[LayerCallback] = None, timeout: Optional[float] = None,
                **options: "Unpack[Options]") -> Surface:
    """Makes a surface from a scan.

    points    (n, 3) numbers in any unit, at least 20 points; or a structured array with x, y, z
              and, where known, sensor_x, sensor_y, sensor_z; nx, ny, nz; red, green, blue
    sensor    where the points were seen from: one place (3,), or (n, 3); NaN: not known
    point_normals  (n, 3), one for each point; zero: not known
    point_colors  (n, 3), sRGB: uint8, uint16, or real numbers from 0 to 1; the surface has colours
    server    "host:port", several with commas between (the first that answers), or a Server with
              a token and certificates; None: a private rilievod is started for this call (see
              PrivateServer for many calls)
    progress  called in this thread with a Progress; what it raises cancels the call
    layer     called in this thread with a Surface each time another level has arrived
    timeout   seconds for everything; None: no limit
    options   see Options: max_error, max_bytes, topology, ...

    Ctrl-C cancels the work and raises KeyboardInterrupt. Raises the errors of rilievo.errors;
    InvalidArgument tells the argument at fault. The same points, options and seed give the same
    bytes, whatever the client.
    """
    message, scan = as_message(options), pack(points, sensor, point_normals, point_colors)
    return _call(scan, message, "points", server, _Receiver(progress, layer), timeout)


def convert(vertices: Any, faces: Any, *, vertex_colors: Any = None,
            server: Optional[Union[str, Server]] = None,
            progress: Optional[ProgressCallback] = None,
            layer: Optional[LayerCallback] = None, timeout: Optional[float] = None,
            **options: "Unpack[ConvertOptions]") -> Surface:
    """Makes a surface of a triangle mesh. It keeps the genus and the borders of the mesh.

    vertices  (n, 3) numbers in any unit; or a structured array with x, y, z and, where known, red,
              green, blue
    faces     (m, 3) integers: the corners of each triangle, counted from 0, counter-clockwise seen
              from outside
    vertex_colors  (n, 3), sRGB: uint8, uint16, or real numbers from 0 to 1; the surface has colours
    options   see ConvertOptions: max_error, max_bytes, creases, ...

    server, progress, layer, timeout, interruption and errors: as of reconstruct(). What became of
    vertices and triangles that are not those of a manifold is in surface.report["mesh"].
    """
    message = as_message(options, "convert", ConvertOptions)
    mesh = pack_mesh(vertices, faces, vertex_colors)
    return _call(mesh, message, "vertices", server, _Receiver(progress, layer), timeout)


def combine(a: Union[Surface, Tuple[Any, Any]], b: Union[Surface, Tuple[Any, Any]],
            operation: Operation, *, server: Optional[Union[str, Server]] = None,
            progress: Optional[ProgressCallback] = None,
            layer: Optional[LayerCallback] = None, timeout: Optional[float] = None,
            **options: "Unpack[MeshOptions]") -> Surface:
    """Makes a surface of what two solids are together.

    a, b      closed Surfaces, at their finest level; or meshes: (vertices, faces) as of convert()
    operation "union", what is inside of a or b; "intersection", of both; "difference", of a alone
    options   as of convert(). Unit, way up and coordinate reference system are those of the
              surfaces, unless they are given; then they are taken for those of both

    server, progress, layer, timeout, interruption and errors: as of convert(). FailedPrecondition
    where a solid is open or overlaps itself, and where nothing is left. Colours are not carried
    over.
    """
    if operation not in _OPERATIONS:
        raise refuse("operation", f"{operation!r} is not one of "
                     f"{', '.join(map(repr, _OPERATIONS))}")
    message = as_message(_with_place(a, b, options), "combine", MeshOptions)
    threads = options.get("threads") or 0
    handle = _library.combine(_solid_of(a, "a", threads), _solid_of(b, "b", threads),
                              _OPERATIONS.index(operation), threads)
    mesh = pack_mesh(handle.array("rilievo_mesh_vertices", 3),
                     handle.array("rilievo_mesh_faces", 3))
    return _call(mesh, message, "vertices", server, _Receiver(progress, layer), timeout)


def trim(shape: Union[Surface, Tuple[Any, Any]], *, keep: Side,
         plane: Optional[Sequence[float]] = None, box: Optional[Sequence[float]] = None,
         sphere: Optional[Sequence[float]] = None,
         polyline: Optional[Tuple[Any, Sequence[float]]] = None, cap: bool = False,
         server: Optional[Union[str, Server]] = None,
         progress: Optional[ProgressCallback] = None, layer: Optional[LayerCallback] = None,
         timeout: Optional[float] = None, **options: "Unpack[MeshOptions]") -> Surface:
    """Makes a surface of what lies on one side of a plane, a box, a sphere or a polyline.

    shape     a Surface, at its finest level; or a mesh: (vertices, faces) as of convert()
    keep      "inside" or "outside" of the one that is given, in the coordinates of `shape`:
    plane     A, B, C, D; inside is where A x + B y + C z < D
    box       two corners: x, y, z, x, y, z
    sphere    x, y, z of its centre, and its radius
    polyline  (points, direction): (n, 3) corners of a closed polyline, swept along the direction
    cap       close the surface along it, as combine() with a solid does; `shape` must be closed
    options   as of convert(). Unit, way up and coordinate reference system are those of `shape`,
              unless they are given

    server, progress, layer, timeout, interruption and errors: as of convert(). FailedPrecondition
    where nothing is left. Colours are not carried over.
    """
    if keep not in ("inside", "outside"):
        raise refuse("keep", f"{keep!r} is not one of 'inside', 'outside'")
    kind, numbers = _trim_numbers(plane, box, sphere, polyline)
    message = as_message(_with_place(shape, shape, options), "trim", MeshOptions)
    if not cap:
        message.control.boundary = options_pb2.BOUNDARY_EXACT
    threads = options.get("threads") or 0
    handle = _library.trim(_solid_of(shape, "shape", threads), kind, numbers, keep == "outside",
                           bool(cap), threads)
    mesh = pack_mesh(handle.array("rilievo_mesh_vertices", 3),
                     handle.array("rilievo_mesh_faces", 3))
    return _call(mesh, message, "vertices", server, _Receiver(progress, layer), timeout)


def update(surface: Surface, points: Any, *, whole: bool = False,
           server: Optional[Union[str, Server]] = None,
           progress: Optional[ProgressCallback] = None,
           timeout: Optional[float] = None, threads: int = 0) -> Surface:
    """The surface with heights made anew where a new scan contradicts it.

    surface   at its finest level, as the whole file has it
    points    (n, 3) numbers in the frame and unit of the surface: a scan of all of it, or of the
              part that changed
    whole     the scan shows all there is to see: heights that were measured where it has no points
              become filled ones; else they stay as they are
    threads   that the server uses at most; 0: all

    The bytes of the new surface begin with those of the old one, and only what follows them comes
    back from the server. The new surface's report["update"] says how much that is, and the
    distances before and after.

    server, progress, timeout, interruption and errors: as of reconstruct(). FailedPrecondition
    where the scan lies elsewhere, or where changes are larger than heights reach.
    """
    packed = pack_update(points, surface, whole)
    message = as_message(Options(threads=threads), "update") if threads else None
    return _call(packed, message, "points", server, _Receiver(progress, None, packed.base), timeout)


def _trim_numbers(plane: Any, box: Any, sphere: Any,
                  polyline: Any) -> Tuple[int, npt.NDArray[np.float64]]:
    """The kind of the shape that is given, and its numbers, for the decoder library."""
    given = {name: value for name, value in
             (("plane", plane), ("box", box), ("sphere", sphere), ("polyline", polyline))
             if value is not None}
    if len(given) != 1:
        raise refuse("plane", f"{', '.join(given) or 'nothing'} given; give one of plane, box, "
                     "sphere, polyline")
    (name, value), = given.items()
    if name == "polyline":
        try:
            points, direction = value
        except (TypeError, ValueError):
            raise refuse(name, "a pair (points, direction) is needed") from None
        rows = [coordinates(np.reshape(direction, (1, -1)), name), coordinates(points, name)]
        return 3, np.concatenate(rows).ravel()
    numbers = np.array(value, np.float64).ravel()
    if len(numbers) != _SHAPE_NUMBERS[name]:
        raise refuse(name, f"{len(numbers)} numbers; {_SHAPE_NUMBERS[name]} are needed")
    if name == "box":
        corners = numbers.reshape(2, 3)
        numbers = np.concatenate([corners.min(axis=0), corners.max(axis=0)])
    return list(_SHAPE_NUMBERS).index(name), numbers


def _solid_of(solid: Any, parameter: str, threads: int) -> _library.Handle:
    if isinstance(solid, Surface):
        return solid._finest(threads)
    vertices, faces = arrays_of_mesh(solid, parameter)
    try:
        return _library.mesh_of_arrays(vertices, np.ascontiguousarray(faces, np.uint32), threads)
    except InvalidArgument as error:
        raise refuse(parameter, str(error)) from None


def _with_place(a: Any, b: Any, options: MeshOptions) -> MeshOptions:
    """What the options leave out is what both solids say; refuses what they contradict."""
    places = [solid.place if isinstance(solid, Surface) else Place(None, None, None)
              for solid in (a, b)]
    completed: Any = dict(options)
    for parameter, field in (("unit", "metres_per_unit"), ("up", "up"), ("crs", "crs")):
        if completed.get(parameter) is not None:
            continue
        of_a, of_b = (getattr(place, field) for place in places)
        if of_a != of_b:
            raise refuse(parameter, f"of a it is {of_a}, of b {of_b}; bring both into one system "
                         "first, or say which one their coordinates are in")
        completed[parameter] = _unit_of(of_a) if parameter == "unit" else of_a
    return cast(MeshOptions, completed)


def _unit_of(metres: Optional[float]) -> Optional[str]:
    if metres is None:
        return None
    for unit, length in UNITS.items():
        if float(length) == metres:
            return unit
    raise refuse("unit", f"a unit of {metres} metres is not one of {', '.join(map(repr, UNITS))}")


def _call(scan: Packed, options: Any, points: str, server: Optional[Union[str, Server]],
          receiver: "_Receiver", timeout: Optional[float]) -> Surface:
    """`points`: what the caller calls them."""
    with contextlib.ExitStack() as stack:
        where = as_server(server if server is not None else stack.enter_context(PrivateServer()))
        channel = stack.enter_context(contextlib.closing(where.channel()))
        stub = _new_stub(channel)
        requests = _Requests(scan, options)
        call = stub.Reconstruct(iter(requests), timeout=timeout, metadata=where.metadata())
        try:
            for response in call:
                receiver.take(response)
        except grpc.RpcError as failure:
            if requests.failure is not None:
                raise requests.failure from None
            raise error_of(failure, where.address, points) from None
        finally:
            # Whatever happened: a finished call is not harmed.
            call.cancel()
            requests.stop()
    return receiver.finish()


def _new_stub(channel: Any) -> Any:
    kind: Any = reconstruction_pb2_grpc.ReconstructionServiceStub  # generated without types
    return kind(channel)


class _Requests:
    """The messages of one call; gRPC takes them in a thread of its own."""

    def __init__(self, scan: Packed, options: Any) -> None:
        self._scan, self._options = scan, options
        self._stopped = threading.Event()
        self.failure: Optional[BaseException] = None

    def stop(self) -> None:
        self._stopped.set()

    def __iter__(self) -> Iterator[Any]:
        try:
            request = reconstruction_pb2.ReconstructRequest
            yield request(header=self._scan.header(self._options))
            streams: Tuple[Tuple[str, Any, Iterator[Any]], ...] = (
                ("points", reconstruction_pb2.PointChunk, self._scan.pieces()),
                ("triangles", reconstruction_pb2.MeshChunk, self._scan.triangle_pieces()),
                ("base", reconstruction_pb2.BaseChunk, self._scan.base_pieces()))
            for field, chunk, pieces in streams:
                for data in pieces:
                    if self._stopped.is_set():
                        return
                    yield request(**{field: chunk(data=data)})
        except Exception as error:  # gRPC would only say that it was cancelled
            self.failure = error
            raise


def check_digest(sha256: bytes, data: bytes) -> None:
    """Raises DataLoss when `data` has another SHA-256 than the server told, if it told one."""
    if sha256 and hashlib.sha256(data).digest() != sha256:
        raise DataLoss("the surface that arrived is not the one that was made: its SHA-256 "
                       "differs; fetch it again")


class _Receiver:
    """Puts the answers together."""

    def __init__(self, progress: Optional[ProgressCallback], layer: Optional[LayerCallback],
                 known: bytes = b"") -> None:
        """`known`: the beginning of the file, which does not come."""
        self._progress, self._layer = progress, layer
        self._header: Any = None
        self._report: Optional[Dict[str, Any]] = None
        self._bytes = bytearray(known)
        self._ends: "list[int]" = []

    def take(self, response: Any) -> None:
        kind = response.WhichOneof("message")
        if kind == "progress":
            if self._progress:
                self._progress(progress_of(response.progress))
        elif kind == "surface":
            self.begin(response.surface)
        elif kind == "piece":
            self.append(response.piece)
        elif kind == "summary":
            self._report = report_of(response.summary.report)

    def begin(self, header: Any) -> None:
        self._header = header
        end = 0
        for size in header.chunk_bytes:
            end += size
            self._ends.append(end)

    def append(self, piece: Any) -> None:
        if piece.offset != len(self._bytes):
            raise DataLoss(f"a piece at byte {piece.offset} came where byte {len(self._bytes)} "
                           "was due")
        self._bytes += piece.data
        # The control mesh alone, chunk 0, is not a layer.
        if self._layer and len(self._bytes) in self._ends[1:-1]:
            self._layer(Surface.from_bytes(self._bytes))

    def finish(self) -> Surface:
        if self._header is None or len(self._bytes) != self._header.total_bytes:
            raise DataLoss(f"the answer ended after {len(self._bytes)} bytes of the surface")
        if self._report is None:
            raise DataLoss("the answer ended without a summary")
        check_digest(self._header.sha256, self._bytes)
        surface = Surface(bytes(self._bytes), len(self._bytes), self._report)
        if self._layer:
            self._layer(surface)
        return surface


def stage_name(stage: int) -> str:
    """"control-mesh" for STAGE_CONTROL_MESH."""
    try:
        name = report_pb2.Stage.Name(stage)
    except ValueError:  # of a newer server
        return f"stage-{stage}"
    return str(name)[len("STAGE_"):].lower().replace("_", "-")


def progress_of(message: Any) -> Progress:
    return Progress(stage_name(message.stage), message.fraction, message.stage_seconds,
                    message.total_seconds)


def report_of(message: Any) -> Dict[str, Any]:
    """A ReconstructReport by the names of report.proto, stage times by stage; what is not set and
    is a message of its own, such as the error when it was not measured, is None."""
    report = _fields_of(message)
    report.pop("stage_times")
    report["stage_seconds"] = {stage_name(t.stage): t.seconds for t in message.stage_times}
    return report


def _fields_of(message: Any) -> Dict[str, Any]:
    values: Dict[str, Any] = {}
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        if field.label == field.LABEL_REPEATED:
            values[field.name] = list(value)
        elif field.message_type is not None:
            values[field.name] = _fields_of(value) if message.HasField(field.name) else None
        else:
            values[field.name] = value
    return values


__all__ = ["LayerCallback", "Operation", "Progress", "ProgressCallback", "RilievoError", "combine",
           "convert", "reconstruct", "trim", "update"]
