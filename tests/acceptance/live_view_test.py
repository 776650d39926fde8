"""The live view as viewers meet it: a strict client of its own on a live daemon. Rights, limits, and that looking changes nothing."""
import contextlib
import hashlib
import json
import math
import pathlib
import re
import signal
import socket
import struct
import threading
import time
import unittest
import urllib.request

from foxglove_viewer import NAMES, Closed, Refused, Viewer
from oculus_reader import Client, fire_message
from running_sonard import BUILD, SONARCTL, Sonard, eventually, run

ORIGINS = ', view_origins: ["https://look.example", {origin: "https://steer.example", steer: true}], hosts: [sonar-lab]'


def http(daemon, path):
    with urllib.request.urlopen(f"http://{daemon.address}:8088{path}", timeout=20) as answer:
        return answer.read().decode()


def refusal(*arguments, **options):
    try:
        Viewer(*arguments, **options).socket.close()
    except Refused as refused:
        return refused
    raise AssertionError("was let in")


def let_in(*arguments):
    """A viewer, or None while there is no place for it."""
    try:
        return Viewer(*arguments)
    except Refused as refused:
        assert refused.status == 503
    return None


@contextlib.contextmanager
def reading(client):
    """It reads as a driver does until the end, when it hangs up."""
    def read():
        with contextlib.suppress(OSError):
            while client.socket.recv(1 << 16):
                pass

    reader = threading.Thread(target=read)
    reader.start()
    try:
        yield
    finally:
        client.socket.shutdown(socket.SHUT_RDWR)
        reader.join()


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
        refused = refusal(self.daemon.address, headers={"Upgrade": "h2c", "Accept": "*/*"})
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
            self.assertEqual(topics, {"/tf", "/scene", "/swath", "/log", "/status", "/faults", "/doctor",
                                      *(f"/front/{name}" for name in ("image", "geometry", "ping", "figures", "fan", "picture", "cloud", "truth"))})
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

    def test_truth_is_made_while_it_is_looked_at(self):
        with Sonard(scene="l-targets.yaml", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}", arguments=["--clock", "stepped"]) as daemon, \
                Viewer(daemon.address) as viewer, Client(daemon.address) as client:
            viewer.greeted().subscribe("/front/truth")
            viewer.say(op="getParameters", parameterNames=[], id="subscribed")  # answered after it
            viewer.wait_for(lambda kind, value: kind == "word" and value.get("id") == "subscribed")
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


SECOND = "  - {{name: second, profile: oculus-m1200d, mount: {{frame: FLU, xyz_m: [0, 0, 0]}}, bind_ip: {0}, status_to: [{0}]}}\nposes:"


