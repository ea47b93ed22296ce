"""A fleet under stress: several servers and workers over one PostgreSQL.

Parts: any-server, turns, kills, frozen, links (the last one where this user may make network
namespaces). Each says what was asked of it and what was seen; the exit status is 1 where they
differ."""
import argparse
import os
import pathlib
import random
import shutil
import signal
import sys
import tempfile
import threading
import time

import numpy as np

import rilievo
from cutting_line import CuttingLine
from fleet import POSTGRES, Fleet
from hosts import Namespaces, OneMachine

SERVERS, WORKERS, CLIENTS = 3, 6, 16
SHAPES = 6
LARGE = -1


def shape_of(number):
    """Of those in Test.right."""
    return SHAPES if number == LARGE else number % SHAPES


def scan(number):
    """A bumpy sphere of some hundred points; six of them differ. LARGE: one that takes a second."""
    shape = shape_of(number)
    rng = np.random.default_rng(shape)
    points = rng.normal(size=(6000 if number == LARGE else 700 + 100 * shape, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return points * (1 + 0.05 * np.sin(5 * points[:, :1]))


class Test:
    def __init__(self, fleet, short):
        self.fleet, self.short, self.faults = fleet, short, []
        with rilievo.PrivateServer() as server:
            self.right = [rilievo.reconstruct(scan(i), server=server).to_bytes()
                          for i in (*range(SHAPES), LARGE)]

    def say(self, part, asked, seen, right):
        print(f"{'ok  ' if right else 'FAIL'} {part}: asked {asked}; seen {seen}", flush=True)
        if not right:
            self.faults.append(part)

    def server(self, name="ann", addresses=None):
        addresses = addresses or [f"{host}:{port}" for host, port in self.fleet.addresses()]
        return rilievo.Server(",".join(addresses), token=self.fleet.tokens[name],
                              allow_plaintext=True)

    def audit(self, part, jobs, seconds, one_attempt):
        """Every job that was acknowledged ended once, with the right bytes."""
        wrong, attempts = [], 0
        end = time.monotonic() + seconds
        with rilievo.Jobs(self.server()) as client:
            for job_id, number in jobs:
                try:
                    job = client.get(job_id).wait(timeout=max(1.0, end - time.monotonic()))
                    attempts += job._message.attempts
                    if job.fetch(timeout=30).to_bytes() != self.right[shape_of(number)]:
                        wrong.append(f"{job_id}: other bytes")
                except rilievo.RilievoError as error:
                    wrong.append(f"{job_id}: {error}")
            listed = [job.job_id for job in client.list(100_000)]
            for job_id, _ in jobs:
                client.get(job_id).delete()
        extra = len(listed) - len(set(listed)) + len(set(listed) - {job for job, _ in jobs})
        right = not wrong and not extra and len(jobs) > 0
        if one_attempt:
            right = right and attempts == len(jobs)
        self.say(part, "every job ends once, with the bytes of a single server" +
                 (", by one attempt" if one_attempt else ""),
                 f"{len(jobs)} jobs, {attempts} attempts, {len(wrong)} wrong, {extra} too many" +
                 "".join(f"\n     {words}" for words in wrong[:3]), right)

    def any_server(self):
        """Clients are thrown from server to server at random bytes."""
        lines = [CuttingLine(target, 40_000, seed)
                 for seed, target in enumerate(self.fleet.addresses())]
        left, jobs, lock = list(range(48 if self.short else 200)), [], threading.Lock()
        troubles = []

        def client():
            with rilievo.Jobs(self.server(addresses=[line.address for line in lines])) as mine:
                while True:
                    with lock:
                        if not left:
                            return
                        number = left.pop()
                    try:
                        job = mine.submit(scan(number), request_id=f"any-{number}")
                        with lock:
                            jobs.append((job.job_id, number))
                        if job.fetch(timeout=120).to_bytes() != self.right[shape_of(number)]:
                            troubles.append(f"job {number}: other bytes")
                    except rilievo.RilievoError as error:
                        troubles.append(f"job {number}: {error}")

        begin = time.monotonic()
        threads = [threading.Thread(target=client) for _ in range(CLIENTS)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        seconds = time.monotonic() - begin
        for line in lines:
            line.close()
        cuts = sum(line.cuts for line in lines)
        self.say("any-server", "no client fails, though its lines are cut",
                 f"{len(troubles)} failed, {cuts} cuts, {seconds:.0f} s" +
                 "".join(f"\n     {words}" for words in troubles[:3]),
                 not troubles and cuts > len(jobs) / 2)
        self.audit("any-server", jobs, 60, one_attempt=True)

    def turns(self):
        """Many jobs of one client do not hold up another's."""
        count = 40 if self.short else 500
        with rilievo.Jobs(self.server("ann")) as ann, rilievo.Jobs(self.server("bob")) as bob:
            many = [(ann.submit(scan(i), request_id=f"many-{i}").job_id, i) for i in range(count)]
            one = bob.submit(scan(0), request_id="one").wait(timeout=120)
            message = bob.get(one.job_id)._message
            for job_id, _ in many:
                ann.get(job_id).wait(timeout=300)
            begun = [ann.get(job_id)._message.start_time.ToNanoseconds() for job_id, _ in many]
            bob.get(message.job_id).delete()
        ahead = sum(message.create_time.ToNanoseconds() < t < message.start_time.ToNanoseconds()
                    for t in begun)
        behind = sum(t > message.start_time.ToNanoseconds() for t in begun)
        self.say("turns", f"of {count} jobs that another client has sent before, at most {WORKERS} "
                 "more begin before it", f"{ahead}; {behind} after it",
                 ahead <= WORKERS and behind > 0)
        self.audit("turns", many, 300, one_attempt=True)

    def fault(self, kind, chance):
        """kill -9 of one of the fleet, which is started again a second later."""
        victim = self.fleet.database
        if kind != "database":
            victim = chance.choice(self.fleet.servers if kind == "server" else self.fleet.workers)
        if kind == "job":
            end = time.monotonic() + 5
            children = []
            while not children and time.monotonic() < end:
                children = [child for worker in self.fleet.workers for child in worker.children()]
            for child in children[:1]:
                try:
                    os.kill(child, signal.SIGKILL)
                except ProcessLookupError:
                    pass
        else:
            victim.kill()
            time.sleep(1)
            victim.start()

    def kills(self):
        jobs, troubles, over = [], [], threading.Event()

        def client(number):
            with rilievo.Jobs(self.server()) as mine:
                i = number
                while not over.is_set():
                    try:
                        job = mine.submit(scan(i), request_id=f"kill-{i}", timeout=60)
                        jobs.append((job.job_id, i))
                        job.wait(timeout=60)
                    except rilievo.RilievoError as error:
                        troubles.append(str(error))
                    i += CLIENTS

        threads = [threading.Thread(target=client, args=(number,)) for number in range(CLIENTS)]
        for thread in threads:
            thread.start()
        chance, faults = random.Random(1), []
        end = time.monotonic() + (10 if self.short else 600)
        while time.monotonic() < end:
            kinds = ["server", "worker", "job", "database"]
            chance.shuffle(kinds)
            for kind in kinds:
                time.sleep(0.5 if self.short else 3)
                self.fault(kind, chance)
                faults.append(kind)
        last = time.monotonic()
        over.set()
        for thread in threads:
            thread.join()
        while self.fleet.waiting() > 0 and time.monotonic() < last + 60:
            time.sleep(0.1)
        seconds = time.monotonic() - last
        counts = ", ".join(f"{faults.count(kind)} {kind}" for kind in sorted(kinds))
        self.say("kills", "queue empty 30 s after the last fault",
                 f"{len(faults)} faults ({counts}), {seconds:.0f} s, {len(troubles)} calls that a "
                 "client gave up" +
                 "".join(f"\n     {words}" for words in troubles[:3]),
                 self.fleet.waiting() == 0 and seconds < 30)
        self.audit("kills", jobs, 60, one_attempt=False)

    def frozen(self):
        """A worker's host stands still for longer than a lease, in the middle of a job."""
        with rilievo.Jobs(self.server()) as client:
            jobs = [(client.submit(scan(LARGE), request_id=f"frozen-{i}").job_id, LARGE)
                    for i in range(20)]
            while not any(worker.children() for worker in self.fleet.workers):
                time.sleep(0.01)
            victim = next(worker for worker in self.fleet.workers if worker.children())
            time.sleep(0.2)  # so that it has told the store
            victim.signal_all(signal.SIGSTOP)
            begin = time.monotonic()
            for job_id, _ in jobs:
                client.get(job_id).wait(timeout=60)
            seconds = time.monotonic() - begin
            time.sleep(max(0.0, 60 - seconds))
            victim.signal_all(signal.SIGCONT)
            time.sleep(3)
        said = "another worker has taken it" in victim.words()
        self.say("frozen", "all jobs done within 30 s though a host stands still; its late result "
                 "is dropped, and its log says so", f"{seconds:.0f} s; {said}",
                 seconds < 30 and said)
        self.audit("frozen", jobs, 30, one_attempt=False)

    def links(self):
        """The line of a worker, then that of the database is cut for a minute."""
        for host in ("w0", "database"):
            with rilievo.Jobs(self.server()) as client:
                jobs = [(client.submit(scan(i), request_id=f"{host}-{i}").job_id, i)
                        for i in range(60)]
                self.fleet.network.cut(host)
                time.sleep(60)
                self.fleet.network.mend(host)
                begin = time.monotonic()
                while self.fleet.waiting() > 0 and time.monotonic() < begin + 60:
                    time.sleep(0.2)
                seconds = time.monotonic() - begin
            self.say(f"links ({host})", "all done 25 s after its return", f"{seconds:.0f} s",
                     seconds < 25)
            self.audit(f"links ({host})", jobs, 30, one_attempt=False)


def main():
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    options = argparse.ArgumentParser(prog="./dev fleet-test", description=__doc__)
    options.add_argument("--short", action="store_true", help="a minute, for every day")
    options.add_argument("--only", default="", help="parts, with commas between")
    options.add_argument("--one-machine", action="store_true", help="without network namespaces")
    arguments = options.parse_args()
    if not (POSTGRES / "postgres").exists():
        print("skipped: postgresql-15 is not installed")
        return 77
    hosts = (["database"] + [f"s{i}" for i in range(SERVERS)] + [f"w{i}" for i in range(WORKERS)])
    apart = not arguments.short and not arguments.one_machine and Namespaces.possible()
    network = Namespaces(hosts) if apart else OneMachine()
    parts = ["any-server", "turns", "kills"]
    if not arguments.short:
        parts += ["frozen"] + (["links"] if apart else [])
    if arguments.only:
        parts = arguments.only.split(",")
    folder = pathlib.Path(tempfile.mkdtemp(prefix="rilievo-fleet-"))
    folder.chmod(0o711)
    fleet = None
    try:
        fleet = Fleet(network, folder, SERVERS, WORKERS).start()
        test = Test(fleet, arguments.short)
        for part in parts:
            getattr(test, part.replace("-", "_"))()
        return 1 if test.faults else 0
    finally:
        if fleet is not None:
            fleet.stop()
        network.close()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
