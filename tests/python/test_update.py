"""A surface brought up to date by a new scan."""
import tempfile
import unittest
from unittest import mock

import numpy as np

import rilievo
from rilievo.jobs import jobs_pb2


def ball(count, seed, bump=0.0):
    """Points of a unit sphere, with a bump of this height around (1, 0, 0)."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    away = np.linalg.norm(points - [1, 0, 0], axis=1) / 0.4
    return points * (1 + bump * np.where(away < 1, (1 - away ** 2) ** 2, 0))[:, None]


class UpdateTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.surface = rilievo.reconstruct(ball(6000, 1))

    def test_what_changed_stands_behind_the_bytes_that_were_there(self):
        changed = ball(6000, 2, bump=0.05)
        part = changed[changed[:, 0] > 0.5]
        updated = rilievo.update(self.surface, part)
        before, after = self.surface.to_bytes(), updated.to_bytes()
        self.assertEqual(after[:len(before)], before)
        self.assertGreater(len(after), len(before))
        self.assertAlmostEqual(updated.vertices()[:, 0].max(), 1.05, delta=2e-3)
        self.assertAlmostEqual(updated.vertices()[:, 0].min(), -1, delta=2e-3)
        self.assertIsNone(self.surface.height_changes)
        changes = updated.height_changes
        self.assertAlmostEqual(changes.max() * updated.frame.diagonal, .05, delta=3e-3)
        np.testing.assert_allclose(self.surface.heights + changes, updated.heights, atol=1e-7)
        report = updated.report["update"]
        self.assertEqual(report["update_bytes"], len(after) - len(before))
        self.assertLess(report["points_to_surface"]["rms"],
                        report["points_to_surface_before"]["rms"] / 5)
        with tempfile.TemporaryDirectory() as store, \
                rilievo.PrivateServer(["--store", store]) as server, rilievo.Jobs(server) as jobs:
            job = jobs.update(self.surface, part)
            with mock.patch.object(jobs_pb2, "StreamSurfaceRequest",
                                   wraps=jobs_pb2.StreamSurfaceRequest) as asked:
                self.assertEqual(job.fetch().to_bytes(), after)
            self.assertEqual(asked.call_args.kwargs["offset"], len(before))
            self.assertEqual(jobs.get(job.job_id).fetch().to_bytes(), after)

    def test_a_scan_that_agrees_changes_nothing(self):
        same = rilievo.update(self.surface, ball(4000, 3), whole=True)
        self.assertEqual(same.to_bytes(), self.surface.to_bytes())

    def test_a_surface_of_which_a_part_was_read(self):
        changed = ball(6000, 2, bump=0.05)
        coarse = rilievo.Surface.from_bytes(self.surface.to_bytes(), max_level=0)
        self.assertEqual(rilievo.update(coarse, changed, threads=1).to_bytes(),
                         rilievo.update(self.surface, changed).to_bytes())

    def test_what_does_not_fit_is_refused(self):
        with self.assertRaisesRegex(rilievo.InvalidArgument, "shape"):
            rilievo.update(self.surface, np.zeros((4, 2)))
        with self.assertRaisesRegex(rilievo.FailedPrecondition, "rilievo align"):
            rilievo.update(self.surface, ball(1000, 4) + 9)


if __name__ == "__main__":
    unittest.main()
