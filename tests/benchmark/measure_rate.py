#!/usr/bin/env python3
"""Bytes at equal error beside the peers' rate curves; writes docs/measured-rate.md.

  measure_rate.py --bin build/release/bin [--shared ../shared] [--page docs/measured-rate.md]

Clouds of 100 000 points of each ground truth of rd_peers.csv ("gt": without noise, against the true
mesh itself simplified and coded; else against the best peer's reconstruction of the same noise) are
reconstructed with --max-error; the bytes are set beside the fewest of any peer at the RMS reached.
With CGAL and Draco here, so are the simulator's smooth shapes, whose true meshes are simplified and
coded in this run. Further: whether --max-error and --max-bytes are kept on every scan and verify
agrees, what the first layers show, the encoder's share of the time, and the decoder's rate beside
OpenSubdiv's. With --results the figures of single parts are kept in a file, and the page is written
once all parts are there.
"""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

from dss_bytes import spent
from rate_page import KEPT_BYTES, KEPT_ERRORS, page, write_page

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
ERRORS = [0.01, 0.02, 0.03, 0.05, 0.1]  # asked for, % of the diagonal
SHAPES = {"spot": "spot_nonuniform_outliers", "owl": "owl_multiscan",
          "mechpart": "mechpart_genus3", "featuretype": "featuretype_cad"}
SMOOTH = ["star", "genus2", "torus"]
SMOOTH_ERRORS = [0.002, 0.005, 0.01, 0.02, 0.05]
PEER_FACES = [300, 1000, 3000, 10000, 30000]
PEER_BITS = [9, 10, 11, 12, 14]


class Tools:
    """The programs under measure, and the evaluator."""

    def __init__(self, a, work):
        self.bin, self.shared, self.work = a.bin, a.shared, work
        self.bench = os.path.join(work, "tools")
        subprocess.run(["make", "-s", "-C", os.path.join(a.shared, "bench"), "BIN=" + self.bench],
                       check=True)

    def path(self, name):
        return os.path.join(self.work, name)

    def rilievo(self, *arguments, check=True):
        return subprocess.run([os.path.join(self.bin, "rilievo"), *arguments], check=check,
                              capture_output=True, text=True)

    def normalise(self, mesh, out):
        subprocess.run([os.path.join(self.bench, "normalise"), mesh, out], check=True,
                       stdout=subprocess.DEVNULL)

    def sample(self, mesh, sigma, seed, prefix):
        subprocess.run([os.path.join(self.bench, "sample"), mesh, "100000", str(sigma), str(seed),
                        prefix], check=True, stdout=subprocess.DEVNULL)

    def rms(self, truth, mesh):
        text = subprocess.run([os.path.join(self.bench, "evaluate"), truth, mesh, "--json"],
                              check=True, capture_output=True, text=True)
        return json.loads(text.stdout)["rms"]

    def reconstruct(self, cloud, *options):
        """Report, bytes and a mesh."""
        surface, mesh = self.path("out.dss"), self.path("out.ply")
        self.rilievo("reconstruct", cloud, "-o", surface, "--quiet", "--report", surface + ".json",
                     *options)
        self.rilievo("export", surface, mesh)
        with open(surface + ".json") as file:
            return json.load(file), os.path.getsize(surface), mesh


def peer_curves(shared):
    sys.path.insert(0, os.path.join(shared, "bench"))
    import rdcompare
    return rdcompare, rdcompare.load(os.path.join(shared, "bench", "rd_peers.csv"))


def curve(tools, cloud, truth, errors, envelope, rdcompare, label):
    rows = []
    for asked in errors:
        report, size, mesh = tools.reconstruct(cloud, "--max-error", str(asked / 100))
        rms = tools.rms(truth, mesh)
        peer = rdcompare.bytes_at(envelope, rms) if envelope else None
        with open(tools.path("out.dss"), "rb") as file:
            kinds = spent(file.read())
        rows.append(dict(label=label, asked=asked, rms=rms, bytes=size, peer=peer, spent=kinds,
                         faces=report["control_faces"], seconds=report["total_seconds"]))
        print(f"{label:24s} asked {asked:5.3f} %  rms {rms:.4f} %  {size:6d} bytes  "
              f"peer {'-' if peer is None else round(peer)}  "
              f"{'' if peer is None else f'{size / peer:.2f}'}", flush=True)
    return rows


def measure_peer_shapes(tools, only):
    rdcompare, curves = peer_curves(tools.shared)
    rows = []
    for (shape, _, sigma), envelope in sorted(curves.items(), key=str):
        label = f"{shape}, {'from the true mesh' if sigma == 'gt' else f'{sigma} % noise'}"
        if shape not in SHAPES or not re.search(only, label):
            continue
        truth = tools.path(shape + ".ply")
        tools.normalise(os.path.join(tools.shared, "data", "gt", SHAPES[shape] + ".ply"), truth)
        noise = 0 if sigma == "gt" else sigma
        prefix = tools.path(f"{shape}_{noise}")
        tools.sample(truth, noise, 1, prefix)
        rows += curve(tools, prefix + ".ply", truth, ERRORS, envelope, rdcompare, label)
    return rows


