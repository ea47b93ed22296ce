"""Reconstructions that outlive the connection: servers with a store keep them."""
import contextlib
import hashlib
import itertools
import random
import time
import uuid
from types import TracebackType
from typing import TYPE_CHECKING, Any, Callable, Dict, Iterator, List, Optional, Type, Union

import grpc

from .connection import Server, as_server, error_of, error_of_status
from .errors import (Cancelled, DataLoss, DeadlineExceeded, InvalidArgument, NotFound,
                     RilievoError, Unavailable)
from .options import ConvertOptions, Options, as_message
from .reconstruction import ProgressCallback, check_digest, progress_of, report_of
from .scan import Packed, pack, pack_mesh, pack_update
from .surface import Surface
from .v1 import jobs_pb2, jobs_pb2_grpc

if TYPE_CHECKING:
    from typing_extensions import Unpack

_ATTEMPTS = 8
_FIRST_PAUSE, _LONGEST_PAUSE = 0.2, 10.0
_FINISHED = ("succeeded", "failed", "cancelled")


class Job:
    """What is known of a kept job; the methods ask the server."""

    def __init__(self, jobs: "Jobs", message: Any, known: bytes = b"") -> None:
        """`known`: the first bytes of the surface."""
        self._jobs, self._message, self._known = jobs, message, known

    @property
    def job_id(self) -> str:
        return str(self._message.job_id)

    @property
    def request_id(self) -> str:
        return str(self._message.request_id)

    @property
    def scan_id(self) -> str:
        return str(self._message.scan_id)

    @property
    def state(self) -> str:
        """"queued", "running", "succeeded", "failed" or "cancelled", when last asked."""
        return str(jobs_pb2.JobState.Name(self._message.state))[len("JOB_STATE_"):].lower()

    @property
    def finished(self) -> bool:
        return self.state in _FINISHED

    @property
    def report(self) -> Optional[Dict[str, Any]]:
        """When succeeded."""
        return report_of(self._message.report) if self.state == "succeeded" else None

    @property
    def error(self) -> Optional[RilievoError]:
        """When failed: what reconstruct() would have raised."""
        return error_of_status(self._message.error) if self.state == "failed" else None

    def __repr__(self) -> str:
        return f"<rilievo.Job {self.job_id}: {self.state}>"

    def refresh(self) -> "Job":
        self._message = self._jobs.get(self.job_id)._message
        return self

    def wait(self, progress: Optional[ProgressCallback] = None,
             timeout: Optional[float] = None) -> "Job":
        """Until the job is finished, whatever becomes of the connection."""
        self._message = self._jobs._watch(self.job_id, progress, timeout)
        return self

    def fetch(self, progress: Optional[ProgressCallback] = None,
              timeout: Optional[float] = None) -> Surface:
        """The surface; waits first. Raises the error of a job that failed or was cancelled."""
        end = None if timeout is None else time.monotonic() + timeout
        if not self.finished:
            self.wait(progress, timeout)
        if self.error is not None:
            raise self.error
        if self.state == "cancelled":
            raise Cancelled(f"job {self.job_id} was cancelled")
        data = self._jobs._fetch(self.job_id, end and end - time.monotonic(), self._known)
        return Surface(data, len(data), self.report)

    def cancel(self) -> "Job":
        self._message = self._jobs._call(
            "CancelJob", jobs_pb2.CancelJobRequest(job_id=self.job_id)).job
        return self

    def delete(self) -> None:
        """Removes the job, its surface, and its scan unless another job of yours names it; a running
        one is cancelled first."""
        self._jobs._delete(self.job_id)


