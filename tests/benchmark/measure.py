#!/usr/bin/env python3
"""Measures rilievo through a real server on a socket and writes the table of the README.

  measure.py --bin build/release/bin [--shared ../shared] [--readme README.md] [--only REGEX]

Without the folder of benchmark scans (--shared) only the paper's own case is measured, and the
README stays as it is.
"""
import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time

from measured_server import MeasuredServer, run_measured
from readme_table import write_tables

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BAD_SECONDS, BAD_MEGABYTES = 5.0, 300.0
POINT_BYTES = 24  # three doubles


def peers_best(shared):
    """Best RMS of any peer on each cloud: the bold figures of PEERS.md."""
    best = {}
    with open(os.path.join(shared, "bench", "PEERS.md")) as page:
        for line in page:
            cells = [c.strip() for c in line.strip().strip("|").split("|")]
            if len(cells) == 10 and cells[2].startswith("**"):
                best[cells[0]] = (float(cells[2].strip("*")), cells[1])
    return best


def build_evaluator(shared, folder):
    subprocess.run(["make", "-s", "-C", os.path.join(shared, "bench"), "BIN=" + folder], check=True)
    return os.path.join(folder, "evaluate")


def topology_of(evaluate, mesh):
    text = subprocess.run([evaluate, "--info", mesh], capture_output=True, text=True, check=True)
    return {k: int(v) for k, v in re.findall(r"(\w+)=(-?\d+)(?=\s|$)", text.stdout)}


def reconstruct(a, server, cloud, out, *options):
    report = out + ".json"
    run = run_measured([os.path.join(a.bin, "rilievo"), "reconstruct", cloud, "-o", out, "--server",
                        server.address, "--report", report, *options], timeout=600)
    if run.status == 0:
        with open(report) as file:
            run.report = json.load(file)
    return run


def edges_of(a, truth, mesh):
    text = subprocess.run([os.path.join(a.bin, "rilievo_edge_error"), truth, mesh],
                          capture_output=True, text=True, check=True)
    return json.loads(text.stdout)


def measure_cloud(a, server, evaluate, cloud, truth, work, *options):
    """One cloud through the server; a dict of figures."""
    name = os.path.splitext(os.path.basename(cloud))[0]
    surface, mesh = os.path.join(work, name + ".dss"), os.path.join(work, name + ".ply")
    run = reconstruct(a, server, cloud, surface, *options)
    row = dict(cloud=name, status=run.status, seconds=run.seconds, message=run.output)
    if run.status != 0:
        return row
    row.update(report=run.report, bytes=os.path.getsize(surface))
    subprocess.run([os.path.join(a.bin, "rilievo"), "export", surface, mesh], check=True,
                   stdout=subprocess.DEVNULL)
    row["topology"] = topology_of(evaluate, mesh)
    if truth:
        text = subprocess.run([evaluate, truth, mesh, "--json"], capture_output=True, text=True,
                              check=True)
        row["truth"] = json.loads(text.stdout)
        if re.match(r"mechpart|featuretype", name):
            row["edges"] = edges_of(a, truth, mesh)
            print(f"  {name}: near sharp edges RMS {row['edges']['near_rms']:.4f}, the edges "
                  f"themselves {row['edges']['edge_rms']:.4f}, "
                  f"{100 * row['edges']['edge_within']:.0f} % of them within 0.1 %", flush=True)
    return row


def measure_scans(a, server, evaluate, work):
    data = os.path.join(a.shared, "data")
    rows = []
    for file in sorted(os.listdir(data)):
        if not file.endswith(".ply") or not re.search(a.only, file):
            continue
        truth = os.path.join(data, "gt", file)
        row = measure_cloud(a, server, evaluate, os.path.join(data, file),
                            truth if os.path.exists(truth) else None, work)
        rows.append(row)
        rms = row.get("truth", {}).get("rms")
        print(f"{row['cloud']:28s} status {row['status']}  {row['seconds']:6.2f} s  "
              f"rms {rms if rms is None else round(rms, 4)}", flush=True)
        if row["status"] != 0:
            print(row["message"])
    return rows


def measure_resampled(a, server, evaluate, work):
    """100 000 points of each clean ground truth at three noises, as in PEERS.md."""
    tools, truths, clouds = os.path.dirname(evaluate), os.path.join(work, "gt"), os.path.join(
        work, "clouds")
    os.makedirs(truths)
    for name, short in (("mechpart_genus3", "mechpart"), ("featuretype_cad", "featuretype"),
                        ("spot_nonuniform_outliers", "spot")):
        subprocess.run([os.path.join(tools, "normalise"),
                        os.path.join(a.shared, "data", "gt", name + ".ply"),
                        os.path.join(truths, short + ".ply")], check=True)
    subprocess.run([sys.executable, os.path.join(a.shared, "bench", "bench.py"), "clouds", "--gt",
                    truths, "--out", clouds, "--n", "100000", "--sigma", "0,0.1,0.3"], check=True,
                   env=dict(os.environ, BENCH_BIN=tools), stdout=subprocess.DEVNULL)
    rows = []
    for file in sorted(os.listdir(clouds)):
        if not re.fullmatch(r"\w+__n100000__s[0-9.]+\.ply", file) or file.endswith("_n.ply"):
            continue
        if not re.search(a.only, file):
            continue
        truth = os.path.join(truths, file.split("__")[0] + ".ply")
        times = []
        for _ in range(3):
            row = measure_cloud(a, server, evaluate, os.path.join(clouds, file), truth, work)
            times.append(row["seconds"])
        row["seconds"] = statistics.median(times)
        rows.append(row)
        print(f"{row['cloud']:28s} status {row['status']}  {row['seconds']:6.2f} s  "
              f"rms {row.get('truth', {}).get('rms')}", flush=True)
    return rows


