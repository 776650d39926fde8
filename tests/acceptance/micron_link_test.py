"""Tests an emulated Micron with a driver, over TCP and a pseudo-terminal, decoded from the tables of docs/protocols/micron.md."""
import pathlib
import re
import socket
import struct
import tempfile
import unittest

import tshark as shark
from pcap_writer import Capture
from pseudo_terminal import PseudoTerminal
from running_sonard import ROOT, SONARCTL, Sonard, run

PORT, PATIENCE_S = 4001, 120
DISSECTOR = ROOT / "protocol/micron/micron.lua"
A, B, C = (3.9, -20), (3.9, 10), (6.9, -8)  # range m, bearing deg to starboard: points of scenes/l-targets.yaml
AHEAD, ALIVE, HEAD_DATA = 3200, 4, 2


def frame(number, payload=b""):
    length = len(payload) + 8
    return (b"@%04X" % length) + struct.pack("<HBBBBBB", length, 255, 2, length - 5, number, 0x80, 2) + payload + b"\n"


def command(left_deg, right_deg, control=0x2305, step=16, interval=26, bins=600, gain=84):
    limits = [round(AHEAD + degrees / 0.05625) % 6400 for degrees in (left_deg, right_deg)]
    return frame(19, struct.pack("<BHB18xHHHBBBB4xBBHHHHHBBH", 1, control, 0x11, 75, *limits, 255, 0, gain, gain, 25, step, interval, bins,
                                 500, 100, 1600, 1, 0, 0))


class Line:
    """A scan line: the payload of mtHeadData."""

    def __init__(self, payload):
        (total, self.type, self.status, self.sweep, self.control, _, _, self.gain, _, _, _, _, self.interval, self.left, self.right, self.step,
         bearing, size) = struct.unpack_from("<HBBBHHIBHBBHHHHBHH", payload)
        assert total == len(payload) == 31 + size, (total, len(payload), size)
        self.degrees = (bearing - AHEAD) * 0.05625
        self.bins = payload[31:]

    def strongest(self, least_m, most_m, speed):
        """Returns value and range of the strongest bin in a window."""
        row_m = self.interval * 640e-9 * speed / 2
        rows = range(int(least_m / row_m), min(int(most_m / row_m), len(self.bins)))
        best = max(rows, key=lambda row: self.bins[row])
        return self.bins[best], (best + 0.5) * row_m


class Driver:
    """A driver that uses read(n) and write(bytes) of a stream."""

    def __init__(self, read, write):
        self.read_some, self.write, self.waiting, self.whole = read, write, b"", []

    def read(self, count):
        while len(self.waiting) < count:
            data = self.read_some(4096)
            assert data, "the stream has ended"
            self.waiting += data
        data, self.waiting = self.waiting[:count], self.waiting[count:]
        return data

    def next(self, wanted):
        while True:
            head = self.read(13)
            length, = struct.unpack_from("<H", head, 5)
            assert head[:5] == b"@%04X" % length and head[7:9] == b"\x02\xff" and head[11:13] == b"\x80\x02", head
            rest = self.read(length + 6 - 13)
            assert rest[-1:] == b"\n" and head[9] == (0 if head[10] == HEAD_DATA else length - 5)
            self.whole.append(head + rest)
            if head[10] == wanted:
                return rest[:-1]

    def scan(self, lines):
        found = []
        for _ in range(lines):
            self.write(frame(25, bytes(4)))
            found.append(Line(self.next(HEAD_DATA)))
        return found


class Link:
    def __init__(self, address):
        self.socket = socket.create_connection((address, PORT), timeout=PATIENCE_S)

    def __enter__(self):
        return Driver(self.socket.recv, self.socket.sendall)

    def __exit__(self, *_):
        self.socket.close()


def sonar(**more):
    return Sonard(scene="l-targets.yaml", profile="micron", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}", **more)