class Jobs:
    """A server's kept jobs. Calls are repeated while the server is away, and streams go on where
    they broke; nothing is done twice. Of several servers over one store ("a:50051,b:50051") calls
    go on at the next one.

        with rilievo.Jobs("host:50051") as jobs:
            surface = jobs.submit(points, max_error=1e-3).fetch()
    """

    def __init__(self, server: Union[str, Server]) -> None:
        self._server = as_server(server)
        self._closed = False
        self._channels = [server.channel() for server in self._server.each()]
        self._stubs = [jobs_pb2_grpc.JobsServiceStub(channel)  # type: ignore[no-untyped-call]
                       for channel in self._channels]
        self._current = 0

    @property
    def _stub(self) -> Any:
        return self._stubs[self._current]

    def _move_on(self) -> None:
        """After a call failed: those that follow go to the next server."""
        self._current = (self._current + 1) % len(self._stubs)

    def close(self) -> None:
        self._closed = True
        for channel in self._channels:
            channel.close()

    def __enter__(self) -> "Jobs":
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], value: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        self.close()

    def submit(self, points: Any, *, sensor: Any = None, point_normals: Any = None,
               point_colors: Any = None,
               request_id: Optional[str] = None,
               timeout: Optional[float] = None,
               **options: "Unpack[Options]") -> Job:
        """Uploads what the server does not have, and creates the job. The same `request_id` (1 to
        64 letters, digits, '-' and '_') gives the same job, however often it is called. Arguments
        as of reconstruct()."""
        return self._create(pack(points, sensor, point_normals, point_colors), as_message(options),
                            request_id, timeout)

    def convert(self, vertices: Any, faces: Any, *, vertex_colors: Any = None,
                request_id: Optional[str] = None, timeout: Optional[float] = None,
                **options: "Unpack[ConvertOptions]") -> Job:
        """submit() of a triangle mesh; arguments as of rilievo.convert()."""
        return self._create(pack_mesh(vertices, faces, vertex_colors),
                            as_message(options, "convert", ConvertOptions), request_id, timeout)

    def update(self, surface: Surface, points: Any, *, whole: bool = False,
               request_id: Optional[str] = None, timeout: Optional[float] = None,
               threads: int = 0) -> Job:
        """submit() of a new scan of a surface; arguments as of rilievo.update(). fetch() of this Job
        brings only what follows the bytes of the old surface."""
        return self._create(pack_update(points, surface, whole),
                            as_message(Options(threads=threads)) if threads else None,
                            request_id, timeout)

    def _create(self, scan: Packed, message: Any, request_id: Optional[str],
                timeout: Optional[float]) -> Job:
        digest = hashlib.sha256()
        for piece in _pieces(scan):
            digest.update(piece)
        request = jobs_pb2.CreateJobRequest(
            request_id=request_id or str(uuid.uuid4()), scan_id=digest.hexdigest(),
            header=scan.header(message))
        tries = _Tries(self, timeout)
        for _ in range(3):
            try:
                return Job(self, tries.repeat(lambda left: self._stub.CreateJob(
                    request, timeout=left, metadata=self._server.metadata())).job, scan.base)
            except NotFound:
                self._upload(scan, digest.digest(), tries)
        raise Unavailable("the server removed the scan after each upload; its store is too small")

    def get(self, job_id: str) -> Job:
        return Job(self, self._call("GetJob", jobs_pb2.GetJobRequest(job_id=job_id)).job)

    def list(self, limit: int = 100) -> List[Job]:
        """The newest first."""
        jobs: List[Job] = []
        request = jobs_pb2.ListJobsRequest()
        while len(jobs) < limit:
            request.page_size = min(limit - len(jobs), 1000)
            page = self._call("ListJobs", request)
            jobs += [Job(self, message) for message in page.jobs]
            request.page_token = page.next_page_token
            if not request.page_token:
                break
        return jobs

    def delete_scan(self, scan_id: str) -> None:
        """Removes a scan that was uploaded; unfinished jobs on it go on."""
        tries = _Tries(self, None)
        request = jobs_pb2.DeleteScanRequest(scan_id=scan_id)
        try:
            tries.repeat(lambda left: self._stub.DeleteScan(request, timeout=left,
                                                            metadata=self._server.metadata()))
        except NotFound:
            if tries.calls == 1:
                raise

    def _call(self, method: str, request: Any) -> Any:
        return _Tries(self, None).repeat(
            lambda left: getattr(self._stub, method)(request, timeout=left,
                                                     metadata=self._server.metadata()))

    def _delete(self, job_id: str) -> None:
        tries = _Tries(self, None)
        request = jobs_pb2.DeleteJobRequest(job_id=job_id)
        try:
            tries.repeat(lambda left: self._stub.DeleteJob(request, timeout=left,
                                                           metadata=self._server.metadata()))
        except NotFound:
            if tries.calls == 1:
                raise

    def _upload(self, scan: Packed, digest: bytes, tries: "_Tries") -> None:
        total = scan.points.nbytes + scan.triangles.nbytes + len(scan.base)
        query = jobs_pb2.GetUploadRequest(upload_id=digest.hex())
        known = 0

        def messages(begin: int) -> Iterator[Any]:
            message = jobs_pb2.UploadScanRequest
            yield message(header=jobs_pb2.UploadHeader(upload_id=digest.hex(), offset=begin,
                                                       total_bytes=total))
            for piece in _pieces(scan, begin):
                yield message(chunk=piece)
            yield message(end=jobs_pb2.UploadEnd(total_bytes=total, sha256=digest))

        while True:
            stored = tries.repeat(lambda left: self._stub.GetUpload(
                query, timeout=left, metadata=self._server.metadata())).stored_bytes
            if stored > known:
                tries.progress()
            known = max(known, stored)
            try:
                tries.once(lambda left: self._stub.UploadScan(
                    messages(stored if stored <= total else 0), timeout=left,
                    metadata=self._server.metadata()))
                return
            except DataLoss as error:
                # What the server had was not what was sent: it has dropped it.
                tries.pause(error, worth_it=True)
            except RilievoError as error:
                # ABORTED: another stream of the same scan has taken over. Offset out of range: it
                # has just completed it, or the server has dropped what it had.
                tries.pause(error, worth_it=type(error) is RilievoError
                            or error.reason == "OFFSET_OUT_OF_RANGE")

    def _watch(self, job_id: str, progress: Optional[ProgressCallback],
               timeout: Optional[float]) -> Any:
        tries = _Tries(self, timeout)
        request = jobs_pb2.WatchJobRequest(job_id=job_id)

        def watch(left: Optional[float]) -> None:
            call = self._stub.WatchJob(request, timeout=left, metadata=self._server.metadata())
            with contextlib.ExitStack() as stack:
                stack.callback(call.cancel)
                for response in call:
                    tries.progress()
                    request.after_sequence = response.event.sequence
                    if progress and response.event.WhichOneof("event") == "progress":
                        progress(progress_of(response.event.progress))

        tries.repeat(watch)
        return self.get(job_id)._message

    def _fetch(self, job_id: str, timeout: Optional[float], known: bytes) -> bytes:
        tries = _Tries(self, timeout)
        data = bytearray(known)
        total, digest = -1, b""

        def stream(left: Optional[float]) -> None:
            nonlocal total, digest
            request = jobs_pb2.StreamSurfaceRequest(job_id=job_id, offset=len(data))
            call = self._stub.StreamSurface(request, timeout=left,
                                            metadata=self._server.metadata())
            with contextlib.ExitStack() as stack:
                stack.callback(call.cancel)
                for response in call:
                    tries.progress()
                    if response.HasField("surface"):
                        total, digest = response.surface.total_bytes, response.surface.sha256
                        continue
                    if response.piece.offset != len(data):
                        raise DataLoss("the server left out a part of the surface")
                    data.extend(response.piece.data)

        tries.repeat(stream)
        if len(data) != total:
            raise DataLoss("the server ended before the surface did")
        check_digest(digest, data)
        return bytes(data)


