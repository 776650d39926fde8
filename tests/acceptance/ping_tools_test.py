"""Tests sonarctl and the dissector for Wireshark with an emulated Ping360, Surveyor, Omniscan, Ping1D and S500."""
import pathlib
import re
import socket
import struct
import subprocess
import tempfile
import threading
import unittest

import tshark as shark
from pcap_writer import Capture
from ping_link_test import DOWN, OMNISCAN, PING1D, PING360, S500, SIDE, SURVEYOR, Host, frame, general, settings, side_scan, sound, transducer
from running_sonard import ROOT, SONARCTL, Sonard, eventually, run

DISSECTOR = ROOT / "protocol/ping/ping.lua"


class Tools(unittest.TestCase):
    def test_sonarctl_listens_views_and_examines(self):
        for profile, port, mount, line in (("ping360", PING360, "{frame: FLU, xyz_m: [0, 0, 0]}", r"x 1  8 bit .* angle \d+ grad"),
                                           ("surveyor-240", SURVEYOR, DOWN, r"points from \d+\.\d\d to \d+\.\d\d m"),
                                           ("omniscan-450", OMNISCAN, SIDE, r"strongest -?\d+\.\d dB at \d+\.\d\d m"),
                                           ("ping1d", PING1D, DOWN, r"distance \d\.\d{3} m, confidence \d+ %"),
                                           ("s500", S500, DOWN, r"distance \d\.\d{3} m, confidence \d+ %")):
            with self.subTest(profile), Sonard(profile=profile, mount=mount) as daemon, tempfile.TemporaryDirectory() as folder:
                at = f"{daemon.address}:{port}"
                examined = daemon.ctl("doctor", "--within", 60, "--control", f"{daemon.address}:14770")
                self.assertRegex(examined.stdout, rf"ok +(udp|tcp) {at} accepts, first ping decoded", examined.stdout + examined.stderr)
                listened = run(SONARCTL, "listen", at, "--wait", "100", "--pings", 5, "--range", 8)
                self.assertEqual(listened.returncode, 0, listened.stderr)
                self.assertEqual(len(re.findall(line, listened.stdout)), 5, listened.stdout)
                self.assertRegex(listened.stdout, r"  (8\.00|7\.99) m  0\.\d{4} MHz")
                without_port = daemon.ctl("listen", "--pings", 1)
                self.assertRegex(without_port.stdout, line, without_port.stderr)
                picture = pathlib.Path(folder) / "fan.png"
                viewed = run(SONARCTL, "view", at, "--wait", "100", "--png", picture, "--range", 4)
                self.assertEqual((viewed.returncode, picture.exists()), (0, True), viewed.stderr)
                self.assertEqual(profile == "surveyor-240", bool(re.search(r"pixels, \d+ points, 4\.00 m, points$", viewed.stdout.strip())), viewed.stdout)
                self.assertNotIn("refused", daemon.log(), "an Omniscan and an S500 have the same port")
                of_many = profile != "surveyor-240"
                self.assertEqual(bool(re.search(r"the picture has \d+ of \d\d\d scan lines", viewed.stderr)), of_many, viewed.stderr)


    def test_sonarctl_observes_beside_a_driver(self):
        drivers = {"omniscan-450": (OMNISCAN, side_scan(1)), "s500": (S500, sound(100, 1308)), "surveyor-240": (SURVEYOR, settings(1)),
                   "ping1d": (PING1D, frame(1400, struct.pack("<H", 1300)))}
        for profile, (port, request) in drivers.items():
            with Sonard(profile=profile, mount=DOWN) as daemon, socket.create_connection((daemon.address, port)) as driver:
                driver.sendall(request)
                reads = threading.Thread(target=self.read_until_closed, args=(driver,))
                reads.start()
                control, mcap = ("--control", f"{daemon.address}:14770"), pathlib.Path(daemon.folder.name) / "run.mcap"
                try:
                    for words in (("listen",), ("listen", "--make", {"omniscan-450": "omniscan450", "surveyor-240": "surveyor240"}.get(profile, profile)),
                                  ("listen", "--observe"), ("record", "--observe", "--mcap", mcap)):
                        with self.subTest(profile=profile, words=words):
                            heard = daemon.ctl(*words, "--pings", 2, *control)
                            self.assertEqual(heard.returncode, 0, heard.stderr)
                            self.assertRegex(heard.stderr, "as an observer: .* settings of the sonar's clients\n")
                            self.assertRegex(heard.stdout, "\npings 2\n|recorded 2 pings")
                finally:
                    driver.shutdown(socket.SHUT_RDWR)
                    reads.join(20)

    def test_an_observer_waits_for_a_driver_or_says_why_it_cannot(self):
        with Sonard(profile="s500", mount=DOWN) as daemon:
            control = ("--control", f"{daemon.address}:14770")
            said = pathlib.Path(daemon.folder.name) / "said"
            with said.open("w") as errors, subprocess.Popen([SONARCTL, "listen", daemon.address, "--observe", "--pings", "2", *control],
                                                            stdout=subprocess.DEVNULL, stderr=errors) as waits:
                try:
                    eventually(lambda: "nothing requested; waiting for the first one\n" in said.read_text())
                    self.assertIn("it has none now: pings come when a driver requests them\n", said.read_text())
                    self.assertEqual(daemon.ctl("listen", "--pings", 4).returncode, 0)
                    self.assertEqual(waits.wait(60), 0, said.read_text())
                finally:
                    waits.kill()
        for profile, why in (("ping360", "it sends pings in datagrams to its host"), ("norbit-wbms", "serves several clients")):
            with Sonard(profile=profile) as daemon:
                refused = daemon.ctl("listen", "--observe", "--control", f"{daemon.address}:14770")
                self.assertEqual(refused.returncode, 69, refused.stderr)
                self.assertRegex(refused.stderr, f"accepts no observers, because .*{why}.*leave out --observe")

    @staticmethod
    def read_until_closed(connection):
        try:
            while connection.recv(65536):
                pass
        except OSError:
            pass


