"""Channels to a server, and its errors as exceptions."""
import os
import random
from dataclasses import dataclass, replace
from typing import Any, List, Optional, Tuple, Type, Union

import grpc

from .errors import (Cancelled, DataLoss, DeadlineExceeded, FailedPrecondition, FieldViolation,
                     InvalidArgument, LimitExceeded, NotFound, PermissionDenied, ResourceExhausted,
                     RilievoError, ServerDefect, Unavailable)
from .google_rpc import error_details_pb2, status_pb2

_OPTIONS = (
    ("grpc.enable_http_proxy", 0),
    # A peer that vanished without a word is noticed after half a minute.
    ("grpc.keepalive_time_ms", 20_000),
    ("grpc.keepalive_timeout_ms", 10_000),
    # A server that was started again is found soon; gRPC's own pauses grow to two minutes.
    ("grpc.initial_reconnect_backoff_ms", 200),
    ("grpc.max_reconnect_backoff_ms", 2_000),
)

_ERRORS = {
    grpc.StatusCode.INVALID_ARGUMENT: InvalidArgument,
    grpc.StatusCode.OUT_OF_RANGE: InvalidArgument,
    grpc.StatusCode.FAILED_PRECONDITION: FailedPrecondition,
    grpc.StatusCode.NOT_FOUND: NotFound,
    grpc.StatusCode.UNAUTHENTICATED: PermissionDenied,
    grpc.StatusCode.PERMISSION_DENIED: PermissionDenied,
    grpc.StatusCode.RESOURCE_EXHAUSTED: ResourceExhausted,
    grpc.StatusCode.DEADLINE_EXCEEDED: DeadlineExceeded,
    grpc.StatusCode.CANCELLED: Cancelled,
    grpc.StatusCode.UNAVAILABLE: Unavailable,
    grpc.StatusCode.DATA_LOSS: DataLoss,
    grpc.StatusCode.INTERNAL: ServerDefect,
}

_DOMAINS = ("rilievo.dev", "rilievo")

# Arguments of reconstruct() and convert() by the protocol's fields, where their names differ.
_PARAMETERS = {
    "point_count": "points", "coordinate_format": "points", "points": "points",
    "triangle_count": "faces", "triangles": "faces", "base": "surface", "base_surface": "surface",
    "height_step_ratio": "height_step", "max_error_ratio": "max_error", "method": "fit",
    "height_step_length": "height_step", "max_error_length": "max_error", "metres_per_unit": "unit",
    "close_holes_below_ratio": "close_holes_below",
    "close_holes_below_length": "close_holes_below",
    "bridge_gaps_below_ratio": "bridge_gaps_below",
    "bridge_gaps_below_length": "bridge_gaps_below",
    "outlier_distance_factor": "outliers", "control_mesh": "control_mesh",
}
_SAME = ("max_bytes", "topology", "boundary", "creases", "stations", "normals", "control_faces",
         "max_level", "seed", "threads", "measure", "up", "crs")


@dataclass(frozen=True)
class Server:
    """Where to work. Without `authorities` the connection is plaintext: for this machine and
    trusted networks."""
    address: str
    """"host:port"; or several servers over one store, "host:port,host:port"."""
    token: Optional[str] = None
    """Sent with every call. Over plaintext only to this machine, unless allow_plaintext."""
    authorities: Optional[Union[str, "os.PathLike[str]"]] = None
    """PEM file of the authorities that the server's certificate must be of."""
    certificate: Optional[Union[str, "os.PathLike[str]"]] = None
    """PEM file of the client's own certificate, for mutual TLS; with `key`."""
    key: Optional[Union[str, "os.PathLike[str]"]] = None
    allow_plaintext: bool = False
    """Send the token unencrypted even to another machine."""

    def each(self) -> List["Server"]:
        """One of each address, in an order of chance, so that clients spread over them."""
        addresses = self.address.split(",")
        if "" in addresses:
            raise InvalidArgument(f"server: one of the addresses of {self.address!r} is empty; give "
                                  "host:port,host:port")
        return [replace(self, address=address)
                for address in random.sample(addresses, len(addresses))]

    def channel(self) -> Any:
        """A grpc.Channel; close it. Of several addresses: to the first that answers."""
        each = self.each()
        for server in each if len(each) > 1 else []:
            channel = server.channel()
            try:
                grpc.channel_ready_future(channel).result(timeout=2)
                return channel
            except grpc.FutureTimeoutError:
                channel.close()
        if len(each) > 1:
            return each[0].channel()
        if (self.certificate is None) != (self.key is None):
            raise InvalidArgument("a certificate and its key go together; give both")
        if self.certificate is not None and self.authorities is None:
            raise InvalidArgument("a certificate is shown over TLS alone; give authorities too")
        if self.authorities is None:
            return grpc.insecure_channel(self.address, options=_OPTIONS)
        credentials = grpc.ssl_channel_credentials(
            _bytes_of(self.authorities), self.key and _bytes_of(self.key),
            self.certificate and _bytes_of(self.certificate))
        return grpc.secure_channel(self.address, credentials, options=_OPTIONS)

    def metadata(self) -> Tuple[Tuple[str, str], ...]:
        """What goes with every call."""
        if self.token is None:
            return ()
        if (self.authorities is None and not self.allow_plaintext and
                not all(server._is_local() for server in self.each())):
            raise InvalidArgument(f"the token would travel unencrypted to {self.address}; give "
                                  "authorities, or set allow_plaintext")
        return (("authorization", f"Bearer {self.token}"),)

    def _is_local(self) -> bool:
        host = self.address.rpartition(":")[0].strip("[]")
        return (self.address.startswith("unix:") or host in ("localhost", "::1") or
                host.startswith("127.") and host.replace(".", "").isdigit())


