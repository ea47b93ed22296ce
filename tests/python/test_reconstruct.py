"""Points in, surface out, through a real rilievod."""
import dataclasses
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest

import numpy as np
from scans import command_line, sheet, sphere

import rilievo
from rilievo.connection import parameter_of
from rilievo.scan import pack


def refused(address: str) -> bool:
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host, int(port)), 1).close()
        return False
    except OSError:
        return True


def becomes_true(condition, seconds: float = 10) -> bool:
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


class WithServer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.private = rilievo.PrivateServer()
        cls.server = cls.private.__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.private.__exit__(None, None, None)


class ReconstructTest(WithServer):
    def test_a_private_server_for_one_call(self):
        points = sphere(3000)
        surface = rilievo.reconstruct(points)
        radii = np.linalg.norm(surface.vertices() - [1, 2, 3], axis=1)
        self.assertTrue((radii > 1.9).all() and (radii < 2.1).all())
        self.assertEqual(surface.report["points_in"], 3000)
        self.assertEqual(surface.report["components"], 1)
        self.assertEqual(surface.report["boundary_loops"], 0)
        self.assertAlmostEqual(surface.report["diagonal"], surface.frame.diagonal)
        self.assertEqual(surface.info["metadata"]["scan_points"], 3000)
        self.assertLess(surface.certificate.scan_to_surface.rms, 1e-3)
        self.assertEqual(surface.report["error"]["points_to_surface"]["samples"], 3000)

    def test_same_bytes_as_the_command_line(self):
        scans = {"closed": (sphere(4000), {}, []),
                 "max_error": (sphere(4000), {"max_error": 2e-3}, ["--max-error", "2e-3"]),
                 "place": (sphere(4000), {"max_error": "2cm", "unit": "m", "up": "-y",
                                          "crs": "EPSG:25832"},
                           ["--max-error", "2cm", "--unit", "m", "--up", "-y", "--crs",
                            "EPSG:25832"]),
                 "units": (sphere(4000), {"height_step": "0.0003u"}, ["--height-step", "0.0003u"]),
                 "percent": (sphere(4000), {"max_error": "0.2%"}, ["--max-error", "0.2%"]),
                 "open": (sheet(4000), {"max_bytes": 2000, "topology": "planar", "max_level": 2,
                                         "outliers": "keep"},
                          ["--max-bytes", "2000", "--topology", "planar", "--max-level", "2",
                           "--outliers", "keep"]),
                 "holes": (sheet(4000), {"close_holes_below": "2cm", "bridge_gaps_below": "1cm",
                                         "unit": "m"},
                           ["--close-holes-below", "2cm", "--bridge-gaps-below", "1cm", "--unit",
                            "m"]),
                 "far": (sheet(3000, (4.6e6, 5.5e6, 300)),
                         {"control_faces": 60, "seed": 5, "creases": "off", "fit": "suzuki"},
                         ["--control-faces", "60", "--seed", "5", "--creases", "off", "--fit",
                          "suzuki"])}
        for name, (points, options, arguments) in scans.items():
            with self.subTest(name):
                surface = rilievo.reconstruct(points, server=self.server, **options)
                self.assertEqual(surface.to_bytes(), command_line(points, arguments))
                if "max_bytes" in options:
                    self.assertLessEqual(len(surface.to_bytes()), 2000)

    def test_the_place_and_the_error_come_back(self):
        surface = rilievo.reconstruct(sphere(3000), server=self.server, unit="mm", up="z")
        self.assertEqual(surface.place, rilievo.Place(0.001, "z", None))
        self.assertEqual(surface.report["place"]["metres_per_unit"], 0.001)
        error = surface.report["error"]["points_to_surface"]["rms"] * surface.frame.diagonal
        self.assertAlmostEqual(surface.error / error, 1, delta=1e-3)
        self.assertIn(f"scan to surface {surface.error / 1000:.3g} m", repr(surface))
        plain = rilievo.reconstruct(sphere(3000), server=self.server)
        self.assertEqual(plain.place, rilievo.Place(None, None, None))
        self.assertIn(f"scan to surface {plain.error:.3g},", repr(plain))

    def test_lengths_that_are_none_are_refused_with_the_ways_to_write_them(self):
        for options, words in (({"max_error": "2cm"}, "unit='m'"),
                               ({"max_error": "2 parsecs", "unit": "m"}, "'2cm'"),
                               ({"height_step": "cm", "unit": "m"}, "'2cm'"),
                               ({"unit": "parsec"}, "'us-ft'"), ({"up": "w"}, "'-z'"),
                               ({"max_error": "9km", "unit": "m"}, "must lie between")):
            with self.subTest(str(options)):
                with self.assertRaisesRegex(rilievo.InvalidArgument, words):
                    rilievo.reconstruct(sphere(100), server=self.server, **options)

    def test_float32_points_are_the_same_scan_as_their_doubles(self):
        narrow = sphere(2000).astype(np.float32)
        structured = np.zeros(2000, [("intensity", "u1"), ("x", "f4"), ("y", "f4"), ("z", "f4")])
        for i, axis in enumerate("xyz"):
            structured[axis] = narrow[:, i]
        first = rilievo.reconstruct(narrow, server=self.server).to_bytes()
        for same in (narrow.astype(np.float64), structured, np.asfortranarray(narrow),
                     narrow.tolist(), np.repeat(narrow, 2, axis=0)[::2]):
            self.assertEqual(rilievo.reconstruct(same, server=self.server).to_bytes(), first)

    def test_the_surface_faces_the_sensor_or_the_given_normals(self):
        points, center = sphere(3000), np.array([1, 2, 3])
        normals = (center - points) / np.linalg.norm(center - points, axis=1)[:, None]
        structured = np.zeros(3000, [(name, "f8") for name in (
            "x", "y", "z", "sensor_x", "sensor_y", "sensor_z", "nx", "ny", "nz")])
        columns = np.column_stack([points, np.tile(center, (3000, 1)), normals])
        for name, column in zip(structured.dtype.names, columns.T):
            structured[name] = column

        def faces_in(surface):
            toward = center - surface.vertices()
            return (np.sum(surface.normals() * toward, axis=1) > 0).all()

        for arguments in ({"sensor": center}, {"point_normals": normals},
                          {"sensor": np.tile(center, (3000, 1)), "stations": "use"}):
            with self.subTest(list(arguments)):
                surface = rilievo.reconstruct(points, server=self.server, **arguments)
                self.assertTrue(faces_in(surface))
                given = "normals" if "point_normals" in arguments else "stations"
                self.assertTrue(surface.report[given]["used"])
                self.assertEqual(surface.report[given]["points"], 3000)
        self.assertTrue(faces_in(rilievo.reconstruct(structured, server=self.server)))
        plain = rilievo.reconstruct(points, server=self.server)
        self.assertFalse(faces_in(plain))
        ignored = rilievo.reconstruct(structured, server=self.server, stations="ignore",
                                      normals="ignore")
        np.testing.assert_array_equal(ignored.vertices(), plain.vertices())

    def test_colours_of_the_points_come_to_the_vertices(self):
        points = sphere(3000)
        center = points.mean(axis=0)

        def color_at(places):
            unit = (places - center) / np.linalg.norm(places - center, axis=1)[:, None]
            return 0.5 + 0.4 * np.column_stack([unit[:, 0], np.sin(2 * unit[:, 1]), -unit[:, 2]])

        shares = color_at(points)
        structured = np.zeros(3000, [(name, "f8") for name in ("x", "y", "z", "red", "green",
                                                               "blue")])
        for name, column in zip(structured.dtype.names, np.column_stack([points, shares]).T):
            structured[name] = column
        surfaces = [rilievo.reconstruct(points, server=self.server, point_colors=colors)
                    for colors in (shares, (255 * shares + 0.5).astype(np.uint8),
                                   (255 * shares + 0.5).astype(np.uint8).astype(np.uint16) * 257,
                                   (255 * shares + 0.5).astype(np.uint16))]
        surfaces.append(rilievo.reconstruct(structured, server=self.server))
        for surface in surfaces:
            self.assertEqual(surface.to_bytes(), surfaces[0].to_bytes())
            self.assertGreater(surface.report["colors"]["bytes"], 0)
            np.testing.assert_array_equal(surface.colors, surface.mesh().colors)
            off = surface.colors / 255 - color_at(surface.vertices())
            self.assertLess(np.sqrt(np.mean(off ** 2)), 0.012)
            self.assertEqual(len(surface.mesh(1).colors), len(surface.vertices(1)))
        plain = rilievo.reconstruct(points, server=self.server)
        self.assertIsNone(plain.colors)
        self.assertIsNone(plain.mesh().colors)
        np.testing.assert_array_equal(plain.heights, surfaces[0].heights)
        for wrong in (shares[:10], 3 * shares, shares.astype(int)):
            with self.assertRaises(rilievo.InvalidArgument) as raised:
                rilievo.reconstruct(points, server=self.server, point_colors=wrong)
            self.assertEqual(raised.exception.parameter, "point_colors")

    def test_a_sensor_that_moves_becomes_places_along_its_way(self):
        way = np.column_stack([np.linspace(0, 4000, 30_000), np.zeros(30_000), np.full(30_000, 9)])
        way[5] = np.nan
        packed = pack(np.zeros((30_000, 3)), way)
        self.assertLessEqual(len(packed.stations), 4096)
        numbers = packed.points["station"]
        self.assertEqual(numbers[5], 65535)
        known = numbers != 65535
        self.assertEqual(known.sum(), 29_999)
        self.assertLess(np.abs(packed.stations[numbers[known]] - way[known]).max(), 0.002 * 4000)

    def test_sensors_and_normals_that_do_not_fit_are_refused(self):
        points = sphere(100)
        for name, value in (("sensor", np.zeros((7, 3))), ("sensor", [1, 2]),
                            ("point_normals", np.zeros((7, 3))), ("point_normals", [1, 2, 3])):
            with self.assertRaises(rilievo.InvalidArgument) as raised:
                rilievo.reconstruct(points, server=self.server, **{name: value})
            self.assertEqual(raised.exception.parameter, name)
        with self.assertRaises(rilievo.InvalidArgument) as raised:
            rilievo.reconstruct(points, server=self.server, stations="use")
        self.assertEqual(raised.exception.parameter, "stations")

    def test_masked_and_non_finite_points_are_dropped_and_counted(self):
        points = np.ma.masked_array(sphere(2000))
        points[7] = np.ma.masked
        points[8, 1] = np.inf
        surface = rilievo.reconstruct(points, server=self.server)
        self.assertEqual(surface.report["non_finite"], 2)

    def test_progress_and_layers_come_in_order_in_this_thread(self):
        stages, layers, threads = [], [], set()

        def progress(event):
            threads.add(threading.get_ident())
            stages.append(event.stage)
            self.assertTrue(0 <= event.fraction <= 1)

        surface = rilievo.reconstruct(sphere(5000), server=self.server, progress=progress,
                                      layer=layers.append)
        self.assertEqual(threads, {threading.get_ident()})
        order = ["queued", "check", "neighbors", "normals", "control-mesh", "domain-fit",
                 "displacement", "measure", "encode"]
        self.assertEqual(sorted(stages, key=order.index), stages)
        self.assertIn("measure", stages)
        self.assertEqual([s.max_level for s in layers], list(range(surface.max_level + 1)))
        self.assertIs(layers[-1], surface)

    def test_without_measuring_there_is_no_error(self):
        surface = rilievo.reconstruct(sphere(1000), server=self.server, measure=False)
        self.assertIsNone(surface.report["error"])
        self.assertIsNone(surface.certificate.error_rms)

    def test_a_given_control_mesh_is_kept(self):
        first = rilievo.reconstruct(sphere(2000), server=self.server, control_faces=60)
        control = first.control_mesh
        second = rilievo.reconstruct(sphere(2000), server=self.server,
                                     control_mesh=(control.vertices, control.faces))
        self.assertEqual(second.report["road"], "user")
        self.assertEqual(len(second.control_mesh.faces), len(control.faces))
        tagged = dataclasses.replace(
            control, creases=control.faces[:1, :2], sharpness=np.array([2.5], np.float32),
            corners=control.faces[0, :1])
        third = rilievo.reconstruct(sphere(2000), server=self.server, control_mesh=tagged)
        self.assertEqual(third.control_mesh.sharpness.tolist(), [2.5])
        self.assertEqual(len(third.control_mesh.corners), 1)


