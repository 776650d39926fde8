"""Tests changes by viewers of the live view (settings, faults, previews, playback), and what viewers see when a configuration is
reloaded."""
import contextlib
import json
import pathlib
import re
import signal
import struct
import time
import unittest

from foxglove_viewer import Viewer
from oculus_reader import Client, fire_message, reading
from running_sonard import SONARCTL, Sonard, eventually, run

ORIGINS = ', view_origins: ["https://look.example"]'
SECOND = "  - {{name: second, profile: oculus-m1200d, mount: {{frame: FLU, xyz_m: [0, 0, 0]}}, bind_ip: {0}, status_to: [{0}]}}\nposes:"


class Reload(unittest.TestCase):
    def test_kept_values_come_again_with_a_new_session(self):
        with Sonard(arguments=["--clock", "lockstep"]) as daemon, Client(daemon.address) as client, Viewer(daemon.address) as viewer, \
                contextlib.ExitStack() as stack:
            config = pathlib.Path(daemon.folder.name) / "sonard.yaml"
            text = config.read_text(encoding="utf-8")
            client.send(fire_message())
            stack.enter_context(reading(client))  # otherwise the step waits until the driver's time limit
            kept = ["/scene", "/swath", "/front/geometry", "/front/image", "/faults", "/tf", "/status"]
            viewer.greeted().subscribe(*kept)
            viewer.wait_for(lambda kind, word: kind == "word" and word["op"] == "advertiseServices")
            viewer.call("/sonard/step", b'{"dt_s": 1}')
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
            viewer.greeted().subscribe("/front/fan", "/front/picture", "/front/cloud")
            lines = viewer.channel("/front/cloud")
            self.assertEqual(viewer.set("/front/preview", True), True)
            self.assertEqual(viewer.first_of("/front/picture")["kind"], "sweep")
            config = pathlib.Path(daemon.folder.name) / "sonard.yaml"
            text = config.read_text(encoding="utf-8")
            config.write_text(text.replace("profile: ping360", "profile: surveyor-240"), encoding="utf-8")
            daemon.process.send_signal(signal.SIGHUP)
            eventually(lambda: "reloaded: " in daemon.log())
            self.assertEqual(viewer.set("/front/preview", True), True)
            viewer.wait_for(lambda kind, value: kind == "message" and value[0] == "/front/picture"
                            and viewer.decode(*value[::2])["kind"] == "points")
            # Clouds of one beam are queued, clouds of a fan replace each other, so the channel must be another one.
            viewer.wait_for(lambda *_: any(c["topic"] == "/front/cloud" and id != lines for id, c in viewer.channels.items()))
            self.assertNotIn(lines, viewer.channels)
            viewer.messages.clear()
            viewer.subscribe("/front/cloud")
            viewer.first_of("/front/cloud")


