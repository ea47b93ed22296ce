"""Meshes refined by the decoder library."""
import unittest

import numpy as np

import rilievo

CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
QUADS = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7],
                  [2, 0, 4, 6]])
TRIANGLES = np.concatenate([QUADS[:, :3], QUADS[:, [0, 2, 3]]])


class SubdivideTest(unittest.TestCase):
    def test_quads(self):
        vertices, faces = rilievo.subdivide(CUBE, QUADS, "catmull-clark", 2)
        self.assertEqual(faces.shape, (96, 4))
        self.assertEqual(len(vertices), 98)
        # The rule of a vertex: (Q + 2 R) / 3 here, since v weighs nothing at valence 3.
        np.testing.assert_allclose(rilievo.subdivide(CUBE, QUADS, "catmull-clark")[0][0],
                                   [2 / 9] * 3, atol=1e-15)
        vertices, faces = rilievo.subdivide(CUBE, QUADS, "doo-sabin")
        self.assertEqual(sorted({len(face) for face in faces}), [3, 4])
        self.assertEqual(len(faces), 26)

    def test_triangles(self):
        for scheme, growth in (("loop", 4), ("butterfly", 4), ("sqrt3", 3)):
            vertices, faces = rilievo.subdivide(CUBE, TRIANGLES, scheme, 3)
            self.assertEqual(faces.shape, (12 * growth ** 3, 3))
            self.assertEqual(len(vertices) - len(faces) / 2, 2)
        np.testing.assert_array_equal(rilievo.subdivide(CUBE, TRIANGLES, "butterfly", 2)[0][:8],
                                      CUBE)

    def test_what_cannot_be_subdivided_is_refused(self):
        for words, arguments in (
                ("triangles alone", (CUBE, QUADS, "loop")), ("must be loop", (CUBE, QUADS, "x")),
                (r"\[0, 8\]", (CUBE, QUADS, "doo-sabin", 9)),
                ("two faces", (CUBE, np.concatenate([QUADS, QUADS[:1]]), "doo-sabin")),
                ("no faces", (CUBE, [], "doo-sabin")),
                ("0 to 7", (CUBE, [[0, 1, 8]], "loop")),
                ("has 2 corners", (CUBE, [[0, 1]], "doo-sabin")),
                (r"\(n, 3\)", (CUBE[:, :2], QUADS, "doo-sabin"))):
            with self.subTest(words=words):
                with self.assertRaisesRegex(rilievo.InvalidArgument, words):
                    rilievo.subdivide(*arguments)


class InterpolateTest(unittest.TestCase):
    def test_surface_passes_through_the_vertices(self):
        cage = rilievo.interpolate(CUBE, TRIANGLES)
        self.assertEqual(cage.faces.shape, (48, 3))
        # Many steps of subdivision bring the first vertices to their limits.
        vertices, _ = rilievo.subdivide(cage.vertices, cage.faces, "loop", 8)
        np.testing.assert_allclose(vertices[:8], CUBE, atol=1e-3)

    def test_what_cannot_be_interpolated_is_refused(self):
        for words, faces in (("triangles alone", QUADS), ("0 to 7", [[0, 1, 8]]),
                             ("face", TRIANGLES[[0, 0, 1]])):
            with self.subTest(words=words):
                with self.assertRaisesRegex(rilievo.InvalidArgument, words):
                    rilievo.interpolate(CUBE, faces)


if __name__ == "__main__":
    unittest.main()
