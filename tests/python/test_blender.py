"""The Blender add-on, in a Blender without a window where one is installed."""
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from scans import program

ROOT = pathlib.Path(__file__).parent.parent.parent
CREASED = ROOT / "tests" / "golden" / "bent_torus_in_groups_v4.dss"


class BlenderTest(unittest.TestCase):
    def test_a_round_trip_is_exact_and_edits_arrive(self):
        blender = shutil.which("blender")
        if blender is None:
            self.skipTest("blender is not installed")
        self.assertTrue(program("RILIEVO_PROGRAM"))
        with tempfile.TemporaryDirectory() as folder:
            ended = subprocess.run(
                [blender, "--background", "--factory-startup", "--python-use-system-env",
                 "--python-exit-code", "1", "--python",
                 str(pathlib.Path(__file__).with_name("in_blender.py")), "--",
                 str(ROOT / "client" / "blender"), str(CREASED), folder],
                capture_output=True, text=True, check=False)
        self.assertIn("ALL IS SO", ended.stdout, ended.stdout[-2000:] + ended.stderr[-4000:])
        self.assertEqual(ended.returncode, 0)


if __name__ == "__main__":
    unittest.main()
