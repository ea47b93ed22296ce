"""A real rilievod on a loopback socket, and commands run with their time and peak memory."""
import contextlib
import glob
import os
import re
import signal
import subprocess
import threading
import time


class Run:
    """What one command did: exit status, seconds, peak memory in MB, output."""

    def __init__(self, status, seconds, megabytes, output):
        self.status, self.seconds, self.megabytes, self.output = status, seconds, megabytes, output
        self.report = None


def run_measured(command, timeout):
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    timer = threading.Timer(timeout, process.kill)
    timer.start()
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    timer.cancel()
    process.stdout.close()
    process.returncode = os.waitstatus_to_exitcode(status)
    return Run(process.returncode, time.monotonic() - start, usage.ru_maxrss / 1024, output)


class MeasuredServer:
    """`with MeasuredServer(bin) as server`: server.address is where it listens."""

    def __init__(self, bin_folder, *options):
        self.bin = bin_folder
        self.process = subprocess.Popen(
            [os.path.join(bin_folder, "rilievod"), "--listen", "127.0.0.1:0", *options],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.address = None
        for line in self.process.stdout:
            found = re.search(r"listening on (\S+)", line)
            if found:
                self.address = found.group(1)
                break
        if not self.address:
            raise SystemExit("rilievod did not start")
        threading.Thread(target=self.process.stdout.read, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(timeout=60)

    @contextlib.contextmanager
    def watched(self):
        """Yields a list that ends up holding one number: the most resident memory, in MB, that the
        server and its workers had together at any time within the block."""
        peak, done = [self.megabytes()], threading.Event()

        def watch():
            while not done.wait(0.005):
                peak[0] = max(peak[0], self.megabytes())

        watcher = threading.Thread(target=watch)
        watcher.start()
        try:
            yield peak
        finally:
            done.set()
            watcher.join()

    def megabytes(self):
        """Resident memory now, of the server and its workers."""
        total = 0
        processes = [self.process.pid]
        for path in glob.glob(f"/proc/{self.process.pid}/task/*/children"):
            with open(path) as children:
                processes += map(int, children.read().split())
        for process in processes:
            try:
                with open(f"/proc/{process}/status") as status:
                    found = re.search(r"VmRSS:\s+(\d+)", status.read())
                    total += int(found.group(1)) / 1024 if found else 0
            except (FileNotFoundError, ProcessLookupError):
                pass
        return total

    def healthy(self):
        if self.process.poll() is not None:
            return False
        probe = subprocess.run([os.path.join(self.bin, "rilievod"), "--probe", self.address],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=10)
        return probe.returncode == 0