def as_server(server: Union[str, Server]) -> Server:
    return server if isinstance(server, Server) else Server(server)


def _bytes_of(path: Union[str, "os.PathLike[str]"]) -> bytes:
    with open(path, "rb") as file:
        return file.read()


def parameter_of(field: str) -> str:
    """The argument of reconstruct() or convert() that a path of the protocol belongs to, or ""."""
    # The outermost: what a control mesh consists of has names that are arguments too.
    for part in field.replace("[", ".").split("."):
        if part in _PARAMETERS:
            return _PARAMETERS[part]
        if part in _SAME:
            return part
    return ""


def error_of(failure: Any, address: str, points: str = "points") -> RilievoError:
    """The exception for a grpc.RpcError, with what its trailer says. `points`: what the caller
    calls them."""
    code, message = failure.code(), failure.details() or ""
    details = _details(failure)
    violations = [v._replace(parameter=points) if v.parameter == "points" else v
                  for v in _violations(details)]
    lines = [f"{v.parameter or v.field}: {v.description}" for v in violations]
    if violations:
        message = "; ".join(lines)
    reason, retry_delay = _reason(details), _retry_delay(details)
    if code == grpc.StatusCode.UNAVAILABLE and not reason:
        message = f"the server at {address} is unavailable: {message}. Is rilievod running there?"
    kind: Type[RilievoError] = _ERRORS.get(code, RilievoError)
    if kind is InvalidArgument and reason == "LIMIT_EXCEEDED":
        kind = LimitExceeded
    return kind(message, violations, reason, retry_delay)


def error_of_status(status: Any) -> RilievoError:
    """The exception for a google.rpc.Status, as a failed job carries it."""
    codes = {code.value[0]: code for code in grpc.StatusCode}
    violations = _violations(status)
    message = "; ".join(f"{v.parameter or v.field}: {v.description}" for v in violations)
    kind: Type[RilievoError] = _ERRORS.get(codes.get(status.code), RilievoError)
    return kind(message or status.message, violations, _reason(status), _retry_delay(status))


def _details(failure: Any) -> Any:
    status = status_pb2.Status()
    for key, value in failure.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            status.ParseFromString(value)
    return status


def _found(status: Any, message: Any) -> Any:
    for detail in status.details:
        if detail.Is(message.DESCRIPTOR):
            detail.Unpack(message)
            return message
    return None


def _violations(status: Any) -> List[FieldViolation]:
    bad = _found(status, error_details_pb2.BadRequest())
    if bad is None:
        return []
    return [FieldViolation(parameter_of(v.field), v.field, v.description)
            for v in bad.field_violations]


def _reason(status: Any) -> str:
    info = _found(status, error_details_pb2.ErrorInfo())
    # What stands between, such as a proxy, has words of its own.
    return str(info.reason) if info is not None and info.domain in _DOMAINS else ""


def _retry_delay(status: Any) -> Optional[float]:
    retry = _found(status, error_details_pb2.RetryInfo())
    return retry.retry_delay.seconds + retry.retry_delay.nanos * 1e-9 if retry else None
