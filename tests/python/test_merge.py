"""Several scans as one, beside what `rilievo reconstruct --merge` makes of their files."""
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
from scans import program, sphere

import rilievo

NAMES = ("x", "y", "z", "sensor_x", "sensor_y", "sensor_z", "red", "green", "blue")


COLORS = ("red", "green", "blue")


def structured(columns, names):
    array = np.empty(len(columns), [(name, "u1" if name in COLORS else "<f8") for name in names])
    for i, name in enumerate(names):
        array[name] = columns[:, i]
    return array


class MergeTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name: str, scan) -> str:
        """A text file with a heading."""
        path = self.folder / name
        names = scan.dtype.names
        with open(path, "w") as file:
            file.write(",".join(names) + "\n")
            for row in scan.tolist():
                file.write(",".join(str(int(value)) if field in COLORS
                                    else repr(float(value)) for field, value in zip(names, row)) + "\n")
        return str(path)

    def test_the_surface_is_that_of_the_merged_files(self):
        points = sphere(4000)
        seen = [points[points[:, 0] > 0.9], points[points[:, 0] < 1.1]]
        sensors = [(9, 2, 3), (-7, 2, 3)]
        scans = [structured(np.column_stack([part, np.tile(sensor, (len(part), 1)),
                                             np.tile((200, 10 * i, 30), (len(part), 1))]), NAMES)
                 for i, (part, sensor) in enumerate(zip(seen, sensors))]
        surface = rilievo.reconstruct(rilievo.merge(scans))
        paths = [self.write(f"{i}.csv", scan) for i, scan in enumerate(scans)]
        subprocess.run([program("RILIEVO_PROGRAM"), "reconstruct", *paths, "--merge", "-o",
                        str(self.folder / "s.dss"), "--quiet"], check=True)
        self.assertEqual(surface.to_bytes(), (self.folder / "s.dss").read_bytes())
        self.assertEqual(surface.report["stations"]["used"], True)
        # The same with the places of the sensors beside the scans.
        bare = [scan[["x", "y", "z", "red", "green", "blue"]] for scan in scans]
        np.testing.assert_array_equal(rilievo.merge(bare, sensors=sensors), rilievo.merge(scans))

    def test_what_some_scans_have(self):
        plain = sphere(5)
        with_normals = structured(np.column_stack([sphere(3), np.ones((3, 3))]),
                                  ("x", "y", "z", "nx", "ny", "nz"))
        colored = structured(np.column_stack([sphere(2), np.zeros((2, 3))]),
                             ("x", "y", "z", "red", "green", "blue"))
        merged = rilievo.merge([plain, with_normals, colored], sensors=[None, (1, 2, 3), None])
        self.assertEqual(merged.dtype.names,
                         ("x", "y", "z", "sensor_x", "sensor_y", "sensor_z", "nx", "ny", "nz"))
        np.testing.assert_array_equal(np.isfinite(merged["nx"]), [0] * 5 + [1] * 3 + [0] * 2)
        np.testing.assert_array_equal(np.isfinite(merged["sensor_y"]), [0] * 5 + [1] * 3 + [0] * 2)
        np.testing.assert_array_equal(merged["x"][:5], plain[:, 0])
        self.assertEqual(rilievo.merge([plain]).dtype.names, ("x", "y", "z"))

    def test_refusals(self):
        plain = sphere(5)
        for scans, sensors, part in (([], None, "scans: there are none"),
                                     ([plain], [], "0 for 1 scans"),
                                     ([plain, plain[:, :2]], None, r"scans\[1\]: the shape"),
                                     ([plain], [np.zeros((4, 3))], r"sensors\[0\]: 4 rows for 5")):
            with self.assertRaisesRegex(rilievo.InvalidArgument, part):
                rilievo.merge(scans, sensors=sensors)


if __name__ == "__main__":
    unittest.main()
