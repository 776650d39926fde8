"""Tests an emulated Norbit with a driver: commands, bathymetry and water column over TCP, decoded with hand-typed offsets
(docs/protocols/norbit.md)."""
import math
import pathlib
import signal
import socket
import struct
import subprocess
import tempfile
import unittest
import zlib

import mcap_checker
import tshark as shark
from pcap_writer import Capture
from running_sonard import ROOT, SONARCTL, Sonard, eventually, run

COMMANDS, BATHYMETRY, COLUMN, PATIENCE_S = 2209, 2210, 2211, 120
A, B, C = (3.9, 20), (3.9, -10), (6.9, 8)  # range m, bearing deg to port: the nearest points of scenes/l-targets.yaml


class Driver:
    def __init__(self, address):
        self.links = {port: socket.create_connection((address, port), PATIENCE_S) for port in (COMMANDS, BATHYMETRY, COLUMN)}
        self.streams = {port: link.makefile("rb") for port, link in self.links.items()}
        self.greeting = self.streams[COMMANDS].readline()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for port, link in self.links.items():
            self.streams[port].close()
            link.close()

    def say(self, text):
        self.links[COMMANDS].sendall(text.encode())
        return self.streams[COMMANDS].readline().decode()

    def packet(self, port):
        head = self.streams[port].read(24)
        magic, kind, size, version, _, crc = struct.unpack("<6I", head)
        assert (magic, kind, version) == (0xDEADBEEF, port - BATHYMETRY + 1, 4), head
        body = self.streams[port].read(size - 24)
        assert zlib.crc32(body) == crc
        return head + body

    def points(self):
        """Returns the ping number, and (range m, degrees to port) of each beam with a bottom."""
        packet = self.packet(BATHYMETRY)
        speed, rate, beams, ping = struct.unpack_from("<ffII", packet, 24)
        assert len(packet) == 112 + 20 * beams
        rows = [struct.unpack_from("<IfHHfHBB", packet, 112 + 20 * i) for i in range(beams)]
        return ping, [(row[0] * speed / (2 * rate), -math.degrees(row[1])) for row in rows if row[0] > 1 and row[6] == 3]

    def column(self):
        """Returns ping number, metres per sample, first sample, rows of pixels, degrees to port."""
        packet = self.packet(COLUMN)
        speed, rate, beams, rows = struct.unpack_from("<ffII", packet, 24)
        kind, first = struct.unpack_from("<Ii", packet, 48)
        assert kind == 3 and len(packet) == 192 + beams * (2 * rows + 4)
        pixels = struct.unpack_from(f"<{rows * beams}h", packet, 192)
        angles = struct.unpack_from(f"<{beams}f", packet, 192 + 2 * rows * beams)
        return struct.unpack_from("<I", packet, 108)[0], speed / (2 * rate), first, pixels, [-math.degrees(a) for a in angles]


