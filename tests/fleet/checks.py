"""What the parts of the test of a fleet share: scans, clients, and what must be true of all jobs."""
import contextlib
import threading
import time

import numpy as np

import rilievo

CLIENTS = 16
SHAPES = 6
LARGE = -1


def shape_of(number):
    """Of those in Checks.right."""
    return SHAPES if number == LARGE else number % SHAPES


def scan(number):
    """A bumpy sphere of some hundred points; six of them differ. LARGE: one that takes a second."""
    shape = shape_of(number)
    rng = np.random.default_rng(shape)
    points = rng.normal(size=(6000 if number == LARGE else 400 + 50 * shape, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return points * (1 + 0.05 * np.sin(5 * points[:, :1]))


class Checks:
    def __init__(self, short):
        self.short, self.faults = short, []
        with rilievo.PrivateServer() as server:
            self.right = [rilievo.reconstruct(scan(i), server=server).to_bytes()
                          for i in (*range(SHAPES), LARGE)]

    def say(self, part, asked, seen, right):
        print(f"{'ok  ' if right else 'FAIL'} {part}: asked {asked}; seen {seen}", flush=True)
        if not right:
            self.faults.append(part)

    @staticmethod
    def server(fleet, name="ann", addresses=None):
        addresses = addresses or [f"{host}:{port}" for host, port in fleet.addresses()]
        return rilievo.Server(",".join(addresses), token=fleet.tokens[name], allow_plaintext=True)

    def wrong_of(self, job, number, seconds):
        """Why a job did not end with the right bytes within that time; "" where it did."""
        try:
            job.wait(timeout=seconds)
            if job.fetch(timeout=30).to_bytes() != self.right[shape_of(number)]:
                return f"{job.job_id}: other bytes"
        except rilievo.RilievoError as error:
            return f"{job.job_id}: {error}"
        return ""

    def audit(self, part, fleet, jobs, seconds, one_attempt):
        """Every job that was acknowledged ended once, with the right bytes; then all are deleted."""
        wrong, attempts = [], 0
        end = time.monotonic() + seconds
        with rilievo.Jobs(self.server(fleet)) as client:
            for job_id, number in jobs:
                job = client.get(job_id)
                wrong.append(self.wrong_of(job, number, max(1.0, end - time.monotonic())))
                attempts += job._message.attempts
            listed = [job.job_id for job in client.list(100_000)]
            for job_id, _ in jobs:
                client.get(job_id).delete()
        wrong = [words for words in wrong if words]
        extra = len(listed) - len(set(listed)) + len(set(listed) - {job for job, _ in jobs})
        right = not wrong and not extra and len(jobs) > 0
        if one_attempt:
            right = right and attempts == len(jobs)
        self.say(part, "every job ends once, with the bytes of a single server" +
                 (", by one attempt" if one_attempt else ""),
                 f"{len(jobs)} jobs, {attempts} attempts, {len(wrong)} wrong, {extra} too many" +
                 "".join(f"\n     {words}" for words in wrong[:3]), right)

    @contextlib.contextmanager
    def load(self, fleet, part, clients=CLIENTS):
        """Clients that make one job after the other while the body runs: (jobs, troubles)."""
        jobs, troubles, over = [], [], threading.Event()

        def client(number):
            with rilievo.Jobs(self.server(fleet)) as mine:
                i = number
                while not over.is_set():
                    try:
                        job = mine.submit(scan(i), request_id=f"{part}-{i}", timeout=60)
                        jobs.append((job.job_id, i))
                        job.wait(timeout=60)
                    except rilievo.RilievoError as error:
                        troubles.append(str(error))
                    i += clients

        threads = [threading.Thread(target=client, args=(number,)) for number in range(clients)]
        for thread in threads:
            thread.start()
        try:
            yield jobs, troubles
        finally:
            over.set()
            for thread in threads:
                thread.join()