class Reload(unittest.TestCase):
    def test_kept_values_come_again_with_a_new_session(self):
        with Sonard(arguments=["--clock", "lockstep"]) as daemon, Client(daemon.address) as client, Viewer(daemon.address) as viewer:
            config = pathlib.Path(daemon.folder.name) / "sonard.yaml"
            text = config.read_text(encoding="utf-8")
            client.send(fire_message())
            kept = ["/scene", "/swath", "/front/geometry", "/front/image", "/faults", "/tf", "/status"]
            viewer.greeted().subscribe(*kept)
            viewer.wait_for(lambda kind, word: kind == "word" and word["op"] == "advertiseServices")
            Steering.call(viewer, "/sonard/step", b'{"dt_s": 1}')
            for topic in kept:
                viewer.first_of(topic)
            config.write_text(text.replace("poses:", SECOND.format("127.0.0.9"), 1), encoding="utf-8")
            daemon.process.send_signal(signal.SIGHUP)
            viewer.wait_for(lambda kind, word: kind == "word" and word["op"] == "advertise")
            first = viewer.info["sessionId"]
            config.write_text(text, encoding="utf-8")
            daemon.process.send_signal(signal.SIGHUP)
            viewer.wait_for(lambda kind, word: kind == "word" and word["op"] == "serverInfo")
            self.assertNotEqual(viewer.info["sessionId"], first)
            viewer.messages.clear()
            viewer.times.clear()
            for topic in kept:
                with self.subTest(topic):
                    viewer.first_of(topic)
            self.assertTrue(viewer.times)

    def test_a_sonar_that_becomes_another_make_gets_the_picture_of_that_make(self):
        with Sonard(profile="ping360") as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribe("/front/fan", "/front/picture")
            self.assertEqual(Steering.set(viewer, "/front/preview", True), True)
            self.assertEqual(viewer.first_of("/front/picture")["kind"], "sweep")
            config = pathlib.Path(daemon.folder.name) / "sonard.yaml"
            text = config.read_text(encoding="utf-8")
            config.write_text(text.replace("profile: ping360", "profile: surveyor-240"), encoding="utf-8")
            daemon.process.send_signal(signal.SIGHUP)
            eventually(lambda: "reloaded: " in daemon.log())
            self.assertEqual(Steering.set(viewer, "/front/preview", True), True)
            viewer.wait_for(lambda kind, value: kind == "message" and value[0] == "/front/picture"
                            and viewer.decode(*value[::2])["kind"] == "points")


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
            self.assertEqual(self.set(viewer, "/front/view/cloud_threshold", 0.9), 0.9)
            self.assertEqual(self.set(viewer, "/front/view/cloud_threshold", 1.5), 0.9)
            self.assertEqual(self.parameters(other, "own", "/front/view/cloud_threshold")["/front/view/cloud_threshold"], 0.35)
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


class Preview(unittest.TestCase):
    @staticmethod
    def numbers(viewer, seconds):
        """Of the pings shown meanwhile: (number, whether it is a preview)."""
        seen, deadline = [], time.monotonic() + seconds
        while time.monotonic() < deadline:  # /status comes every second
            kind, value = viewer.receive()
            if kind == "message" and value[0] == "/front/ping":
                event = viewer.decode(*value[::2])
                seen.append((event["number"], event.get("preview", False)))
        return seen

    def test_pings_for_viewers_until_a_driver_connects(self):
        with Sonard() as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribe("/front/ping", "/front/image", "/status")
            self.assertEqual(self.numbers(viewer, 1), [])
            self.assertEqual(Steering.set(viewer, "/front/preview", True), True)
            viewer.first_of("/front/ping")
            shown = self.numbers(viewer, 4)
            self.assertEqual(shown, [(n, True) for n in range(2, len(shown) + 2)])
            self.assertTrue(1 <= len(shown) <= 22, shown)
            status = json.loads(http(daemon, "/api/v1/status"))
            self.assertTrue(status["sonars"][0]["preview"], status)
            eventually(lambda: re.search(r" Hz, preview [0-5]\.\d Hz  gain", run(SONARCTL, "status", "--control", f"{daemon.address}:14770").stdout))
            self.assertEqual((status["sonars"][0]["figures"]["pings"], status["sonars"][0]["clients"]), ("0", []))
            with Client(daemon.address) as client:
                client.send(fire_message())
                self.assertEqual(client.ping().id, 1, "a driver's first ping")
                deadline = time.monotonic() + 60  # the view looks ten times a second
                while Steering.parameters(viewer, "now", "/front/preview")["/front/preview"]:
                    self.assertLess(time.monotonic(), deadline)
                    time.sleep(0.1)  # a viewer that asks without end is closed
                self.assertEqual(Steering.set(viewer, "/front/preview", True), False)
                self.numbers(viewer, 2)
            events = [viewer.decode(topic, payload) for topic, _, payload in viewer.messages if topic == "/front/ping"]
            self.assertEqual([e["number"] for e in events if not e.get("preview")][0], 1)
            self.assertIn("preview ends", daemon.log())

    def test_ends_with_its_viewer(self):
        with Sonard(control=ORIGINS) as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribe("/front/ping", "/status")
            with Viewer(daemon.address, headers={"Origin": "https://look.example"}) as looker:
                self.assertEqual(Steering.set(looker.greeted(), "/front/preview", True), False)
            with Viewer(daemon.address) as other:
                self.assertEqual(Steering.set(other.greeted(), "/front/preview", True), True)
                viewer.first_of("/front/ping")
            while Steering.parameters(viewer, "on", "/front/preview")["/front/preview"]:
                time.sleep(0.1)
            self.assertEqual(self.numbers(viewer, 1.5), [])

    def test_only_in_real_time(self):
        with Sonard(arguments=["--clock", "stepped"]) as daemon, Viewer(daemon.address) as viewer:
            self.assertNotIn("/front/preview", Steering.parameters(viewer.greeted()))
            self.assertIsNone(Steering.set(viewer, "/front/preview", True))


