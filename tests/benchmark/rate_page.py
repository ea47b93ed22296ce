"""The page of measure_rate.py: tables of its figures between the two marks of docs/measured-rate.md."""
import re

from readme_table import BEGIN, END, table

KEPT_ERRORS, KEPT_BYTES = [0.1, 0.05, 0.03], [4000, 8000, 16000]  # asked for
SMALL_FILE = 1000  # bytes


def kept_error(figure):
    if figure["refused"]:
        return "refused"
    mark = "" if figure["kept"] else " (not: said so)"
    over = figure["rms"] / figure["asked"]
    broken = " NOT KEPT" if figure["kept"] and over > 1 else ""
    return f"{over:.3f}{mark}{broken}, {figure['bytes']} B"


def kept_bytes(figure):
    if figure["refused"]:
        return "refused"
    first = 100 * figure["first"] / figure["bytes"]
    return f"{figure['bytes']} B, {figure['rms']:.4f}, {first:.0f} %"


def page(results):
    parts = [
        f"Measured {results['date']} by `./dev bench --rate`. RMS in % of the diagonal, both "
        "directions, against the ground truth; *peer*: fewest bytes of any peer at the RMS reached "
        "(`-`: no peer gets there). 100 000 points a cloud, `--max-error`, all else at its default.",
        table(["cloud", "asked", "RMS", "control faces", "bytes", "peer", "ours / peer"],
              [[r["label"], f"{r['asked']:.3f}", f"{r['rms']:.4f}", r["faces"], r["bytes"],
                "-" if r["peer"] is None else round(r["peer"]),
                "-" if r["peer"] is None else f"{r['bytes'] / r['peer']:.2f}"]
               for r in results["peers"] + results["smooth"]]),
    ]
    small = [r for r in results["peers"] + results["smooth"] if r["bytes"] < SMALL_FILE]
    if small:
        kinds = list(small[0]["spent"])
        parts += [
            "## Where the bytes of small files go",
            f"Files of less than {SMALL_FILE} bytes of the table above. *Framing*: signature, tags, "
            "lengths and checksums; *header*: counts, frame, steps; *flags*: which heights are "
            "smoothed (those of filled ones are among the heights).",
            table(["cloud", "asked", "bytes"] + kinds,
                  [[r["label"], f"{r['asked']:.3f}", r["bytes"]] + [r["spent"][k] for k in kinds]
                   for r in small]),
        ]
    if results["kept"]:
        parts += [
            "## An error or a size asked for",
            "`--max-error E`: RMS across the surface, the larger of both ways, as `rilievo verify` "
            "finds it, over E, and bytes; *not*: the report says that the scan does not allow E, "
            "what is reached and why. `--max-bytes N`: bytes, that RMS in % of the diagonal, and the share "
            "of the bytes that the first picture takes, control mesh and level 0.",
            table(["scan"] + [f"E = {e} %" for e in KEPT_ERRORS] + [f"N = {n}" for n in KEPT_BYTES]
                  + ["verify agrees"],
                  [[r["scan"]] + [kept_error(f) for f in r["errors"]]
                   + [kept_bytes(f) for f in r["sizes"]]
                   + ["yes" if all(f["refused"] or f["verified"] for f in r["errors"] + r["sizes"])
                      else "NO"] for r in results["kept"]]),
        ]
    if results["layers"]:
        parts += [
            "## Layer by layer",
            "The default surface of clean clouds: share of the bytes read and RMS of what they show, "
            "from the control mesh on; the encoder's share of the time.",
            table(["shape", "bytes", "share read: RMS", "encoding / whole"],
                  [[r["shape"], r["bytes"],
                    "; ".join(f"{100 * s:.0f} %: {e:.4f}" for s, e in zip(r["shares"], r["errors"])),
                    f"{100 * r['encode'] / r['total']:.0f} %"] for r in results["layers"]]),
        ]
    if results["decoder"]:
        parts += [
            "## The decoder",
            "5 000 control faces at level 4, 640 000 vertices; medians of five. Milliseconds of the first "
            "thread's processor time (with two threads it does half of the work), millions of vertices a "
            "second by it, and OpenSubdiv's time (topology, limit and normals, one thread) over it.",
            table(["", "million / s", "ms", "OpenSubdiv / this"],
                  [[r["name"], f"{r['rate']:.1f}", f"{r['cpu']:.1f}", f"{r['ratio']:.1f}"]
                   for r in results["decoder"]]),
        ]
    return "\n\n".join(parts) + "\n"


def write_page(path, text):
    """Between the two marks; what people wrote around them stays."""
    with open(path) as file:
        old = file.read()
    fresh = f"{BEGIN}\n\n{text}\n{END}"
    with open(path, "w") as file:
        file.write(re.sub(re.escape(BEGIN) + ".*?" + re.escape(END), lambda _: fresh, old, flags=re.S))