def coded_by_draco(tools, mesh, bits, truth):
    drc, back = tools.path("peer.drc"), tools.path("peer.ply")
    subprocess.run(["draco_encoder", "-i", mesh, "-o", drc, "-cl", "10", "-qp", str(bits)],
                   check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["draco_decoder", "-i", drc, "-o", back], check=True, stdout=subprocess.DEVNULL)
    return tools.rms(truth, back), os.path.getsize(drc)


def measure_smooth_shapes(tools, only):
    """The simulator's shapes: their true meshes, simplified and Draco-coded in this run."""
    peer = os.path.join(tools.bin, "rilievo_rate_peer")
    if not os.path.exists(peer) or not shutil.which("draco_encoder"):
        print("skipped: the smooth shapes need CGAL and draco_encoder (libcgal-dev, draco)")
        return []
    rdcompare, _ = peer_curves(tools.shared)
    rows = []
    for shape in (s for s in SMOOTH if re.search(only, s)):
        cloud, truth = tools.path(shape + "_cloud.ply"), tools.path(shape + "_truth.off")
        tools.rilievo("simulate", shape, "-o", cloud, "--points", "100000", "--views", "0")
        _, _, mesh = tools.reconstruct(cloud, "--max-level", "3")
        off = tools.path("dense.off")
        write_off(mesh, off)
        subprocess.run([peer, "project", shape, off, truth], check=True)
        points = []
        for faces in PEER_FACES:
            simple = tools.path("simple.off")
            subprocess.run([peer, "simplify", truth, str(faces), simple], check=True)
            obj = tools.path("simple.obj")
            write_obj(simple, obj)
            points += [coded_by_draco(tools, obj, bits, truth) for bits in PEER_BITS]
        envelope = rdcompare.envelope(points)
        rows += curve(tools, cloud, truth, SMOOTH_ERRORS, envelope, rdcompare,
                      f"{shape}, from the true mesh")
    return rows


def write_off(ply, off):
    """A binary PLY of the program's own (vertices x y z first, triangles) as OFF."""
    import struct
    sizes = {"float": 4, "double": 8, "uchar": 1, "int": 4, "uint": 4}
    with open(ply, "rb") as file:
        counts, stride, kind, element = {}, 0, None, None
        while (line := file.readline().decode().split()) != ["end_header"]:
            if line[0] == "element":
                element = line[1]
                counts[element] = int(line[2])
            elif line[0] == "property" and element == "vertex":
                kind = kind or line[1]
                stride += sizes[line[1]]
        vertices = file.read(counts["vertex"] * stride)
        faces = file.read(counts["face"] * 13)
    code, width = ("<ddd", 24) if kind == "double" else ("<fff", 12)
    with open(off, "w") as out:
        out.write(f"OFF\n{counts['vertex']} {counts['face']} 0\n")
        for i in range(counts["vertex"]):
            out.write("%.9g %.9g %.9g\n" % struct.unpack(code, vertices[i * stride:i * stride + width]))
        for i in range(counts["face"]):
            out.write("3 %d %d %d\n" % struct.unpack("<iii", faces[13 * i + 1:13 * i + 13]))


def write_obj(off, obj):
    with open(off) as file:
        words = file.read().split()
    vertices, faces = int(words[1]), int(words[2])
    with open(obj, "w") as out:
        for i in range(vertices):
            out.write("v " + " ".join(words[4 + 3 * i:7 + 3 * i]) + "\n")
        begin = 4 + 3 * vertices
        for i in range(faces):
            corners = words[begin + 4 * i + 1:begin + 4 * i + 4]
            out.write("f " + " ".join(str(int(c) + 1) for c in corners) + "\n")


def measure_kept(tools, only):
    """--max-error and --max-bytes on every scan; the certificate recomputed."""
    data = os.path.join(tools.shared, "data")
    rows = []
    for file in sorted(os.listdir(data)):
        if not file.endswith(".ply") or not re.search(only, file):
            continue
        cloud, row = os.path.join(data, file), dict(scan=file[:-4], errors=[], sizes=[])
        for option, asked, list_of in ([("--max-error", e, row["errors"]) for e in KEPT_ERRORS]
                                       + [("--max-bytes", n, row["sizes"]) for n in KEPT_BYTES]):
            value = asked / 100 if option == "--max-error" else asked
            surface = tools.path("kept.dss")
            run = tools.rilievo("reconstruct", cloud, "-o", surface, "--quiet", "--report",
                                surface + ".json", option, str(value), check=False)
            if run.returncode != 0:
                list_of.append(dict(asked=asked, refused=True))
                continue
            with open(surface + ".json") as report_file:
                report = json.load(report_file)
            verified = tools.rilievo("verify", "--json", surface, cloud, check=False)
            figures = json.loads(verified.stdout)["figures"]
            info = json.loads(tools.rilievo("info", "--json", surface).stdout)
            list_of.append(dict(asked=asked, refused=False, bytes=os.path.getsize(surface),
                                first=info["control_bytes"] + info["levels"][0]["bytes"],
                                flags=info["flag_bytes"],
                                rms=100 * figures["rms_across"]["found"], verified=verified.returncode == 0,
                                kept=report["max_error_kept"]))
        rows.append(row)
        print(row, flush=True)
    return rows


