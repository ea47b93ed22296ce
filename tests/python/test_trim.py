"""A surface cut along a shape, through the decoder library and a real rilievod."""
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

import rilievo
from test_combine import box, volume


class TrimTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.private = rilievo.PrivateServer()
        cls.server = cls.private.__enter__()
        cls.block = box([0, 0, 0], [2, 2, 2])

    @classmethod
    def tearDownClass(cls):
        cls.private.__exit__(None, None, None)

    def trim(self, shape, **arguments):
        return rilievo.trim(shape, server=self.server, control_faces=200, max_level=2, **arguments)

    def test_shapes_and_sides(self):
        square = np.array([[.5, .5, 9], [1.5, .5, 9], [1.5, 1.5, 9], [.5, 1.5, 9]])
        for shape, inside in (({"plane": [0, 0, 3, 3]}, 4),
                              ({"box": [3, 1, 1, 1, -1, -1]}, 1),
                              ({"polyline": (square, [0, 0, 1])}, 2)):
            for keep, expected in (("inside", inside), ("outside", 8 - inside)):
                with self.subTest(shape=shape, keep=keep):
                    surface = self.trim(self.block, keep=keep, cap=True, **shape)
                    self.assertAlmostEqual(volume(surface), expected, delta=4e-3 * expected)

    def test_open_along_the_shape_with_the_bytes_of_the_command_line(self):
        surface = rilievo.convert(*self.block, unit="mm", up="z", control_faces=100, max_level=1,
                                  server=self.server)
        half = self.trim(surface, plane=[0, 0, 1, 1], keep="outside")
        self.assertEqual(half.place, rilievo.Place(0.001, "z", None))
        self.assertEqual(half.report["boundary_loops"], 1)
        self.assertEqual(half.report["components"], 1)
        with tempfile.TemporaryDirectory() as folder:
            paths = [str(pathlib.Path(folder) / name) for name in ("a.dss", "b.dss")]
            surface.write(paths[0])
            subprocess.run([os.environ["RILIEVO_PROGRAM"], "trim", paths[0], "--plane", "z=1",
                            "--keep", "outside", "-o", paths[1], "--control-faces", "200",
                            "--max-level", "2", "--quiet"], check=True)
            self.assertEqual(rilievo.read(paths[1]).to_bytes(), half.to_bytes())

    def test_what_is_no_shape_is_refused(self):
        for parameter, words, arguments in (
                ("keep", "'below' is not one of", {"keep": "below", "plane": [0, 0, 1, 1]}),
                ("plane", "nothing given; give one of", {"keep": "inside"}),
                ("plane", "plane, box given", {"keep": "inside", "plane": [0, 0, 1, 1],
                                               "box": [0, 0, 0, 1, 1, 1]}),
                ("sphere", "3 numbers; 4 are needed", {"keep": "inside", "sphere": [0, 0, 1]}),
                ("polyline", "a pair", {"keep": "inside", "polyline": 7})):
            with self.subTest(words=words):
                with self.assertRaisesRegex(rilievo.InvalidArgument, words) as caught:
                    self.trim(self.block, **arguments)
                self.assertEqual(caught.exception.parameter, parameter)
        with self.assertRaisesRegex(rilievo.InvalidArgument, "radius"):
            self.trim(self.block, keep="inside", sphere=[0, 0, 0, -1])
        with self.assertRaisesRegex(rilievo.FailedPrecondition, "nothing is left"):
            self.trim(self.block, keep="outside", box=[-1, -1, -1, 3, 3, 3])


if __name__ == "__main__":
    unittest.main()
