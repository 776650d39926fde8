"""Tests the live view with our own strict client and a running daemon: rights, limits, and that watching changes nothing."""
import collections
import contextlib
import hashlib
import json
import math
import pathlib
import re
import struct
import subprocess
import threading
import time
import unittest

from foxglove_viewer import NAMES, Closed, Refused, Viewer
from life_cycle_test import Reader
from oculus_reader import Client, fire_message
from running_sonard import BUILD, SONARCTL, Sonard, eventually

ORIGINS = ', view_origins: ["https://look.example", {origin: "https://steer.example", steer: true}], hosts: [sonar-lab]'


def refusal(*arguments, **options):
    try:
        Viewer(*arguments, **options).socket.close()
    except Refused as refused:
        return refused
    raise AssertionError("the connection was accepted")


def let_in(*arguments):
    """Returns a viewer, or None while no slot is free."""
    try:
        return Viewer(*arguments)
    except Refused as refused:
        assert refused.status == 503
    return None


class Handshake(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard(control=ORIGINS).__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def viewer(self, **options):
        viewer = Viewer(self.daemon.address, **options)
        self.addCleanup(viewer.socket.close)
        return viewer

    def test_the_first_known_protocol_name_is_used(self):
        for offered in (NAMES, NAMES[::-1], ("other", NAMES[1])):
            self.assertEqual(self.viewer(protocols=", ".join(offered)).protocol, next(n for n in offered if n in NAMES))
        self.assertIn("foxglove.sdk.v1", refusal(self.daemon.address, protocols="other").body)

    def test_wrong_handshakes(self):
        for status, headers in ((426, {"Sec-WebSocket-Version": "8"}), (400, {"Sec-WebSocket-Key": "short"}), (400, {"Connection": "close"}),
                                (400, {"Sec-WebSocket-Protocol": None}), (403, {"Host": "evil.example"})):
            with self.subTest(headers):
                refused = refusal(self.daemon.address, headers=headers)
                self.assertEqual(refused.status, status)
                if status == 426:
                    self.assertEqual(refused.headers["sec-websocket-version"], "13")

    def test_who_may_look_and_who_may_steer(self):
        for origin, rights in ((None, "true"), (f"http://{self.daemon.address}:8088", "true"), ("http://localhost", "true"),
                               ("http://sonar-lab", "true"), ("https://look.example", "false"), ("https://steer.example", "true"),
                               ("https://look.example:444", 403), ("https://evil.example", 403), ("null", 403), ("file://", 403)):
            with self.subTest(origin):
                if rights == 403:
                    self.assertEqual(refusal(self.daemon.address, headers={"Origin": origin}).status, 403)
                else:
                    viewer = self.viewer(headers={"Origin": origin}).greeted()
                    self.assertEqual(viewer.info["metadata"]["sonard.may_steer"], rights)
                    viewer.socket.close()
        self.assertIn('control: {view_origins: ["https://evil.example"]}', self.daemon.log())

    def test_other_upgrades_get_the_help_text(self):
        refused = refusal(self.daemon.address, headers={"Upgrade": "h2c", "Accept": "*/*"})
        self.assertEqual(refused.status, 200)
        self.assertIn("curl", refused.body)


class Token(unittest.TestCase):
    def test_every_viewer_must_send_the_token(self):
        daemon = Sonard(control=ORIGINS + ", token_file: token")
        token = pathlib.Path(daemon.folder.name) / "token"
        token.write_text("0123456789abcdef\n", encoding="utf-8")
        token.chmod(0o600)
        with daemon:
            for origin in (None, "http://localhost", "https://look.example", "https://steer.example", "null"):
                with self.subTest(origin):
                    headers = {"Origin": origin}
                    self.assertEqual(refusal(daemon.address, headers=headers).status, 401)
                    self.assertEqual(refusal(daemon.address, path="/?token=0123456789abcdee", headers=headers).status, 401)
                    with Viewer(daemon.address, path="/?token=0123456789abcdef", headers=headers) as viewer:
                        self.assertEqual(viewer.greeted().info["metadata"]["sonard.may_steer"], "true")
            with Viewer(daemon.address, headers={"Authorization": "Bearer 0123456789abcdef"}) as viewer:
                viewer.greeted()
            self.assertNotIn("0123456789abcdee", daemon.log())


class Channels(unittest.TestCase):
    def test_all_channels_decode_and_the_picture_is_the_one_that_the_driver_got(self):
        with Sonard(trajectory="orbit", arguments=["--clock", "stepped"]) as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted()
            topics = {channel["topic"] for channel in viewer.channels.values()}
            self.assertEqual(topics, {"/tf", "/scene", "/swath", "/log", "/status", "/faults", "/doctor",
                                      *(f"/front/{name}" for name in ("image", "geometry", "ping", "figures", "fan", "picture", "cloud", "truth"))})
            viewer.subscribe(*sorted(topics))
            pictures, enough = set(), threading.Event()

            def drive():
                with Client(daemon.address) as client, contextlib.suppress(OSError, EOFError):
                    client.send(fire_message())
                    while not enough.is_set():
                        pictures.add(client.ping().image_bytes)

            driver = threading.Thread(target=drive)
            driver.start()
            try:
                seen, last = self.seen_of(viewer, topics)
            finally:
                enough.set()
                driver.join()
            self.assertEqual(set(seen), topics)
            ns, image = last
            self.assertEqual(image["timestamp"], {key: value for key, value in (("seconds", ns // 10**9), ("nanos", ns % 10**9)) if value})
            self.assertEqual((image["encoding"], image["frame_id"], image["step"]), ("mono8", "front", image["width"]))
            self.assertTrue(image["data"] in pictures, "the driver got this picture")
            self.assertTrue(viewer.times and viewer.times == sorted(viewer.times))

    def seen_of(self, viewer, topics, patience_s=300):
        """Waits for all topics and some pictures. Returns the messages of each topic, and the last picture with its time."""
        seen, last = collections.Counter(), None
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline and not (topics <= set(seen) and seen["/front/image"] >= 5):
            kind, value = viewer.receive()
            if kind != "message":
                continue
            topic, ns, payload = value
            seen[topic] += 1
            if topic == "/front/figures":
                self.assertEqual((len(payload), payload[:4]), (4 + 15 * 8, b"\0\1\0\0"))
                continue
            message = viewer.decode(topic, payload)
            if topic == "/front/image":
                last = ns, message
        return seen, last

    def test_geometry_comes_before_the_picture_and_frames_have_their_parents(self):
        with Sonard(arguments=["--clock", "stepped"]) as daemon, Viewer(daemon.address) as viewer, Client(daemon.address) as client:
            viewer.greeted().subscribe("/front/image", "/front/geometry", "/tf", "/scene")
            client.send(fire_message())
            client.ping()
            viewer.first_of("/front/image")
            self.assertIn("/front/geometry", [topic for topic, _, _ in viewer.messages])
            shape = viewer.first_of("/front/geometry")
            self.assertGreater(shape["azimuth_rad"][0], 0)
            self.assertLess(shape["azimuth_rad"][-1], 0)
            self.assertGreater(shape["row_spacing_m"], 0)
            frames = {t["child_frame_id"]: t["parent_frame_id"] for t in viewer.first_of("/tf")["transforms"]}
            self.assertEqual((frames["front"], frames["rov"]), ("rov", "world"))
            scene = viewer.first_of("/scene")
            model = scene["entities"][0]["models"][0]
            self.assertEqual(struct.unpack_from("<4sII", model["data"]), (b"glTF", 2, len(model["data"])))

    def test_a_subscriber_gets_the_truth_of_pings(self):
        with Sonard(scene="l-targets.yaml", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}", arguments=["--clock", "stepped"]) as daemon, \
                Viewer(daemon.address) as viewer, Client(daemon.address) as client:
            viewer.greeted().subscribed("/front/truth")
            client.send(fire_message())
            client.ping()
            truth = viewer.first_of("/front/truth")
            self.assertEqual(len(truth["range_m"]), len(truth["azimuth_rad"]))
            self.assertEqual(truth["azimuth_rad"], sorted(truth["azimuth_rad"], reverse=True))
            def at(deg):
                return min(zip(truth["azimuth_rad"], truth["range_m"]), key=lambda beam: abs(beam[0] - math.radians(deg)))[1]
            self.assertAlmostEqual(at(20), 3.9, delta=0.03)  # A, to port
            self.assertEqual(at(-20), 0)
            self.assertGreater(truth["range_end_m"], 0)

    def test_every_line_of_a_scanning_sonar_is_a_cloud(self):
        with Sonard(profile="ping360") as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribed("/front/ping", "/front/cloud")
            with subprocess.Popen([SONARCTL, "listen", daemon.address, "--make", "ping360", "--wait", "100"], stdin=subprocess.DEVNULL,
                                  stdout=subprocess.DEVNULL) as host:
                stamps = collections.defaultdict(list)
                try:
                    while len(stamps["/front/ping"]) < 20 or stamps["/front/cloud"][-1:] < stamps["/front/ping"][19:20]:
                        topic, ns, _ = viewer.wait_for(lambda kind, value: kind == "message")
                        stamps[topic].append(ns)
                finally:
                    host.terminate()
            self.assertLessEqual(set(stamps["/front/ping"][:20]), set(stamps["/front/cloud"]))

    def test_fast_lines_come_without_loss(self):
        """A sonar with 100 lines per second loses none to limits; a busy computer may lose some because queues are full."""
        with Sonard(profile="ping1d") as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribed("/front/ping", "/front/cloud")
            with subprocess.Popen([SONARCTL, "listen", daemon.address, "--make", "ping1d", "--range", "1", "--rate", "100"],
                                  stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as host:
                try:
                    for _ in range(800):
                        viewer.wait_for(lambda kind, value: kind == "message")
                        viewer.messages.clear()
                    dropped, = [v["dropped"] for v in daemon.status()["viewers"]]
                finally:
                    host.terminate()
            self.assertLess(max(int(dropped["/front/ping"]), int(dropped["/front/cloud"])), 200, dropped)

    def test_a_viewer_after_all_others_have_left_gets_geometry(self):
        with Sonard() as daemon, Client(daemon.address) as client:
            client.send(fire_message(rate_hz=10))
            for _ in range(2):
                with Viewer(daemon.address) as viewer:
                    viewer.greeted().subscribe("/front/geometry", "/swath")
                    reader = threading.Thread(target=lambda: [client.ping() for _ in range(5)])
                    reader.start()
                    self.assertGreater(viewer.first_of("/front/geometry")["row_spacing_m"], 0)
                    self.assertEqual(viewer.first_of("/swath")["entities"][0]["frame_id"], "front")
                    reader.join()
                eventually(lambda: "\nsonard_viewers 0\n" in daemon.get("/metrics"))

    def test_one_channel_is_for_plotjuggler(self):
        with Sonard() as daemon, Viewer(daemon.address) as viewer:
            figures = viewer.greeted().channels[viewer.channel("/front/figures")]
            self.assertEqual((figures["encoding"], figures["schemaEncoding"]), ("cdr", "ros2msg"))
            names = re.findall(r"float64 (\w+)\n", figures["schema"])
            self.assertEqual((len(names), names[0]), (15, "stamp_s"))
            viewer.subscribe("/front/figures")
            with Client(daemon.address) as client:
                client.send(fire_message(range_=7))
                values = struct.unpack_from("<15d", viewer.wait_for(lambda kind, value: kind == "message")[2], 4)
            self.assertEqual(dict(zip(names, values))["z"], -3)

    def test_a_new_viewer_gets_the_log(self):
        with Sonard() as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribe("/log")
            self.assertEqual(viewer.first_of("/log")["level"], 2)


class Limits(unittest.TestCase):
    def test_eight_viewers_and_no_more(self):
        with Sonard() as daemon, contextlib.ExitStack() as stack:
            viewers = [stack.enter_context(Viewer(daemon.address)).greeted() for _ in range(8)]
            self.assertEqual(refusal(daemon.address).status, 503)
            viewers[0].socket.close()
            stack.enter_context(eventually(lambda: let_in(daemon.address))).greeted()

    def close_code(self, viewer):
        with self.assertRaises(Closed) as closed:
            while True:
                viewer.receive()
        return closed.exception.code

    def test_floods_and_wrong_messages_end_the_connection_or_are_reported(self):
        with Sonard() as daemon:
            with Viewer(daemon.address) as viewer:
                for _ in range(10):
                    viewer.send_frame(1, b"nonsense")
                self.assertEqual(self.close_code(viewer), 1008)
            with Viewer(daemon.address) as viewer:
                with contextlib.suppress(OSError):
                    for _ in range(300):
                        viewer.say(op="getParameters", parameterNames=["/"], id="1")
                self.assertIn(self.close_code(viewer), (1008, 0))
            with Viewer(daemon.address) as viewer:
                with contextlib.suppress(OSError):
                    viewer.send_frame(1, b" " * 70000)
                self.assertIn(self.close_code(viewer), (1009, 0))
            with Viewer(daemon.address) as viewer:
                viewer.greeted()
                viewer.send_frame(1, b'{"op": "getParameters"')
                self.assertEqual(viewer.status()["level"], 2)
                viewer.say(op="subscribe", subscriptions=[{"id": 1, "channelId": 999}])
                self.assertIn("999", viewer.status()["message"])
                viewer.send_frame(2, b"\1\0")
                self.assertIn("clientPublish", viewer.status()["message"])
            self.assertEqual(daemon.stop()[0], 0)

    def test_messages_that_a_slow_viewer_loses_are_counted(self):
        with Sonard() as daemon, Viewer(daemon.address, small_window=True) as viewer, Client(daemon.address) as client:
            viewer.greeted().subscribe("/front/image")
            client.send(fire_message(rate_hz=5))
            deadline = time.monotonic() + 300
            while not (count := re.search(r'sonard_viewer_dropped_total\{viewer="http 127\.[^"]+:\d+",channel="/front/image"\} ([1-9]\d*)\n',
                                          daemon.get("/metrics"))):
                self.assertLess(time.monotonic(), deadline, daemon.get("/metrics"))
                client.message()
            self.assertIn("\nsonard_viewers 1\n", daemon.get("/metrics"))
            viewers = json.loads(daemon.get("/api/v1/status"))["viewers"]
            self.assertGreaterEqual(int(viewers[0]["dropped"]["/front/image"]), int(count[1]))

    def test_a_stop_closes_connections_with_the_code_for_going_away(self):
        with Sonard() as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted()
            self.assertEqual(daemon.stop()[0], 0)
            self.assertEqual(self.close_code(viewer), 1001)


def resident_kb(daemon):
    return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{daemon.process.pid}/status").read_text(encoding="utf-8"))[1])


def read_all(viewer):
    with contextlib.suppress(OSError, Closed):
        while True:
            viewer.receive()


class LookingChangesNothing(unittest.TestCase):
    PINGS = 40

    def run_with(self, viewers, reads=True):
        """Returns the SHA-256 of the bytes that a driver received."""
        with Sonard(trajectory="orbit", arguments=["--clock", "stepped", "--digest", "--exit-after-pings", self.PINGS]) as daemon:
            connections = [Viewer(daemon.address, small_window=not reads).greeted() for _ in range(viewers)]
            for viewer in connections:
                viewer.subscribed(*(channel["topic"] for channel in viewer.channels.values()))
            threads = [threading.Thread(target=read_all, args=(viewer,)) for viewer in connections if reads]
            for thread in threads:
                thread.start()
            received = hashlib.sha256()
            with Client(daemon.address) as client, contextlib.suppress(EOFError):
                client.send(fire_message())
                for n in range(10**6):
                    if viewers == 8 and n == 10:  # one viewer disconnects after ten messages
                        connections.pop().socket.close()
                    received.update(client.message()[1])
            self.assertEqual(daemon.wait(), 0, daemon.log())
            for thread in threads:
                thread.join(20)
            for viewer in connections:
                viewer.socket.close()
            self.assertIn(received.hexdigest(), daemon.log())
            return received.hexdigest()

    def test_the_driver_gets_the_same_bytes(self):
        alone = self.run_with(0)
        self.assertEqual(self.run_with(1), alone)
        self.assertEqual(self.run_with(8), alone)
        self.assertEqual(self.run_with(8, reads=False), alone)

    def test_ten_viewers_that_never_read_cost_no_ping_and_little_memory(self):
        viewers, picture_kb = 10, 1024
        with Sonard(more=f"limits: {{viewers: {viewers}}}") as daemon:
            driver = Reader(daemon.address)  # also reads while viewers connect
            driver.wait_for(10)
            before = resident_kb(daemon)
            for _ in range(viewers):
                viewer = Viewer(daemon.address, small_window=True)
                self.addCleanup(viewer.socket.close)
                viewer.greeted().subscribe("/front/image", "/front/geometry", "/tf", "/status")
            driver.wait_for(len(driver.pings) + 30)
            print(f"{(resident_kb(daemon) - before) / viewers:.0f} kB a viewer")
            if "SONAR_SANITIZE:STRING=\n" in (BUILD / "CMakeCache.txt").read_text(encoding="utf-8"):  # sanitizers keep freed memory
                self.assertLess(resident_kb(daemon) - before, 2048 * viewers + picture_kb)
            daemon.stop()
            self.assertRegex(daemon.log(), r"sonar front .* 0 dropped")


if __name__ == "__main__":
    unittest.main()
