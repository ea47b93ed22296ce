"""Reading .dss files: what the arrays hold, how long they live, and what is refused."""
import gc
import json
import os
import pickle
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np
from scans import GOLDEN, program

import rilievo


def cpp_mesh(level: int):
    """Vertices, normals and faces as the command line exports them: each number reads back the
    same."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "mesh.obj")
        subprocess.run([program("RILIEVO_PROGRAM"), "export", str(GOLDEN), path, "--level",
                        str(level)], check=True, stdout=subprocess.DEVNULL)
        with open(path) as file:
            lines = [line.split() for line in file]
    vertices = np.array([line[1:] for line in lines if line[0] == "v"], np.float64)
    normals = np.array([line[1:] for line in lines if line[0] == "vn"], np.float32)
    faces = np.array([[int(corner.split("/")[0]) - 1 for corner in line[1:]]
                      for line in lines if line[0] == "f"])
    return vertices, normals, faces


class SurfaceTest(unittest.TestCase):
    def setUp(self):
        self.surface = rilievo.read(GOLDEN)

    def test_same_mesh_as_the_command_line_at_every_level(self):
        for level in range(self.surface.max_level + 3):
            vertices, normals, faces = cpp_mesh(level)
            mesh = self.surface.mesh(level)
            np.testing.assert_array_equal(mesh.vertices, vertices)
            np.testing.assert_array_equal(mesh.normals, normals)
            np.testing.assert_array_equal(mesh.faces, faces)
            self.assertEqual(mesh.flags.shape, (len(vertices),))
            self.assertEqual((mesh.vertices.dtype, mesh.faces.dtype, mesh.normals.dtype,
                              mesh.flags.dtype), (np.float64, np.uint32, np.float32, np.uint8))

    def test_methods_default_to_the_finest_level(self):
        finest = self.surface.max_level
        self.assertIs(self.surface.vertices(), self.surface.vertices(finest))
        self.assertEqual(len(self.surface.faces()), self.surface.levels[finest]["faces"])
        self.assertEqual(len(self.surface.normals()), self.surface.levels[finest]["vertices"])
        self.assertEqual(set(self.surface.flags()), {rilievo.MEASURED, rilievo.FILLED})

    def test_a_notebook_shows_a_picture(self):
        drawn = self.surface.picture(size=(120, 90), turn=-10.5, elevation=40, colors="flags", level=0)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "picture.png")
            subprocess.run([program("RILIEVO_PROGRAM"), "view", str(GOLDEN), "-o", path, "--size", "120x90",
                            "--turn=-10.5", "--elevation=40", "--colors", "flags", "--level", "0"],
                           check=True, stdout=subprocess.DEVNULL)
            with open(path, "rb") as file:
                self.assertEqual(drawn, file.read())
        shown = self.surface._repr_png_()
        self.assertEqual(shown[:8] + shown[12:24], b"\x89PNG\r\n\x1a\nIHDR\0\0\x02\x80\0\0\x01\xe0")
        for words, arguments in (("colors", {"colors": "loud"}), ("size", {"size": (0, 5)}),
                                 ("elevation", {"elevation": 91})):
            with self.subTest(words=words), self.assertRaisesRegex(rilievo.InvalidArgument, words):
                self.surface.picture(**arguments)
        with mock.patch.dict(os.environ, {"RILIEVO_PROGRAM": "/nowhere/rilievo"}):
            self.assertIsNone(self.surface._repr_png_())
            with self.assertRaises(rilievo.Unavailable):
                self.surface.picture()

    def test_control_mesh_frame_and_heights(self):
        control, frame = self.surface.control_mesh, self.surface.frame
        self.assertEqual(control.vertices.shape, (self.surface.levels[0]["vertices"], 3))
        self.assertEqual(control.faces.shape, (self.surface.levels[0]["faces"], 3))
        self.assertEqual(len(control.creases), len(control.sharpness))
        self.assertEqual(frame.center.shape, (3,))
        self.assertEqual(len(self.surface.heights), len(self.surface.vertices()))
        # Control points of a Loop surface lie near it.
        distance = np.linalg.norm(control.vertices - self.surface.vertices(0), axis=1)
        self.assertLess(distance.max(), frame.diagonal)

    def test_arrays_outlive_their_surface_and_cannot_be_written(self):
        vertices, heights = self.surface.vertices(), self.surface.heights
        copies = vertices.copy(), heights.copy()
        del self.surface
        gc.collect()
        junk = [np.full(len(copies[0]) * 3, 7.0) for _ in range(20)]
        np.testing.assert_array_equal(vertices, copies[0])
        np.testing.assert_array_equal(heights, copies[1])
        with self.assertRaises(ValueError):
            vertices[0, 0] = 1
        self.assertEqual(len(junk), 20)

    def test_bytes_come_back_and_pickles(self):
        data = GOLDEN.read_bytes()
        self.assertEqual(self.surface.to_bytes(), data)
        again = pickle.loads(pickle.dumps(self.surface))
        np.testing.assert_array_equal(again.vertices(2), self.surface.vertices(2))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "copy.dss")
            self.surface.write(path)
            self.assertEqual(rilievo.read(path).to_bytes(), data)
            self.assertEqual(os.listdir(folder), ["copy.dss"])
            scan = os.path.join(folder, "scan.ply")
            with open(scan, "w") as file:
                file.write("points")
            with self.assertRaisesRegex(rilievo.InvalidArgument, "rilievo export"):
                self.surface.write(scan)
            with open(scan) as file:
                self.assertEqual(file.read(), "points")
            with self.assertRaises(FileNotFoundError):
                self.surface.write(os.path.join(folder, "no", "copy.dss"))

    def test_beginnings_and_coarser_levels(self):
        data = self.surface.to_bytes()
        ends = np.cumsum(self.surface.info["chunk_bytes"])
        for level in range(self.surface.max_level + 1):
            coarse = rilievo.read(GOLDEN, max_level=level)
            self.assertEqual(coarse.max_level, level)
            self.assertEqual(coarse.declared_max_level, self.surface.max_level)
            self.assertEqual(coarse.to_bytes(), data[:ends[level + 1]])
            cut = rilievo.Surface.from_bytes(data[:ends[level + 1] + 1], partial=True)
            self.assertEqual(cut.to_bytes(), coarse.to_bytes())
            np.testing.assert_array_equal(coarse.heights,
                                          self.surface.heights[:len(coarse.heights)]
                                          if level == self.surface.max_level else coarse.heights)
        with self.assertRaises(rilievo.InvalidArgument):
            rilievo.Surface.from_bytes(data[:ends[0] - 1], partial=True)
        with self.assertRaises(rilievo.DataLoss):
            rilievo.Surface.from_bytes(data[:-1])
        with self.assertRaises(rilievo.DataLoss):
            rilievo.Surface.from_bytes(data[:ends[2] - 1], max_level=4)

    def test_adaptive_mesh(self):
        mesh, error = self.surface.adaptive_mesh(triangles=300)
        self.assertLessEqual(len(mesh.faces), 300)
        finest = {tuple(v) for v in self.surface.vertices()}
        self.assertTrue(all(tuple(v) in finest for v in mesh.vertices))
        coarser, larger = self.surface.adaptive_mesh(tolerance=2 * error)
        self.assertLessEqual(larger, 2 * error)
        self.assertLessEqual(len(coarser.faces), len(mesh.faces))
        for arguments in ({}, {"tolerance": 0.1, "triangles": 4}, {"triangles": 0},
                          {"tolerance": 7}):
            with self.assertRaises(rilievo.InvalidArgument):
                self.surface.adaptive_mesh(**arguments)

    def test_at_passes_through_the_vertices(self):
        faces = self.surface.control_mesh.faces
        vertices = self.surface.vertices()
        numbers = np.arange(len(faces))
        for corner, (u, v) in enumerate([(0, 0), (1, 0), (0, 1)]):
            jet = self.surface.at(numbers, u, v)
            np.testing.assert_allclose(jet.positions, vertices[faces[:, corner]], rtol=0,
                                       atol=1e-12 * self.surface.frame.diagonal)
        smooth = self.surface.at(0, 0.2, [0.3, 0.4], smooth=True)
        self.assertEqual(smooth.positions.shape, (2, 3))
        self.assertEqual(smooth.curvatures.shape, (2, 2))
        step = 1e-5
        after, before = (self.surface.at(0, 0.2 + s, 0.3, smooth=True) for s in (step, -step))
        np.testing.assert_allclose((after.positions - before.positions)[0] / (2 * step),
                                   smooth.du[0], rtol=0, atol=1e-5 * self.surface.frame.diagonal)
        np.testing.assert_allclose(np.linalg.norm(smooth.normals, axis=1), 1)
        self.assertLess(np.abs((smooth.normals * smooth.dv).sum(axis=1)).max(),
                        1e-12 * self.surface.frame.diagonal)

    def test_closest_points_are_on_the_surface_and_no_farther_than_its_vertices(self):
        random = np.random.default_rng(5)
        vertices, diagonal = self.surface.vertices(), self.surface.frame.diagonal
        places = vertices[random.integers(len(vertices), size=300)]
        places = places + 0.02 * diagonal * random.standard_normal(places.shape)
        closest = self.surface.closest(places)
        at = self.surface.at(closest.faces, closest.u, closest.v)
        np.testing.assert_allclose(at.positions, closest.positions, rtol=0, atol=1e-12 * diagonal)
        np.testing.assert_allclose(np.linalg.norm(places - closest.positions, axis=1),
                                   closest.distances, rtol=0, atol=1e-12 * diagonal)
        to_vertices = np.linalg.norm(places[:, None] - vertices, axis=2).min(axis=1)
        self.assertTrue((closest.distances <= to_vertices + 1e-9 * diagonal).all())
        self.assertLess(closest.distances.sum(), 0.99 * to_vertices.sum())

    def test_at_and_closest_refuse_what_is_wrong(self):
        count = self.surface.levels[0]["faces"]
        for faces, u, v, said in ((count, 0, 0, f"0 to {count - 1}"), (-1, 0, 0, "faces"),
                                  (0, 0.7, 0.4, "u is 0.7"), (0.5, 0, 0, "whole numbers")):
            with self.assertRaisesRegex(rilievo.InvalidArgument, said):
                self.surface.at(faces, u, v)
        with self.assertRaisesRegex(rilievo.InvalidArgument, r"\(n, 3\)"):
            self.surface.closest([1.0, 2.0, 3.0])
        with self.assertRaisesRegex(rilievo.InvalidArgument, "point 1 .* not finite"):
            self.surface.closest([[1.0, 2.0, 3.0], [np.nan, 0, 0]])

    def test_voxels_are_those_of_the_command_line(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "voxels.raw")
            for kind, element in (("shell", np.uint8), ("distance", np.float32)):
                told = json.loads(subprocess.run(
                    [program("RILIEVO_PROGRAM"), "voxelize", str(GOLDEN), path, "--kind", kind,
                     "--resolution", "40", "--json", "--quiet"], check=True,
                    capture_output=True).stdout)
                voxels = self.surface.voxels(40, kind=kind)
                self.assertEqual(voxels.values.dtype, element)
                self.assertEqual(list(voxels.values.shape), told["size"])
                self.assertEqual((voxels.voxel, list(voxels.origin)),
                                 (told["voxel"], told["origin"]))
                np.testing.assert_array_equal(voxels.values.ravel(order="F"),
                                              np.fromfile(path, element))

    def test_voxels_hold_the_vertices_of_their_level(self):
        voxels = self.surface.voxels(voxel=self.surface.frame.diagonal / 50, level=1)
        at = np.floor((self.surface.vertices(1) - voxels.origin) / voxels.voxel).astype(int)
        self.assertTrue((voxels.values[tuple(at.T)] == 1).all())
        with self.assertRaises(ValueError):
            voxels.values[0, 0, 0] = 1

    def test_voxels_refuse_what_is_wrong(self):
        for said, arguments in (("either resolution or voxel", {}),
                                ("either resolution or voxel", {"resolution": 8, "voxel": 1.0}),
                                ("resolution = 0", {"resolution": 0}),
                                ("voxel -1", {"voxel": -1.0}),
                                ("kind = 'hull'", {"resolution": 8, "kind": "hull"}),
                                ("level", {"resolution": 8, "level": 90}),
                                ("band 0", {"resolution": 8, "kind": "distance", "band": 0})):
            with self.assertRaisesRegex(rilievo.InvalidArgument, said):
                self.surface.voxels(**arguments)

    def test_refusals_name_what_is_wrong(self):
        for level in (-1, self.surface.max_level + 3, 10**6):
            with self.assertRaisesRegex(rilievo.InvalidArgument, "level"):
                self.surface.mesh(level)
        with self.assertRaises(TypeError):
            self.surface.mesh(1.5)
        with self.assertRaisesRegex(rilievo.InvalidArgument, "not a .dss"):
            rilievo.Surface.from_bytes(b"ply\n")
        with self.assertRaises(rilievo.InvalidArgument):
            rilievo.Surface.from_bytes(b"")
        data = bytearray(self.surface.to_bytes())
        data[len(data) // 2] ^= 4
        with self.assertRaisesRegex(rilievo.DataLoss, "chunk"):
            rilievo.Surface.from_bytes(data)
        with tempfile.NamedTemporaryFile(suffix=".dss") as file:
            file.write(data)
            file.flush()
            with self.assertRaisesRegex(rilievo.DataLoss, file.name):
                rilievo.read(file.name)

    def test_reading_needs_no_grpc(self):
        code = ("import sys; sys.modules['grpc'] = None; import rilievo; "
                f"print(len(rilievo.read({str(GOLDEN)!r}).vertices(0)))")
        shown = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
        self.assertEqual(int(shown.stdout), self.surface.levels[0]["vertices"])

    def test_a_missing_library_is_explained(self):
        code = "import rilievo; rilievo.Surface.from_bytes(b'')"
        environment = dict(os.environ)
        del environment["RILIEVO_DECODER_LIBRARY"]
        environment["LD_LIBRARY_PATH"] = ""
        shown = subprocess.run([sys.executable, "-c", code], capture_output=True, env=environment)
        if b"InvalidArgument" in shown.stderr:
            self.skipTest("the decoder is installed on this system")
        self.assertIn(b"RILIEVO_DECODER_LIBRARY", shown.stderr)


if __name__ == "__main__":
    unittest.main()