def measure_layers(tools, only):
    """What each layer of the default surface costs and shows."""
    rows = []
    for shape in ("owl", "mechpart", "spot"):
        if not re.search(only, shape):
            continue
        truth, cloud = tools.path(shape + ".ply"), tools.path(f"{shape}_0.ply")
        if not os.path.exists(cloud):
            tools.normalise(os.path.join(tools.shared, "data", "gt", SHAPES[shape] + ".ply"), truth)
            tools.sample(truth, 0, 1, cloud[:-4])
        report, size, _ = tools.reconstruct(cloud)
        info = json.loads(tools.rilievo("info", "--json", tools.path("out.dss")).stdout)
        with open(tools.path("out.dss"), "rb") as file:
            data = file.read()
        end, errors, shares = 0, [], []
        # Finest levels without a chunk come with the last that has one.
        chunks = [info["control_bytes"]] + [n["bytes"] for n in info["levels"] if n["bytes"] > 0]
        for chunk in chunks:
            end += chunk
            part, mesh = tools.path("part.dss"), tools.path("part.ply")
            with open(part, "wb") as file:
                file.write(data[:end])
            # Two levels finer than the heights that are there, at most: the surface is smooth.
            level = min(report["max_level"], level_of(tools, part) + 2)
            tools.rilievo("export", part, mesh, "--level", str(level))
            errors.append(tools.rms(truth, mesh))
            shares.append(end / len(data))
        stages = report["stage_seconds"]
        rows.append(dict(shape=shape, bytes=size, errors=errors, shares=shares,
                         encode=stages["encode"], total=report["total_seconds"]))
        print(rows[-1], flush=True)
    return rows


def measure_decoder(tools, only):
    """Displaced vertices a second, and processor time beside OpenSubdiv's in the same run."""
    program = os.path.join(tools.bin, "rilievo_decoder_benchmark")
    if not os.path.exists(program) or only:
        return []
    text = subprocess.run([program, "--benchmark_format=json", "--benchmark_repetitions=5",
                           "--benchmark_report_aggregates_only=true"], check=True,
                          capture_output=True, text=True).stdout
    medians = {b["run_name"].removesuffix("/real_time"): b for b in json.loads(text)["benchmarks"]
               if b["aggregate_name"] == "median"}
    peer = medians["OpenSubdivTopology"]["cpu_time"] + medians["OpenSubdivLimit"]["cpu_time"]
    rows = [dict(name=name, rate=640 / b["cpu_time"], cpu=b["cpu_time"],
                 ratio=peer / b["cpu_time"]) for name, b in medians.items()]
    for row in rows:
        print(row, flush=True)
    return rows


def level_of(tools, part):
    return json.loads(tools.rilievo("info", "--json", part).stdout)["max_level"]


MEASURES = dict(peers=measure_peer_shapes, smooth=measure_smooth_shapes, kept=measure_kept,
                layers=measure_layers, decoder=measure_decoder)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(ROOT, "build", "release", "bin"))
    parser.add_argument("--shared", default=os.path.join(ROOT, "..", "shared"))
    parser.add_argument("--page", default=os.path.join(ROOT, "docs", "measured-rate.md"))
    parser.add_argument("--only", default="", help="regular expression on the cloud's name")
    parser.add_argument("--parts", default=",".join(MEASURES))
    parser.add_argument("--results", help="a JSON file that keeps the figures of parts already run")
    a = parser.parse_args()
    a.bin, a.shared = os.path.abspath(a.bin), os.path.abspath(a.shared)
    if not os.path.isdir(a.shared):
        print(f"skipped: no benchmark scans at {a.shared}; the page stays as it is")
        return
    results = {}
    if a.results and os.path.exists(a.results):
        with open(a.results) as file:
            results = json.load(file)
    results["date"] = time.strftime("%Y-%m-%d")
    with tempfile.TemporaryDirectory(prefix="rilievo-rate-") as work:
        tools = Tools(a, work)
        for part in a.parts.split(","):
            results[part] = MEASURES[part](tools, a.only)
            if a.results:
                with open(a.results, "w") as file:
                    json.dump(results, file, indent=1)
    if a.only or not all(part in results for part in MEASURES):
        return
    write_page(a.page, page(results))
    print(f"wrote {os.path.relpath(a.page)}")


if __name__ == "__main__":
    main()
