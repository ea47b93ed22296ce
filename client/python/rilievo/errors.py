"""What can go wrong, as exceptions. `docs/api.md` says when each of them comes and what to do."""
from typing import NamedTuple, Optional, Sequence, Tuple


class FieldViolation(NamedTuple):
    """A field of the request at fault."""
    parameter: str
    """The argument of the call that it came from, such as "max_error"; "" for
    none."""
    field: str
    """Its path in the protocol, such as "header.options.encode.max_error_ratio"."""
    description: str
    """The value found and what would be right."""


class RilievoError(Exception):
    """Of all errors of this package."""

    def __init__(self, message: str, violations: Sequence[FieldViolation] = (), reason: str = "",
                 retry_delay: Optional[float] = None) -> None:
        super().__init__(message)
        self.violations: Tuple[FieldViolation, ...] = tuple(violations)
        self.reason = reason
        """ErrorInfo.reason of the server, such as "JOBS_LIMIT"; "" when the error is not from one."""
        self.retry_delay = retry_delay
        """Seconds after which the same call may succeed, when the server named a time."""

    @property
    def parameter(self) -> str:
        """The first argument at fault; "" when none is known."""
        return next((v.parameter for v in self.violations if v.parameter), "")


class InvalidArgument(RilievoError, ValueError):
    """An argument out of range, points or a mesh that cannot be a surface, or bytes that are no
    .dss."""


class LimitExceeded(InvalidArgument):
    """The scan or the surface asked for is over a limit of this server."""


class FailedPrecondition(RilievoError):
    """The points are sound but cannot be had as asked, solids cannot be combined, or the server
    keeps no jobs."""


class NotFound(RilievoError, LookupError):
    """No such job or scan."""


class PermissionDenied(RilievoError, PermissionError):
    """The server wants a token, or another one."""


class ResourceExhausted(RilievoError):
    """Memory, places or room have run out; see `reason` and `retry_delay`."""


class DeadlineExceeded(RilievoError, TimeoutError):
    """The caller's time or the server's is over; see `reason`."""


class Cancelled(RilievoError):
    """The call or the job was cancelled."""


class Unavailable(RilievoError, ConnectionError):
    """The server cannot be reached or shuts down."""


class DataLoss(RilievoError):
    """Bytes that are cut off or corrupted."""


class ServerDefect(RilievoError):
    """A defect of the server or of this library; report it."""
