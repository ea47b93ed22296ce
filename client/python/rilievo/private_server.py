"""A rilievod of one's own, for as long as it is needed."""
import os
import select
import signal
import subprocess
import tempfile
import time
from types import TracebackType
from typing import IO, List, Optional, Type

from . import _programs
from .connection import Server
from .errors import Unavailable

_START_SECONDS = 30.0
# The shell ends the server when this process is gone, however it went: then its standard input
# is at its end. Standard output is the server's alone, so that its end is seen too.
_WATCH = ('exec 3<&0; "$@" 3<&- & child=$!; exec >/dev/null; '
          'cat <&3; kill -TERM $child; wait $child')
# A server's limits protect it from strangers; here are none.
_OPTIONS = {
    "--max-points": "2147483647", "--max-bytes": "51539607528",
    "--max-surface-faces": "2147483647", "--max-job-seconds": "604800",
    "--max-idle-seconds": "604800", "--drain-seconds": "0", "--max-job-memory": "0",
    "--memory-budget": "9223372036854775807",
}


def find_program() -> str:
    """rilievod: named by the environment variable RILIEVOD, in PATH, or in the bin folder of the
    place where this package is installed."""
    return _programs.find("rilievod", "RILIEVOD",
                          ", or start one elsewhere and pass server=\"host:port\"")


class PrivateServer:
    """Starts rilievod on a free port of the loopback interface, and ends it with the `with` block.

        with rilievo.PrivateServer() as server:
            surfaces = [rilievo.reconstruct(scan, server=server) for scan in scans]
    """

    def __init__(self, arguments: Optional[List[str]] = None) -> None:
        """`arguments`: more options of rilievod, such as ["--threads", "2"]."""
        self._arguments = list(arguments or [])
        self._process: Optional["subprocess.Popen[bytes]"] = None
        self._log: Optional[IO[bytes]] = None

    def __enter__(self) -> Server:
        command = ["/bin/sh", "-c", _WATCH, "rilievod", find_program(), "--listen", "127.0.0.1:0"]
        for option, value in _OPTIONS.items():
            if option not in self._arguments:
                command += [option, value]
        self._log = tempfile.TemporaryFile()
        # In a session of its own: an interrupt from the keyboard is for this process to handle.
        self._process = subprocess.Popen(
            command + self._arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=self._log, start_new_session=True)
        try:
            return Server(self._address())
        except BaseException:
            self.__exit__(None, None, None)
            raise

    def __exit__(self, kind: Optional[Type[BaseException]], value: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        for stream in (process.stdin, process.stdout, self._log):
            if stream is not None:
                stream.close()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()

    def _address(self) -> str:
        assert self._process is not None and self._process.stdout is not None
        output, text = self._process.stdout.fileno(), b""
        deadline = time.monotonic() + _START_SECONDS
        while b"\n" not in text:
            ready, _, _ = select.select([output], [], [], max(0.0, deadline - time.monotonic()))
            piece = os.read(output, 4096) if ready else b""
            if not piece:
                reason = self._complaint() or "it is silent"
                raise Unavailable(f"rilievod did not start: {reason}")
            text += piece
        return text.decode().splitlines()[0].rpartition(" ")[2]

    def _complaint(self) -> str:
        assert self._log is not None
        time.sleep(0.1)  # the shell ends a moment after what it started
        self._log.seek(0)
        return self._log.read(4096).decode("utf-8", "replace").strip()