class Steering(unittest.TestCase):
    def refusals(self, viewer):
        return [word["message"] for word in viewer.words if word["op"] == "status" and word["level"] == 2]

    def test_settings_and_water(self):
        with Sonard() as daemon, Viewer(daemon.address) as viewer, Viewer(daemon.address) as other:
            viewer.greeted()
            values = viewer.parameters()
            self.assertEqual((values["/front/range_m"], values["/clock/mode"], values["/faults/armed"]), (10, "realtime", False))
            self.assertEqual(set(viewer.parameters("one", "/front/range_m", "/none")), {"/front/range_m"})
            other.greeted().say(op="subscribeParameterUpdates", parameterNames=["/front/range_m"])
            self.assertEqual(viewer.set("/front/range_m", 5), 5)
            other.wait_for(lambda kind, word: kind == "word" and word["op"] == "parameterValues" and
                           word["parameters"] == [{"name": "/front/range_m", "value": 5.0, "type": "float64"}])
            self.assertEqual(viewer.set("/front/gain_percent", 30), 30)
            self.assertEqual(viewer.set("/front/transmit", False), False)
            self.assertEqual(viewer.set("/water/temperature_c", 4), 4)
            self.assertEqual(viewer.set("/front/range_m", 5000), 5)
            self.assertEqual(viewer.set("/front/range_m", "far"), 5)
            self.assertEqual(viewer.set("/front/mode", 1.5), values["/front/mode"])
            self.assertEqual(viewer.set("/front/view/cloud_threshold", 0.9), 0.9)
            self.assertEqual(viewer.set("/front/view/cloud_threshold", 1.5), 0.9)
            self.assertEqual(other.parameters("own", "/front/view/cloud_threshold")["/front/view/cloud_threshold"], 0.35)
            self.assertIsNone(viewer.set("/front/nothing", 1))
            self.assertEqual(viewer.set("/clock/mode", "stepped"), "realtime")
            self.assertIsNone(viewer.set("/faults/power_cycle", 5))
            self.assertTrue(any("--faults" in text for text in self.refusals(viewer)), viewer.words)
            self.assertIn("live view http 127.0.0.1", daemon.log())

    def test_faults_count_down(self):
        with Sonard(arguments=["--faults"]) as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted()
            trouble = next(name for name in viewer.parameters() if name.startswith("/faults/") and name[8:] not in ("armed", "clear_all"))
            self.assertGreater(viewer.set(trouble, 500), 400)
            viewer.subscribe("/faults")
            self.assertTrue(viewer.first_of("/faults")["armed"])
            longest = viewer.set(trouble, 700)
            self.assertTrue(500 < viewer.parameters("now", trouble)[trouble] <= longest <= 600, longest)
            self.assertEqual(viewer.set(trouble, 0), 0)
            self.assertEqual(viewer.set("/faults/clear_all", True), False)

    def test_services_are_the_requests_of_http(self):
        with Sonard(control=ORIGINS, arguments=["--clock", "lockstep"]) as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().wait_for(lambda kind, word: kind == "word" and word["op"] == "advertiseServices")
            (service, call, encoding, body), kind = viewer.call("/sonard/step", b'{"dt_s": 0.5}', 7)
            self.assertEqual((kind, call, encoding), ("answer", 7, "json"))
            self.assertEqual(json.loads(body)["now_ns"], "500000000")
            viewer.wait_for(lambda kind, value: kind == "time" and value == 500_000_000)
            failure, kind = viewer.call("/sonard/set_sonar", b'{"range_m": -1}')
            self.assertEqual((kind, failure["callId"]), ("word", 1))
            failure, kind = viewer.call("/sonard/step", b"nonsense")
            self.assertEqual(kind, "word")
            with Viewer(daemon.address, headers={"Origin": "https://look.example"}) as looker:
                looker.greeted().wait_for(lambda kind, word: kind == "word" and word["op"] == "advertiseServices")
                failure, kind = looker.call("/sonard/step", b'{"dt_s": 0.5}')
                self.assertIn("is read-only", failure["message"])
                self.assertEqual(looker.set("/front/range_m", 5), 10)


def is_ping(kind, value):
    return kind == "message" and value[0] == "/front/ping"


