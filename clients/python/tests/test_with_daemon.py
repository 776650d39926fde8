"""The client with a running sonard: pings of all kinds, poses, discovery, control, and every example of the manuals."""
import contextlib
import io
import math
import os
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import time
import unittest

from common import PACKAGE, ROOT, SONARD, config

from sonard_client import Control, ControlError, Daemon, DaemonFailed, OculusClient, PoseSender, discover
from sonard_client.__main__ import main

WITH_EXAMPLES = ("README.md", "clients/python/README.md")
A, B = (3.76, 1.37), (3.94, -0.69)  # m ahead and to port: the near spheres of scenes/l-targets.yaml


def next_with_settings(sonar, settings, attempts=50):
    """Returns the first ping that echoes these settings. The echoed gain may differ."""
    for ping in sonar.pings(timeout=60, count=attempts):
        echo = ping.settings
        if all(getattr(echo, name) == getattr(settings, name) for name in ("flags", "extended", "range", "mode")):
            return ping
    raise AssertionError("no ping with these settings")


class Running(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(config(), SONARD).__enter__()
        cls.address = cls.daemon.address

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def eventually(self, condition, timeout_s=60):
        deadline = time.monotonic() + timeout_s
        while not condition():
            self.assertLess(time.monotonic(), deadline, self.daemon.log()[-2000:])
            time.sleep(0.02)

    def vehicle(self):
        return Control(self.address).status()["vehicles"][0]

    def test_pings_of_every_version_and_width_arrive(self):
        with OculusClient(self.address) as sonar:
            for chosen in (dict(version=0, beams=256), dict(version=1, bits=16, gains=True), dict(version=2, bits=32),
                         dict(mode=1, gains=True)):
                with self.subTest(**chosen):
                    ping = next_with_settings(sonar, sonar.fire(range_m=5, rate_hz=40, **chosen))
                    self.assertEqual(ping.sample_bits, chosen.get("bits", 8))
                    self.assertEqual(ping.beams, chosen.get("beams", 512))
                    self.assertEqual(ping.version, chosen.get("version", 2))
                    self.assertEqual(ping.row_gains is not None, chosen.get("gains", False))
                    self.assertAlmostEqual(float(ping.ranges_m[-1]), 5, delta=0.1)
                    self.assertGreater(float(ping.azimuths_rad[0]), 0.5)
            self.assertEqual(sonar.reader.skipped_bytes, 0)

    def test_image_follows_the_heading(self):
        for encoding in ("json", "protobuf"):
            for yaw in (0.5, 0.0):
                with self.subTest(encoding, yaw=yaw), OculusClient(self.address) as sonar, \
                        PoseSender(self.address, encoding) as poses:  # a new sender: without extrapolation
                    settings = sonar.fire(range_m=5, rate_hz=40, gain_percent=20, salinity=30, gain_assist=True)
                    poses.send((0, 0, 0), rpy=(0, 0, yaw), timestamp=time.monotonic())
                    self.eventually(lambda: abs(self.vehicle()["orientation"]["z"] - math.sin(yaw / 2)) < 1e-6)
                    ping, heading_deg = next_with_settings(sonar, settings), 90 - math.degrees(yaw)
                    for _ in range(300):  # the first ones may have been made before the pose
                        if abs(ping.heading_deg - heading_deg) < 0.01:
                            break
                        ping = sonar.ping(timeout=60)
                    self.assertAlmostEqual(ping.heading_deg, heading_deg, delta=0.01)
                    there = ping.strongest(beyond_m=3)[-2:]
                    turned = [(x * math.cos(yaw) + y * math.sin(yaw), y * math.cos(yaw) - x * math.sin(yaw)) for x, y in (A, B)]
                    nearest = min(math.hypot(there[0] - x, there[1] - y) for x, y in turned)
                    self.assertLess(nearest, 0.25, f"{there} is none of {turned}")

    def test_poses_arrive_over_every_transport(self):
        sent = dict(position=(1, -2, -3), rpy=(0.1, -0.2, 0.3))
        expected = {"w": 0.98186, "x": 0.06407, "y": -0.09116, "z": 0.15344}
        for number, (encoding, transport) in enumerate((("json", "udp"), ("protobuf", "udp"), ("json", "tcp"))):
            with self.subTest(encoding, transport=transport), PoseSender(self.address, encoding, transport) as poses:
                poses.send(velocity=(0.5, 0, 0), **dict(sent, position=(1, -2, -3 - number)))
                self.eventually(lambda: abs(self.vehicle()["position"]["z"] + 3 + number) < 1e-9)
                vehicle = self.vehicle()
                self.assertIn(encoding, vehicle["source"])
                self.assertTrue(1 <= vehicle["position"]["x"] < 1.11, vehicle)  # extrapolated by the velocity for at most 0.2 s
                self.assertAlmostEqual(vehicle["position"]["y"], -2, places=9)
                for name, value in expected.items():
                    self.assertAlmostEqual(vehicle["orientation"][name], value, places=3)
        with PoseSender(self.address, "protobuf") as poses:  # 1 m down, 90 degrees: bow to the east
            poses.send((5, 6, 1), rpy=(0, 0, math.pi / 2), frame="NED_FRD")
            self.eventually(lambda: abs(self.vehicle()["position"]["x"] - 6) < 1e-9)
            vehicle = self.vehicle()
            self.assertAlmostEqual(vehicle["position"]["z"], -1)
            self.assertAlmostEqual(abs(vehicle["orientation"]["w"]), 1)

    def test_protobuf_poses_have_unix_time_and_angular_velocity(self):
        with PoseSender(self.address, "protobuf", clock="wall", vehicle="rov") as poses:
            poses.send((0, 0, -9), angular_velocity=(0, 0, 0.1), timestamp=time.time())
            self.eventually(lambda: self.vehicle()["position"]["z"] == -9)
            self.eventually(lambda: self.vehicle()["orientation"]["z"] > 0.004)  # 0.1 rad/s for a part of 0.2 s

    def test_discovery_finds_the_sonar(self):
        (sonar,) = discover(60, listen=self.address, enough=1)
        self.assertEqual((sonar.address, sonar.sender, sonar.part_number), (self.address, self.address, 1042))

    def test_control_changes_the_daemon(self):
        control = Control(self.address)
        self.assertEqual(control.health(), "ok")
        with control.events(scene=True, timeout=60) as events:
            control.set_sonar("front", range_m=4)
            self.assertEqual(control.status()["sonars"][0]["range_m"], 4)
            control.mount_sonar(rpy_deg=(0, 20, 0))
            control.mount_sonar(position=(0, 0, 0), rpy_deg=(0, 0, 0))
            control.set_environment(temperature_c=7)
            self.assertEqual(control.status()["environment"]["temperature_c"], 7)
            control.add_object("D", like="A", position=(2, 0, 0), moving=True)
            control.move_object("D", (2, 1, 0))
            control.hide_object("B")
            objects = {o["name"]: o for o in control.status()["objects"]}
            self.assertEqual((objects["D"]["position"]["y"], objects["D"]["moving"], objects["B"]["visible"]), (1, True, False))
            control.show_object("B")
            control.place_object("D", (2, 0.5, 0))
            control.remove_object("D")
            self.assertIn("scene", next(events))
        with self.assertRaisesRegex(ControlError, "rear"):
            control.set_sonar("rear", range_m=4)
        self.assertEqual(control.metrics()['sonard_clients{sonar="front"}'], 0)
        control.set_environment(temperature_c=12)

    def test_timeout_and_busy_sonar_have_different_errors(self):
        with OculusClient(self.address) as sonar:
            with self.assertRaisesRegex(TimeoutError, "fire"):
                sonar.ping(timeout=0.1)
            sonar.fire(range_m=2)
            sonar.ping(timeout=60)
            for asks in (False, True):
                with self.assertRaisesRegex(ConnectionError, "may already have a client"), OculusClient(self.address) as second:
                    if asks:
                        second.fire()
                    second.ping()
            sonar.standby()
            self.assertTrue(any(sonar.message(60).type == 0xFF for _ in range(300)), "pings that came before, then dummies")
            sonar.fire(range_m=2, triggered=True)
            sonar.again()
            self.assertGreater(sonar.ping(60).number, 0)

    def run_main(self, *words):
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            code = main(list(words))
        return code, out.getvalue()

    def test_commands_print_their_results(self):
        code, text = self.run_main("listen", self.address, "--count", "2", "--range", "5", "--timeout", "100")
        self.assertEqual((code, text.count("\nping") + text.startswith("ping")), (0, 2), text)
        self.assertEqual(self.run_main("pose", "-1", "2", "-4", "--rpy", "0", "10", "0", "--to", self.address)[0], 0)
        self.eventually(lambda: self.vehicle()["position"] == {"x": -1, "y": 2, "z": -4})
        self.assertIn('"front"', self.run_main("status", "--host", self.address)[1])
        self.assertIn("id 7001", self.run_main("discover", "--listen", self.address, "--enough", "1", "--seconds", "60")[1])
        self.assertEqual(self.run_main("pose", "0", "0", "nan", "--to", self.address)[0], 64)
        code, text = self.run_main("pose", "0", "0", "0", "--to", "no host has spaces")
        self.assertEqual((code, "no address for no host has spaces: " in text), (69, True), text)
        code, text = self.run_main("status", "--token-file", "/none")
        self.assertEqual((code, text), (69, "sonard_client: cannot read /none: No such file or directory\n"))
        with socket.socket() as unused:
            unused.bind(("127.0.0.1", 0))
            port = str(unused.getsockname()[1])
        code, text = self.run_main("status", "--port", port)
        self.assertEqual((code, text[:15]), (69, "sonard_client: "))


class Lockstep(unittest.TestCase):
    def test_one_thread_steps_and_reads(self):
        with Daemon(config() + "clock: lockstep\n", SONARD) as daemon, OculusClient(daemon.address) as sonar:
            control = Control(daemon.address)
            sonar.fire(range_m=10, rate_hz=10)
            deadline = time.monotonic() + 60
            while not control.status()["sonars"][0].get("pinging"):
                self.assertLess(time.monotonic(), deadline)
            began = time.monotonic()
            pings = sonar.pings_during(lambda: control.step(2.0))
            self.assertLess(time.monotonic() - began, 60, "step and reading must not deadlock")
            self.assertEqual([p.number for p in pings], list(range(1, 21)))
            self.assertEqual(len(sonar.pings_during(lambda: control.step(0.1))), 1)
            with self.assertRaises(ControlError):
                sonar.pings_during(lambda: control.step(-1))


class Token(unittest.TestCase):
    def test_the_token_is_required(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder, "token")
            token.write_text("0123456789abcdef0123\n", encoding="utf-8")
            token.chmod(0o600)
            with Daemon(config(more=f", token_file: {token}"), SONARD) as daemon:
                with self.assertRaises(ControlError) as caught:
                    Control(daemon.address).status()
                self.assertEqual(caught.exception.status, 401)
                self.assertEqual(Control(daemon.address, token="0123456789abcdef0123").status()["sonars"][0]["name"], "front")


    def test_a_reader_that_ends_is_no_error(self):
        with Daemon(config(), SONARD) as daemon, subprocess.Popen(
                [sys.executable, "-B", "-m", "sonard_client", "listen", daemon.address, "--timeout", "100"], stdout=subprocess.PIPE,
                stderr=subprocess.PIPE, env=dict(os.environ, PYTHONPATH=str(PACKAGE))) as listener:
            self.assertIn(b"ping ", listener.stdout.readline())
            listener.stdout.close()
            self.assertEqual((listener.wait(100), listener.stderr.read()), (0, b""))


class Starting(unittest.TestCase):
    def test_error_contains_the_log(self):
        with self.assertRaisesRegex(DaemonFailed, "wrold"):
            with Daemon(config().replace("world", "wrold"), SONARD):
                self.fail("it runs")
        with self.assertRaisesRegex(DaemonFailed, "code 66") as failed:
            with Daemon("nowhere.yaml", SONARD):
                self.fail("it runs")
        self.assertEqual(failed.exception.code, 66)

    def test_stops_at_the_end_of_the_block_and_by_stop(self):
        with Daemon(config(), SONARD, ["--seed", "4"]) as daemon:
            process = daemon.process
            self.assertIn("seed      4", daemon.log())
            self.assertEqual(daemon.stop(), 0)
        with Daemon(config(), SONARD) as daemon:
            process = daemon.process
        self.assertEqual(process.returncode, 0)


def examples():
    for name in WITH_EXAMPLES:
        text = (ROOT / name).read_text(encoding="utf-8")
        for number, code in enumerate(re.findall(r"^```python\n(.*?)^```", text, re.M | re.S), 1):
            yield f"{name} example {number}", code


class Manuals(unittest.TestCase):
    """Runs each example as a program, against its own daemon."""

    def test_every_example_runs(self):
        listed = dict(examples())
        self.assertIn("README.md example 1", listed)
        environment = dict(os.environ, PYTHONPATH=str(PACKAGE), PATH=f"{SONARD.parent}{os.pathsep}{os.environ['PATH']}")
        for name, code in listed.items():
            with self.subTest(name), Daemon(config("demo.yaml"), SONARD) as daemon, tempfile.TemporaryDirectory() as folder:
                here = code.replace("127.0.0.2", daemon.address)
                here = here.replace("discover()", f'discover(20, listen="{daemon.address}", enough=1)')
                for name in ("PoseSender", "Control"):
                    here = here.replace(f"{name}()", f'{name}("{daemon.address}")')
                done = subprocess.run([sys.executable, "-B", "-c", here], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                      capture_output=True, text=True, timeout=120, check=False)
                self.assertEqual(done.returncode, 0, done.stderr + done.stdout)
                self.assertTrue(done.stdout.strip(), "an example must print something")

    def test_the_first_example_has_five_lines(self):
        self.assertEqual(len(dict(examples())["README.md example 1"].strip().splitlines()), 5)


if __name__ == "__main__":
    unittest.main()