class MicronLink(unittest.TestCase):
    def expect_targets(self, lines):
        speed = 1500  # of scenes/l-targets.yaml, within the tolerance
        for range_m, degrees in (A, B, C):
            near = [line for line in lines if abs(line.degrees - degrees) < 6]
            best = max(near, key=lambda line: line.strongest(range_m - 0.3, range_m + 0.3, speed)[0])
            value, seen_m = best.strongest(range_m - 0.3, range_m + 0.3, speed)
            self.assertGreater(value, 60)
            self.assertAlmostEqual(seen_m, range_m, delta=0.1)
            self.assertAlmostEqual(best.degrees, degrees, delta=2)

    def test_bearings_are_not_mirrored_over_tcp(self):
        with sonar() as daemon, Link(daemon.address) as driver:
            self.assertIn(driver.next(ALIVE)[-1] & 0xC2, (0x42,), "centred, no parameters")
            driver.write(frame(23))
            self.assertEqual(len(driver.next(1)), 11)
            driver.write(command(-30, 30))
            lines = driver.scan(150)
            self.expect_targets(lines)
            self.assertEqual([line.sweep for line in lines[:3]], [0, 0, 0])
            self.assertTrue({1, 2} <= {line.sweep for line in lines}, "both ends were reached")
            self.assertTrue(all(abs(line.degrees) <= 30.01 for line in lines))
            driver.write(frame(16))
            self.assertEqual(driver.next(ALIVE)[-1], 0x5D)

    def test_a_pseudo_terminal_has_the_same_messages(self):
        with sonar() as daemon, PseudoTerminal(daemon.address, PORT, PATIENCE_S) as line:
            driver = Driver(line.read, line.write)
            driver.write(command(-30, 30))
            self.expect_targets(driver.scan(100))

    def test_sonarctl_listens_views_and_examines(self):
        with sonar() as daemon, tempfile.TemporaryDirectory() as folder:
            at = f"{daemon.address}:{PORT}"
            examined = daemon.ctl("doctor", "--within", 60, "--control", f"{daemon.address}:14770")
            self.assertRegex(examined.stdout, rf"ok +tcp {at} accepts, first ping decoded", examined.stdout + examined.stderr)
            listened = run(SONARCTL, "listen", at, "--wait", "100", "--pings", 5, "--range", 8)
            self.assertEqual(len(re.findall(r"x 1  8 bit .* bearing -?\d+\.\d deg", listened.stdout)), 5, listened.stdout + listened.stderr)
            picture = pathlib.Path(folder) / "sweep.png"
            viewed = run(SONARCTL, "view", at, "--wait", "100", "--png", picture, "--range", 8)
            self.assertEqual((viewed.returncode, picture.exists()), (0, True), viewed.stderr)

    @unittest.skipIf(shark.why_not(), shark.why_not())
    def test_a_conversation_is_dissected(self):
        with sonar() as daemon, Link(daemon.address) as driver:
            driver.next(ALIVE)
            driver.write(command(-30, 30))
            driver.scan(2)
            messages = list(driver.whole)
        capture = Capture(device_port=PORT)
        capture.connect()
        capture.tcp("client", command(-30, 30))
        capture.tcp("client", frame(25, bytes(4)))
        joined = b"".join(messages)
        for at in range(0, len(joined), 100):  # cuts that do not coincide with the ends of messages
            capture.tcp("device", joined[at:at + 100])
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "micron.pcap"
            capture.write(path)
            values = shark.tshark("-r", path, "-Y", "micron.line", "-T", "fields", "-e", "micron.bearing", "-e", "micron.dataBytes", "-e",
                                  "micron.step", dissector=DISSECTOR).split()
            lines = shark.tshark("-r", path, "-Y", "micron", dissector=DISSECTOR)
            wrong = shark.tshark("-r", path, "-Y", "micron.expert.broken || micron.expert.junk", dissector=DISSECTOR)
            capture.tcp("device", b"junk" * 10)
            capture.write(path)
            broken = shark.tshark("-r", path, "-Y", "micron.expert.broken || micron.expert.junk", dissector=DISSECTOR)
        self.assertEqual(values, ["3200", "600", "16", "3216", "600", "16"])
        for name in ("mtHeadCommand", "mtSendData", "mtAlive", "mtHeadData"):
            self.assertIn(name, lines)
        self.assertEqual(wrong.strip(), "")
        self.assertNotEqual(broken.strip(), "")


if __name__ == "__main__":
    unittest.main()
