"""Tests the distances that an autopilot gets from an altimeter over MAVLink. A controller requests the distances to hold its
altitude."""
import pathlib
import re
import socket
import sys
import tempfile
import unittest
import urllib.request

import mavlink_frames
from running_sonard import ROOT, SONARCTL, SONARD, Daemon, Sonard, run

sys.path.insert(0, str(ROOT / "clients/python"))
from sonard_client import Control  # noqa: E402

DOWN = "{frame: FLU, xyz_m: [0, 0, 0], rpy_deg: [0, 90, 0]}"
SLOPE = 0.06  # rise per metre ahead
BED = f"""\
name: slope
objects:
  - name: bed
    type: seabed
    material: sand
    pose: {{xyz_m: [0, 0, -6]}}
    size_m: [60, 20]
    spacing_m: [0.1, 0.3]
    relief_m: 0.1
    wavelength_m: 5
    slope: [{SLOPE}, 0]
"""


class Autopilot:
    """A UDP port to which sonard sends first, or that sends first to `peer`, a listening link of sonard."""

    def __init__(self, peer=None):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(120)
        self.port, self.peer, self.speak = self.socket.getsockname()[1], peer, mavlink_frames.Speaker()

    def next(self, name):
        """Returns the fields of the next message of that name."""
        while True:
            datagram, self.peer = self.socket.recvfrom(512)
            for message, fields in mavlink_frames.read_frames(datagram):
                if message == name:
                    return fields

    def arrived(self):
        """Yields the distances that have arrived."""
        self.socket.setblocking(False)
        try:
            while True:
                for message, fields in mavlink_frames.read_frames(self.socket.recv(512)):
                    if message == "DISTANCE_SENSOR":
                        yield fields
        except BlockingIOError:
            self.socket.settimeout(120)

    def command(self, code, interval_us=0):
        """Sends a command; returns its MAV_RESULT."""
        self.socket.sendto(self.speak("COMMAND_LONG", target_system=1, target_component=193, command=code, param1=132,
                                      param2=interval_us), self.peer)
        return self.next("COMMAND_ACK")["result"]


def sonard(port, folder, distance_sensor="true", link="udpout:127.0.0.1", **options):
    scene = pathlib.Path(folder) / "slope.yaml"
    scene.write_text(BED, encoding="utf-8")
    return Sonard(scene=scene, profile="ping1d", mount=DOWN, pose="{frame: ENU_FLU, xyz_m: [0, 0, -3]}",
                  poses=f", mavlink: [{{endpoint: '{link}:{port}', distance_sensor: {distance_sensor}}}]",
                  arguments=["--clock", "lockstep", *options.pop("arguments", ())], **options)


def dropped(daemon):
    """Returns the counts of unsent distances of the only link, by reason. Status and metrics must agree."""
    with urllib.request.urlopen(f"http://{daemon.address}:8088/metrics", timeout=60) as answer:
        metrics = answer.read().decode()
    reasons = {reason: int(count) for reason, count in
               re.findall(r'^sonard_distances_dropped_total\{.*reason="(\w+)"\} (\d+)$', metrics, re.M)}
    [link] = Control(daemon.address).status()["links"]
    assert link["distances_dropped"] == sum(reasons.values()), (link, reasons)
    assert f'sonard_distances_sent_total{{link="{link["endpoint"]}"}} {link["distances_sent"]}\n' in metrics, metrics
    told = f"{link['endpoint']}  rov  {link['distances_sent']} distances sent, {link['distances_dropped']} dropped\n"
    status = run(SONARCTL, "status", "--control", f"{daemon.address}:14770").stdout
    assert told in status, status
    return reasons


