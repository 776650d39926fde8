"""The live view as viewers meet it: a strict client of its own on a live daemon. Rights, limits, and that looking changes nothing."""
import contextlib
import hashlib
import json
import pathlib
import re
import struct
import threading
import time
import unittest

from foxglove_viewer import NAMES, Closed, Refused, Viewer
from oculus_reader import Client, fire_message
from running_sonard import Sonard

ORIGINS = ', view_origins: ["https://look.example", {origin: "https://steer.example", steer: true}], hosts: [sonar-lab]'


def refusal(*arguments, **options):
    try:
        Viewer(*arguments, **options).socket.close()
    except Refused as refused:
        return refused
    raise AssertionError("was let in")


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

    def test_takes_the_first_name_that_it_knows(self):
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

    def test_other_requests_stay_as_they_were(self):
        refused = refusal(self.daemon.address, headers={"Upgrade": "h2c", "Accept": "text/html"})
        self.assertEqual(refused.status, 200)
        self.assertIn("curl", refused.body)


class Token(unittest.TestCase):
    def test_every_viewer_shows_it(self):
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
    def test_all_decode_and_the_picture_is_what_the_driver_got(self):
        with Sonard(trajectory="orbit", arguments=["--clock", "stepped"]) as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted()
            topics = {channel["topic"] for channel in viewer.channels.values()}
            self.assertEqual(topics, {"/tf", "/scene", "/swath", "/log", "/status", "/faults",
                                      *(f"/front/{name}" for name in ("image", "geometry", "ping", "figures", "fan", "cloud"))})
            viewer.subscribe(*sorted(topics))
            pings = {}

            def drive():
                with Client(daemon.address) as client, contextlib.suppress(OSError, EOFError):
                    client.send(fire_message())
                    while len(pings) < 400:
                        ping = client.ping()
                        pings[ping.id] = ping

            driver = threading.Thread(target=drive)
            driver.start()
            seen, last = {}, None
            deadline = time.monotonic() + 30
            while time.monotonic() < deadline and not (topics <= set(seen) and seen["/front/image"] >= 5):
                kind, value = viewer.receive()
                if kind != "message":
                    continue
                topic, ns, payload = value
                seen[topic] = seen.get(topic, 0) + 1
                if topic == "/front/figures":
                    self.assertEqual((len(payload), payload[:4]), (4 + 15 * 8, b"\0\1\0\0"))
                    continue
                message = viewer.decode(topic, payload)
                if topic == "/front/image":
                    last = ns, message
            driver.join()
            self.assertEqual(set(seen), topics)
            ns, image = last
            self.assertEqual(image["timestamp"], {key: value for key, value in (("seconds", ns // 10**9), ("nanos", ns % 10**9)) if value})
            self.assertEqual((image["encoding"], image["frame_id"], image["step"]), ("mono8", "front", image["width"]))
            rows = [list(image["data"][i:i + image["width"]]) for i in range(0, len(image["data"]), image["width"])]
            self.assertIn(rows, [ping.image for ping in pings.values()])
            self.assertTrue(viewer.times and viewer.times == sorted(viewer.times))

    def test_geometry_comes_before_the_picture_and_frames_hang_together(self):
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

    def test_who_comes_after_all_have_left_gets_geometry_too(self):
        with Sonard() as daemon, Client(daemon.address) as client:
            client.send(fire_message(rate_hz=5))
            for _ in range(2):
                with Viewer(daemon.address) as viewer:
                    viewer.greeted().subscribe("/front/geometry", "/swath")
                    reader = threading.Thread(target=lambda: [client.ping() for _ in range(5)])
                    reader.start()
                    self.assertGreater(viewer.first_of("/front/geometry")["row_spacing_m"], 0)
                    self.assertEqual(viewer.first_of("/swath")["entities"][0]["frame_id"], "front")
                    reader.join()
                deadline = time.monotonic() + 10
                while "viewer gone" not in daemon.log() and time.monotonic() < deadline:
                    time.sleep(0.05)

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

    def test_the_log_reaches_newcomers(self):
        with Sonard() as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribe("/log")
            self.assertEqual(viewer.first_of("/log")["level"], 2)


class Steering(unittest.TestCase):
    @staticmethod
    def parameters(viewer, request="all", *names):
        viewer.say(op="getParameters", parameterNames=list(names), id=request)
        values = viewer.wait_for(lambda kind, value: kind == "word" and value["op"] == "parameterValues" and value.get("id") == request)
        return {p["name"]: p.get("value") for p in values["parameters"]}

    @staticmethod
    def set(viewer, name, value):
        """What holds afterwards."""
        viewer.say(op="setParameters", parameters=[{"name": name, "value": value}], id="set " + name)
        values = viewer.wait_for(lambda kind, word: kind == "word" and word["op"] == "parameterValues" and word.get("id") == "set " + name)
        return values["parameters"][0].get("value") if values["parameters"] else None

    def refusals(self, viewer):
        return [word["message"] for word in viewer.words if word["op"] == "status" and word["level"] == 2]

    @staticmethod
    def call(viewer, name, payload, call=1):
        services = next(word for word in viewer.words if word["op"] == "advertiseServices")["services"]
        service = next(s["id"] for s in services if s["name"] == name)
        viewer.send_frame(2, struct.pack("<BIII", 2, service, call, 4) + b"json" + payload)
        kind = None

        def is_answer(what, value):
            nonlocal kind
            kind = what
            return what == "answer" or (what == "word" and value["op"] == "serviceCallFailure")

        return viewer.wait_for(is_answer), kind

    def test_settings_and_water(self):
        with Sonard() as daemon, Viewer(daemon.address) as viewer, Viewer(daemon.address) as other:
            viewer.greeted()
            values = self.parameters(viewer)
            self.assertEqual((values["/front/range_m"], values["/clock/mode"], values["/faults/armed"]), (10, "realtime", False))
            self.assertEqual(set(self.parameters(viewer, "one", "/front/range_m", "/none")), {"/front/range_m"})
            other.greeted().say(op="subscribeParameterUpdates", parameterNames=["/front/range_m"])
            self.assertEqual(self.set(viewer, "/front/range_m", 5), 5)
            other.wait_for(lambda kind, word: kind == "word" and word["op"] == "parameterValues" and
                           word["parameters"] == [{"name": "/front/range_m", "value": 5.0, "type": "float64"}])
            self.assertEqual(self.set(viewer, "/front/gain_percent", 30), 30)
            self.assertEqual(self.set(viewer, "/front/transmit", False), False)
            self.assertEqual(self.set(viewer, "/water/temperature_c", 4), 4)
            self.assertEqual(self.set(viewer, "/front/range_m", 5000), 5)
            self.assertEqual(self.set(viewer, "/front/range_m", "far"), 5)
            self.assertEqual(self.set(viewer, "/front/mode", 1.5), values["/front/mode"])
            self.assertIsNone(self.set(viewer, "/front/nothing", 1))
            self.assertEqual(self.set(viewer, "/clock/mode", "stepped"), "realtime")
            self.assertIsNone(self.set(viewer, "/faults/power_cycle", 5))
            self.assertTrue(any("--faults" in text for text in self.refusals(viewer)), viewer.words)
            self.assertIn("live view http 127.0.0.1", daemon.log())

    def test_faults_count_down(self):
        with Sonard(arguments=["--faults"]) as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted()
            trouble = next(name for name in self.parameters(viewer) if name.startswith("/faults/") and name[8:] not in ("armed", "clear_all"))
            self.assertGreater(self.set(viewer, trouble, 20), 19)
            viewer.subscribe("/faults")
            self.assertTrue(viewer.first_of("/faults")["armed"])
            self.assertEqual(self.set(viewer, trouble, 700), self.parameters(viewer, "now", trouble)[trouble])
            self.assertEqual(self.set(viewer, trouble, 0), 0)
            self.assertEqual(self.set(viewer, "/faults/clear_all", True), False)

    def test_services_are_the_requests_of_http(self):
        with Sonard(control=ORIGINS, arguments=["--clock", "lockstep"]) as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().wait_for(lambda kind, word: kind == "word" and word["op"] == "advertiseServices")
            (service, call, encoding, body), kind = self.call(viewer, "/sonard/step", b'{"dt_s": 0.5}', 7)
            self.assertEqual((kind, call, encoding), ("answer", 7, "json"))
            self.assertEqual(json.loads(body)["now_ns"], "500000000")
            viewer.wait_for(lambda kind, value: kind == "time" and value == 500_000_000)
            failure, kind = self.call(viewer, "/sonard/set_sonar", b'{"range_m": -1}')
            self.assertEqual((kind, failure["callId"]), ("word", 1))
            failure, kind = self.call(viewer, "/sonard/step", b"nonsense")
            self.assertEqual(kind, "word")
            with Viewer(daemon.address, headers={"Origin": "https://look.example"}) as looker:
                looker.greeted().wait_for(lambda kind, word: kind == "word" and word["op"] == "advertiseServices")
                failure, kind = self.call(looker, "/sonard/step", b'{"dt_s": 0.5}')
                self.assertIn("may only look", failure["message"])
                self.assertEqual(self.set(looker, "/front/range_m", 5), 10)


class Limits(unittest.TestCase):
    def test_eight_viewers_and_no_more(self):
        with Sonard() as daemon, contextlib.ExitStack() as stack:
            viewers = [stack.enter_context(Viewer(daemon.address)).greeted() for _ in range(8)]
            self.assertEqual(refusal(daemon.address).status, 503)
            viewers[0].socket.close()
            time.sleep(0.5)
            stack.enter_context(Viewer(daemon.address)).greeted()

    def close_code(self, viewer):
        with self.assertRaises(Closed) as closed:
            while True:
                viewer.receive()
        return closed.exception.code

    def test_noise_is_not_listened_to(self):
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

    def test_says_goodbye(self):
        with Sonard() as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted()
            self.assertEqual(daemon.stop()[0], 0)
            self.assertEqual(self.close_code(viewer), 1001)


def resident_kb(daemon):
    return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{daemon.process.pid}/status").read_text(encoding="utf-8"))[1])


def watch_all(viewer, reads):
    with contextlib.suppress(OSError, Closed):
        viewer.greeted().subscribe(*(channel["topic"] for channel in viewer.channels.values()))
        while reads:
            viewer.receive()


class LookingChangesNothing(unittest.TestCase):
    PINGS = 100

    def run_with(self, viewers, reads=True):
        """SHA-256 of what a driver received."""
        with Sonard(trajectory="orbit", arguments=["--clock", "stepped", "--digest", "--exit-after-pings", self.PINGS]) as daemon:
            connections = [Viewer(daemon.address, small_window=not reads) for _ in range(viewers)]
            threads = [threading.Thread(target=watch_all, args=(viewer, reads)) for viewer in connections]
            for thread in threads:
                thread.start()
            time.sleep(0.5 if viewers else 0)
            received = hashlib.sha256()
            with Client(daemon.address) as client, contextlib.suppress(EOFError):
                client.send(fire_message())
                for n in range(10**6):
                    if viewers == 8 and n == 20:  # one dies in the middle
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

    def test_one_that_never_reads_costs_no_ping_and_little_memory(self):
        def take_pings(client, count):
            while count > 0:
                count -= client.message()[0] == 0x23

        with Sonard() as daemon:
            with Client(daemon.address) as client:
                client.send(fire_message(rate_hz=5))
                take_pings(client, 10)
                before = resident_kb(daemon)
                viewer = Viewer(daemon.address, small_window=True)
                self.addCleanup(viewer.socket.close)
                viewer.greeted().subscribe("/front/image", "/front/geometry", "/tf", "/status")
                take_pings(client, 40)
                picture_kb = 1024
                self.assertLess(resident_kb(daemon) - before, 4096 + picture_kb)
            daemon.stop()
            self.assertRegex(daemon.log(), r"sonar front .* 0 dropped")


if __name__ == "__main__":
    unittest.main()
