"""Scans larger than memory: what their surfaces cost, and that they are the same however made.

For each number of points a scan is simulated and made into a surface by parts, by the command with
one thread and with two, then by fleets of so many workers over one PostgreSQL. Where this user may
make control groups each process has 1.5 GB of memory, and each worker a share of a core. A line for
each says the time, processor time, largest resident memory of a process, bytes, components and
loops; the exit status is 1 where surfaces differ, a process takes more than 1.3 GB, or one fails."""
import argparse
import collections
import contextlib
import hashlib
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "fleet"))

from fleet import POSTGRES, Fleet, Postgres  # noqa: E402
from hosts import OneMachine  # noqa: E402
from limits import Limits  # noqa: E402

LIMIT, MOST, ESTIMATED = 1_500_000_000, 1_300_000_000, 2_000_000_000
FLEET = ["--max-points", 10**9, "--max-bytes", 24 * 10**9, "--max-surface-faces", 10**10,
         "--max-job-seconds", 10**6, "--max-job-memory", ESTIMATED]
Seen = collections.namedtuple("Seen", "words digest peak")


class Peak:
    """The largest resident memory of any process that lives below some others, looked at for a
    while; and the processor time of those that are still there."""

    def __init__(self, roots):
        self._roots, self._over = roots, threading.Event()
        self.bytes, self._seconds = 0, {}
        self._thread = threading.Thread(target=self._look, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()

    @property
    def seconds(self):
        return sum(self._seconds.values())

    def _look(self):
        while not self._over.wait(0.2):
            waiting = [root() for root in self._roots]
            while waiting:
                process = waiting.pop()
                with contextlib.suppress(OSError, IndexError):
                    folder = pathlib.Path(f"/proc/{process}")
                    status = folder.joinpath("status").read_text(encoding="ascii")
                    self.bytes = max(self.bytes, 1024 * int(status.split("VmHWM:")[1].split()[0]))
                    words = folder.joinpath("stat").read_text(encoding="ascii")
                    times = words.rsplit(")", 1)[1].split()[11:13]
                    self._seconds[process] = sum(map(int, times)) / os.sysconf("SC_CLK_TCK")
                    for task in folder.glob("task/*/children"):
                        waiting += map(int, task.read_text(encoding="ascii").split())


class Large:
    def __init__(self, options, folder):
        self._options, self._folder = options, folder
        self._limited = Limits.possible()
        self.faults = 0
        if not self._limited:
            print("without limits: this user may not make control groups", flush=True)

    def _within(self, stack, name, words, cores=0.0):
        if not self._limited:
            return [str(word) for word in words]
        limits = Limits(f"{os.getpid()}-{name}", LIMIT, cores)
        stack.callback(limits.close)
        return limits.command(words)

    def simulate(self, points):
        scan = self._folder / f"{points}.ply"
        subprocess.run([self._options.bin / "rilievo", "simulate", self._options.shape, "--points",
                        str(points), "--noise", str(self._options.noise), "--views", "0", "-o",
                        scan], check=True, stdout=subprocess.DEVNULL)
        return scan

    def _seen(self, name, begin, peak, surface):
        took = time.monotonic() - begin
        data = surface.read_bytes()
        about = json.loads(subprocess.run([self._options.bin / "rilievo", "info", surface, "--json"],
                                          check=True, capture_output=True).stdout)
        surface.unlink()
        return Seen(f"{name}: {took:.0f} s, {peak.seconds:.0f} s of processor time, "
                    f"{peak.bytes / 1e6:.0f} MB, {len(data)} bytes, components "
                    f"{about['components']}, loops {about['boundary_loops']}",
                    hashlib.sha256(data).hexdigest(), peak.bytes)

    def by_command(self, scan, threads):
        surface, scratch = self._folder / "surface.dss", self._folder / "scratch"
        scratch.mkdir()
        with contextlib.ExitStack() as stack:
            stack.callback(shutil.rmtree, scratch)
            begin = time.monotonic()
            running = stack.enter_context(subprocess.Popen(self._within(
                stack, "command", [self._options.bin / "rilievo", "reconstruct", scan, "--parts",
                                   "--scratch", scratch, "--threads", threads, "--quiet", "-o",
                                   surface]), stdout=subprocess.DEVNULL))
            with Peak([lambda: running.pid]) as peak:
                if running.wait() != 0:
                    raise RuntimeError(f"the command ended with {running.returncode}")
        return self._seen(f"{threads} threads", begin, peak, surface)

    def by_fleet(self, scan, workers, database):
        """One of them is killed every --kill-seconds, and begins anew."""
        name, surface = f"of{workers}_{time.monotonic_ns()}", self._folder / "surface.dss"
        with contextlib.ExitStack() as stack:
            blobs = self._folder / f"blobs-{name}"
            blobs.mkdir()
            fleet = Fleet(OneMachine(), self._folder, database, name, database.make(name), 1,
                          workers, program=str(self._options.bin / "rilievod"),
                          blobs=f"file:{blobs}", also=FLEET)
            stack.callback(shutil.rmtree, self._folder / name)
            stack.callback(shutil.rmtree, blobs)
            for number, process in enumerate(fleet.servers + fleet.workers):
                scratch = self._folder / name / f"scratch{number}"
                scratch.mkdir()
                process.command += ["--scratch", str(scratch)]
                if process in fleet.workers:
                    process.command = self._within(stack, f"{name}-{number}", process.command,
                                                   self._options.cores)
            stack.callback(fleet.stop)
            fleet.start()
            host, port = fleet.addresses()[0]
            begin = time.monotonic()
            if self._options.kill_seconds:
                stack.enter_context(self._killing(fleet))
            with Peak([lambda process=process: process.process.pid
                       for process in fleet.workers]) as peak:
                done = subprocess.run(
                    [self._options.bin / "rilievo", "jobs", "submit", scan, "--server",
                     f"{host}:{port}", "--wait", "-o", surface], text=True,
                    stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                    env={**os.environ, "RILIEVO_TOKEN": fleet.tokens["ann"]})
            if done.returncode != 0:
                words = "".join(process.words()[-2000:] for process in fleet.servers + fleet.workers)
                raise RuntimeError(f"{done.stderr[-2000:]}\n{words}")
            return self._seen(f"{workers} workers", begin, peak, surface)

    @contextlib.contextmanager
    def _killing(self, fleet):
        over = threading.Event()

        def kill():
            turn = 0
            while not over.wait(self._options.kill_seconds):
                worker = fleet.workers[turn % len(fleet.workers)]
                worker.kill()
                worker.start()
                turn += 1

        killer = threading.Thread(target=kill)
        killer.start()
        try:
            yield
        finally:
            over.set()
            killer.join()

    def run(self, points, ways):
        scan, first = self.simulate(points), None
        for way in ways:
            seen = way(scan)
            first = first or seen.digest
            words = ["other bytes"] * (seen.digest != first)
            words += ["too much memory"] * (seen.peak > MOST)
            self.faults += len(words)
            print(f"{'FAIL' if words else 'ok  '} {points} points, {seen.words}, "
                  f"{seen.digest[:12]} {', '.join(words)}".rstrip(), flush=True)
        scan.unlink()


def numbers(text):
    return [int(word) for word in text.split(",") if word]


def main():
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    options = argparse.ArgumentParser(prog="./dev large-test", description=__doc__)
    options.add_argument("--points", type=numbers, default=[10_000_000],
                         help="how many, with commas between (default ten million; fleets make five "
                         "million and fewer in memory, with other bytes, or over the limit)")
    options.add_argument("--shape", default="torus", help="as of rilievo simulate")
    options.add_argument("--noise", type=float, default=0.0, help="as of rilievo simulate")
    options.add_argument("--threads", type=numbers, default=[1, 2], help="of the command")
    options.add_argument("--workers", type=numbers, default=[1, 2, 3, 5, 8], help="of fleets")
    options.add_argument("--cores", type=float, default=0.25, help="of a worker; 0: no limit")
    options.add_argument("--kill-seconds", type=float, default=0.0,
                         help="a worker is killed each time so many have passed; 0: none is")
    options.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release/bin"))
    options.add_argument("--folder", type=pathlib.Path, default=None,
                         help="for the scan and all scratch files (default a temporary one)")
    arguments = options.parse_args()
    arguments.bin = arguments.bin.resolve()
    if arguments.workers and not (POSTGRES / "postgres").exists():
        sys.exit("postgresql-15 is not installed; without fleets: --workers ''")
    folder = pathlib.Path(tempfile.mkdtemp(prefix="rilievo-large-", dir=arguments.folder))
    folder.chmod(0o711)
    large, database = Large(arguments, folder), None
    try:
        if arguments.workers:
            database = Postgres(OneMachine(), folder).start()
        ways = [lambda scan, n=n: large.by_command(scan, n) for n in arguments.threads]
        ways += [lambda scan, n=n: large.by_fleet(scan, n, database) for n in arguments.workers]
        for points in arguments.points:
            large.run(points, ways)
        return 1 if large.faults else 0
    finally:
        if database:
            database.stop()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