class Preview(unittest.TestCase):
    @staticmethod
    def numbers(viewer, seconds):
        """Returns (number, True if it is a preview) of each ping that is shown in the meantime."""
        seen, deadline = [], time.monotonic() + seconds
        while time.monotonic() < deadline:  # /status is sent every second
            kind, value = viewer.receive()
            if is_ping(kind, value):
                event = viewer.decode(*value[::2])
                seen.append((event["number"], event.get("preview", False)))
        return seen

    def test_viewers_get_pings_until_a_driver_connects(self):
        with Sonard() as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribe("/front/ping", "/front/image", "/status")
            self.assertEqual(self.numbers(viewer, 1), [])
            self.assertEqual(viewer.set("/front/preview", True), True)
            viewer.first_of("/front/ping")
            shown = [viewer.decode(*viewer.wait_for(is_ping)[::2]) for _ in range(8)]
            self.assertEqual([(event["number"], event["preview"]) for event in shown], [(n, True) for n in range(2, 10)])
            first_ns, *_, last_ns = (int(event["fired_at_ns"]) for event in shown)
            self.assertGreater(last_ns - first_ns, 0.9e9 * (len(shown) - 1) / 5, "at most 5 per second")
            status = json.loads(daemon.get("/api/v1/status"))
            self.assertTrue(status["sonars"][0]["preview"], status)
            eventually(lambda: re.search(r" Hz, preview [0-5]\.\d Hz  gain", run(SONARCTL, "status", "--control", f"{daemon.address}:14770").stdout))
            self.assertEqual((status["sonars"][0]["figures"]["pings"], status["sonars"][0]["clients"]), ("0", []))
            with Client(daemon.address) as client:
                client.send(fire_message())
                self.assertEqual(client.ping().id, 1, "a driver's first ping has the number 1")
                deadline = time.monotonic() + 60  # the live view checks this ten times a second
                while viewer.parameters("now", "/front/preview")["/front/preview"]:
                    self.assertLess(time.monotonic(), deadline)
                    time.sleep(0.1)  # a viewer that sends requests without a pause is disconnected
                self.assertEqual(viewer.set("/front/preview", True), False)
                self.assertTrue(all(not preview for _, preview in self.numbers(viewer, 1)))
            events = [viewer.decode(topic, payload) for topic, _, payload in viewer.messages if topic == "/front/ping"]
            self.assertEqual([e["number"] for e in events if not e.get("preview")][0], 1)
            self.assertIn("preview ends", daemon.log())

    def test_a_preview_ends_with_its_viewer(self):
        with Sonard(control=ORIGINS) as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribe("/front/ping", "/status")
            with Viewer(daemon.address, headers={"Origin": "https://look.example"}) as looker:
                self.assertEqual(looker.greeted().set("/front/preview", True), False)
            with Viewer(daemon.address) as other:
                self.assertEqual(other.greeted().set("/front/preview", True), True)
                viewer.first_of("/front/ping")
            while viewer.parameters("on", "/front/preview")["/front/preview"]:
                time.sleep(0.1)
            self.assertEqual(self.numbers(viewer, 1.5), [])

    def test_there_is_no_preview_in_stepped_time(self):
        with Sonard(arguments=["--clock", "stepped"]) as daemon, Viewer(daemon.address) as viewer:
            self.assertNotIn("/front/preview", viewer.greeted().parameters())
            self.assertIsNone(viewer.set("/front/preview", True))


def follows_file(loop=False):
    """Returns a daemon whose trajectory goes straight ahead for ten seconds."""
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
            playback = other.wait_for(lambda kind, value: kind == "playback" and value["state"] == "paused")
            self.assertEqual((playback["ns"], playback["did_seek"], playback["request"]), (3 * self.S, 1, ""))
            for speed in (0.0, -1.0, 2000.0, float("nan"), float("inf")):
                self.assertEqual(self.control(viewer, "b", pause=True, speed=speed)["speed"], 1.5)
                self.assertIn("speed", viewer.words[-1]["message"])
            self.assertEqual(self.control(viewer, "c", pause=True, to_ns=2**62)["ns"], end_ns)
            self.control(viewer, "d", pause=True, to_ns=3 * self.S)

            # Changes by other viewers are reported; stamps are those of the trajectory.
            self.assertEqual(plain.set("/rov/trajectory/position_s", 5), 5)
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

    def test_loops_and_read_only_viewers(self):
        with follows_file(loop=True) as daemon:
            with Viewer(daemon.address, path="/?playback=rov", headers={"Origin": "https://look.example"}) as looker:
                looker.greeted()
                self.assertEqual(self.control(looker, "x", pause=True)["state"], "playing")
                self.assertIn("is read-only", looker.words[-1]["message"])
            with Viewer(daemon.address, path="/?playback=nothing") as viewer:
                self.assertIn("nothing", viewer.greeted().status()["message"])
                self.assertNotIn("playbackControl", viewer.info["capabilities"])
                viewer.send_frame(2, struct.pack("<BBfBQI", 3, 0, 1.0, 0, 0, 0))
                self.assertIn("playbackControl", viewer.status()["message"])
            with Viewer(daemon.address, path="/?playback=rov") as viewer:
                viewer.greeted()
                end_ns = viewer.info["dataEndTime"]["sec"] * self.S + viewer.info["dataEndTime"]["nsec"]
                self.control(viewer, "near the end", speed=0.1, to_ns=end_ns - self.S // 10)
                round_ = viewer.wait_for(lambda kind, value: kind == "playback" and value["did_seek"] and not value["request"])
                self.assertLess(round_["ns"], self.S)


if __name__ == "__main__":
    unittest.main()
