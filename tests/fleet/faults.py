"""Parts of the test of a fleet: what strangers, other clients and bad luck do to it."""
import os
import random
import re
import signal
import threading
import time

import rilievo
from checks import CLIENTS, LARGE, scan, shape_of
from cutting_line import CuttingLine
from fleet import HERE


def any_server(checks, fleet):
    """Clients are thrown from server to server at random bytes."""
    lines = [CuttingLine(target, 40_000, seed) for seed, target in enumerate(fleet.addresses())]
    left, jobs, lock = list(range(48 if checks.short else 200)), [], threading.Lock()
    troubles = []

    def client():
        addresses = [line.address for line in lines]
        with rilievo.Jobs(checks.server(fleet, addresses=addresses)) as mine:
            while True:
                with lock:
                    if not left:
                        return
                    number = left.pop()
                try:
                    job = mine.submit(scan(number), request_id=f"any-{number}")
                    with lock:
                        jobs.append((job.job_id, number))
                    if job.fetch(timeout=120).to_bytes() != checks.right[shape_of(number)]:
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
    checks.say("any-server", "no client fails, though its lines are cut",
               f"{len(troubles)} failed, {cuts} cuts, {seconds:.0f} s" +
               "".join(f"\n     {words}" for words in troubles[:3]),
               not troubles and cuts > len(jobs) / 2)
    checks.audit("any-server", fleet, jobs, 60, one_attempt=True)


def turns(checks, fleet):
    """Many jobs of one client do not hold up another's. No worker runs until all are sent: a fast
    machine would end the many meanwhile."""
    count, workers = 40 if checks.short else 500, len(fleet.workers)
    for worker in fleet.workers:
        worker.stop()
    with rilievo.Jobs(checks.server(fleet)) as ann, \
            rilievo.Jobs(checks.server(fleet, "bob")) as bob:
        many = [(ann.submit(scan(i), request_id=f"many-{i}").job_id, i) for i in range(count)]
        # What scales the workers of deploy/fleet.
        words = (HERE / "../../deploy/fleet/keda.yaml").read_text(encoding="utf-8")
        asked = int(fleet.database.ask(re.search(r"query: (.*)", words)[1], fleet.name))
        one = bob.submit(scan(0), request_id="one")
        for worker in fleet.workers:
            worker.start()
        one.wait(timeout=120)
        message = bob.get(one.job_id)._message
        for job_id, _ in many:
            ann.get(job_id).wait(timeout=300)
        begun = [ann.get(job_id)._message.start_time.ToNanoseconds() for job_id, _ in many]
        bob.get(message.job_id).delete()
    ahead = sum(message.create_time.ToNanoseconds() < t < message.start_time.ToNanoseconds()
                for t in begun)
    behind = sum(t > message.start_time.ToNanoseconds() for t in begun)
    checks.say("turns", f"of {count} jobs that another client has sent before, at most {workers} "
               "more begin before it", f"{ahead}; {behind} after it",
               ahead <= workers and behind > 0)
    checks.say("turns", "the scaler of KEDA sees jobs that are not done", asked, asked == count)
    checks.audit("turns", fleet, many, 300, one_attempt=True)


def _fault(fleet, kind, chance):
    """kill -9 of one of the fleet, which is started again a second later."""
    victim = fleet.database
    if kind != "database":
        victim = chance.choice(fleet.servers if kind == "server" else fleet.workers)
    if kind == "job":
        end = time.monotonic() + 5
        children = []
        while not children and time.monotonic() < end:
            children = [child for worker in fleet.workers for child in worker.children()]
        for child in children[:1]:
            try:
                os.kill(child, signal.SIGKILL)
            except ProcessLookupError:
                pass
    else:
        victim.kill()
        time.sleep(1)
        victim.start()


def kills(checks, fleet):
    """kill -9 every 3 s, for ten minutes."""
    chance, faults = random.Random(1), []
    with checks.load(fleet, "kill") as (jobs, troubles):
        end = time.monotonic() + (10 if checks.short else 600)
        while time.monotonic() < end:
            kinds = ["server", "worker", "job", "database"]
            chance.shuffle(kinds)
            for kind in kinds:
                time.sleep(0.5 if checks.short else 3)
                _fault(fleet, kind, chance)
                faults.append(kind)
        last = time.monotonic()
    while fleet.waiting() > 0 and time.monotonic() < last + 60:
        time.sleep(0.1)
    seconds = time.monotonic() - last
    counts = ", ".join(f"{faults.count(kind)} {kind}" for kind in sorted(set(faults)))
    checks.say("kills", "queue empty 30 s after the last fault",
               f"{len(faults)} faults ({counts}), {seconds:.0f} s, {len(troubles)} calls that a "
               "client gave up" + "".join(f"\n     {words}" for words in troubles[:3]),
               fleet.waiting() == 0 and seconds < 30)
    checks.audit("kills", fleet, jobs, 120, one_attempt=False)


def frozen(checks, fleet):
    """A worker's host stands still for longer than a lease, in the middle of a job."""
    with rilievo.Jobs(checks.server(fleet)) as client:
        jobs = [(client.submit(scan(LARGE), request_id=f"frozen-{i}").job_id, LARGE)
                for i in range(20)]
        while not any(worker.children() for worker in fleet.workers):
            time.sleep(0.01)
        victim = next(worker for worker in fleet.workers if worker.children())
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
    checks.say("frozen", "all jobs done within 30 s though a host stands still; its late result "
               "is dropped, and its log says so", f"{seconds:.0f} s; {said}", seconds < 30 and said)
    checks.audit("frozen", fleet, jobs, 30, one_attempt=False)


def links(checks, fleet):
    """The line of a worker, then that of the database is cut for a minute."""
    for host in ("w0", "database"):
        with rilievo.Jobs(checks.server(fleet)) as client:
            jobs = [(client.submit(scan(i), request_id=f"{host}-{i}").job_id, i)
                    for i in range(60)]
            fleet.network.cut(host)
            time.sleep(60)
            fleet.network.mend(host)
            begin = time.monotonic()
            while fleet.waiting() > 0 and time.monotonic() < begin + 60:
                time.sleep(0.2)
            seconds = time.monotonic() - begin
        checks.say(f"links ({host})", "all done 25 s after its return", f"{seconds:.0f} s",
                   seconds < 25)
        checks.audit(f"links ({host})", fleet, jobs, 30, one_attempt=False)
