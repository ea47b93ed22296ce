"""Two solids in, a surface out, through the decoder library and a real rilievod."""
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

import rilievo


def box(low, high):
    """(vertices, faces) of an axis-aligned box."""
    vertices = np.array([[(low, high)[v >> axis & 1][axis] for axis in range(3)]
                         for v in range(8)], float)
    faces = np.array([[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
                      [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]])
    return vertices, faces


def volume(surface):
    corners = surface.vertices()[surface.faces()]
    return np.linalg.det(corners).sum() / 6


class CombineTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.private = rilievo.PrivateServer()
        cls.server = cls.private.__enter__()
        cls.block, cls.bar = box([0, 0, 0], [2, 2, 2]), box([.5, .5, -1], [1.5, 1.5, 3])
        cls.surface = cls.convert(cls.block)

    @classmethod
    def tearDownClass(cls):
        cls.private.__exit__(None, None, None)

    @classmethod
    def convert(cls, shape):
        """A surface of few triangles."""
        return rilievo.convert(*shape, unit="mm", up="z", control_faces=100, max_level=1,
                               server=cls.server)

    def combine(self, a, b, operation, **options):
        return rilievo.combine(a, b, operation, server=self.server, **options)

    def test_volumes_and_genus(self):
        for operation, expected, genus in (("union", 10, 0), ("intersection", 2, 0),
                                           ("difference", 6, 1)):
            with self.subTest(operation=operation):
                surface = self.combine(self.block, self.bar, operation, control_faces=400,
                                       max_level=1)
                self.assertAlmostEqual(volume(surface), expected, delta=2e-3 * expected)
                self.assertEqual(surface.report["genus"], genus)
                self.assertEqual(surface.report["components"], 1)

    def test_surfaces_give_the_bytes_of_the_command_line(self):
        bar = self.convert(self.bar)
        combined = self.combine(self.surface, bar, "difference", max_error="0.02%",
                                control_faces=400)
        self.assertEqual(combined.place, rilievo.Place(0.001, "z", None))
        with tempfile.TemporaryDirectory() as folder:
            paths = [str(pathlib.Path(folder) / name) for name in ("a.dss", "b.dss", "c.dss")]
            self.surface.write(paths[0])
            bar.write(paths[1])
            subprocess.run([os.environ["RILIEVO_PROGRAM"], "combine", *paths[:2], "--difference",
                            "-o", paths[2], "--max-error", "0.02%", "--control-faces", "400",
                            "--quiet"], check=True)
            self.assertEqual(rilievo.read(paths[2]).to_bytes(), combined.to_bytes())

    def test_places_must_agree_or_be_given(self):
        with self.assertRaisesRegex(rilievo.InvalidArgument, "of a it is 0.001, of b None") as caught:
            self.combine(self.surface, self.bar, "union")
        self.assertEqual(caught.exception.parameter, "unit")
        surface = self.combine(self.surface, self.bar, "union", unit="mm", up="z", control_faces=400,
                               max_level=1)
        self.assertEqual(surface.place, rilievo.Place(0.001, "z", None))

    def test_what_cannot_be_combined_is_refused(self):
        vertices, faces = self.block
        with self.assertRaisesRegex(rilievo.FailedPrecondition, "the first shape is open"):
            self.combine((vertices, faces[1:]), self.bar, "union")
        far = box([9, 9, 9], [10, 10, 10])
        with self.assertRaisesRegex(rilievo.FailedPrecondition, "nothing is left"):
            self.combine(self.block, far, "intersection")
        for parameter, a, b, operation, words in (
                ("operation", self.block, far, "xor", "'union', 'intersection', 'difference'"),
                ("a", vertices, far, "union", "pair"),
                ("b", far, (vertices, [[0, 1, 8]]), "union", "vertex 8, there are 8"),
                ("b", far, (vertices, [[0, 1, 1]]), "union", "three different places")):
            with self.subTest(words=words):
                with self.assertRaisesRegex(rilievo.InvalidArgument, words) as caught:
                    self.combine(a, b, operation)
                self.assertEqual(caught.exception.parameter, parameter)
        with self.assertRaisesRegex(TypeError, r"combine\(\).*'boundary'"):
            self.combine(self.block, far, "union", boundary="close")


if __name__ == "__main__":
    unittest.main()
