"""Kept jobs."""
import tempfile
import threading
import unittest

from scans import sheet, sphere
from test_convert import torus

import rilievo
from rilievo.connection import error_of_status
from rilievo.google_rpc import error_details_pb2, status_pb2


class JobsTest(unittest.TestCase):
    def setUp(self):
        store = tempfile.TemporaryDirectory()
        self.addCleanup(store.cleanup)
        private = rilievo.PrivateServer(["--store", store.name])
        self.server = private.__enter__()
        self.addCleanup(private.__exit__, None, None, None)
        self.jobs = rilievo.Jobs(self.server)
        self.addCleanup(self.jobs.close)

    def test_submit_wait_fetch(self):
        points, stages = sphere(3000), []
        job = self.jobs.submit(points, max_error=3e-3, request_id="first")
        self.assertIn(job.state, ("queued", "running", "succeeded"))
        surface = job.fetch(progress=lambda event: stages.append(event.stage), timeout=60)
        self.assertEqual(job.state, "succeeded")
        self.assertEqual(surface.report["points_in"], 3000)
        direct = rilievo.reconstruct(points, max_error=3e-3, server=self.server)
        self.assertEqual(surface.to_bytes(), direct.to_bytes())
        again = self.jobs.submit(points, max_error=3e-3, request_id="first")
        self.assertEqual(again.job_id, job.job_id)
        self.assertEqual([j.job_id for j in self.jobs.list()], [job.job_id])
        self.assertEqual(self.jobs.get(job.job_id).request_id, "first")
        self.assertEqual(again.wait().state, "succeeded")
        job.delete()
        with self.assertRaises(rilievo.NotFound):
            self.jobs.get(job.job_id)
        with self.assertRaises(rilievo.NotFound):
            job.delete()

    def test_a_mesh_is_converted(self):
        around, across = 400, 200  # more than a piece of triangles
        vertices, faces = torus(around, across)
        job = self.jobs.convert(vertices, faces, max_level=2, control_faces=500)
        surface = job.fetch(timeout=120)
        self.assertEqual(surface.report["genus"], 1)
        self.assertEqual(surface.report["mesh"]["triangles"], 2 * around * across)
        direct = rilievo.convert(vertices, faces, max_level=2, control_faces=500,
                                 server=self.server)
        self.assertEqual(surface.to_bytes(), direct.to_bytes())
        with self.assertRaises(TypeError):
            self.jobs.convert(vertices, faces, topology="planar")

    def test_of_several_servers_another_one_is_asked(self):
        with rilievo.Jobs(f"127.0.0.1:1,{self.server.address},127.0.0.1:2") as jobs:
            for _ in range(3):  # begins with another one each time
                job = jobs.submit(sphere(500), request_id="several")
                self.assertEqual(job.wait(timeout=60).state, "succeeded")
                self.assertEqual([j.job_id for j in self.jobs.list()], [job.job_id])
        with self.assertRaises(rilievo.InvalidArgument):
            rilievo.Jobs(f"{self.server.address},,127.0.0.1:2")
        surface = rilievo.reconstruct(sphere(500), server=f"127.0.0.1:1,{self.server.address}")
        self.assertEqual(surface.report["points_in"], 500)

    def test_a_job_that_fails_raises_what_the_call_would_have_raised(self):
        points = sheet(500)
        points[:, 1:] = 0  # on a line
        job = self.jobs.submit(points)
        with self.assertRaises(rilievo.InvalidArgument) as from_job:
            job.fetch(timeout=60)
        with self.assertRaises(rilievo.InvalidArgument) as from_call:
            rilievo.reconstruct(points, server=self.server)
        self.assertEqual(job.state, "failed")
        self.assertEqual(str(from_job.exception), str(from_call.exception))

    def test_refused_options_make_no_job(self):
        with self.assertRaises(rilievo.InvalidArgument) as caught:
            self.jobs.submit(sphere(100), max_level=40)
        self.assertEqual(caught.exception.parameter, "max_level")
        self.assertEqual(self.jobs.list(), [])

    def test_cancel(self):
        job = self.jobs.submit(sphere(300_000))
        self.assertEqual(job.cancel().state, "cancelled")
        self.assertTrue(job.finished)
        with self.assertRaises(rilievo.Cancelled):
            job.fetch()

    def test_a_timeout_leaves_the_job_at_work(self):
        job = self.jobs.submit(sphere(100_000))
        with self.assertRaises(rilievo.DeadlineExceeded):
            job.wait(timeout=0.05)
        self.assertIn(job.refresh().state, ("queued", "running"))
        job.cancel()

    def test_two_clients_upload_the_same_scan(self):
        points, ids = sphere(200_000), []

        def submit():
            with rilievo.Jobs(self.server) as jobs:
                ids.append(jobs.submit(points, request_id="both", max_level=1).job_id)

        threads = [threading.Thread(target=submit) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(ids), 2)
        self.assertEqual(len(set(ids)), 1)
        self.jobs.get(ids[0]).cancel()

    def test_an_upload_that_the_server_dropped_begins_anew(self):
        with rilievo.Jobs(self.server) as jobs:
            ask, answers = jobs._stub.GetUpload, []

            def ask_too_early(*arguments, **named):
                answers.append(ask(*arguments, **named))
                if len(answers) == 1:
                    answers[0].stored_bytes = 1000
                return answers[-1]

            jobs._stub.GetUpload = ask_too_early
            jobs.submit(sphere(500), max_level=1).cancel()
            self.assertEqual([answer.stored_bytes for answer in answers], [1000, 0])

    def test_a_server_without_a_store(self):
        with rilievo.PrivateServer() as plain, rilievo.Jobs(plain) as jobs:
            with self.assertRaises(rilievo.FailedPrecondition) as caught:
                jobs.submit(sphere(100))
            self.assertEqual(caught.exception.reason, "NO_STORE")

    def test_reasons_are_those_of_the_server_alone(self):
        for domain, reason in (("rilievo.dev", "JOBS_LIMIT"), ("rilievo", "JOBS_LIMIT"),
                               ("proxy.example", "")):
            status = status_pb2.Status(code=8, message="full")
            status.details.add().Pack(error_details_pb2.ErrorInfo(reason="JOBS_LIMIT",
                                                                  domain=domain))
            self.assertEqual(error_of_status(status).reason, reason)


if __name__ == "__main__":
    unittest.main()