@unittest.skipIf(shark.why_not(), shark.why_not())
class Dissected(unittest.TestCase):
    def test_a_conversation_is_read_as_it_was_sent(self):
        with Sonard(scene="l-targets.yaml", profile="ping360", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}") as daemon:
            host = Host(daemon.address, PING360)
            host.ask(general(4), 4)
            host.ask(transducer(17), 2300)
        with Sonard(profile="omniscan-450", mount=SIDE) as daemon:
            side = Host(daemon.address, OMNISCAN)
            side.send(side_scan(1, results=200))
            side.next(2198)
        with Sonard(profile="ping1d", mount=DOWN) as daemon:
            down = Host(daemon.address, PING1D)
            down.ask(general(1300), 1300)
        with Sonard(profile="s500", mount=DOWN) as daemon:
            narrow = Host(daemon.address, S500)
            narrow.ask(sound(-1, 1308), 1308)
        capture = Capture(device_port=SURVEYOR)
        capture.connect()
        whole = general(4) + settings(1)
        for data in (whole[:7], whole[7:]):  # cuts that do not coincide with the ends of frames
            capture.tcp("client", data)
        for datagram in host.datagrams:
            capture.udp(datagram, PING360)
        capture.udp(side.datagrams[0], OMNISCAN)
        capture.udp(down.datagrams[0], PING1D)
        for datagram in narrow.datagrams:
            capture.udp(datagram, S500)
        capture.udp(sound(-1, 1308), S500)
        capture.tcp("client", side_scan(1))
        capture.tcp("client", frame(1300))  # as older hosts request it, without a payload
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "ping.pcap"
            capture.write(path)
            lines = shark.tshark("-r", path, "-Y", "brping", dissector=DISSECTOR)
            values = shark.tshark("-r", path, "-Y", "brping.device_data.angle", "-T", "fields", "-e", "brping.device_data.angle", "-e",
                                  "brping.device_data.data_length", "-e", "brping.src_device_id", dissector=DISSECTOR).split()
            wrong = shark.tshark("-r", path, "-Y", "brping.expert.broken || brping.expert.checksum", dissector=DISSECTOR)
            capture.udp(host.datagrams[0][:-1] + b"\x55", PING360)
            capture.udp(host.datagrams[0][:-3], PING360)
            capture.write(path)
            broken = shark.tshark("-r", path, "-Y", "brping.expert.broken || brping.expert.checksum", dissector=DISSECTOR)
        for name in ("general_request", "set_ping_parameters", "device_information", "device_data", "os_ping_params", "os_mono_profile", "profile", "profile6_t", "set_ping_params"):
            self.assertIn(name, lines)
        self.assertEqual(values, ["17", "1200", "2"])
        self.assertEqual(wrong.strip(), "")
        self.assertEqual(len(broken.splitlines()), 2, broken)


if __name__ == "__main__":
    unittest.main()
