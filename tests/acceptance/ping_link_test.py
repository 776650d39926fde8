"""Tests an emulated Ping360, Surveyor, Omniscan, Ping1D and S500 with hosts of the ping protocol."""
import math
import pathlib
import re
import select
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

from running_sonard import ROOT, SONARCTL, SONARD, Sonard, eventually, expect_quiet, run

PING360, DISCOVERY, SURVEYOR, OMNISCAN, PING1D, S500 = 12345, 30303, 62312, 51200, 9090, 51200
B, C = (3.9, 10), (6.9, -8)  # range m, bearing deg clockwise: points of scenes/l-targets.yaml
SIDE = "{frame: FRD, xyz_m: [0, 0, 0], rpy_deg: [0, -30, 90]}"
DOWN = "{frame: FRD, xyz_m: [0, 0, 0], rpy_deg: [0, -90, 0]}"


def frame(number, payload=b""):
    body = b"BR" + struct.pack("<HHBB", len(payload), number, 0, 0) + payload
    return body + struct.pack("<H", sum(body) & 0xFFFF)


def read(data):
    """Returns (id, payload) of each frame."""
    frames = []
    while data:
        size, number = struct.unpack("<HH", data[2:6])
        assert data[:2] == b"BR" and sum(data[:8 + size]) & 0xFFFF == struct.unpack("<H", data[8 + size:10 + size])[0], data
        frames.append((number, data[8:8 + size]))
        data = data[10 + size:]
    return frames


class Host:
    def __init__(self, address, port):
        self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.udp.connect((address, port))
        self.datagrams = []

    def __del__(self):
        self.udp.close()

    def send(self, data):
        self.udp.send(data)

    def next(self, wanted, patience_s=30):
        """Returns the payload and the time until it arrived [s]."""
        start = time.monotonic()
        self.udp.settimeout(patience_s)
        while True:
            datagram = self.udp.recv(4096)
            self.datagrams.append(datagram)
            frames = read(datagram)
            assert len(frames) == 1, "one frame per datagram"
            if frames[0][0] == wanted:
                return frames[0][1], time.monotonic() - start

    def is_answered(self, data):
        self.send(data)
        return select.select([self.udp], [], [], 0.5)[0] != []

    def ask(self, data, wanted):
        start = time.monotonic()
        self.send(data)
        return self.next(wanted)[0], time.monotonic() - start


def transducer(angle, samples=1200, transmit=1):
    return frame(2601, struct.pack("<BBHHHHHBB", 1, 0, angle, 10, 88, 750, samples, transmit, 0))


def scan(start, stop, period=80, samples=200):
    return frame(2602, struct.pack("<BBHHHHHHBB", 1, 0, 80, period, 750, samples, start, stop, 1, 0))


def general(wanted):
    return frame(6, struct.pack("<H", wanted))


def settings(enable):
    return frame(3023, struct.pack("<iifhhHBBBBBBiHHf", 0, 10000, 1500, -1, 100, 0, 0, enable, 0, 0, 1, 1, 240000, 400, 0, 1.5))


def pings_recorded(daemon):
    return int(daemon.status()["recordings"][0].get("pings", 0))