def follows_file(loop=False):
    """Ten seconds straight ahead."""
    daemon = Sonard(trajectory=f"{{file: ahead.tum, loop: {str(loop).lower()}}}", control=ORIGINS)
    lines = ["# frame: ENU_FLU", "100 -7 0 -3 0 0 0 1", "110 -6 0 -3 0 0 0 1"]
    (pathlib.Path(daemon.folder.name) / "ahead.tum").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return daemon


class Playback(unittest.TestCase):
    S = 10**9

    @staticmethod
    def control(viewer, request, pause=False, speed=1.0, to_ns=None):
        viewer.send_frame(2, struct.pack("<BBfBQI", 3, pause, speed, to_ns is not None, to_ns or 0, len(request)) + request.encode())
        return viewer.wait_for(lambda kind, value: kind == "playback" and value["request"] == request)

    def test_a_trajectory_is_played_as_a_recording(self):
        with follows_file() as daemon, Viewer(daemon.address, path="/?playback=rov") as viewer, \
                Viewer(daemon.address, path="/?playback=rov") as other, Viewer(daemon.address) as plain:
            for each in (viewer, other):
                each.greeted()
                self.assertTrue({"playbackControl", "time"} <= set(each.info["capabilities"]))
            end_ns = viewer.info["dataEndTime"]["sec"] * self.S + viewer.info["dataEndTime"]["nsec"]
            self.assertEqual(viewer.info["dataStartTime"], {"sec": 0, "nsec": 0})
            self.assertNotIn("playbackControl", plain.greeted().info["capabilities"])
            viewer.wait_for(lambda kind, value: kind == "playback" and value["state"] == "playing")
            viewer.wait_for(lambda kind, value: kind == "time" and value <= end_ns)

            paused = self.control(viewer, "a", pause=True, speed=1.5, to_ns=3 * self.S)
            self.assertEqual(paused, {"state": "paused", "ns": 3 * self.S, "speed": 1.5, "did_seek": 1, "request": "a"})
            told = other.wait_for(lambda kind, value: kind == "playback" and value["state"] == "paused")
            self.assertEqual((told["ns"], told["did_seek"], told["request"]), (3 * self.S, 1, ""))
            for speed in (0.0, -1.0, 2000.0, float("nan"), float("inf")):
                self.assertEqual(self.control(viewer, "b", pause=True, speed=speed)["speed"], 1.5)
                self.assertIn("speed", viewer.words[-1]["message"])
            self.assertEqual(self.control(viewer, "c", pause=True, to_ns=2**62)["ns"], end_ns)
            self.control(viewer, "d", pause=True, to_ns=3 * self.S)

            # What others steer is told; stamps are the trajectory's.
            self.assertEqual(Steering.set(plain, "/rov/trajectory/position_s", 5), 5)
            moved = viewer.wait_for(lambda kind, value: kind == "playback" and value["request"] == "")
            self.assertEqual((moved["ns"], moved["did_seek"]), (5 * self.S, 1))
            viewer.wait_for(lambda kind, value: kind == "time" and value == 5 * self.S)
            viewer.subscribe("/front/image", "/tf", "/status", "/front/figures", "/front/ping")
            with Client(daemon.address) as client:
                client.send(fire_message())
                image = viewer.first_of("/front/image")
                self.assertEqual(image["timestamp"], {"seconds": 5})
                self.assertEqual(int(viewer.first_of("/front/ping")["fired_at_ns"]), 5 * self.S)
                self.assertEqual(int(viewer.first_of("/status")["now_ns"]), 5 * self.S)
                figures = viewer.wait_for(lambda kind, value: kind == "message" and value[0] == "/front/figures")
                self.assertEqual((figures[1], struct.unpack_from("<d", figures[2], 4)[0]), (5 * self.S, 5.0))
                plain.subscribe("/front/image")
                self.assertGreater(plain.first_of("/front/image")["timestamp"]["seconds"], 10**9)
            self.assertTrue(all(ns == 5 * self.S for topic, ns, _ in viewer.messages if topic == "/front/image"))

    def test_rounds_and_rights(self):
        with follows_file(loop=True) as daemon:
            with Viewer(daemon.address, path="/?playback=rov", headers={"Origin": "https://look.example"}) as looker:
                looker.greeted()
                self.assertEqual(self.control(looker, "x", pause=True)["state"], "playing")
                self.assertIn("may only look", looker.words[-1]["message"])
            with Viewer(daemon.address, path="/?playback=nothing") as viewer:
                self.assertIn("nothing", viewer.greeted().status()["message"])
                self.assertNotIn("playbackControl", viewer.info["capabilities"])
                viewer.send_frame(2, struct.pack("<BBfBQI", 3, 0, 1.0, 0, 0, 0))
                self.assertIn("playbackControl", viewer.status()["message"])
            with Viewer(daemon.address, path="/?playback=rov") as viewer:
                viewer.greeted()
                end_ns = viewer.info["dataEndTime"]["sec"] * self.S + viewer.info["dataEndTime"]["nsec"]
                self.control(viewer, "near the end", to_ns=end_ns - self.S)
                round_ = viewer.wait_for(lambda kind, value: kind == "playback" and value["did_seek"] and not value["request"])
                self.assertLess(round_["ns"], self.S)