def measure_memory(a, evaluate, work):
    """Peak of the command alone on 500 000 points, less that of an idle one and the points; the
    median of three runs."""
    clouds = os.path.join(work, "large")
    subprocess.run([sys.executable, os.path.join(a.shared, "bench", "bench.py"), "clouds", "--gt",
                    os.path.join(work, "gt"), "--out", clouds, "--n", "500000", "--sigma", "0"],
                   check=True, env=dict(os.environ, BENCH_BIN=os.path.dirname(evaluate)),
                   stdout=subprocess.DEVNULL)
    program = os.path.join(a.bin, "rilievo")
    idle = run_measured([program, "--version"], 10).megabytes
    rows = []
    for file in sorted(os.listdir(clouds)):
        if not re.fullmatch(r"\w+__n500000__s[0-9.]+\.ply", file):
            continue
        runs = [run_measured([program, "reconstruct", os.path.join(clouds, file), "-o",
                              os.path.join(work, "large.dss"), "--quiet"], 600) for _ in range(3)]
        status = max(run.status for run in runs)
        # The order in which threads give memory back moves the peak of single runs by 10 MB.
        megabytes = [run.megabytes for run in runs]
        above = [(mb - idle) * 2**20 / 500000 - POINT_BYTES for mb in megabytes]
        rows.append(dict(cloud=file[:-4], status=status, megabytes=statistics.median(megabytes),
                         bytes_a_point=statistics.median(above)))
        print(f"{file[:-4]:28s} status {status}  " + " ".join(f"{a:.0f}" for a in above) +
              " bytes a point", flush=True)
    return rows


def measure_bad_files(a, server, work):
    """Malformed scans: each must end cleanly, quickly and small, the server healthy afterwards."""
    folder = os.path.join(a.shared, "data", "bad")
    rows = []
    for file in sorted(os.listdir(folder)):
        if not file.endswith(".ply"):
            continue
        with server.watched() as peak:
            run = reconstruct(a, server, os.path.join(folder, file), os.path.join(work, "bad.dss"),
                              "--points-only")
        rows.append(dict(file=file, status=run.status, seconds=run.seconds,
                         megabytes=max(run.megabytes, peak[0]),
                         healthy=server.healthy(), message=run.output.strip().split("\n")[-1]))
    slow = [r for r in rows if r["seconds"] > BAD_SECONDS or r["megabytes"] > BAD_MEGABYTES]
    ill = [r for r in rows if not r["healthy"]]
    print(f"{len(rows)} malformed files: {sum(r['status'] == 0 for r in rows)} accepted, "
          f"{sum(r['status'] != 0 for r in rows)} refused, {len(slow)} over the bounds, "
          f"{len(ill)} left the server ill", flush=True)
    return rows


def measure_seed_case(a, server, work):
    """Jeong and Kim 2002, table 1: 9 218 points, an octahedron refined to 4 098 vertices. 55 s there."""
    cloud = os.path.join(work, "star.ply")
    subprocess.run([os.path.join(a.bin, "rilievo"), "simulate", "star", "-o", cloud, "--points",
                    "9218", "--views", "0", "--seed", "4"], check=True, stdout=subprocess.DEVNULL)
    runs = [reconstruct(a, server, cloud, os.path.join(work, "star.dss"), "--topology", "spherical",
                        "--control-faces", "512", "--max-level", "2") for _ in range(5)]
    if any(r.status != 0 for r in runs):
        sys.exit("the paper's case failed: " + runs[0].output)
    row = dict(runs[0].report, whole_seconds=statistics.median(r.seconds for r in runs),
               core_seconds=statistics.median(r.report["total_seconds"] for r in runs))
    print(f"paper's case: {row['surface_vertices']} vertices in {row['whole_seconds']:.3f} s, "
          f"the paper's 55 s", flush=True)
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(ROOT, "build", "release", "bin"))
    parser.add_argument("--shared", default=os.path.join(ROOT, "..", "shared"))
    parser.add_argument("--readme", default=os.path.join(ROOT, "README.md"))
    parser.add_argument("--only", default="", help="regular expression on the cloud's name")
    parser.add_argument("--results", help="also write all figures to this JSON file")
    a = parser.parse_args()
    a.bin = os.path.abspath(a.bin)
    a.shared = os.path.abspath(a.shared)

    with tempfile.TemporaryDirectory(prefix="rilievo-measure-") as work, \
            MeasuredServer(a.bin) as server:
        results = dict(date=time.strftime("%Y-%m-%d"), seed=measure_seed_case(a, server, work))
        if os.path.isdir(a.shared):
            evaluate = build_evaluator(a.shared, os.path.join(work, "tools"))
            results["peers"] = peers_best(a.shared)
            results["scans"] = measure_scans(a, server, evaluate, work)
            results["resampled"] = measure_resampled(a, server, evaluate, work)
            if not a.only:
                results["memory"] = measure_memory(a, evaluate, work)
                # A fresh server: what earlier scans left in its heap is none of these files' doing.
                with MeasuredServer(a.bin) as fresh:
                    results["bad"] = measure_bad_files(a, fresh, work)
        else:
            print(f"skipped: no benchmark scans at {a.shared}; the README's table stays as it is")
    if a.results:
        with open(a.results, "w") as file:
            json.dump(results, file, indent=1)
    if "bad" in results:
        write_tables(a.readme, results)
        print(f"wrote the tables of {os.path.relpath(a.readme)}")


if __name__ == "__main__":
    main()