class RefusalTest(WithServer):
    def test_the_argument_at_fault_is_named(self):
        points = sphere(100)
        cases = [
            ("max_error", points, {"max_error": 3}), ("max_error", points, {"max_error": "x"}),
            ("max_level", points, {"max_level": 9}), ("max_level", points, {"max_level": -1}),
            ("max_level", points, {"max_level": 1.5}), ("height_step", points, {"height_step": 1}),
            ("topology", points, {"topology": "flat"}), ("creases", points, {"creases": None, "fit":
             "suzuki", "topology": "planar", "control_mesh": None, "boundary": "shut"}),
            ("points", points[:5], {}), ("points", points[:, :2], {}), ("points", "abc", {}),
            ("points", np.zeros((3, 100)), {}), ("points", np.zeros((50, 3)), {}),
            ("points", points.astype(complex), {}), ("control_mesh", points, {"control_mesh": 5}),
            ("control_mesh", points, {"control_mesh": (points, [[0, 1, 100]])}),
            ("control_mesh", points, {"control_mesh": (points, [[0.5, 1, 2]])}),
            ("topology", points, {"control_mesh": (points, [[0, 1, 2]]), "topology": "planar"}),
        ]
        for parameter, scan, options in cases:
            with self.subTest(parameter=parameter, options=list(options)):
                with self.assertRaises(rilievo.InvalidArgument) as caught:
                    rilievo.reconstruct(scan, server=self.server, **options)
                expected = "boundary" if "boundary" in options else parameter
                if caught.exception.violations:
                    self.assertEqual(caught.exception.parameter, expected, caught.exception)
                else:
                    self.assertIn("point", str(caught.exception))
                self.assertIsInstance(caught.exception, ValueError)
        choices = {"topology": "planar", "boundary": "close", "creases": "off",
                   "fit": "least-squares"}
        for parameter, choice in choices.items():
            with self.assertRaisesRegex(rilievo.InvalidArgument, f"'closed' is not one of.*'{choice}'"):
                rilievo.reconstruct(points, server=self.server, **{parameter: "closed"})
        with self.assertRaisesRegex(rilievo.InvalidArgument, "^points: all 50 finite") as identical:
            rilievo.reconstruct(np.zeros((50, 3)), server=self.server)
        self.assertNotIn("points: points", str(identical.exception))
        with self.assertRaisesRegex(TypeError, "max_eror"):
            rilievo.reconstruct(points, server=self.server, max_eror=1e-3)
        with self.assertRaisesRegex(rilievo.InvalidArgument, r"points\[:, :3\]"):
            rilievo.reconstruct(np.zeros((50, 6)), server=self.server)

    def test_two_targets_exclude_each_other(self):
        with self.assertRaises(rilievo.InvalidArgument) as caught:
            rilievo.reconstruct(sphere(100), server=self.server, max_error=1e-3, max_bytes=900)
        self.assertIn(caught.exception.parameter, ("max_error", "max_bytes"))

    def test_too_few_bytes(self):
        with self.assertRaises(rilievo.ResourceExhausted):
            rilievo.reconstruct(sphere(1000), server=self.server, max_bytes=10)

    def test_nobody_there(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            address = "127.0.0.1:%d" % free.getsockname()[1]
        with self.assertRaisesRegex(rilievo.Unavailable, address) as caught:
            rilievo.reconstruct(sphere(100), server=address)
        self.assertIsInstance(caught.exception, ConnectionError)

    def test_limits_of_a_server(self):
        with rilievo.PrivateServer(["--max-points", "50"]) as small:
            with self.assertRaises(rilievo.LimitExceeded) as caught:
                rilievo.reconstruct(sphere(100), server=small)
            self.assertEqual(caught.exception.reason, "LIMIT_EXCEEDED")
            self.assertEqual(caught.exception.parameter, "points")

    def test_a_token_is_not_sent_unencrypted_to_another_machine(self):
        server = rilievo.Server("192.0.2.1:50051", token="secret")
        with self.assertRaisesRegex(rilievo.InvalidArgument, "unencrypted"):
            rilievo.reconstruct(sphere(100), server=server)
        with self.assertRaisesRegex(rilievo.InvalidArgument, "key"):
            rilievo.reconstruct(sphere(100), server=rilievo.Server("a:1", certificate="c.pem"))
        for address in ("localhost:1", "127.0.0.1:1", "[::1]:1", "127.8.9.1:2"):
            self.assertEqual(rilievo.Server(address, token="t").metadata(),
                             (("authorization", "Bearer t"),))
        with self.assertRaises(rilievo.InvalidArgument):
            rilievo.Server("127.evil.example:1", token="t").metadata()

    def test_paths_of_the_protocol_become_arguments(self):
        for field, parameter in (("header.options.encode.max_error_ratio", "max_error"),
                                 ("header.point_count", "points"),
                                 ("header.options.control.close_holes_below_ratio",
                                  "close_holes_below"),
                                 ("header.options.control.control_mesh.faces[3]", "control_mesh"),
                                 ("header.options.control.control_mesh.creases", "control_mesh"),
                                 ("header.options.control.creases", "creases"),
                                 ("header.options.fit.method", "fit"), ("upload_id", "")):
            self.assertEqual(parameter_of(field), parameter)


class StoppingTest(WithServer):
    def test_the_deadline_ends_the_call(self):
        began = time.monotonic()
        with self.assertRaises(rilievo.DeadlineExceeded) as caught:
            rilievo.reconstruct(sphere(200_000), server=self.server, timeout=0.3)
        self.assertLess(time.monotonic() - began, 5)
        self.assertIsInstance(caught.exception, TimeoutError)

    def test_what_progress_raises_cancels_the_call(self):
        def stop(event):
            raise LookupError("enough")

        for _ in range(3):  # more often than the server has places
            with self.assertRaisesRegex(LookupError, "enough"):
                rilievo.reconstruct(sphere(100_000), server=self.server, progress=stop)
        surface = rilievo.reconstruct(sphere(1000), server=self.server, timeout=60)
        self.assertEqual(surface.report["points_in"], 1000)

    def run_script(self, code: str):
        return subprocess.Popen([sys.executable, "-c", "import sys, numpy, rilievo\n" + code],
                                cwd=os.path.dirname(__file__), stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def test_an_interrupt_cancels_and_ends_the_private_server(self):
        script = self.run_script("""
from scans import sphere
from rilievo import private_server
start = private_server.PrivateServer.__enter__
def announced(self):
    server = start(self)
    print(server.address, flush=True)
    return server
private_server.PrivateServer.__enter__ = announced
points = sphere(400000)
try:
    rilievo.reconstruct(points, progress=lambda event: print(event.stage, flush=True))
except KeyboardInterrupt:
    print("interrupted", flush=True)
""")
        with script:
            address = script.stdout.readline().strip()
            self.assertFalse(refused(address), address)
            while script.stdout.readline().strip() not in ("neighbors", ""):
                pass
            began = time.monotonic()
            script.send_signal(signal.SIGINT)
            rest = script.stdout.read()
            self.assertEqual(rest.split()[-1:], ["interrupted"], rest + script.stderr.read())
            self.assertLess(time.monotonic() - began, 5)
        self.assertTrue(refused(address))

    def test_the_private_server_ends_with_its_process(self):
        script = self.run_script("""
with rilievo.PrivateServer() as server:
    print(server.address, flush=True)
    sys.stdin.read()
    import time; time.sleep(60)
""")
        with script:
            address = script.stdout.readline().strip()
            self.assertFalse(refused(address))
            script.kill()
        self.assertTrue(becomes_true(lambda: refused(address)))

    def test_a_server_that_does_not_start_says_why(self):
        with self.assertRaisesRegex(rilievo.Unavailable, "no-such-option"):
            rilievo.PrivateServer(["--no-such-option"]).__enter__()
        before = os.environ["RILIEVOD"]
        os.environ["RILIEVOD"] = "/nonexistent/rilievod"
        try:
            with self.assertRaisesRegex(rilievo.Unavailable, "nonexistent"):
                rilievo.reconstruct(sphere(100))
        finally:
            os.environ["RILIEVOD"] = before


if __name__ == "__main__":
    unittest.main()
