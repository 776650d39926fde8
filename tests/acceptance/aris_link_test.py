"""Tests an emulated ARIS with a controller (beacons, frames, cookies, one controller at a time) and with tshark."""
import math
import pathlib
import shutil
import struct
import subprocess
import tempfile
import time
import unittest

import tshark as shark
from aris_controller import BEACONS, COMMANDS, PING, RECEIVER, SALINITY, Beacons, Controller, field, fields
from pcap_writer import Capture
from running_sonard import ROOT, SONARCTL, SONARD, Sonard, eventually, expect_quiet, run

DISSECTOR = ROOT / "protocol/aris/aris.lua"
STARBOARD, PORT = range(0, 64), range(64, 128)  # beam 0 is farthest to starboard
B, C = (3.9, 10), (6.9, -8)  # range m, bearing deg clockwise: points of scenes/l-targets.yaml


LENSES = {48: (15.879, -2.384), 96: (16.135, -2.404), 64: (15.024, -0.128), 128: (15.145, -0.125)}


def bearing_deg(beam, beams=128):
    """Returns the bearing of a beam, clockwise from ahead."""
    a, b = LENSES[beams]
    x = 2 * beam / (beams - 1) - 1
    return -(a * x + b * x ** 3)


class ArisLink(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard(scene="l-targets.yaml", profile="aris-3000", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}").__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def until_free(self):
        """Waits until the daemon has noticed that the previous controller has left."""
        eventually(lambda: not self.daemon.status()["sonars"][0].get("clients"))

    def controller(self, **options):
        self.until_free()
        link = Controller(self.daemon.address, **options)
        self.addCleanup(link.close)
        return link

    def test_beacons_say_whether_the_sonar_is_free(self):
        beacons = Beacons(self.daemon.address)
        self.addCleanup(beacons.close)
        self.assertTrue(beacons.until_state(0, 30))
        beacon, source, data = beacons.next()
        self.assertEqual(source, self.daemon.address, "controllers connect to the source of the beacon")
        self.assertLessEqual(len(data), 256)
        self.assertEqual((beacon[1], beacon[2], beacon[4]), ([7001], [1], [0]))
        self.assertNotIn(9, beacon)
        early = any(self.is_early(beacons) for _ in range(20))  # a busy computer delays some
        self.assertTrue(early, "the state changes at once, not with the next beacon a second later")

    def is_early(self, beacons):
        """Connects after a beacon with the state free. Returns whether one with the state busy comes before the next was due."""
        self.assertTrue(beacons.until_state(0, 30))
        begin_s = beacons.arrived_s
        with Controller(self.daemon.address):
            self.assertTrue(beacons.until_state(1, 30))
        return beacons.arrived_s - begin_s < 0.9

    def test_frames_are_whole_and_counted_from_one(self):
        for _ in range(2):
            with self.controller() as link:
                link.set(1)
                frames = [link.frame() for _ in range(5)]
                indexes = [f.index for f in frames]  # a busy computer may skip frames
                self.assertEqual(indexes[0], 1)
                self.assertEqual(indexes, sorted(set(indexes)))
                self.assertEqual([f.u32(0) + 1 for f in frames], indexes)
                self.assertEqual(link.incomplete, 0)
                self.assertEqual(len(frames[0].header), 744)
                self.assertLessEqual(max(map(len, link.datagrams)), 1400)
                self.assertEqual(frames[0].u32(488), 7001)
                self.assertEqual(frames[0].u32(680), 1)

    def test_targets_have_their_ranges_and_bearings(self):
        with self.controller() as link:
            link.set(1, gain=0.0)
            frame = link.frame()
        for (range_m, bearing), beams in ((B, STARBOARD), (C, PORT)):
            near = [b for b in beams if abs(bearing_deg(b) - bearing) < 4]
            found_m, beam = frame.brightest(near, range_m - 0.7, range_m + 0.7)
            self.assertAlmostEqual(found_m, range_m, delta=0.1)
            self.assertAlmostEqual(bearing_deg(beam), bearing, delta=1.2)

    def test_salinity_changes_the_ranges(self):
        with self.controller() as link:
            link.set(1)
            salt = link.frame().f32(464)
            link.command(SALINITY, 6)
            speeds = [link.frame().f32(464) for _ in range(4)]
        self.assertAlmostEqual(speeds[-1] / salt, 1 / 1.029, delta=0.003)

    def test_cookies_report_which_settings_apply(self):
        with self.controller() as link:
            link.set(1)
            link.frame()
            link.set(2, rate=0.0)
            link.set(3, mode=3)
            frames = [link.frame() for _ in range(4)]
            self.assertEqual((frames[-1].u32(680), frames[-1].u32(688), frames[-1].mode), (1, 3, 9))
            link.set(4, rate=15.0, samples=200, period=4, pulse=20)
            frame = [link.frame() for _ in range(4)][-1]
            self.assertEqual((frame.u32(684), frame.u32(444), frame.samples), (4, 16, 200))

    @unittest.skipUnless(shutil.which("protoc"), "protoc is not installed")
    def test_the_proto_file_describes_the_messages(self):
        def decoded(kind, data):
            done = subprocess.run(["protoc", f"--decode=sonar.aris.{kind}", f"--proto_path={ROOT / 'protocol/aris'}", "aris.proto"],
                                  input=data, capture_output=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            return done.stdout.decode()

        beacons = Beacons(self.daemon.address)
        self.addCleanup(beacons.close)
        beacon = decoded("Availability", beacons.next()[2])
        for line in ("serialNumber: 7001", "systemType: 1", "connectionState: ", "major: 2", 'enabled: "KA"', "isDiverHeld: false"):
            self.assertIn(line, beacon)
        with self.controller() as link:
            link.set(7)
            link.frame()
            self.assertIn("cookie: 7", decoded("Command", link.sent[-1][4:]))
            part = decoded("FramePart", link.datagrams[0])
        self.assertRegex(part, f"^frame_index: 1\ntotal_data_size: {128 * 1600}\nheader: ")
        self.assertRegex(part, r"data_offset: 0\n$")
        self.assertNotRegex(beacon + part, r"(?m)^\d+:", "fields that the file does not know")

    def test_one_controller_at_a_time(self):
        with self.controller() as first:
            first.set(1)
            first.frame()
            with Controller(self.daemon.address, receiver=False) as second:
                second.tcp.settimeout(30)
                try:
                    self.assertEqual(second.tcp.recv(1), b"")
                except ConnectionResetError:
                    pass
            before = first.frame().index
            self.assertGreater(first.frame().index, before)
            self.assertEqual(first.incomplete, 0)

    def test_the_stream_stops_on_request(self):
        with self.controller() as link:
            link.set(1)
            link.frame()
            link.command(RECEIVER, 3, field(1, 1) + field(2, b"0.0.0.0"))
            expect_quiet(link.udp)

    def test_silence_ends_a_connection(self):
        self.until_free()
        start = time.monotonic()
        with self.controller(receiver=False) as link:
            link.tcp.settimeout(100)
            try:
                self.assertEqual(link.tcp.recv(1), b"")
            except ConnectionResetError:
                pass
            self.assertTrue(9 < time.monotonic() - start < 100)  # 10 s on a quiet machine


class EveryMode(unittest.TestCase):
    def test_targets_have_their_ranges_and_bearings(self):
        for profile, modes in (("aris-1200", (1,)), ("aris-1800", (1, 3)), ("aris-3000", (6,))):
            with Sonard(scene="l-targets.yaml", profile=profile, pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}") as daemon:
                with Controller(daemon.address) as link:
                    for cookie, (mode, frequency) in enumerate([(m, f) for m in modes for f in (0, 1)], 1):
                        link.set(cookie, mode=mode, frequency=frequency, rate=8.0, gain=0.0)  # below full scale
                        frame = link.frame()
                        while frame.u32(680) != cookie:
                            frame = link.frame()
                        with self.subTest(profile=profile, mode=mode, frequency=frequency):
                            self.check(frame)

    def check(self, frame):
        spacing = 30 / frame.beams
        for range_m, bearing in (B, C):
            near = [b for b in range(frame.beams) if abs(bearing_deg(b, frame.beams) - bearing) < 4]
            found_m, beam = frame.brightest(near, range_m - 0.7, range_m + 0.7)
            self.assertAlmostEqual(found_m, range_m, delta=0.1)
            self.assertAlmostEqual(bearing_deg(beam, frame.beams), bearing, delta=0.7 + spacing)


class Tools(unittest.TestCase):
    def test_listen_view_and_a_recording(self):
        with tempfile.TemporaryDirectory() as folder:
            with Sonard(profile="aris-1800", more=f"recording: {{folder: {folder}}}") as daemon:
                control = ("--control", f"{daemon.address}:14770")
                begun = run(SONARCTL, "recording", "start", "run.aris", *control)
                self.assertEqual(begun.returncode, 0, begun.stderr)
                listened = daemon.ctl("listen", "--pings", 5, "--range", 6)
                self.assertEqual(listened.returncode, 0, listened.stderr)
                self.assertRegex(listened.stdout, r"x 96  8 bit  6\.\d+ m  1\.8000 MHz")
                run(SONARCTL, "recording", "stop", *control)
                picture = pathlib.Path(folder) / "fan.png"
                viewed = daemon.ctl("view", "--png", picture)
                self.assertEqual(viewed.returncode, 0, viewed.stderr)
                self.assertTrue(picture.exists())
            file = pathlib.Path(folder) / "run.aris"
            recorded = file.read_bytes()
            self.assertNotIn("settings", self.replayed(file, daemon.address).stderr)
            self.set_cookies(file, 99)
            self.assertIn("does not use the settings", self.replayed(file, daemon.address).stderr)
        _, frames, beams, samples = (struct.unpack_from("<I", recorded, at)[0] for at in (0, 4, 16, 24))
        self.assertEqual((recorded[:4], beams), (b"DDF\x05", 96))
        self.assertEqual(len(recorded), 1024 + frames * (1024 + beams * samples))
        self.assertGreaterEqual(frames, 5)

    def replayed(self, file, address):
        replay = subprocess.Popen([SONARD, "replay", file, "--ip", address, "--loop"], stderr=subprocess.PIPE, text=True)
        try:
            self.assertIn("(.aris file) as sonar 7001", replay.stderr.readline())
            heard = run(SONARCTL, "listen", address, "--make", "aris", "--wait", 100, "--pings", 5)
            self.assertEqual(heard.returncode, 0, heard.stderr)
            self.assertRegex(heard.stdout, r"x 96  8 bit  6\.\d+ m  1\.8000 MHz")
            return heard
        finally:
            replay.terminate()
            replay.communicate(timeout=20)

    @staticmethod
    def set_cookies(file, cookie):
        data = bytearray(file.read_bytes())
        _, frames, beams, samples = (struct.unpack_from("<I", data, at)[0] for at in (0, 4, 16, 24))
        for i in range(frames):
            for place in (680, 684):
                struct.pack_into("<I", data, 1024 + i * (1024 + beams * samples) + place, cookie)
        file.write_bytes(data)

    def test_sonarctl_says_what_the_product_cannot_do(self):
        with Sonard(scene="l-targets.yaml", profile="aris-3000") as daemon:
            for settings, why in ((("--range", 60), "the range of an ARIS 3000 is 1.1 to 20 m, not 60 m"),
                                  (("--mode", 4, "--range", 21), "the range of an ARIS 3000 is 1.1 to 20 m, not 21 m"),
                                  (("--mode", 5), "no ARIS has this range and mode: an ARIS 1200 has modes 1 and 2, others 1 to 4")):
                for command in (("listen", "--pings", 1), ("record", "--pings", 1, "--pcap", f"{daemon.folder.name}/run.pcap"),
                                ("view", "--png", f"{daemon.folder.name}/fan.png"), ("view", "--live", "--term")):
                    done = run(SONARCTL, command[0], daemon.address, "--make", "aris", "--wait", 100, *command[1:], *settings)
                    self.assertEqual(done.returncode, 64, done.stderr)
                    self.assertIn(f"sonarctl: {why}", done.stderr)

    def test_injected_faults(self):
        with Sonard(scene="l-targets.yaml", profile="aris-3000", arguments=("--faults",)) as daemon:
            control = ("--control", f"{daemon.address}:14770")
            with Controller(daemon.address) as link:
                link.set(1, samples=200)
                link.frame()
                run(SONARCTL, "fault", "add", "G01", "--pings", "1", *control)
                self.assertTrue(any(link.frame() and link.incomplete == 1 for _ in range(40)), "one frame lost a part")
                run(SONARCTL, "fault", "add", "P15", "--pings", "1", *control)
                self.assertTrue(any(math.isnan(link.frame().f32(160)) for _ in range(40)))
            self.assertNotEqual(daemon.ctl("listen", "--as-it-is", "--seconds", 2).returncode, 0, "no settings, no frames")
            self.assertEqual(daemon.ctl("listen", "--pings", 2).returncode, 0)
            run(SONARCTL, "fault", "add", "G01", "--pings", "1000", *control)
            start = time.monotonic()
            self.assertNotEqual(daemon.ctl("listen", "--seconds", 3).returncode, 0)
            self.assertLess(time.monotonic() - start, 30, "frames that lack parts do not prolong the command")
            refused = run(SONARCTL, "fault", "add", "S01", *control)
            self.assertIn("sends pings by datagrams alone", refused.stderr)


@unittest.skipIf(shark.why_not(), shark.why_not())
class Dissected(unittest.TestCase):
    def test_a_conversation_is_read_as_it_was_sent(self):
        with Sonard(scene="l-targets.yaml", profile="aris-3000") as daemon:
            beacons = Beacons(daemon.address)
            beacon = beacons.next()[2]
            beacons.close()
            with Controller(daemon.address) as link:
                link.set(77)
                link.command(PING)
                frame = link.frame()
                sent, datagrams = link.sent, link.datagrams
        port = fields(fields(sent[0][4:])[3][0])[1][0]
        capture = Capture(device_port=COMMANDS)
        capture.connect()
        whole = b"".join(sent)
        for data in (whole[:7], whole[7:]):  # in pieces that do not end with a command
            capture.tcp("client", data)
        capture.udp(beacon, BEACONS)
        for datagram in datagrams:
            capture.udp(datagram, port)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "aris.pcap"
            capture.write(path)
            lines = shark.tshark("-r", path, "-Y", "aris", dissector=DISSECTOR)
            values = shark.tshark("-r", path, "-Y", "aris.header.SamplesPerBeam", "-T", "fields", "-e", "aris.part.frameIndex", "-e",
                                  "aris.header.SamplesPerBeam", "-e", "aris.header.SoundSpeed", "-e", "aris.header.AppliedSettings",
                                  dissector=DISSECTOR).split()
            capture.udp(datagrams[0][:-5], port)
            capture.tcp("client", struct.pack(">I", 9) + b"\x2a\x20" + bytes(7))
            capture.write(path)
            broken = shark.tshark("-r", path, "-Y", "aris.expert.broken", dissector=DISSECTOR)
        self.assertIn("SET_ACOUSTICS 77: mode 9, 10 Hz, 1600 samples of 6 us from 1360 us, gain 12 dB", lines)
        self.assertIn("beacon: ARIS 3000 7001, available", lines)
        self.assertIn(f"bytes 0 to 620 of {128 * 1600}, 128 x 1600", lines)
        self.assertEqual(lines.count("frame 1: "), len(datagrams))
        self.assertEqual((values[0], values[1], values[3]), ("1", "1600", "77"))
        self.assertAlmostEqual(float(values[2]), frame.f32(464), places=2)
        self.assertEqual(len(broken.splitlines()), 2, broken)


if __name__ == "__main__":
    unittest.main()
