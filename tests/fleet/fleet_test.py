"""A fleet under stress: several servers and workers over one PostgreSQL.

Parts: any-server, turns, kills, upgrade, backup, blobs, lives, frozen, links (the last one where this
user may make network namespaces). Each says what was asked of it and what was seen; the exit status
is 1 where they differ."""
import argparse
import pathlib
import shutil
import signal
import sys
import tempfile

import faults
import operations
from checks import Checks
from fleet import POSTGRES, Fleet, Postgres
from hosts import Namespaces, OneMachine

SERVERS, WORKERS = 3, 6
PARTS = {"any-server": faults.any_server, "turns": faults.turns, "kills": faults.kills,
         "upgrade": operations.upgrade, "backup": operations.backup, "blobs": operations.blobs,
         "lives": operations.lives, "frozen": faults.frozen, "links": faults.links}


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
    hosts = (["database", "blobs"] + [f"s{i}" for i in range(SERVERS)] +
             [f"w{i}" for i in range(WORKERS)])
    apart = not arguments.short and not arguments.one_machine and Namespaces.possible()
    network = Namespaces(hosts) if apart else OneMachine()
    left_out = {"blobs", "lives", "frozen"} if arguments.short else set()
    parts = [part for part in PARTS if part not in left_out and (apart or part != "links")]
    if arguments.only:
        parts = arguments.only.split(",")
    folder = pathlib.Path(tempfile.mkdtemp(prefix="rilievo-fleet-"))
    folder.chmod(0o711)
    running = []
    try:
        database = Postgres(network, folder).start()
        running.append(database)
        fleet = Fleet(network, folder, database, "rilievo", database.make("rilievo"), SERVERS,
                      WORKERS).start()
        running.append(fleet)
        checks = Checks(arguments.short)
        for part in parts:
            PARTS[part](checks, fleet)
        return 1 if checks.faults else 0
    finally:
        for one in reversed(running):
            one.stop()
        network.close()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
