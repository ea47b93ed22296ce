"""What `rilievo export` writes, read by others' rules."""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib

import lib3mf
import numpy as np
from check_usda import UsdError, check
from scans import GOLDEN, command_line, program, sphere

import rilievo


def cube(count: int):
    """Points on a cube of side 2, whose edges become creases."""
    rng = np.random.default_rng(3)
    points = rng.uniform(-1, 1, size=(count, 3))
    axis = rng.integers(0, 3, size=count)
    points[np.arange(count), axis] = rng.choice([-1.0, 1.0], size=count)
    return points


def gray_png(data: bytes):
    """Samples and texts of a 16-bit grey PNG."""
    at, texts, packed, size = 8, {}, b"", None
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        crc, = struct.unpack(">I", data[at + 8 + length:at + 12 + length])
        assert crc == zlib.crc32(kind + body), kind
        if kind == b"IHDR":
            size = struct.unpack(">IIBBBBB", body)
        elif kind == b"tEXt":
            keyword, text = body.split(b"\0")
            texts[keyword.decode("latin-1")] = text.decode("latin-1")
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    width, height, depth, color = size[:4]
    assert (depth, color) == (16, 0), size
    raw = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + 2 * width)
    rows = np.zeros((height, 2 * width), np.int64)
    for y in range(height):
        kind, line = raw[y, 0], raw[y, 1:].astype(np.int64)
        above = rows[y - 1] if y > 0 else np.zeros(2 * width, np.int64)
        for x in range(2 * width):
            a = rows[y, x - 2] if x > 1 else 0
            b, c = above[x], above[x - 2] if x > 1 else 0
            p = a + b - c
            paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            rows[y, x] = (line[x] + (0, a, b, (a + b) // 2, paeth)[kind]) % 256
    return rows[:, 0::2] * 256 + rows[:, 1::2], texts


class ExportTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.surface = rilievo.read(GOLDEN)

    def export(self, name: str, *arguments: str, source=GOLDEN) -> pathlib.Path:
        subprocess.run([program("RILIEVO_PROGRAM"), "export", str(source), str(self.folder / name),
                        *arguments], check=True, stdout=subprocess.DEVNULL)
        return self.folder / name

    def test_usd_text_holds_the_surface_at_every_level(self):
        for level in range(self.surface.max_level + 1):
            mesh = check(self.export("a.usda", "--level", str(level)).read_text())
            self.assertEqual(mesh["subdivisionScheme"], "loop")
            self.assertEqual(len(mesh["points"]), self.surface.levels[level]["vertices"])
            faces = np.array(mesh["faceVertexIndices"]).reshape(-1, 3)
            np.testing.assert_array_equal(faces, self.surface.faces(level))
            np.testing.assert_allclose(
                mesh["primvars:displacement"],
                self.surface.heights[:len(mesh["points"])] * self.surface.frame.diagonal,
                rtol=1e-6)
            if level == 0:
                np.testing.assert_allclose(
                    np.array(mesh["points"]) + mesh["xformOp:translate"],
                    self.surface.control_mesh.vertices, atol=1e-6)

    def test_usd_text_tells_unit_and_up(self):
        for up, turned in (("x", True), ("y", False), ("z", False), ("-z", True)):
            mesh = check(self.export("a.usda", "--unit", "mm", "--up", up).read_text())
            self.assertEqual("xformOp:orient" in mesh, turned)
            self.assertEqual(len(mesh["xformOpOrder"]), 1 + turned)

    def test_usd_text_tells_the_creases(self):
        (self.folder / "cube.dss").write_bytes(command_line(cube(6000), ["--topology", "arbitrary"]))
        surface = rilievo.read(self.folder / "cube.dss")
        self.assertGreater(len(surface.control_mesh.creases), 20)
        mesh = check(self.export("c.usda", "--level", "0",
                                 source=self.folder / "cube.dss").read_text())
        pairs = {frozenset(p) for p in np.array(mesh["creaseIndices"]).reshape(-1, 2).tolist()}
        self.assertEqual(pairs, {frozenset(p) for p in surface.control_mesh.creases.tolist()})
        finer = check(self.export("d.usda", "--level", "1",
                                  source=self.folder / "cube.dss").read_text())
        self.assertEqual(len(finer["creaseIndices"]), 2 * len(mesh["creaseIndices"]))
        cage = self.export("cage.obj", "--cage", source=self.folder / "cube.dss").read_text()
        self.assertEqual(cage.count("t crease 2/1/0 "), len(surface.control_mesh.creases))

    def test_the_checker_finds_what_is_wrong(self):
        text = self.export("a.usda", "--level", "0").read_text()
        check(text)
        for old, new in (("#usda 1.0", "#usda 2.0"), ("\"loop\"", "\"lop\""),
                         ("    metersPerUnit = 1\n", ""),
                         ("point3f[] points", "point3d[] points"), ("int[] faceV", "int faceV"),
                         ("[3, ", "[4, "), ("\"varying\"", "\"uniform\""), ("}\n", ""),
                         ("uniform token sub", "token sub"), (" = [(", " = [(1, 2, 3), ("),
                         ("def Mesh \"surface\"", "def Mesh \"other\"")):
            self.assertIn(old, text)
            with self.assertRaises(UsdError, msg=new):
                check(text.replace(old, new, 1))

    def test_atlas_samples_are_heights_without_seams(self):
        for level in (0, 2):
            samples, texts = gray_png(self.export("h.png", "--level", str(level)).read_bytes())
            control, n = self.surface.control_mesh, 2**level
            least, most = float(texts["Minimum"]), float(texts["Maximum"])
            columns = int(texts["Columns"])
            self.assertEqual(int(texts["Faces"]), len(control.faces))

            def sample(face, i, j):
                tile = face // 2
                x = tile % columns * (n + 2) + (i if face % 2 == 0 else n + 1 - i)
                y = tile // columns * (n + 1) + (j if face % 2 == 0 else n - j)
                return samples[y, x]

            heights = self.surface.heights * self.surface.frame.diagonal
            along = {}
            for face, corners in enumerate(control.faces.tolist()):
                for corner, (i, j) in zip(corners, ((0, 0), (n, 0), (0, n))):
                    height = least + sample(face, i, j) / 65535 * (most - least)
                    self.assertAlmostEqual(height, heights[corner], delta=(most - least) / 65535)
                a, b, c = corners
                sides = {(a, b): [sample(face, k, 0) for k in range(n + 1)],
                         (b, c): [sample(face, n - k, k) for k in range(n + 1)],
                         (c, a): [sample(face, 0, n - k) for k in range(n + 1)]}
                for (start, end), values in sides.items():
                    self.assertEqual(along.setdefault((end, start), values[::-1]), values[::-1])
                    along[(start, end)] = values

    def test_ply_has_flags(self):
        data = self.export("a.ply").read_bytes()
        head, body = data.split(b"end_header\n", 1)
        self.assertIn(b"property uchar source", head)
        kinds = {"float": "f4", "double": "f8", "uchar": "u1"}
        fields = [line.split() for line in head.decode().splitlines()
                  if line.startswith("property") and "list" not in line]
        vertices = np.frombuffer(body, [(name, "<" + kinds[kind]) for _, kind, name in fields],
                                 len(self.surface.vertices()))
        np.testing.assert_array_equal(vertices["source"], self.surface.flags())

    def colored_scan(self) -> pathlib.Path:
        """Vertices of the surface, moved a little, red by number."""
        points = self.surface.vertices() + 1e-7
        rows = "".join(f"{x!r} {y!r} {z!r} {i % 256} {i // 256} 7 {i / 4}\n"
                       for i, (x, y, z) in enumerate(points.tolist()))
        path = self.folder / "colors.ply"
        path.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n" +
                        "".join(f"property double {axis}\n" for axis in "xyz") +
                        "".join(f"property uchar {c}\n" for c in ("red", "green", "blue")) +
                        "property float intensity\nend_header\n" + rows)
        return path

    def test_colors_and_intensity_are_carried(self):
        data = self.export("a.ply", "--carry", str(self.colored_scan())).read_bytes()
        head, body = data.split(b"end_header\n", 1)
        kinds = {"float": "f4", "double": "f8", "uchar": "u1"}
        fields = [line.split() for line in head.decode().splitlines()
                  if line.startswith("property") and "list" not in line]
        count = len(self.surface.vertices())
        vertices = np.frombuffer(body, [(name, "<" + kinds[kind]) for _, kind, name in fields],
                                 count)
        number = vertices["red"] + 256 * vertices["green"].astype(int)
        # Some vertices lie at the same place.
        np.testing.assert_allclose(self.surface.vertices()[number], self.surface.vertices(),
                                   atol=1e-6)
        np.testing.assert_array_equal(vertices["intensity"] * 4, number)

    def clip(self):
        """Two frames with morph targets."""
        cage, path = self.export("cage.obj", "--cage"), self.folder / "clip.glb"
        subprocess.run([program("RILIEVO_PROGRAM"), "deform", str(GOLDEN), "--cage", str(cage),
                        str(cage), "-o", str(path)], check=True, stdout=subprocess.DEVNULL)
        return path

    def test_glb_passes_the_validator(self):
        validator = os.environ.get("RILIEVO_GLTF_VALIDATOR", "")
        node, npm = shutil.which("node"), shutil.which("npm")
        if not validator or node is None or npm is None:
            self.skipTest("node and npm are not installed")
        modules = pathlib.Path(validator)
        if not (modules / "node_modules" / "gltf-validator").exists():
            modules.mkdir(parents=True, exist_ok=True)
            installed = subprocess.run(
                [npm, "install", "--prefix", str(modules), "--no-audit", "--no-fund", "--silent",
                 "gltf-validator@2.0.0-dev.3.10"], capture_output=True)
            if installed.returncode != 0:
                self.skipTest("npm cannot install gltf-validator; no network?")
        files = [self.export("level0.glb", "--level", "0"), self.export("finest.glb"),
                 self.export("few.glb", "--triangles", "300"),
                 self.export("colors.glb", "--carry", str(self.colored_scan())), self.clip()]
        script = ("const validator = require('gltf-validator'); const fs = require('fs');"
                  "Promise.all(process.argv.slice(1).map(path => validator.validateBytes("
                  "new Uint8Array(fs.readFileSync(path))))).then(r => console.log("
                  "JSON.stringify(r)));")
        shown = subprocess.run([node, "-e", script, *map(str, files)], check=True,
                               capture_output=True, cwd=modules)
        for path, report in zip(files, json.loads(shown.stdout)):
            issues = report["issues"]
            self.assertEqual((issues["numErrors"], issues["numWarnings"]), (0, 0),
                             f"{path.name}: {issues['messages'][:5]}")
            self.assertEqual(report["info"]["totalTriangleCount"] > 0, True)

    def test_lib3mf_reads_3mf_without_a_warning(self):
        try:
            lib3mf.load()
        except OSError:
            self.skipTest(f"{lib3mf.LIBRARY} is not installed")
        vertices = self.surface.vertices()
        for unit, name, factor in (("mm", "millimeter", 1), ("m", "meter", 1),
                                   ("in", "inch", 1), ("dm", "millimeter", 100)):
            model = lib3mf.read(str(self.export("a.3mf", "--unit", unit)))
            self.assertEqual((model.unit, model.warnings), (name, 0))
            np.testing.assert_allclose(model.vertices, factor * vertices, rtol=1e-6, atol=1e-6)
            np.testing.assert_array_equal(model.triangles, self.surface.faces())
        self.assertFalse(model.is_closed)
        (self.folder / "ball.dss").write_bytes(command_line(sphere(3000), []))
        for more in ([], ["--up", "y"]):
            model = lib3mf.read(str(self.export("ball.3mf", *more,
                                                source=self.folder / "ball.dss")))
            self.assertEqual((model.is_closed, model.warnings), (True, 0))

    def test_refusals(self):
        for name, arguments, part in (("a.fbx", [], ".usda"), ("a.usda", ["--level", "9"], "level"),
                                      ("a.png", ["--triangles", "9"], "--level"),
                                      ("a.obj", ["--cage", "--level", "1"], "--cage"),
                                      ("a.usda", ["--cage"], "--level"),
                                      ("a.stl", ["--carry", "x.las"], ".glb")):
            shown = subprocess.run([program("RILIEVO_PROGRAM"), "export", str(GOLDEN),
                                    str(self.folder / name), *arguments], capture_output=True)
            self.assertEqual(shown.returncode, 2, shown.stderr)
            self.assertIn(part, shown.stderr.decode())
            self.assertFalse((self.folder / name).exists())


if __name__ == "__main__":
    unittest.main()
