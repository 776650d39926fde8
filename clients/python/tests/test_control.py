"""Requests of Control over HTTP and its handling of replies, against a fake server."""
import http.server
import json
import re
import socket
import sys
import threading
import time
import unittest
from unittest import mock

from common import PACKAGE  # also puts sonard_client on sys.path

from sonard_client import Control, ControlError, OculusClient, control

ANSWERS = {
    "/healthz": (503, "scene cannot be loaded\n"),
    "/metrics": (200, '# HELP a b\n# TYPE a counter\nsonard_pings_total{sonar="front left"} 12\nsonard_late_seconds 1e-3\n\n'),
    "/api/v1/status": (200, '{"seed":"18446744073709551615","sonars":[{"clients":[],"figures":{"pings":"7","clients":"1"}}],'
                            '"viewers":[{"dropped":{"/front/image":"12"}}]}'),
    "/api/v1/sonar": (400, '{"code":"REFUSED","text":"no sonar is called \\"rear\\"; there are: front"}'),
    "/api/v1/faults/journal?after=6":
        (200, '{"journal":[{"seq":"7","utc_ns":"1152921504606846976","offset":"-1","bytes_before":"10","with":{}}]}'),
    "/api/v1/load": (502, "<html>a proxy</html>"),
}


class Handler(http.server.BaseHTTPRequestHandler):
    def answer(self):
        length = int(self.headers.get("Content-Length", 0))
        body = json.loads(self.rfile.read(length)) if length else None
        self.server.requests.append((self.command, self.path, dict(self.headers), body))
        if self.path.startswith("/api/v1/events"):
            return self.events()
        status, text = ANSWERS.get(self.path, (200, '{"code":"OK","text":""}'))
        self.send_response(status)
        self.end_headers()
        self.wfile.write(text.encode())

    def events(self):
        self.protocol_version = "HTTP/1.1"
        self.send_response(200)
        self.send_header("Transfer-Encoding", "chunked")
        self.end_headers()
        for line in (b'{"ping":{"number":1,"fired_at_ns":"123"},"unsent":"0"}\n', b'{"scene":{"text":"loaded"},"unsent":"2"}\n'):
            self.wfile.write(b"%x\r\n%s\r\n" % (len(line), line))
        if "clients" in self.path:
            self.server.release.wait(20)  # silence
        elif "poses" not in self.path:    # for poses the stream ends without a last chunk
            self.wfile.write(b"0\r\n\r\n")
        self.close_connection = True

    do_GET = do_POST = do_DELETE = answer

    def log_message(self, *_):
        """Suppresses the log."""


class Refused(unittest.TestCase):
    def test_error_names_the_closed_port(self):
        with socket.socket() as taken:  # without listen()
            taken.bind(("127.0.0.1", 0))
            port = taken.getsockname()[1]
            with self.assertRaisesRegex(ConnectionRefusedError, f"127.0.0.1:{port} refuses the connection: is sonard running"):
                Control(port=port).status()
            with self.assertRaisesRegex(ConnectionRefusedError, f"127.0.0.1:{port} refuses the connection: is a sonar running"):
                OculusClient("127.0.0.1", port)


class WideFields(unittest.TestCase):
    def test_all_wide_fields_of_answers_are_listed(self):
        text = re.sub(r"//[^\n]*", "", (PACKAGE.parents[1] / "protocol/control/control.proto").read_text(encoding="utf-8"))
        bodies = dict(re.findall(r"^message (\w+) \{(.*?)^\}", text, re.M | re.S))
        reached, waiting = set(), ["DaemonStatus", "Event", "FaultEntry"]
        while waiting:
            name = waiting.pop()
            reached.add(name)
            waiting += [word for word in re.findall(r"\w+", bodies[name]) if word in bodies and word not in reached]
        wide = {field for name in reached
                for field in re.findall(r"(?:\bu?int64|fixed64>?|, uint64>)\s+(\w+)\s*=", bodies[name])}
        self.assertIn("dropped", wide)
        self.assertEqual(wide - control._WIDE, set())


