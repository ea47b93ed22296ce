"""PostgreSQL, an S3 store, servers and workers as processes, each killed and started as a test
likes."""
import os
import pathlib
import pwd
import signal
import subprocess
import time

from hosts import free_port
from swift_s3 import KEY, SECRET

POSTGRES = pathlib.Path("/usr/lib/postgresql/15/bin")
HERE = pathlib.Path(__file__).parent


class Process:
    """A program on a host, in a session of its own, with its words in a file."""

    def __init__(self, network, host, command, log, variables=None):
        self._log, self._environment = log, {**os.environ, **(variables or {})}
        self.command = network.command(host) + [str(word) for word in command]
        self.process = None

    def start(self):
        with open(self._log, "ab") as log:
            self.process = subprocess.Popen(self.command, stdin=subprocess.DEVNULL, stdout=log,
                                            stderr=log, start_new_session=True, cwd="/",
                                            env=self._environment)
        return self

    def running(self):
        return self.process is not None and self.process.poll() is None

    def children(self):
        """Those of the program itself, whichever thread has started them."""
        found = []
        for path in pathlib.Path(f"/proc/{self.process.pid}/task").glob("*/children"):
            try:
                found += [int(child) for child in path.read_text(encoding="ascii").split()]
            except (FileNotFoundError, ProcessLookupError):
                pass
        return found

    def kill(self, number=signal.SIGKILL):
        self.process.send_signal(number)
        if number == signal.SIGKILL:
            self.process.wait()

    def signal_all(self, number):
        """The whole session: as its host would stop or go on."""
        os.killpg(self.process.pid, number)

    def stop(self):
        if not self.running():
            return
        self.signal_all(signal.SIGCONT)
        self.process.terminate()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.kill()

    def words(self):
        """All that it said, also before it was killed."""
        with open(self._log, encoding="utf-8", errors="replace") as file:
            return file.read()


class Postgres(Process):
    """With fsync, as an operator has it. It does not run as root."""

    def __init__(self, network, folder):
        root = os.geteuid() == 0
        self.user = "postgres" if root else pwd.getpwuid(os.geteuid()).pw_name
        data, self.port = folder / "data", free_port()
        if root:
            os.chown(folder, pwd.getpwnam("postgres").pw_uid, -1)
        self._tool([POSTGRES / "initdb", "-D", data, "-U", "rilievo", "-A", "trust", "-E", "UTF8",
                    "--locale=C", "--no-sync"])
        with open(data / "pg_hba.conf", "a", encoding="ascii") as rules:
            rules.write("host all all 10.77.83.0/24 trust\n")
        address = network.address("database")
        super().__init__(network, "database",
                         [POSTGRES / "postgres", "-D", data, "-k", folder, "-p", self.port, "-c",
                          f"listen_addresses={address}"], folder / "postgres.log")
        if root:
            self.command = (network.command("database") +
                            ["setpriv", "--reuid=postgres", "--regid=postgres", "--init-groups"] +
                            self.command[len(network.command("database")):])
        self._folder = folder
        self._server = f"postgres://rilievo@{address}:{self.port}"

    def _tool(self, command):
        user = {"user": self.user} if os.geteuid() == 0 else {}
        return subprocess.run([str(word) for word in command], check=True, cwd="/",
                              capture_output=True, text=True, **user).stdout

    def _on(self, tool, *words):
        return self._tool([POSTGRES / tool, "-h", self._folder, "-p", self.port, "-U", "rilievo",
                           *words])

    def ask(self, sql, database="rilievo"):
        """The first column of the first row, as text."""
        return self._on("psql", "-d", database, "-Atc", sql).strip()

    def make(self, name):
        """A new database; its URL."""
        self.ask(f"CREATE DATABASE {name}", "postgres")
        return f"{self._server}/{name}"

    def dump(self, name):
        """The dump of a database that may be in use."""
        file = self._folder / f"{name}.dump"
        self._on("pg_dump", "-Fc", "-d", name, "-f", file)
        return file

    def restore(self, file, name):
        """Into a new database; its URL."""
        url = self.make(name)
        self._on("pg_restore", "-d", name, "--exit-on-error", file)
        return url

    def start(self):
        """Again where the children of one that was killed hold its files for a moment."""
        end = time.monotonic() + 60
        while time.monotonic() < end:
            if not self.running():
                super().start()
            time.sleep(0.1)
            try:
                self.ask("SELECT 1", "postgres")
                return self
            except subprocess.CalledProcessError:
                pass
        raise RuntimeError(f"PostgreSQL does not start: {self.words()[-2000:]}")

    def stop(self):
        if self.running():
            self.kill(signal.SIGINT)
            self.process.wait(20)


class S3(Process):
    """Swift (swift_s3.py) on the host "blobs"."""

    def __init__(self, network, folder):
        address, port = network.address("blobs"), free_port()
        (folder / "s3").mkdir()
        super().__init__(network, "blobs", ["/usr/bin/python3", "-B", HERE / "swift_s3.py",
                                            folder / "s3", address, port, "rilievo"],
                         folder / "s3.log")
        self.blobs = f"s3://rilievo/fleet?endpoint=http://{address}:{port}"
        self.variables = {"AWS_ACCESS_KEY_ID": KEY, "AWS_SECRET_ACCESS_KEY": SECRET}

    def start(self):
        """False where Swift is not installed."""
        said = len(self.words()) if self.process else 0
        super().start()
        while "ready" not in self.words()[said:]:
            if not self.running():
                return False
            time.sleep(0.1)
        return True


class Fleet:
    """Servers that only answer and workers that only work, over one database of that name."""

    def __init__(self, network, folder, database, name, url, servers, workers, *, program=None,
                 blobs=None, variables=None, also=()):
        """`also`: words for all of them."""
        self.network, self.folder, self.database, self.name = network, folder, database, name
        folder = folder / name
        folder.mkdir(mode=0o700)
        program = program or os.environ["RILIEVOD"]
        self.ports = [free_port() for _ in range(servers)]
        store = ["--store", url] + (["--blobs", blobs] if blobs else []) + list(also)
        self.tokens = {name: subprocess.run(
            [program, "--make-token", name, "--tokens", str(folder / "tokens")], check=True,
            capture_output=True, text=True).stdout.split()[-1] for name in ("ann", "bob")}
        serve = [program, "--serve-only", "--allow-plaintext", "--max-waiting-jobs", 10000,
                 "--tokens", folder / "tokens"] + store
        work = [program, "--work-only", "--max-concurrent-jobs", 1, "--threads", 1] + store
        self.servers = [
            Process(network, f"s{number}", serve + ["--listen", f"{address}:{port}"],
                    folder / f"s{number}.log", variables)
            for number, (address, port) in enumerate(self.addresses())]
        self.workers = [Process(network, f"w{number}", work, folder / f"w{number}.log", variables)
                        for number in range(workers)]

    def addresses(self):
        return [(self.network.address(f"s{number}"), port)
                for number, port in enumerate(self.ports)]

    def start(self):
        for process in self.servers + self.workers:
            process.start()
        return self

    def waiting(self):
        return int(self.database.ask("SELECT COUNT(*) FROM queue", self.name))

    def replace(self, process, program):
        """In order: the old one goes, one of that program comes."""
        old = process.process
        process.kill(signal.SIGTERM)
        old.wait(60)
        process.command = [str(program) if word.endswith("rilievod") else word
                           for word in process.command]
        process.start()

    def stop(self):
        for process in self.workers + self.servers:
            process.stop()
