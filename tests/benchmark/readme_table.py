"""The measured tables of the README, between two marks."""
import re

STAGES = ["check", "neighbors", "normals", "control-mesh", "domain-fit", "displacement", "measure",
          "encode"]
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    lines += ["| " + " | ".join(str(c) for c in row) + " |" for row in rows]
    return "\n".join(lines)


def truth_rows(rows, peers):
    body = []
    for row in rows:
        if row["status"] != 0 or "truth" not in row:
            continue
        peer = peers.get(row["cloud"])
        rms = row["truth"]["rms"]
        body.append([
            row["cloud"], f"{rms:.4f}", f"{peer[0]:.4f} ({peer[1]})" if peer else "",
            f"{rms / peer[0]:.2f}" if peer else "", f"{row['truth']['hausdorff']:.2f}",
            f"{row['truth']['fscore']:.3f}", f"{row['seconds']:.2f}", f"{row['bytes'] / 1000:.0f}",
        ])
    return body


def shape_rows(rows):
    body = []
    for row in rows:
        if row["status"] != 0:
            body.append([row["cloud"], "refused"] + [""] * 9)
            continue
        report, topology = row["report"], row["topology"]
        vertices = report["surface_vertices"]
        body.append([
            row["cloud"], report["points_in"], report["road"], report["control_faces"], vertices,
            "yes" if topology["manifold"] else "NO", "yes" if topology["closed"] else "no",
            topology["genus"] if topology["closed"] else "",
            report["boundary_loops"], f"{100 * report['heights_filled'] / vertices:.1f} %",
            f"{100 * report['error']['rms']:.3f}", f"{row['seconds']:.2f}",
        ])
    return body


def slowest(rows):
    """The bound of the project: 100 000 points take at most 4 s on two cores, in all."""
    timed = [r for r in rows if r["status"] == 0 and 90000 <= r["report"]["points_in"] <= 120000]
    row = max(timed, key=lambda r: r["seconds"])
    return (f"Of {len(timed)} clouds of about 100 000 points the slowest, {row['cloud']}, took "
            f"{row['seconds']:.2f} s; the bound is 4 s.")


def profile_rows(rows):
    return [[row["cloud"]] + [f"{row['report']['stage_seconds'][stage]:.2f}" for stage in STAGES]
            for row in rows if row["status"] == 0]


def render(results):
    seed, bad = results["seed"], results["bad"]
    bounded = [r for r in bad if r["seconds"] <= 5 and r["megabytes"] <= 300 and r["healthy"]]
    parts = [
        f"Measured {results['date']} by `./dev bench`, through a real server on a loopback socket, "
        "two cores. Distances in % of the ground truth's diagonal, RMS over both directions; "
        "seconds are of the whole command, reading and network included.",
        table(["cloud", "RMS", "best peer", "ratio", "Hausdorff", "F-score", "seconds", "KB"],
              truth_rows(results["scans"] + results["resampled"], results["peers"])),
        table(["scan", "points", "road", "control faces", "vertices", "manifold", "closed",
               "genus", "loops", "filled", "to the scan", "seconds"], shape_rows(results["scans"])),
        "To the scan: RMS between surface and points, both directions, in % of the scan's diagonal.",
        slowest(results["scans"] + results["resampled"]),
        "Seconds by stage, 100 000 points:",
        table(["cloud"] + STAGES, profile_rows(results["resampled"])),
        "Memory, 500 000 points: the peak of the command alone (median of three), less that of an "
        "idle one and 24 bytes for each point as it was read.",
        table(["cloud", "MB", "bytes a point"],
              [[r["cloud"], f"{r['megabytes']:.0f}", f"{r['bytes_a_point']:.0f}"]
               for r in results["memory"] if r["status"] == 0]),
        f"The case of table 1 in Jeong and Kim 2002, 9 218 points and an octahedron refined to "
        f"{seed['surface_vertices']} vertices: {seed['core_seconds']:.3f} s in the pipeline, "
        f"{seed['whole_seconds']:.3f} s for the whole command; the table says 55 s "
        "(Pentium II).",
        f"Malformed files: {len(bad)}; accepted {sum(r['status'] == 0 for r in bad)}, refused with "
        f"a reason {sum(r['status'] != 0 for r in bad)}; within 5 s and 300 MB with the server "
        f"healthy afterwards: {len(bounded)}. Slowest {max(r['seconds'] for r in bad):.2f} s, "
        f"largest {max(r['megabytes'] for r in bad):.0f} MB.",
    ]
    return "\n\n".join(parts)


def write_tables(path, results):
    with open(path) as page:
        text = page.read()
    if BEGIN not in text or END not in text:
        raise SystemExit(f"{path} lacks the marks {BEGIN} and {END}")
    fresh = f"{BEGIN}\n\n{render(results)}\n\n{END}"
    text = re.sub(re.escape(BEGIN) + ".*?" + re.escape(END), lambda _: fresh, text, flags=re.S)
    with open(path, "w") as page:
        page.write(text)
