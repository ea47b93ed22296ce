"""A mesh in, surface out, through a real rilievod."""
import unittest

import numpy as np

import rilievo
from rilievo.connection import parameter_of
from rilievo.scan import pack_mesh


def torus(around: int, across: int):
    """Of radii 2 and 0.7 about (1, 2, 3)."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    u, v = 2 * np.pi * i / around, 2 * np.pi * j / across
    ring = 2 + 0.7 * np.cos(v)
    vertices = np.column_stack([ring * np.cos(u), ring * np.sin(u), 0.7 * np.sin(v)]) + [1, 2, 3]

    def at(di, dj):
        return (i + di) % around * across + (j + dj) % across

    faces = np.vstack([np.column_stack([at(0, 0), at(1, 0), at(1, 1)]),
                       np.column_stack([at(0, 0), at(1, 1), at(0, 1)])])
    return vertices, faces


def distances_to_torus(points):
    x, y, z = (points - [1, 2, 3]).T
    return np.abs(np.hypot(np.hypot(x, y) - 2, z) - 0.7)


class WithServer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.private = rilievo.PrivateServer()
        cls.server = cls.private.__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.private.__exit__(None, None, None)


class ConvertTest(WithServer):
    def test_a_torus_keeps_its_hole(self):
        vertices, faces = torus(80, 40)
        stages = []
        surface = rilievo.convert(vertices, faces, server=self.server, control_faces=600, max_level=2,
                                  progress=lambda event: stages.append(event.stage))
        self.assertEqual(surface.report["genus"], 1)
        self.assertEqual(surface.report["boundary_loops"], 0)
        self.assertEqual(surface.report["road"], "mesh")
        self.assertEqual(surface.report["mesh"]["triangles"], 6400)
        self.assertEqual(surface.report["mesh"]["triangles_used"], 6400)
        self.assertEqual(len(surface.vertices()) - len(surface.faces()) // 2, 0)
        self.assertLess(distances_to_torus(surface.vertices()).max(), 0.01)
        self.assertIn("encode", stages)

    def test_an_open_mesh_stays_open(self):
        vertices, faces = torus(80, 40)
        half = faces[(vertices[faces][:, :, 2] >= 3 - 1e-9).all(axis=1)]
        surface = rilievo.convert(vertices, half, server=self.server, control_faces=600, max_level=1,
                                  boundary="exact")
        self.assertEqual(surface.report["boundary_loops"], 2)
        diagonal = np.linalg.norm(np.ptp(vertices[half.ravel()], axis=0))
        self.assertLess(abs(surface.vertices()[:, 2].min() - 3), 1e-5 * diagonal)
        self.assertEqual(surface.report["genus"], 0)

    def test_the_same_mesh_from_any_array(self):
        vertices, faces = torus(12, 8)
        few = {"control_faces": 100, "max_level": 1, "server": self.server}
        vertices = vertices.astype(np.float32)
        structured = np.zeros(len(vertices), [("x", "f4"), ("y", "f4"), ("z", "f4")])
        for i, axis in enumerate("xyz"):
            structured[axis] = vertices[:, i]
        first = rilievo.convert(vertices, faces, **few).to_bytes()
        for some, others in ((vertices.tolist(), faces.tolist()), (structured, faces),
                             (vertices.astype(float), faces.astype(np.uint16)),
                             (np.asfortranarray(vertices), np.asfortranarray(faces))):
            again = rilievo.convert(some, others, **few)
            self.assertEqual(again.to_bytes(), first)

    def test_options_and_colors_arrive(self):
        vertices, faces = torus(60, 30)
        colors = np.tile(np.array([200, 100, 50], np.uint8), (len(vertices), 1))
        surface = rilievo.convert(vertices, faces, vertex_colors=colors, server=self.server,
                                  max_error=1e-3, max_level=2, unit="mm", up="z", creases="off",
                                  seed=3)
        self.assertEqual(surface.place, rilievo.Place(0.001, "z", None))
        self.assertLess(surface.certificate.scan_to_surface.rms, 1e-3)
        self.assertTrue(surface.report["max_error_kept"])
        self.assertTrue((np.abs(surface.colors.astype(int) - [200, 100, 50]) < 8).all())

    def test_quads(self):
        few = {"control_faces": 200, "max_level": 2, "server": self.server}
        quads = rilievo.convert(*torus(60, 30), scheme="catmull-clark", **few)
        self.assertEqual(quads.info["control"]["scheme"], "catmull-clark")
        cage = quads.control_mesh
        self.assertEqual(cage.diagonals.shape, (len(cage.faces) // 2, 2))
        halves = [set(face.tolist()) for face in cage.faces]
        for a, b in cage.diagonals.tolist():
            self.assertEqual(sum({a, b} <= half for half in halves), 2)
        with self.assertRaisesRegex(rilievo.InvalidArgument, "quads"):
            rilievo.reconstruct(cage.vertices, control_mesh=cage)
        self.assertEqual(quads.info["format_version"], 5)
        self.assertLess(quads.certificate.scan_to_surface.rms, 1e-3)
        triangles = rilievo.convert(*torus(60, 30), scheme="loop", **few)
        self.assertEqual(triangles.to_bytes(), rilievo.convert(*torus(60, 30), **few).to_bytes())
        self.assertEqual(triangles.info["control"]["scheme"], "loop")
        self.assertEqual(triangles.control_mesh.diagonals.shape, (0, 2))

    def test_levels_arrive_one_by_one(self):
        levels = []
        rilievo.convert(*torus(60, 30), server=self.server, control_faces=200,
                        layer=lambda part: levels.append(part.max_level))
        self.assertEqual(levels, list(range(levels[-1] + 1)))


class RefusalTest(WithServer):
    def test_what_is_no_mesh_is_refused_before_anything_is_sent(self):
        vertices, faces = torus(10, 5)
        cases = [
            ("faces", vertices, [[0, 1, 50]], "vertex 50, there are 50, counted from 0"),
            ("faces", vertices, [[0, -1, 2]], "vertex -1"),
            ("faces", vertices, [[0, 1, 2, 3]], "split polygons into triangles"),
            ("faces", vertices, [[0, 1, 2], [0, 1, 2, 3]], "split polygons into triangles"),
            ("faces", vertices, [[0.0, 1.0, 2.0]], "integers"), ("faces", vertices, [], "none"),
            ("faces", vertices, faces.ravel(), r"\(m, 3\)"),
            ("vertices", vertices[:, :2], faces, r"\(n, 3\)"), ("vertices", "abc", faces, "numbers"),
            ("vertex_colors", vertices, faces, "shape")]
        for parameter, points, corners, words in cases:
            with self.subTest(parameter=parameter, words=words):
                with self.assertRaisesRegex(rilievo.InvalidArgument, words) as caught:
                    rilievo.convert(points, corners, server="127.0.0.1:1",
                                    vertex_colors=[1] if parameter == "vertex_colors" else None)
                self.assertEqual(caught.exception.parameter, parameter)
        with self.assertRaisesRegex(TypeError, r"convert\(\).*'topology'"):
            rilievo.convert(vertices, faces, topology="planar")

    def test_the_server_names_the_argument(self):
        vertices, faces = torus(10, 5)
        with self.assertRaises(rilievo.InvalidArgument) as caught:
            rilievo.convert(vertices[:2], [[0, 1, 1]], server=self.server)
        self.assertEqual(caught.exception.parameter, "vertices")
        with self.assertRaises(rilievo.InvalidArgument) as caught:
            rilievo.convert(np.zeros((50, 3)), faces, server=self.server)
        self.assertEqual(caught.exception.parameter, "faces")
        self.assertTrue(str(caught.exception).startswith("faces: "))
        with self.assertRaises(rilievo.InvalidArgument) as caught:
            rilievo.convert(vertices, faces, server=self.server, max_level=9)
        self.assertEqual(caught.exception.parameter, "max_level")

    def test_limits_of_a_server(self):
        with rilievo.PrivateServer(["--max-points", "50"]) as small:
            with self.assertRaises(rilievo.LimitExceeded) as caught:
                rilievo.convert(*torus(10, 6), server=small)
            self.assertEqual(caught.exception.parameter, "vertices")
            vertices, faces = torus(10, 5)
            with self.assertRaises(rilievo.LimitExceeded) as caught:
                rilievo.convert(vertices, np.vstack([faces, faces[:1]]), server=small)
            self.assertEqual(caught.exception.parameter, "faces")

    def test_paths_of_the_protocol_become_arguments(self):
        for field in ("header.triangle_count", "triangles", "triangles.data"):
            self.assertEqual(parameter_of(field), "faces")
        self.assertEqual(parameter_of("points.data"), "points")

    def test_triangles_travel_after_the_points_in_whole_ones(self):
        vertices, faces = torus(200, 200)
        packed = pack_mesh(vertices, faces)
        pieces = list(packed.triangle_pieces())
        self.assertGreater(len(pieces), 1)
        self.assertTrue(all(len(piece) % 12 == 0 for piece in pieces))
        self.assertEqual(b"".join(pieces), faces.astype("<u4").tobytes())
        header = packed.header(None)
        self.assertEqual((header.point_count, header.triangle_count), (40_000, 80_000))


if __name__ == "__main__":
    unittest.main()