class Link(unittest.TestCase):
    def test_commands_start_pings_and_bearings_are_not_mirrored(self):
        with Sonard(scene="l-targets.yaml", profile="norbit-fls", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}") as daemon, \
                Driver(daemon.address) as driver:
            self.assertEqual(driver.greeting, b"Sonar is ready to accept commands\r\n")
            self.assertEqual(driver.say("set_range .5 8"), "set_range 0.5 8 # m\r\n", "without an end of line")
            self.assertTrue(driver.say("set_rate 5\r\n").startswith("set_rate 5 "))
            self.assertTrue(driver.say("set_power 1\r\n").startswith("set_power 1 "))
            number, points = driver.points()
            for range_m, bearing_deg in (A, B, C):
                near = [p for p in points if abs(p[0] - range_m) < 0.1 and abs(p[1] - bearing_deg) < 1.5]
                self.assertTrue(near, (range_m, bearing_deg, points))
            ping, row_m, first, pixels, angles = driver.column()
            self.assertEqual(ping, number)
            beams = len(angles)
            at = {(first + i // beams, i % beams): value for i, value in enumerate(pixels)}
            for range_m, bearing_deg in (A, B):
                window = {place: value for place, value in at.items() if 3.5 < place[0] * row_m < 4.3 and abs(angles[place[1]] - bearing_deg) < 6}
                row, beam = max(window, key=window.get)
                self.assertAlmostEqual(row * row_m, range_m, delta=0.1)
                self.assertAlmostEqual(angles[beam], bearing_deg, delta=1.5)
            self.assertEqual(driver.points()[0], number + 1)
            clients = daemon.status()["sonars"][0]["clients"]
            self.assertEqual(sorted(client.get("commands_only", False) for client in clients), [False, False, True])
            self.assertTrue(driver.say("set_power").startswith("set_power 1 "))
            self.assertIn("unchanged", driver.say("set_range 0 1000"))
            eventually(lambda: "set_range is refused" in daemon.log())

    def test_sonarctl_restores_the_settings_of_the_last_driver(self):
        with Sonard(profile="norbit-wbms") as daemon, tempfile.TemporaryDirectory() as folder:
            at, control = f"{daemon.address}:{BATHYMETRY}", ("--control", f"{daemon.address}:14770")
            wanted = ("set_power 0", "set_range 0 7", "set_rate 3", "set_gain 11")
            with Driver(daemon.address) as driver:
                settings = [driver.say(f"{command}\r\n") for command in wanted]
            for command in (("view", at, "--png", f"{folder}/ping.png", "--range", 5, "--gain", 50, "--wait", 100),
                            ("doctor", at, "--within", 40, "--http", f"{daemon.address}:8088", *control)):
                done = run(SONARCTL, *command)
                self.assertEqual(done.returncode, 0, done.stderr + done.stdout)
                with Driver(daemon.address) as driver:
                    self.assertEqual([driver.say(f"{name.split()[0]}\r\n") for name in wanted], settings, command[0])

    def test_sonarctl_keeps_settings_that_another_driver_has_changed_since(self):
        with Sonard(profile="norbit-wbms") as daemon:
            with Driver(daemon.address) as driver:
                before = [driver.say(f"{command}\r\n") for command in ("set_rate 3", "set_gain 11")]
            command = (SONARCTL, "listen", f"{daemon.address}:{BATHYMETRY}", "--range", "5", "--rate", "4", "--gain", "50", "--wait", "100")
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as listener:
                for line in listener.stdout:
                    if line.startswith("ping "):
                        break
                with Driver(daemon.address) as driver:
                    ours = driver.say("set_range 0 9\r\n")
                for number in (signal.SIGINT, signal.SIGTERM):  # `timeout` signals twice
                    listener.send_signal(number)
                listener.communicate(timeout=PATIENCE_S)
            with Driver(daemon.address) as driver:
                self.assertEqual([driver.say(f"{name}\r\n") for name in ("set_rate", "set_gain", "set_range")], [*before, ours])

    def test_sonarctl_lists_points_over_a_floor(self):
        with Sonard(scene="demo.yaml", profile="norbit-wbms", mount="{frame: FRD, xyz_m: [0, 0, 0], rpy_deg: [0, -90, 0]}") as daemon:
            done = run(SONARCTL, "listen", f"{daemon.address}:{BATHYMETRY}", "--range", 20, "--rate", 5, "--wait", 100, "--pings", 3)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("points from", done.stdout)

    def test_a_recording_holds_whole_packets_of_all_ports(self):
        with Sonard(scene="l-targets.yaml", profile="norbit-wbms") as daemon, tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "norbit.mcap"
            done = run(SONARCTL, "record", f"{daemon.address}:{BATHYMETRY}", "--mcap", path, "--range", 12, "--rate", 10, "--wait", 100, "--pings", 6)
            self.assertEqual(done.returncode, 0, done.stderr)
            messages = [data for topic, _, data in mcap_checker.check(path.read_bytes()).messages if topic.endswith("/device")]
        kinds = []
        for data in messages:
            magic, kind, size, _, _, crc = struct.unpack_from("<6I", data) if len(data) >= 24 else (0,) * 6
            if magic == 0xDEADBEEF:  # otherwise it is a reply to a command
                self.assertEqual((size, zlib.crc32(data[24:])), (len(data), crc))
                kinds.append(kind)
        self.assertGreaterEqual((kinds.count(1), kinds.count(2)), (5, 5))

    @unittest.skipIf(shark.why_not(), shark.why_not())
    def test_tshark_reads_the_same(self):
        with Sonard(scene="l-targets.yaml", profile="norbit-wbms") as daemon, Driver(daemon.address) as driver:
            driver.say("set_range 0 3\n")
            driver.say("set_power 1\n")
            packets = {port: driver.packet(port) for port in (BATHYMETRY, COLUMN)}
        for port, packet in packets.items():
            capture = Capture(device_port=port)
            capture.connect()
            damaged = bytearray(packet)
            damaged[32] ^= 1
            for whole in (packet, bytes(damaged), b"no packet at all, but long enough"):
                for begin in range(0, len(whole), 30000):
                    capture.tcp("device", whole[begin:begin + 30000])
            with tempfile.TemporaryDirectory() as folder:
                path = pathlib.Path(folder) / "norbit.pcap"
                capture.write(path)
                script = ROOT / "protocol/norbit/norbit.lua"
                shown = shark.tshark("-r", path, "-Y", "norbit.ping and not norbit.expert.broken", "-T", "fields", "-e", "norbit.ping",
                                     "-e", "norbit.beams", "-e", "norbit.soundSpeed", dissector=script).split()
                number, = struct.unpack_from("<I", packet, 36 if port == BATHYMETRY else 108)
                self.assertEqual(shown[:2], [str(number), str(struct.unpack_from("<I", packet, 32)[0])])
                self.assertAlmostEqual(float(shown[2]), struct.unpack_from("<f", packet, 24)[0], delta=0.01)
                for expert in ("broken", "junk"):
                    self.assertEqual(len(shark.tshark("-r", path, "-Y", "norbit.expert." + expert, dissector=script).splitlines()), 1, expert)


if __name__ == "__main__":
    unittest.main()