def _pieces(scan: Packed, begin: int = 0) -> Iterator[bytes]:
    """What is uploaded, from byte `begin` on: the points, and what follows them."""
    skipped = min(begin, scan.points.nbytes)
    yield from scan.pieces(skipped)
    skipped = begin - skipped
    for piece in itertools.chain(scan.triangle_pieces(), scan.base_pieces()):
        if skipped < len(piece):
            yield piece[skipped:]
        skipped = max(0, skipped - len(piece))


class _Tries:
    """Repeats a call after growing pauses while that may help, at each server in turn; one deadline
    for all."""

    def __init__(self, jobs: Jobs, timeout: Optional[float]) -> None:
        self._jobs = jobs
        self._end = None if timeout is None else time.monotonic() + timeout
        self._failures = 0
        self._of_call: Optional[RilievoError] = None
        self.calls = 0

    def progress(self) -> None:
        """Pauses and attempts begin anew."""
        self._failures = 0

    def once(self, call: Callable[[Optional[float]], Any]) -> Any:
        left = None if self._end is None else max(0.0, self._end - time.monotonic())
        self.calls += 1
        try:
            return call(left)
        except grpc.RpcError as failure:
            self._of_call = error_of(failure, self._jobs._server.address)
            raise self._of_call from None

    def repeat(self, call: Callable[[Optional[float]], Any]) -> Any:
        while True:
            try:
                return self.once(call)
            except RilievoError as error:
                self.pause(error)

    def pause(self, error: RilievoError, worth_it: bool = False) -> None:
        """Waits, or raises `error` when another attempt cannot help or no time is left."""
        self._failures += 1
        # Cancelled: by a server that ended before it had answered, not by a callback or close().
        ended = isinstance(error, Cancelled) and error is self._of_call and not self._jobs._closed
        may_help = (worth_it or ended or isinstance(error, Unavailable)
                    or error.retry_delay is not None)
        servers = len(self._jobs._stubs)
        rounds, rest = divmod(self._failures, servers)
        seconds = 0.0
        if rest == 0:  # each has been asked
            seconds = min(_LONGEST_PAUSE, _FIRST_PAUSE * 2.0 ** (rounds - 1))
            seconds = max(seconds * random.uniform(0.5, 1.5), error.retry_delay or 0.0)
        late = self._end is not None and time.monotonic() + seconds > self._end
        if not may_help or self._failures >= _ATTEMPTS * servers or late:
            raise error
        self._jobs._move_on()
        time.sleep(seconds)
