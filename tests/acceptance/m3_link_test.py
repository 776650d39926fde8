"""Tests an emulated M3 with a driver: packets of complex samples over TCP, decoded with hand-typed offsets
(docs/protocols/m3.md)."""
import cmath
import math
import pathlib
import socket
import struct
import tempfile
import unittest

import tshark as shark
from pcap_writer import Capture
from running_sonard import ROOT, SONARCTL, Sonard, eventually, run

PORT, PATIENCE_S = 20001, 120
HEAD, DATA, FOOT = 56, 8512, 44
A, B, C = (3.9, 20), (3.9, -10), (6.9, 8)  # range m, bearing deg to port: the nearest points of scenes/l-targets.yaml
QUIET = ["--noise", "off"]


class Packet:
    def __init__(self, head, body, foot):
        self.size, = struct.unpack_from("<I", head, 52)
        assert head[:12] == b"\x00\x80" * 4 + b"\x02\x10\x00\x00" and foot == struct.pack("<I", self.size) + bytes(40), head
        number = lambda form, at: struct.unpack_from("<" + form, body, at)[0]  # noqa: E731
        self.version, self.time_s, self.speed = number("I", 0), number("I", 40) + number("I", 44) / 1000, number("f", 48)
        self.samples, self.near, self.far = number("I", 52), number("f", 56), number("f", 60)
        self.beams, self.interval, self.number = number("H", 72), number("f", 4172), number("I", 4208)
        self.delay = number("f", 64) - number("f", 4496)
        self.rate, self.gain = number("f", 4220), struct.unpack_from("<hhff", body, 4416)
        self.heading, self.depth = number("f", 4428), number("f", 4444)
        assert self.size == DATA + 8 * self.beams * self.samples
        self.angles = struct.unpack_from(f"<{self.beams}f", body, 76)
        self.values = struct.unpack_from(f"<{2 * self.beams * self.samples}f", body, DATA)

    def at(self, beam, sample):
        i = 2 * (beam * self.samples + sample)
        return complex(self.values[i], self.values[i + 1])

    def range_of(self, sample):
        return (self.delay + sample * self.interval) * self.speed / 2

    def levels(self, least_m, most_m, least_deg, most_deg):
        """Returns level, beam and sample of the values in a window."""
        rows = [k for k in range(self.samples) if least_m <= self.range_of(k) <= most_m]
        beams = [j for j in range(self.beams) if least_deg <= self.angles[j] <= most_deg]
        return [(abs(self.at(j, k)), j, k) for j in beams for k in rows]

    def place(self, *window):
        """Returns the range of the strongest value and the mean angle of the power, because the brightest spot of a sphere may
        not be in its middle."""
        levels = self.levels(*window)
        angle = sum(level**2 * self.angles[j] for level, j, _ in levels) / sum(level**2 for level, _, _ in levels)
        return self.range_of(max(levels)[2]), angle


class Driver:
    """Connects and reads; it never sends."""

    def __init__(self, address):
        self.link = socket.create_connection((address, PORT), PATIENCE_S)
        self.stream = self.link.makefile("rb")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stream.close()
        self.link.close()

    def next(self):
        head = self.stream.read(HEAD)
        size, = struct.unpack_from("<I", head, 52)
        rest = self.stream.read(size + FOOT)
        packet = Packet(head, rest[:size], rest[size:])
        packet.whole = head + rest
        return packet


def sonar(x_m=0.0, options="", arguments=()):
    daemon = Sonard(scene="l-targets.yaml", profile="m3", pose=f"{{frame: ENU_FLU, xyz_m: [{x_m}, 0, 0]}}", arguments=list(arguments))
    daemon.profile += f"\n    options: {{{options}}}" if options else ""
    return daemon


