"""Surfaces with another cage: in memory by the decoder library, as files by `rilievo deform`."""
import os
import pickle
import subprocess
import tempfile
import unittest
from unittest import mock

import numpy as np
from scans import GOLDEN, program

import rilievo

GROUPED = GOLDEN.with_name("colored_torus_in_groups_v3.dss")
QUADS = GOLDEN.with_name("quad_torus_v5.dss")
ANGLE = 0.7
TURN = np.array([[np.cos(ANGLE), -np.sin(ANGLE), 0], [np.sin(ANGLE), np.cos(ANGLE), 0], [0, 0, 1]])


def read_obj(text):
    """Its lines without comments, their numbers read."""
    words = [line.split() for line in text.splitlines() if line[:1] != "#"]
    return [[word if word[0] in "fvt" or "/" in word or word.isalpha() else float(word)
             for word in line] for line in words if line]


class CageTest(unittest.TestCase):
    def setUp(self):
        self.surface = rilievo.read(GROUPED)
        self.cage = self.surface.control_mesh
        self.diagonal = self.surface.frame.diagonal

    def bent(self):
        """The control points, bent about an axis beside them."""
        points = self.cage.vertices - self.surface.frame.center
        angle, radius = points[:, 0] / self.diagonal, self.diagonal + points[:, 2]
        return np.stack([radius * np.sin(angle), points[:, 1], radius * np.cos(angle)], axis=1)

    def test_the_same_cage_gives_the_same_mesh_and_bytes(self):
        same = self.surface.with_cage(self.cage.vertices)
        np.testing.assert_allclose(same.vertices(), self.surface.vertices(), atol=1e-12 * self.diagonal)
        np.testing.assert_array_equal(same.colors, self.surface.colors)
        np.testing.assert_array_equal(same.heights, self.surface.heights)
        self.assertEqual(same.to_bytes(), self.surface.to_bytes())

    def test_a_rigid_motion_moves_every_level(self):
        moved = self.surface.with_cage(self.cage.vertices @ TURN.T + [50, -20, 3])
        for level in range(self.surface.max_level + 2):
            apart = moved.vertices(level) - (self.surface.vertices(level) @ TURN.T + [50, -20, 3])
            # Coordinates of some 5e6, to 52 binary digits.
            self.assertLess(np.linalg.norm(apart, axis=1).max(), 1e-10 * self.diagonal)
        self.assertIsNone(moved.error)
        self.assertIsNone(moved.report)
        self.assertEqual(moved.place, self.surface.place)

    def test_the_file_has_the_surface_that_was_seen(self):
        moved = self.surface.with_cage(self.bent())
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "moved.dss")
            moved.write(path)
            again = rilievo.read(path)
        apart = np.linalg.norm(again.vertices() - moved.vertices(), axis=1)
        self.assertLess(apart.max(), 2e-7 * self.diagonal)
        np.testing.assert_array_equal(again.heights, self.surface.heights)
        self.assertLess(len(again.to_bytes()) - len(self.surface.to_bytes()), 8 * len(self.cage.vertices))

    def test_tags_are_taken_kept_and_taken_away(self):
        edge = self.cage.faces[:1, :2]
        sharp = self.surface.with_cage(self.cage.vertices, creases=edge, sharpness=2.5,
                                       corners=[int(edge[0, 0])])
        control = sharp.control_mesh
        np.testing.assert_array_equal(control.creases, np.sort(edge))
        self.assertEqual((control.sharpness, control.corners), (2.5, edge[0, 0]))
        self.assertGreater(np.abs(sharp.vertices() - self.surface.vertices()).max(), 0)
        kept = sharp.with_cage(self.cage.vertices, sharpness=3)
        self.assertEqual(kept.control_mesh.sharpness, 3)
        np.testing.assert_array_equal(
            rilievo.Surface.from_bytes(kept.to_bytes()).control_mesh.creases, np.sort(edge))
        smooth = kept.with_cage(self.cage.vertices, creases=[], corners=[])
        self.assertEqual(smooth.to_bytes(), self.surface.to_bytes())
        self.assertTrue(smooth.control_mesh.to_obj().endswith("\nt crease 0/1/0 10\n"))

    def test_pickles_and_outlives_what_it_comes_from(self):
        moved = self.surface.with_cage(self.bent())
        expected = np.array(moved.vertices())
        del self.surface
        np.testing.assert_array_equal(moved.vertices(1), moved.mesh(1).vertices)
        again = pickle.loads(pickle.dumps(moved))
        np.testing.assert_allclose(again.vertices(), expected, atol=1e-12 * self.diagonal)

    def test_what_is_no_cage_of_it_is_refused(self):
        points = np.array(self.cage.vertices)
        spoiled = points.copy()
        spoiled[5, 1] = np.nan
        for words, arguments in (
                ("shape", {"vertices": points[1:]}), ("vertex 5 .* not finite", {"vertices": spoiled}),
                ("not an edge", {"vertices": points, "creases": [[0, len(points) - 1]]}),
                ("whole numbers", {"vertices": points, "creases": [[0.5, 1]]}),
                ("must be positive", {"vertices": points, "creases": self.cage.faces[:1, :2],
                                      "sharpness": 0}),
                ("one for each of 1", {"vertices": points, "creases": self.cage.faces[:1, :2],
                                       "sharpness": [1, 2]}),
                ("corner", {"vertices": points, "corners": [len(points)]})):
            with self.subTest(words=words), self.assertRaisesRegex(rilievo.InvalidArgument, words):
                self.surface.with_cage(**arguments)

    def test_a_file_that_the_program_refuses(self):
        moved = self.surface.with_cage(self.bent())
        moved._file = moved._file[:100]
        with self.assertRaises(rilievo.RilievoError) as caught:
            moved.to_bytes()
        self.assertEqual(str(caught.exception).count("rilievo deform: "), 1, caught.exception)

    def test_a_control_mesh_of_lists(self):
        lists = {name: value.tolist() for name, value in vars(self.cage).items()}
        self.assertEqual(rilievo.ControlMesh(**lists).to_obj(), self.cage.to_obj())
        bare = rilievo.ControlMesh(lists["vertices"], lists["faces"], [], [], [])
        self.assertEqual([bare.creases.shape, bare.sharpness.shape, bare.corners.shape],
                         [(0, 2), (0,), (0,)])
        for name, value, words in (
                ("vertices", [[0, 1]], r"vertices has the shape \(1, 2\)"),
                ("vertices", [["a", "b", "c"]], "vertices .* must be numbers"),
                ("faces", [[0, 1, 2], [0, 1]], "faces has rows of different lengths"),
                ("faces", [[0.5, 1, 2]], "faces .* must be whole numbers"),
                ("creases", [[-1, 2]], "creases holds -1"), ("creases", None, "creases"),
                ("sharpness", 2.5, r"sharpness .* \(n,\)"), ("corners", [0.5], "corners")):
            with self.subTest(name=name, value=value), \
                    self.assertRaisesRegex(rilievo.InvalidArgument, words):
                rilievo.ControlMesh(**{**lists, name: value})

    def test_quads_are_written_as_the_program_writes_them(self):
        dss = QUADS.read_bytes()
        moved = rilievo.read(QUADS)
        sharp = moved.with_cage(moved.control_mesh.vertices, creases=moved.control_mesh.creases[:0],
                                corners=[3])
        for surface in (moved, sharp):
            cage = surface.control_mesh
            written = subprocess.run(
                [program("RILIEVO_PROGRAM"), "export", "-", "-", "--format", "obj", "--cage"],
                input=surface.to_bytes(), capture_output=True, check=True).stdout.decode()
            self.assertEqual(read_obj(cage.to_obj()), read_obj(written))
            self.assertEqual(cage.to_obj().count("\nf "), len(cage.diagonals))
        self.assertEqual(moved.with_cage(moved.control_mesh.vertices).to_bytes(), dss)
        with self.assertRaisesRegex(rilievo.InvalidArgument, "pair up all faces"):
            cage = moved.control_mesh
            rilievo.ControlMesh(cage.vertices, cage.faces, [], [], [], cage.diagonals[1:]).to_obj()

    def test_without_the_program_meshes_are_made_all_the_same(self):
        moved = self.surface.with_cage(self.bent())
        with mock.patch.dict(os.environ, {"RILIEVO_PROGRAM": "/nowhere/rilievo"}):
            self.assertGreater(len(moved.faces()), 0)
            with self.assertRaisesRegex(rilievo.Unavailable, "/nowhere/rilievo cannot be started"):
                moved.to_bytes()


if __name__ == "__main__":
    unittest.main()