class WrongPort(unittest.TestCase):
    """A wrong port is reported within about two seconds, with any timeout of the request."""

    def expect(self, port, error, words):
        for ask in (lambda c: c.status(), lambda c: c.load_scene("demo.yaml"), lambda c: c.events()):
            begin = time.monotonic()
            with self.assertRaisesRegex(error, f"127.0.0.1:{port} {words}.*another program listens there.*8088"):
                ask(Control(port=port))
            self.assertLess(time.monotonic() - begin, 20)  # 2 s on a quiet machine; without this check: 30 s, 330 s, no limit

    def test_silent_server(self):
        with socket.create_server(("127.0.0.1", 0)) as silent:
            self.expect(silent.getsockname()[1], TimeoutError, "does not answer HTTP within 2 s")

    def test_other_protocol(self):
        for greeting in (b"SSH-2.0-Other\r\n", b""):
            with socket.create_server(("127.0.0.1", 0)) as other:
                def serve():
                    for _ in range(3):
                        connection = other.accept()[0]
                        with connection:
                            connection.sendall(greeting)
                            connection.recv(4096)

                thread = threading.Thread(target=serve)
                thread.start()
                self.expect(other.getsockname()[1], ConnectionError, "does not speak HTTP")
                thread.join()


class Requests(unittest.TestCase):
    def setUp(self):
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.requests, self.server.release = [], threading.Event()
        thread = threading.Thread(target=self.server.serve_forever, args=(0.02,))
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.addCleanup(self.server.release.set)
        self.control = Control("127.0.0.1", self.server.server_address[1], token="secret")

    def last(self):
        method, path, headers, body = self.server.requests[-1]
        self.assertEqual(headers["Authorization"], "Bearer secret")
        if method == "POST":
            self.assertEqual(headers["Content-Type"], "application/json")
        return method, path, body

    def test_answers(self):
        self.assertEqual(self.control.health(), "scene cannot be loaded")
        self.assertEqual(self.control.metrics(), {'sonard_pings_total{sonar="front left"}': 12.0, "sonard_late_seconds": 0.001})
        status = self.control.status()
        self.assertEqual(status["seed"], 2 ** 64 - 1)
        self.assertEqual(status["sonars"][0], {"clients": [], "figures": {"pings": 7, "clients": 1}})
        self.assertEqual(status["viewers"], [{"dropped": {"/front/image": 12}}])
        self.assertEqual(self.last(), ("GET", "/api/v1/status", None))

    def test_trajectories_and_recordings(self):
        self.control.set_trajectory("rov", paused=False, position_s=1.5)
        self.assertEqual(self.last(), ("POST", "/api/v1/set_trajectory", {"vehicle": "rov", "paused": False, "position_s": 1.5}))
        self.control.set_trajectory(object_name="boat", speed=2)
        self.assertEqual(self.last(), ("POST", "/api/v1/set_trajectory", {"object": "boat", "speed": 2}))
        self.control.start_recording("run.mcap", "front")
        self.assertEqual(self.last(), ("POST", "/api/v1/start_recording", {"file": "run.mcap", "sonar": "front"}))
        self.control.start_recording("run.mcap", labels=True)
        self.assertEqual(self.last(), ("POST", "/api/v1/start_recording", {"file": "run.mcap", "labels": True}))
        self.control.stop_recording()
        self.assertEqual(self.last(), ("POST", "/api/v1/stop_recording", {}))

    def test_faults(self):
        self.control.add_fault("F01", at={"every": 50}, count=3, seconds=2, client="newest", parameters={"bytes": 1, "fill": "zero"})
        self.assertEqual(self.last(), ("POST", "/api/v1/faults", {
            "do": "F01", "at": {"every": 50}, "for": {"seconds": 2, "count": 3}, "client": "newest",
            "with": {"bytes": 1, "fill": "zero"}}))
        self.control.end_fault("a name/..")
        self.assertEqual(self.last(), ("DELETE", "/api/v1/faults/a%20name%2F..", None))
        self.control.reset_faults()
        self.assertEqual(self.last(), ("POST", "/api/v1/faults/reset", {}))
        entry = {"seq": 7, "utc_ns": 2 ** 60, "offset": -1, "bytes_before": 10, "with": {}}
        self.assertEqual(self.control.fault_journal(after=6), [entry])
        self.assertEqual(self.last()[1], "/api/v1/faults/journal?after=6")

    def test_refusals_carry_the_message(self):
        with self.assertRaisesRegex(ControlError, "no sonar is called") as caught:
            self.control.set_sonar("rear", range_m=5)
        self.assertEqual((caught.exception.status, caught.exception.code), (400, "REFUSED"))
        self.assertEqual(self.last(), ("POST", "/api/v1/sonar", {"sonar": "rear", "range_m": 5}))
        with self.assertRaisesRegex(ControlError, "proxy") as caught:
            self.control.load_scene("demo.yaml")
        self.assertEqual((caught.exception.status, caught.exception.code), (502, ""))

    def test_each_request_has_its_path_and_body(self):
        at = {"frame": "NED_FRD", "position": {"x": 1, "y": 2, "z": 3}, "orientation": {"w": 1, "x": 0, "y": 0, "z": 0}}
        placed = dict(position=(1, 2, 3), frame="NED_FRD")
        for call, path, body in (
                (lambda: self.control.set_environment(temperature_c=4, ph=0), "environment",
                 {"environment": {"temperature_c": 4, "ph": 0}}),
                (lambda: self.control.add_object("b", "a", moving=True, **placed), "add_object",
                 {"name": "b", "like": "a", "at": at, "moving": True}),
                (lambda: self.control.remove_object("b"), "remove_object", {"object": "b"}),
                (lambda: self.control.show_object("b"), "set_object", {"object": "b", "visible": True}),
                (lambda: self.control.hide_object("b"), "set_object", {"object": "b", "visible": False}),
                (lambda: self.control.place_object("b", **placed), "set_object", {"object": "b", "at": at}),
                (lambda: self.control.move_object("b", **placed), "object", dict(at, object="b")),
                (lambda: self.control.send_pose(vehicle="rov", **placed), "pose", dict(at, vehicle="rov"))):
            with self.subTest(path):
                call()
                self.assertEqual(self.last(), ("POST", "/api/v1/" + path, body))
        with self.assertRaises(ValueError):
            self.control.place_object("b", (0, 0, 0), frame="up")
        with self.assertRaises(ValueError):
            self.control.set_sonar(range_m=float("nan"))

    def test_a_mount_has_only_what_is_given(self):
        control, place, angles = self.control, {"x": 0.3, "y": 0, "z": 0}, {"x": 0, "y": 20, "z": 0}
        for given, sent in (({"position": (0.3, 0, 0)}, {"position": place}),
                            ({"rpy_deg": (0, 20, 0)}, {"rpy_deg": angles}),
                            ({"position": (0.3, 0, 0), "rpy_deg": (0, 20, 0)}, {"position": place, "rpy_deg": angles})):
            with self.subTest(**given), mock.patch.dict(ANSWERS, {"/api/v1/sonar": (200, '{"code":"OK"}')}):
                control.mount_sonar("front", frame="FRD", **given)
                self.assertEqual(self.last(), ("POST", "/api/v1/sonar", {"sonar": "front", "mount": dict(sent, frame="FRD")}))
        with self.assertRaisesRegex(ValueError, "a mount needs a position, angles"):
            control.mount_sonar("front")

    def test_events_until_end_disconnection_and_timeout(self):
        for kinds in ({"pings": True}, {"poses": True}):
            events = list(self.control.events(**kinds))
            self.assertEqual(events[0]["ping"]["fired_at_ns"], 123)
            self.assertEqual((len(events), events[1]["unsent"]), (2, 2))
        self.assertEqual(self.last()[1], "/api/v1/events?poses=1")
        with self.control.events(clients=True, timeout=2) as events:
            self.assertEqual(len([next(events), next(events)]), 2)
            with self.assertRaisesRegex(TimeoutError, "no event"):
                next(events)

    def test_package_is_of_this_checkout(self):
        self.assertIn(str(PACKAGE), sys.modules[Control.__module__].__file__)

    def test_a_closed_port_raises_an_error(self):
        with socket.socket() as unused:
            unused.bind(("127.0.0.1", 0))
            port = unused.getsockname()[1]
        with self.assertRaises(OSError):
            Control("127.0.0.1", port).status()


if __name__ == "__main__":
    unittest.main()