class Stream(unittest.TestCase):
    def test_bearings_are_not_mirrored_and_ranges_are_right(self):
        with sonar() as daemon, Driver(daemon.address) as driver:
            packet = driver.next()
            for (range_m, bearing_deg), window in ((A, (3, 5, 14, 60)), (B, (3, 5, -60, -4)), (C, (6, 8, -60, 60))):
                seen_m, seen_deg = packet.place(*window)
                self.assertAlmostEqual(seen_m, range_m, delta=0.06)
                self.assertAlmostEqual(seen_deg, bearing_deg, delta=1)
            self.assertEqual((packet.version, packet.beams, packet.samples, packet.rate), (14, 128, 1372, 15))
            self.assertEqual(packet.gain, (20, 100, -16, 100))
            self.assertEqual(packet.angles[0], -59.53125)

    def test_positive_angles_can_be_to_starboard(self):
        with sonar(options="positive_angles: starboard") as daemon, Driver(daemon.address) as driver:
            range_m, bearing_deg = driver.next().place(3, 5, -60, -14)
            self.assertAlmostEqual(range_m, A[0], delta=0.06)
            self.assertAlmostEqual(bearing_deg, -A[1], delta=1)

    def test_a_phase_turns_with_the_distance(self):
        """If an echo comes nearer, its phase turns by 4 pi f / c per metre."""
        moved_m, seen = 0.0003, []
        for x_m in (0, moved_m):
            with sonar(x_m, arguments=QUIET) as daemon, Driver(daemon.address) as driver:
                first, second = driver.next(), driver.next()
                _, beam, sample = max(first.levels(3, 5, 14, 60))
                self.assertAlmostEqual(cmath.phase(second.at(beam, sample) / first.at(beam, sample)), 0, delta=0.02, msg="the target is at rest")
                seen.append((beam, sample, first))
        (beam, sample, before), (_, _, after) = seen
        turned = cmath.phase(after.at(beam, sample) / before.at(beam, sample))
        nearer_m = moved_m * math.cos(math.radians(A[1]))
        self.assertAlmostEqual(turned, 4 * math.pi * 500e3 / before.speed * nearer_m, delta=0.15)

    def test_settings_are_those_of_sonarctl(self):
        with sonar() as daemon, Driver(daemon.address) as driver:
            first = driver.next()
            done = run(SONARCTL, "set", "sonar", "front", "--range", "20", "--rate", "4", "--gain", "75", "--control", f"{daemon.address}:14770")
            self.assertEqual(done.returncode, 0, done.stderr)
            packet = driver.next()
            while packet.far == first.far:
                packet = driver.next()
            self.assertAlmostEqual(packet.near, 0.4, delta=1e-6)
            self.assertEqual((packet.far, packet.rate, packet.gain), (20, 4, (20, 100, 4, 100)))
            self.assertAlmostEqual(packet.interval, 20.48e-6, delta=1e-10)
            self.assertAlmostEqual(packet.place(3, 5, 14, 60)[1], A[1], delta=1)
            refused = run(SONARCTL, "listen", f"{daemon.address}:{PORT}", "--range", "5")
            self.assertEqual(refused.returncode, 64)
            self.assertIn("--range does not apply to an M3, whose drivers set nothing: use `sonarctl set sonar`", refused.stderr)

    def test_several_drivers_get_pings_and_bytes_from_one_are_logged(self):
        with sonar() as daemon, Driver(daemon.address) as one, Driver(daemon.address) as other:
            one.link.sendall(b"<Command><Operation>Get_Status</Operation></Command>")
            numbers = [[driver.next().number for _ in range(3)] for driver in (one, other)]
            for seen in numbers:
                self.assertEqual(seen, sorted(set(seen)))
            eventually(lambda: "bytes at a port where drivers send none" in daemon.log())

    @unittest.skipIf(shark.why_not(), shark.why_not())
    def test_tshark_reads_the_same(self):
        with sonar() as daemon, Driver(daemon.address) as driver:
            control = ("--control", f"{daemon.address}:14770")
            self.assertEqual(run(SONARCTL, "set", "sonar", "front", "--range", "2", *control).returncode, 0)
            packet = driver.next()
            while packet.far != 2:
                packet = driver.next()
        capture = Capture(device_port=PORT)
        capture.connect()
        for begin in range(0, len(packet.whole), 30000):
            capture.tcp("device", packet.whole[begin:begin + 30000])
        damaged = bytearray(packet.whole)
        damaged[-FOOT] ^= 1
        for begin in range(0, len(damaged), 30000):
            capture.tcp("device", bytes(damaged[begin:begin + 30000]))
        capture.tcp("device", b"<Response>" * 10)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "m3.pcap"
            capture.write(path)
            script = ROOT / "protocol/m3/m3.lua"
            names = ("ping", "beams", "samples", "far", "interval", "soundSpeed", "firstAngle", "application", "gainC")
            shown = shark.tshark("-r", path, "-Y", "m3.ping and not m3.expert.broken", "-T", "fields", *[w for n in names for w in ("-e", "m3." + n)],
                                 dissector=script).rstrip("\n").split("\t")
            self.assertEqual(shown[:3], [str(packet.number), "128", str(packet.samples)])
            for text, value in zip(shown[3:7], (2, packet.interval, packet.speed, -59.53125)):
                self.assertAlmostEqual(float(text), value, delta=1e-5 * abs(value))
            self.assertEqual((shown[7], float(shown[8])), ("Imaging 3", -16))
            for expert in ("broken", "junk"):
                self.assertEqual(len(shark.tshark("-r", path, "-Y", "m3.expert." + expert, dissector=script).splitlines()), 1, expert)


if __name__ == "__main__":
    unittest.main()