class DepthHold(unittest.TestCase):
    def test_the_example_holds_two_metres_above_a_rising_bed(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        with tempfile.TemporaryDirectory() as folder, sonard(port, folder) as daemon:
            done = run(sys.executable, ROOT / "docs/examples/depth_hold.py", "--listen", f"127.0.0.1:{port}", "--sonard",
                       daemon.address, "--steps", 250, patience_s=600)
        self.assertEqual(done.returncode, 0, done.stderr)
        seen = [tuple(map(float, line)) for line in re.findall(r"x (\S+) z (\S+) distance (\S+) m", done.stdout)]
        self.assertGreaterEqual(len(seen), 240, done.stdout)
        held = seen[-150:]
        self.assertGreater(seen[0][2], 2.5)
        print(f"{len(held)} distances held: {min(d for *_, d in held):.2f} to {max(d for *_, d in held):.2f} m")
        for _, _, distance in held:
            self.assertAlmostEqual(distance, 2, delta=0.15)
        climbed = held[-1][1] - held[0][1]
        self.assertAlmostEqual(climbed / (held[-1][0] - held[0][0]), SLOPE, delta=0.04, msg="the vehicle follows the slope")

    def test_the_example_runs_with_its_configuration_and_the_link_misses_nothing(self):
        with Daemon(ROOT / "docs/examples/depth_hold.yaml", str(SONARD)):
            done = run(sys.executable, ROOT / "docs/examples/depth_hold.py", "--steps", 30, patience_s=600)
            status = run(SONARCTL, "status").stdout
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreater(done.stdout.count("distance"), 25, done.stdout)
        self.assertRegex(status, r"mavlink +udpout:127.0.0.1:14552  rov  3\d distances sent, 0 dropped\n")
        self.assertNotIn("no poses yet", status, "the example sends poses over another link")

    def test_each_ping_is_a_message_with_the_time_of_the_scene(self):
        autopilot = Autopilot()
        with tempfile.TemporaryDirectory() as folder, sonard(autopilot.port, folder, more="faults: {armed: true}") as daemon:
            control = Control(daemon.address)
            autopilot.next("HEARTBEAT")
            control.step(3)
            seen = list(autopilot.arrived())
            self.assertEqual([m["time_boot_ms"] for m in seen[-10:]], list(range(2000, 3000, 100)))
            last = seen[-1]
            self.assertAlmostEqual(last["current_distance"], 300, delta=30)
            self.assertEqual((last["min_distance"], last["max_distance"], last["type"], last["id"], last["orientation"],
                              last["covariance"], last["quaternion"]), (30, 10000, 1, 0, 25, 255, (0, 0, 0, 0)))
            self.assertAlmostEqual(last["horizontal_fov"], 0.5236, delta=1e-4)
            self.assertGreater(last["signal_quality"], 50)
            with control.fault("L05"):
                control.step(1)
                self.assertEqual(list(autopilot.arrived()), [], "the pings are withheld")
            self.assertIn("DISTANCE_SENSOR was not sent: a fault withholds the ping", daemon.log())
            self.assertEqual(dropped(daemon), {"fault": 10, "no_vehicle": 0, "socket": 0})
            control.step(1)
            self.assertEqual(len(list(autopilot.arrived())), 10)

    def test_a_vehicle_requests_distances(self):
        autopilot = Autopilot()
        with tempfile.TemporaryDirectory() as folder, sonard(autopilot.port, folder, "false") as daemon:
            control = Control(daemon.address)
            autopilot.next("HEARTBEAT")
            control.step(1)
            self.assertEqual(list(autopilot.arrived()), [])
            self.assertEqual(autopilot.command(512), 0)
            control.step(1)
            self.assertEqual(len(list(autopilot.arrived())), 1)
            self.assertEqual(autopilot.command(511, 500_000), 0)
            control.step(5)
            self.assertAlmostEqual(len(list(autopilot.arrived())), 10, delta=1)
            self.assertEqual(autopilot.command(511, -1), 0)
            control.step(1)
            self.assertEqual(list(autopilot.arrived()), [])

    def test_distances_that_cannot_be_sent_are_counted(self):
        for link, reason, why in (("udpin:127.0.0.1", "no_vehicle", "no vehicle is known"),
                                  ("udpout:127.255.255.255", "socket", "Permission denied")):  # broadcast needs an option of the socket
            with self.subTest(link=link), tempfile.TemporaryDirectory() as folder, sonard(14599, folder, link=link) as daemon:
                Control(daemon.address).step(1)
                self.assertEqual(dropped(daemon), {"fault": 0, "no_vehicle": 0, "socket": 0, reason: 10})
                self.assertIn(f"DISTANCE_SENSOR was not sent: {why}", daemon.log())

    def test_two_runs_send_the_same_messages(self):
        def run_once():
            autopilot = Autopilot()
            with tempfile.TemporaryDirectory() as folder, sonard(autopilot.port, folder) as daemon:
                control = Control(daemon.address)
                for n in range(20):
                    control.send_pose((0.1 * n, 0, -3))
                    control.step(0.1)
                return [tuple(sorted(m.items())) for m in autopilot.arrived()]
        first = run_once()
        self.assertGreaterEqual(len(first), 18)
        self.assertEqual(run_once(), first)


if __name__ == "__main__":
    unittest.main()
