"""The example for ROS: messages of sensor_msgs as arrays, and a surface of one."""
import pathlib
import sys
import tempfile
import types
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples" / "ros"))
import surface_of_cloud  # noqa: E402

import rilievo  # noqa: E402

try:
    from sensor_msgs.msg import PointCloud2, PointField
except ImportError:  # Debian's python3-sensor-msgs; the layout is the documented one
    PointCloud2 = PointField = types.SimpleNamespace

FLOAT32, UINT16 = 7, 4


def message(points, colors, order="<", padding=8, width=100,
            nanoseconds=0):
    """Rows of `width` points with a field each of rgb and ring, and bytes that are no field."""
    record = np.dtype({"names": ["x", "y", "z", "rgb", "ring"], "offsets": [0, 4, 8, 16, 20],
                       "formats": [order + "f4"] * 3 + [order + "u4", order + "u2"],
                       "itemsize": 24})
    rows = np.zeros((len(points) // width, width), record)
    for axis, values in zip("xyz", np.asarray(points).T):
        rows[axis] = values.reshape(rows.shape)
    red, green, blue = np.asarray(colors, np.uint32).T
    rows["rgb"] = (red << 16 | green << 8 | blue).reshape(rows.shape)
    rows["ring"] = 40000
    data = b"".join(row.tobytes() + padding * b"\xff" for row in rows)
    fields = [PointField(name=name, offset=record.fields[name][1], count=1, datatype=kind)
              for name, kind in (("x", FLOAT32), ("y", FLOAT32), ("z", FLOAT32), ("rgb", FLOAT32),
                                 ("ring", UINT16))]
    cloud = PointCloud2(height=len(rows), width=width, fields=fields, is_bigendian=order == ">",
                        point_step=24, row_step=24 * width + padding, data=data)
    cloud.header = types.SimpleNamespace(stamp=types.SimpleNamespace(sec=7, nanosec=nanoseconds))
    return cloud


class RosTest(unittest.TestCase):
    def setUp(self):
        random = np.random.default_rng(3)
        points = random.normal(size=(2000, 3))
        self.points = (points / np.linalg.norm(points, axis=1)[:, None]).astype(np.float32)
        self.colors = random.integers(0, 256, size=(2000, 3), dtype=np.uint8)

    def test_fields_of_both_byte_orders(self):
        for order in "<>":
            got = surface_of_cloud.points_of(message(self.points, self.colors, order))
            np.testing.assert_array_equal(np.stack([got[axis] for axis in "xyz"], 1), self.points)
            np.testing.assert_array_equal(
                np.stack([got[name] for name in ("red", "green", "blue")], 1), self.colors)
            self.assertEqual(set(got["ring"]), {40000})

    def test_an_unknown_type_is_named(self):
        cloud = message(self.points, self.colors)
        cloud.fields[1].datatype = 9
        with self.assertRaisesRegex(ValueError, "field y: datatype 9"):
            surface_of_cloud.points_of(cloud)

    def test_surface(self):
        self.points[::50] = np.nan  # no return
        with tempfile.TemporaryDirectory() as folder:
            path = surface_of_cloud.write_surface(message(self.points, self.colors), folder)
            self.assertEqual(path.name, "cloud_7_000000000.dss")
            before = path.read_bytes()
            later = surface_of_cloud.write_surface(
                message(self.points[:1000], self.colors[:1000], nanoseconds=40_000_000), folder)
            self.assertEqual(later.name, "cloud_7_040000000.dss")
            with self.assertRaisesRegex(FileExistsError, "cloud_7_000000000.dss is there already"):
                surface_of_cloud.write_surface(message(self.points, self.colors), folder)
            self.assertEqual(path.read_bytes(), before)
            surface = rilievo.read(path)
        self.assertLess(abs(np.linalg.norm(surface.vertices(), axis=1) - 1).mean(), 0.02)
        self.assertIsNotNone(surface.colors)
        self.assertEqual(surface.place.up, "z")


if __name__ == "__main__":
    unittest.main()
