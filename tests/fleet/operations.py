"""Parts of the test of a fleet: what its operator does to it."""
import os
import subprocess
import time

import rilievo
from checks import LARGE, scan
from fleet import S3, Fleet


def upgrade(checks, fleet):
    """Every server and every worker (short: one each) is replaced in order, under load. Where
    $RILIEVOD_BEFORE is an older program, it is that which is replaced, on a database that it made."""
    before, now = os.environ.get("RILIEVOD_BEFORE"), os.environ["RILIEVOD"]
    if before:
        url = fleet.database.make("upgraded")
        fleet = Fleet(fleet.network, fleet.folder, fleet.database, "upgraded", url,
                      len(fleet.servers), 3, program=before).start()
        time.sleep(2)
    schemas = []
    with checks.load(fleet, "upgrade", 6) as (jobs, troubles):
        time.sleep(3)
        schemas.append(fleet.database.ask("SELECT MAX(version) FROM rilievo_schema", fleet.name))
        for process in (fleet.servers[:1] + fleet.workers[:1] if checks.short else
                        fleet.servers + fleet.workers):
            fleet.replace(process, now)
            time.sleep(0.5 if checks.short else 3)
        schemas.append(fleet.database.ask("SELECT MAX(version) FROM rilievo_schema", fleet.name))
    checks.say("upgrade" + (f" (from {before})" if before else ""),
               "no call fails that a client does not mend",
               f"{len(jobs)} jobs meanwhile, {len(troubles)} calls given up, tables of version "
               f"{schemas[0]}, then {schemas[1]}" +
               "".join(f"\n     {words}" for words in troubles[:3]), not troubles)
    checks.audit("upgrade", fleet, jobs, 60, one_attempt=False)
    if before:
        fleet.stop()


def backup(checks, fleet):
    """pg_dump under load; another fleet on what is restored from it."""
    with checks.load(fleet, "backup", 4) as (jobs, troubles):
        time.sleep(2 if checks.short else 10)
        # Some that are not done then.
        with rilievo.Jobs(checks.server(fleet)) as client:
            jobs += [(client.submit(scan(LARGE), request_id=f"large-{i}").job_id, LARGE)
                     for i in range(8)]
        known = list(jobs)
        dump = fleet.database.dump(fleet.name)
        time.sleep(1)
    url = fleet.database.restore(dump, "restored")
    waiting = int(fleet.database.ask("SELECT COUNT(*) FROM queue", "restored"))
    other = Fleet(fleet.network, fleet.folder, fleet.database, "restored", url, 1, 1).start()
    wrong = []
    with rilievo.Jobs(checks.server(other)) as client:
        for job_id, number in known:
            try:
                wrong.append(checks.wrong_of(client.get(job_id), number, 60))
            except rilievo.RilievoError as error:
                wrong.append(f"{job_id}: {error}")
    other.stop()
    wrong = [words for words in wrong if words]
    checks.say("backup", "a store restored from a dump of a live one has every job that was "
               "acknowledged before, and ends those that were not done",
               f"{len(known)} jobs, {waiting} of the dump not done, {len(wrong)} wrong, "
               f"{len(troubles)} calls given up" + "".join(f"\n     {words}" for words in wrong[:3]),
               not wrong and not troubles and waiting > 0)
    checks.audit("backup", fleet, jobs, 60, one_attempt=True)


def blobs(checks, fleet):
    """Scans and surfaces in S3, whose server is killed, or whose line is cut for a minute."""
    store = S3(fleet.network, fleet.folder)
    if not store.start():
        print("skip blobs: python3-swift is not installed", flush=True)
        return
    url = fleet.database.make("in_s3")
    other = Fleet(fleet.network, fleet.folder, fleet.database, "in_s3", url, 2, 2,
                  blobs=store.blobs, variables=store.variables)
    apart = hasattr(fleet.network, "cut")
    for server in other.servers:
        server.start()
    try:
        with rilievo.Jobs(checks.server(other)) as client:
            jobs = [(client.submit(scan(i), request_id=f"blobs-{i}", timeout=60).job_id, i)
                    for i in range(16 if checks.short else 60)]
            for worker in other.workers:
                worker.start()
            while other.waiting() > len(jobs) - 4:
                time.sleep(0.05)
            if apart:
                fleet.network.cut("blobs")
            else:
                store.kill()
            time.sleep(60 if apart else 3)
            if apart:
                fleet.network.mend("blobs")
            else:
                store.start()
            begin = time.monotonic()
            while other.waiting() > 0 and time.monotonic() < begin + 90:
                time.sleep(0.2)
            seconds = time.monotonic() - begin
        checks.say("blobs", "all done 60 s after the return of the S3 store", f"{seconds:.0f} s",
                   seconds < 60)
        checks.audit("blobs", other, jobs, 60, one_attempt=True)
        left = fleet.database.ask("SELECT COUNT(*) FROM objects WHERE name IS NOT NULL", "in_s3")
        checks.say("blobs", "nothing is a blob when all jobs and scans are deleted", left,
                   left == "0")
    finally:
        other.stop()
        store.stop()


def lives(checks, fleet):
    """Jobs made, taken, begun and finished in the store alone, as fast as it goes."""
    program = os.environ.get("RILIEVO_STORE_RATE")
    if not program:
        print("skip lives: $RILIEVO_STORE_RATE is not set", flush=True)
        return
    url = fleet.database.make("lives")
    said = subprocess.run([program, url, "10"], check=True, text=True,
                          capture_output=True).stdout.split()
    checks.say("lives", "300 jobs claimed, begun and finished a second", f"{said[0]}; {said[1]} when "
               "they are made meanwhile", float(said[0]) >= 300)
