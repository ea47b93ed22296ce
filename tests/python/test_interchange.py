"""Surfaces as meshes of other libraries: those that are installed here."""
import importlib
import unittest
from unittest import mock

import numpy as np
from scans import GOLDEN

import rilievo


def installed(name):
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


class InterchangeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.plain = rilievo.read(GOLDEN)
        cls.colored = rilievo.read(GOLDEN.parent / "colored_torus_in_groups_v3.dss")

    def check(self, mesh, vertices, faces, normals, colors):
        np.testing.assert_array_equal(np.asarray(vertices), mesh.vertices)
        np.testing.assert_array_equal(np.asarray(faces), mesh.faces)
        np.testing.assert_allclose(np.asarray(normals), mesh.normals, atol=1e-6)
        self.assertEqual(colors is None, mesh.colors is None)
        if colors is not None:
            np.testing.assert_array_equal(np.asarray(colors), mesh.colors)

    @unittest.skipUnless(installed("open3d"), "Open3D is not installed")
    def test_open3d(self):
        for surface in (self.plain, self.colored):
            made, mesh = surface.to_open3d(1), surface.mesh(1)
            colors = np.round(255 * np.asarray(made.vertex_colors)) \
                if made.has_vertex_colors() else None
            self.check(mesh, made.vertices, made.triangles, made.vertex_normals, colors)
            self.assertEqual(len(surface.to_open3d().vertices), len(surface.vertices()))
        mesh, _ = self.plain.adaptive_mesh(triangles=100)
        self.assertEqual(len(mesh.to_open3d().triangles), len(mesh.faces))

    @unittest.skipUnless(installed("trimesh"), "trimesh is not installed")
    def test_trimesh(self):
        for surface in (self.plain, self.colored):
            made = surface.to_trimesh(1)
            self.assertTrue(made.vertices.flags.writeable)
            colors = made.visual.vertex_colors[:, :3] if made.visual.kind == "vertex" else None
            self.check(surface.mesh(1), made.vertices, made.faces, made.vertex_normals, colors)

    @unittest.skipUnless(installed("pyvista"), "PyVista is not installed")
    def test_pyvista(self):
        for surface in (self.plain, self.colored):
            made = surface.to_pyvista(1)
            faces = made.faces.reshape(-1, 4)
            self.assertEqual(set(faces[:, 0]), {3})
            data = made.point_data
            self.check(surface.mesh(1), made.points, faces[:, 1:], data["Normals"],
                       data["colors"] if "colors" in data else None)
            np.testing.assert_array_equal(data["flags"], surface.flags(1))

    def test_what_is_missing_is_named_with_the_remedy(self):
        for name in ("open3d", "trimesh", "pyvista"):
            # None: an import of it fails as where it is not installed.
            with mock.patch.dict("sys.modules", {name: None}), \
                    self.assertRaisesRegex(ImportError, f"pip install {name}"):
                getattr(self.plain, f"to_{name}")()


if __name__ == "__main__":
    unittest.main()