class Doctor(unittest.TestCase):
    """What keeps a driver from its pings is named within 5 s."""

    @contextlib.contextmanager
    def daemon_and_viewer(self, **options):
        with Sonard(**options) as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribe("/doctor")
            start = time.monotonic()
            viewer.first_of("/doctor")
            self.assertLess(time.monotonic() - start, 50)
            yield daemon, viewer

    def named(self, viewer, check, *words):
        """The first finding of that check that is not well and has these words."""
        found = []

        def is_it(kind, value):
            if kind != "message":
                return False
            findings = viewer.decode("/doctor", value[2])["findings"]
            found[:] = [f for f in findings if f["check"] == check and f.get("level", 0) > 0 and all(w in f["text"] for w in words)]
            return bool(found) and findings[0].get("level", 0) > 0  # the worst first

        viewer.wait_for(is_it)
        return found[0]

    @staticmethod
    def name_of(client):
        return "%s:%d" % client.socket.getsockname()

    def test_connected_and_never_fires(self):
        with self.daemon_and_viewer() as (daemon, viewer):
            self.assertIn(f"point a driver at {daemon.address}, TCP port 52100", viewer.first_of("/doctor")["findings"][0]["cure"])
            with Client(daemon.address) as client:
                finding = self.named(viewer, "driver", self.name_of(client), "has not asked for pings", "sent nothing")
                self.assertEqual((finding["sonar"], finding["client"], finding["level"]), ("front", self.name_of(client), 2))
                client.send(b"PING\r\n")
                self.named(viewer, "driver", "it has sent 6 bytes, no valid fire message among them")
                client.send(fire_message())
                with reading(client):
                    viewer.wait_for(lambda kind, value: kind == "message" and  # a busy machine may make pings late
                                    all(f.get("level", 0) == 0 or f["check"] != "driver"
                                        for f in viewer.decode("/doctor", value[2])["findings"]))
            self.named(viewer, "driver", "No driver is connected to front", "left at")

    def test_on_a_wrong_address(self):
        with self.daemon_and_viewer() as (daemon, viewer):
            for port in (52100, 52101):
                with contextlib.suppress(ConnectionRefusedError):
                    socket.create_connection(("127.0.0.1" if port == 52100 else daemon.address, port)).close()
            finding = self.named(viewer, "address", " of programs of this computer failed")
            self.assertIn(f"point the driver at {daemon.address}, TCP port 52100", finding["cure"])
            with socket.create_server(("127.99.0.1", 52100)) as other, socket.create_connection(other.getsockname()):
                self.named(viewer, "address", "is connected to 127.99.0.1:52100, which is not a sonar")

    def test_does_not_read(self):
        with self.daemon_and_viewer() as (daemon, viewer), Client(daemon.address) as client:
            client.send(fire_message())
            self.named(viewer, "read", self.name_of(client), "has not read for")

    def test_turned_away(self):
        with self.daemon_and_viewer() as (daemon, viewer), Client(daemon.address) as client:
            client.send(fire_message())
            with reading(client), Client(daemon.address) as other:
                self.assertEqual(other.socket.recv(1), b"")
                finding = self.named(viewer, "places", self.name_of(other), "was refused", self.name_of(client))
                self.assertIn("clients.max", finding["cure"])

    def test_standby_and_faults(self):
        with self.daemon_and_viewer(arguments=["--faults"]) as (daemon, viewer), Client(daemon.address) as client:
            client.send(fire_message(rate_hz=0))
            self.named(viewer, "standby", "set by " + self.name_of(client))
            self.assertGreater(Steering.set(viewer, "/faults/power_cycle", 20), 19)
            self.named(viewer, "fault", "power-cycle")

    def test_stepped_time_waits(self):
        with self.daemon_and_viewer(arguments=["--clock", "stepped"]) as (daemon, viewer), Client(daemon.address) as client:
            client.send(fire_message())
            self.named(viewer, "clock", "Time stands still at", f"it moves when {self.name_of(client)} has taken ping", "has not read for")


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

    def test_what_a_slow_one_loses_is_counted(self):
        with Sonard() as daemon, Viewer(daemon.address, small_window=True) as viewer, Client(daemon.address) as client:
            viewer.greeted().subscribe("/front/image")
            client.send(fire_message(rate_hz=5))
            deadline = time.monotonic() + 30
            while not (count := re.search(r'sonard_viewer_dropped_total\{viewer="http 127\.[^"]+:\d+",channel="/front/image"\} ([1-9]\d*)\n',
                                          http(daemon, "/metrics"))):
                self.assertLess(time.monotonic(), deadline, http(daemon, "/metrics"))
                client.message()
            self.assertIn("\nsonard_viewers 1\n", http(daemon, "/metrics"))
            viewers = json.loads(http(daemon, "/api/v1/status"))["viewers"]
            self.assertGreaterEqual(int(viewers[0]["dropped"]["/front/image"]), int(count[1]))

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

    def test_ten_that_never_read_cost_no_ping_and_little_memory(self):
        def take_pings(client, count):
            while count > 0:
                count -= client.message()[0] == 0x23

        viewers, picture_kb = 10, 1024
        with Sonard(more=f"limits: {{viewers: {viewers}}}") as daemon:
            with Client(daemon.address) as client:
                client.send(fire_message(rate_hz=5))
                take_pings(client, 10)
                before = resident_kb(daemon)
                for _ in range(viewers):
                    viewer = Viewer(daemon.address, small_window=True)
                    self.addCleanup(viewer.socket.close)
                    viewer.greeted().subscribe("/front/image", "/front/geometry", "/tf", "/status")
                take_pings(client, 40)
                print(f"{(resident_kb(daemon) - before) / viewers:.0f} kB a viewer")
                if "SONAR_SANITIZE:STRING=\n" in (BUILD / "CMakeCache.txt").read_text(encoding="utf-8"):  # sanitizers keep what was freed
                    self.assertLess(resident_kb(daemon) - before, 2048 * viewers + picture_kb)
            daemon.stop()
            self.assertRegex(daemon.log(), r"sonar front .* 0 dropped")


if __name__ == "__main__":
    unittest.main()
