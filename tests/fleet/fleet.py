"""PostgreSQL, servers and workers as processes, each killed and started as a test likes."""
import os
import pathlib
import pwd
import signal
import subprocess
import time

from hosts import free_port

POSTGRES = pathlib.Path("/usr/lib/postgresql/15/bin")


class Process:
    """A program on a host, in a session of its own, with its words in a file."""

    def __init__(self, network, host, command, log, user=None):
        self._host, self._log, self._user = host, log, user
        self.command = network.command(host) + [str(word) for word in command]
        self.process = None

    def start(self):
        with open(self._log, "ab") as log:
            self.process = subprocess.Popen(self.command, stdin=subprocess.DEVNULL, stdout=log,
                                            stderr=log, start_new_session=True, user=self._user,
                                            cwd="/")
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
        self.url = f"postgres://rilievo@{address}:{self.port}/rilievo"

    def _tool(self, command):
        user = {"user": self.user} if os.geteuid() == 0 else {}
        return subprocess.run([str(word) for word in command], check=True, cwd="/",
                              capture_output=True, text=True, **user).stdout

    def ask(self, sql, database="rilievo"):
        """The first column of the first row, as text."""
        return self._tool([POSTGRES / "psql", "-h", self._folder, "-p", self.port, "-U", "rilievo",
                           "-d", database, "-Atc", sql]).strip()

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


class Fleet:
    """A database, servers that only answer and workers that only work."""

    def __init__(self, network, folder, servers, workers):
        self.network = network
        self.database = Postgres(network, folder).start()
        self.database.ask("CREATE DATABASE rilievo", "postgres")
        program = os.environ["RILIEVOD"]
        self.ports = [free_port() for _ in range(servers)]
        store = ["--store", self.database.url]
        self.tokens = {name: subprocess.run(
            [program, "--make-token", name, "--tokens", str(folder / "tokens")], check=True,
            capture_output=True, text=True).stdout.split()[-1] for name in ("ann", "bob")}
        serve = [program, "--serve-only", "--allow-plaintext", "--max-waiting-jobs", 10000,
                 "--tokens", folder / "tokens"] + store
        work = [program, "--work-only", "--max-concurrent-jobs", 1, "--threads", 1] + store
        self.servers = [
            Process(network, f"s{number}", serve + ["--listen", f"{address}:{port}"],
                    folder / f"s{number}.log")
            for number, (address, port) in enumerate(self.addresses())]
        self.workers = [Process(network, f"w{number}", work, folder / f"w{number}.log")
                        for number in range(workers)]

    def addresses(self):
        return [(self.network.address(f"s{number}"), port)
                for number, port in enumerate(self.ports)]

    def start(self):
        for process in self.servers + self.workers:
            process.start()
        return self

    def waiting(self):
        return int(self.database.ask("SELECT COUNT(*) FROM queue"))

    def stop(self):
        for process in self.workers + self.servers:
            process.stop()
        if self.database.running():
            self.database.kill(signal.SIGINT)
            self.database.process.wait(20)