class Ping360Link(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard(scene="l-targets.yaml", profile="ping360", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}").__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def test_discovery_is_one_datagram_to_each_request(self):
        host = Host(self.daemon.address, DISCOVERY)
        host.udp.settimeout(30)
        for _ in range(100):
            host.udp.send(b"Discovery")
            parts = host.udp.recv(4096).decode().split("\r\n")
            self.assertEqual(len(parts), 5)
        self.assertTrue(parts[0].startswith("PING360"))
        self.assertEqual([int(n) for n in parts[3].split(":- ")[1].split(".")], [int(n) for n in self.daemon.address.split(".")])
        host.udp.send(b"discover")
        host.udp.settimeout(0.2)
        self.assertRaises(socket.timeout, host.udp.recv, 4096)

    def test_a_search_from_the_sonars_own_address_is_answered(self):
        """A host on sonard's computer that has the port at all addresses sends from the computer's first address, which may be
        the sonar's."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as host:
            for option in (socket.SO_REUSEADDR, socket.SO_BROADCAST):
                host.setsockopt(socket.SOL_SOCKET, option, 1)
            host.bind(("0.0.0.0", DISCOVERY))
            host.settimeout(30)
            ip_pktinfo, source = 8, struct.pack("=I4s4s", 0, socket.inet_aton(self.daemon.address), bytes(4))
            host.sendmsg([b"Discovery"], [(socket.IPPROTO_IP, ip_pktinfo, source)], 0, ("127.255.255.255", DISCOVERY))
            self.assertEqual(host.recvfrom(99), (b"Discovery", (self.daemon.address, DISCOVERY)))  # its own broadcast
            answer, place = host.recvfrom(4096)
            self.assertEqual((answer[:7], place), (b"PING360", (self.daemon.address, DISCOVERY)))

    def test_the_head_takes_time_to_turn(self):
        host = Host(self.daemon.address, PING360)
        host.udp.send(b"\x00\xff")  # a host sends this first
        host.ask(transducer(0), 2300)
        data, took_s = host.ask(transducer(200), 2300)
        self.assertGreater(took_s, 0.8)  # the time that the head takes to turn
        self.assertLess(took_s, 12)
        self.assertEqual(struct.unpack("<BBHHHHHH", data[:14]), (1, 0, 200, 10, 88, 750, 1200, 1200))
        self.assertEqual(len(data), 14 + 1200)
        still, _ = host.ask(transducer(200, transmit=0), 2300)
        self.assertEqual(struct.unpack("<H", still[12:14])[0], 0)

    def test_a_scan_has_every_angle_in_order_and_ends_when_the_motor_is_off(self):
        host = Host(self.daemon.address, PING360)
        host.send(scan(0, 399))
        angles = [struct.unpack("<H", host.next(2301)[0][2:4])[0] for _ in range(60)]
        self.assertEqual(angles, list(range(60)))
        acked, took_s = host.ask(frame(2903), 1)
        self.assertEqual(acked, struct.pack("<H", 2903))
        self.assertLess(took_s, 5)
        # Replies are sent before waiting pings, so one line may follow the acknowledgement.
        lines = 0
        while select.select([host.udp], [], [], 0.5)[0]:
            lines += [kind for kind, _ in read(host.udp.recv(4096))].count(2301)
        self.assertLessEqual(lines, 1)

    def test_targets_are_at_their_bearings(self):
        host = Host(self.daemon.address, PING360)
        period, brightest = 352, {}
        metres = period * 25e-9 * 1500 / 2
        host.send(scan(385, 20, period, 1200))
        for _ in range(36):
            data, _ = host.next(2301)
            angle = (struct.unpack("<H", data[2:4])[0] + 200) % 400 - 200
            for range_m, _ in (B, C):
                near = data[20 + int((range_m - 0.3) / metres):20 + int((range_m + 0.3) / metres)]
                brightest.setdefault(range_m, {})[angle] = max(near)
        host.ask(frame(2903), 1)
        for range_m, bearing_deg in (B, C):
            top = max(brightest[range_m], key=brightest[range_m].get)
            self.assertAlmostEqual(top * 0.9, bearing_deg, delta=1.5)

    def test_the_host_of_the_last_request_gets_the_pings(self):
        one, other = Host(self.daemon.address, PING360), Host(self.daemon.address, PING360)
        one.send(scan(0, 399))
        one.next(2301)
        self.assertEqual(other.ask(general(5), 5)[0][0], 1)
        other.next(2301)
        other.ask(frame(2903), 1)

    def test_a_refusal_names_the_request(self):
        host = Host(self.daemon.address, PING360)
        self.assertEqual(host.ask(frame(2345), 2)[0][:2], struct.pack("<H", 2345))
        self.assertIn(b"number_of_samples", host.ask(transducer(0, samples=1201), 2)[0])


class SurveyorLink(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.daemon = Sonard(profile="surveyor-240", mount=DOWN, more=f"recording: {{folder: {cls.folder.name}}}").__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()
        cls.folder.cleanup()

    def points(self, payload):
        count = struct.unpack("<H", payload[98:100])[0]
        self.assertEqual(len(payload), 100 + 8 * count)
        return [struct.unpack_from("<ff", payload, 100 + 8 * i) for i in range(count)]

    def test_points_come_over_tcp_and_over_udp_and_are_recorded(self):
        control = ("--control", f"{self.daemon.address}:14770")
        with socket.create_connection((self.daemon.address, SURVEYOR)) as tcp:
            tcp.sendall(general(4) + settings(1))
            begun = run(SONARCTL, "recording", "start", "run.svlog", *control)
            self.assertEqual(begun.returncode, 0, begun.stderr)
            received = b""
            tcp.settimeout(60)
            while pings_recorded(self.daemon) < 5:
                some = tcp.recv(65536)
                self.assertTrue(some, self.daemon.log())
                received += some
            run(SONARCTL, "recording", "stop", *control)
            tcp.sendall(settings(0))
        self.assertIn(frame(14)[:6], received[:40], "the sonar requests the time")
        recorded = read((pathlib.Path(self.folder.name) / "run.svlog").read_bytes())
        self.assertEqual(recorded[0][0], 10)
        self.assertLessEqual({504, 3011, 3012}, {number for number, _ in recorded})
        for number, payload in recorded:
            if number == 3011:
                for y, z in self.points(payload):
                    self.assertTrue(-12 < z < 0 and math.hypot(y, z) < 10.5, (y, z))
        host = Host(self.daemon.address, SURVEYOR)
        eventually(lambda: host.is_answered(general(5)))  # the TCP host has disconnected
        self.assertEqual(host.ask(general(5), 5)[0][0], 1)
        host.send(settings(1))
        host.next(504)
        first = struct.unpack_from("<I", host.next(3012)[0], 20)[0]
        for step in range(1, 5):
            self.assertEqual(struct.unpack_from("<I", host.next(3012)[0], 20)[0], first + step)
        now = time.time()
        host.send(frame(15, struct.pack("<QI", int(now * 1000), 0)))
        stamp_s = lambda: struct.unpack_from("<Q", host.next(3012)[0], 4)[0] / 1000  # noqa: E731
        eventually(lambda: abs(stamp_s() - time.time()) < 1)  # earlier pings may still wait to be read
        host.send(settings(0))
        expect_quiet(host.udp)


def side_scan(enable, length_mm=10000, results=600):
    return frame(2197, struct.pack("<IIIffffhHBB", 0, length_mm, 100, 0, 0, 0.002, 0.0015, -1, results, enable, 0))


class OmniscanLink(unittest.TestCase):
    def profile(self, payload):
        """Returns ping number and powers [dB]."""
        highest, lowest = struct.unpack_from("<ff", payload, 36)
        count = struct.unpack_from("<H", payload, 22)[0]
        self.assertEqual(len(payload), 52 + 2 * count)
        powers = struct.unpack_from(f"<{count}H", payload, 52)
        return struct.unpack_from("<I", payload)[0], [lowest + v / 65535 * (highest - lowest) for v in powers]

    def test_profiles_come_over_udp_and_tcp_and_their_recording_is_served_again(self):
        with tempfile.TemporaryDirectory() as folder:
            with Sonard(profile="omniscan-450", mount=SIDE, more=f"recording: {{folder: {folder}}}") as daemon:
                control = ("--control", f"{daemon.address}:14770")
                host = Host(daemon.address, OMNISCAN)
                self.assertEqual(host.ask(general(2198), 2)[0][:2], struct.pack("<H", 2198), "no pings are enabled")
                host.send(side_scan(1))
                numbers = [self.profile(host.next(2198)[0])[0] for _ in range(5)]
                self.assertEqual(numbers, list(range(numbers[0], numbers[0] + 5)))
                _, powers = self.profile(host.ask(general(2198), 2198)[0])
                self.assertEqual(len(powers), 600)
                self.assertGreater(max(powers) - min(powers), 20, "the bed is much louder than the water")
                host.send(side_scan(0))
                with self.connected_once_free(daemon.address) as tcp:
                    tcp.sendall(side_scan(1, results=200))
                    begun = run(SONARCTL, "recording", "start", "run.svlog", *control)
                    self.assertEqual(begun.returncode, 0, begun.stderr)
                    while pings_recorded(daemon) < 3:
                        self.assertTrue(tcp.recv(65536))
                    run(SONARCTL, "recording", "stop", *control)
            file = pathlib.Path(folder) / "run.svlog"
            recorded = file.read_bytes()
            self.assertIn(b'"os450"', recorded[:200])
            frames = recorded[recorded.index(b"BR", 2):]
            self.assertEqual(self.served_again(file, daemon.address), frames)

    def connected_once_free(self, address):
        """Returns a TCP connection once the UDP host is forgotten, some time after it has disabled pings."""
        give_up = time.monotonic() + 60
        while time.monotonic() < give_up:
            tcp = socket.create_connection((address, OMNISCAN))
            tcp.settimeout(30)
            try:
                tcp.sendall(general(5))
                if tcp.recv(65536):
                    return tcp
            except OSError:
                pass
            tcp.close()
            time.sleep(0.5)
        raise AssertionError("the sonar still belongs to a host that has disabled pings")

    def served_again(self, file, address):
        replay = subprocess.Popen([SONARD, "replay", file, "--ip", address], stderr=subprocess.PIPE, text=True)
        try:
            self.assertIn("as Omniscan 450 on tcp", replay.stderr.readline())
            with socket.create_connection((address, OMNISCAN)) as tcp:
                tcp.settimeout(60)
                tcp.sendall(general(4))
                self.assertEqual(read(tcp.recv(65536))[0][0], 4)
                tcp.sendall(side_scan(1))
                served = b""
                while data := tcp.recv(65536):
                    served += data
            return served
        finally:
            replay.terminate()
            replay.communicate(timeout=20)


class Ping1DLink(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard(profile="ping1d", mount=DOWN, pose="{frame: ENU_FLU, xyz_m: [-7, 0, -3]}").__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def test_measurements_come_when_they_are_requested(self):
        host = Host(self.daemon.address, PING1D)
        eventually(lambda: host.is_answered(general(5)))
        self.assertEqual(host.ask(frame(1210), 1210)[0][8:10], bytes([3, 1]), "gain 3, automatic")
        for _ in range(20):
            distance, confidence, _, ping, start, length, _ = struct.unpack("<IHHIIII", host.ask(general(1212), 1212)[0])
        self.assertGreater(confidence, 50)
        self.assertEqual(start, 0)
        self.assertAlmostEqual(distance / 1000, 2, delta=0.35)  # ripples and relief of the harbour's bed, 2 m below
        self.assertTrue(0.3 < distance / length < 0.9, (distance, length))
        self.assertEqual(struct.unpack("<IB", host.ask(frame(1211), 1211)[0])[1] > 50, True)
        host.send(frame(1003, b"\0"))
        host.send(frame(1001, struct.pack("<II", 500, 4000)))
        self.assertEqual(struct.unpack("<II", host.ask(frame(1204), 1204)[0]), (500, 4000))
        profile = host.ask(general(1300), 1300)[0]
        self.assertEqual(len(profile), 26 + 200)
        self.assertGreater(struct.unpack_from("<I", profile, 8)[0], ping)
        self.assertEqual(struct.unpack_from("<II", profile, 12), (500, 4000))
        host.send(frame(1003, b"\1"))

    def test_a_stream_comes_over_tcp(self):
        listener = run(SONARCTL, "listen", f"{self.daemon.address}:{PING1D}", "--pings", 5, "--wait", 60)
        self.assertEqual(listener.returncode, 0, listener.stderr)
        self.assertEqual(len(re.findall(r"distance \d\.\d{3} m, confidence \d+ %", listener.stdout)), 5, listener.stdout)


def sound(period_ms, report):
    """Returns a frame with an S500's ping parameters, range and gain automatic."""
    return frame(1015, struct.pack("<IIhhHHHBB", 0, 0, -1, period_ms, 0, report, 0, 0, 0))


class S500Link(unittest.TestCase):
    def test_single_pings_a_stream_and_its_end(self):
        with Sonard(profile="s500", mount=DOWN, pose="{frame: ENU_FLU, xyz_m: [-7, 0, -3]}") as daemon:
            host = Host(daemon.address, S500)
            eventually(lambda: host.is_answered(general(5)))
            profile = host.ask(sound(-1, 1308), 1308)[0]
            self.assertEqual(len(profile), 66 + 2 * 1024)
            host.send(sound(100, 1223))
            for _ in range(25):
                distance, averaged, _, confidence, sure, _ = struct.unpack("<IIHBBI", host.next(1223)[0])
            self.assertGreater(confidence, 50)
            self.assertAlmostEqual(distance / 1000, 2, delta=0.35)  # ripples and relief of the harbour's bed, 2 m below
            self.assertAlmostEqual(averaged, distance, delta=50)
            start, length = struct.unpack("<II", host.ask(general(1204), 1204)[0])
            self.assertTrue(start == 0 and 0.3 < distance / length < 0.9, (distance, length))
            host.send(sound(100, 0))
            expect_quiet(host.udp)


class AltitudeHold(unittest.TestCase):
    def test_the_example_brings_a_vehicle_to_its_altitude_and_keeps_it_there(self):
        with Sonard(profile="ping1d", mount=DOWN) as daemon:
            done = run(sys.executable, ROOT / "docs/examples/altitude_hold.py", "--sonar", daemon.address, "--sonard", daemon.address,
                       "--altitude", 1, "--pings", 150, patience_s=600)
        self.assertEqual(done.returncode, 0, done.stderr)
        held = [float(metres) for metres in re.findall(r"distance (\d+\.\d{3}) m", done.stdout)]
        self.assertEqual(len(held), 150)
        self.assertGreater(held[0], 1.5)
        for distance in held[-30:]:
            self.assertAlmostEqual(distance, 1, delta=0.15)


if __name__ == "__main__":
    unittest.main()
