"""The computer's clock is set by hours while sonard or sonarctl runs, as NTP does after the start of a computer without a battery
for its clock. set_clock.cpp sets it for these programs only."""
import json
import os
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

from oculus_reader import Client, fire_message
from running_sonard import BUILD, ROOT, SONARCTL, Sonard, eventually, run

sys.path.insert(0, str(ROOT / "clients/python"))
from sonard_client import Control  # noqa: E402  pylint: disable=wrong-import-position

HOURS = (2, -3)


class SetClock(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.file = self.folder / "shift"
        self.set_clock(0)
        library, = BUILD.glob("tests/acceptance/libset_clock.so")
        patch = mock.patch.dict(os.environ, {"LD_PRELOAD": str(library), "SET_CLOCK": str(self.file)})
        patch.start()
        self.addCleanup(patch.stop)

    def set_clock(self, hours):
        with open(self.file, "r+b" if self.file.exists() else "wb") as file:
            file.write(struct.pack("<q", 3600 * hours))

    def test_pings_continue_and_the_daemon_reports_the_set_clock(self):
        with Sonard() as daemon, Client(daemon.address) as client:
            client.send(fire_message(rate_hz=10))
            client.ping()
            control = Control(daemon.address)
            self.assertEqual(control.status()["notes"], [])
            for hours in HOURS:
                self.set_clock(hours)
                for _ in range(5):
                    client.ping()
                status = control.status()
                self.assertAlmostEqual(status["wall_ahead_s"], 3600 * hours, delta=2)
                notes = status["notes"]
                self.assertEqual(len(notes), 1, notes)
                self.assertIn(f"it is {abs(3600 * hours)} s {'ahead of' if hours > 0 else 'behind'} sonard's", notes[0]["text"])
                self.assertIn("systemd-time-wait-sync", notes[0]["cure"])
                eventually(lambda: "the computer's clock was set" in daemon.log())
            self.assertEqual(daemon.log().count("the computer's clock was set"), 1, daemon.log())
            self.set_clock(0)
            eventually(lambda: control.status()["notes"] == [])

    def test_visits_and_poses_keep_their_time(self):
        with Sonard() as daemon:
            control = Control(daemon.address)
            with Client(daemon.address) as client:
                client.send(fire_message(rate_hz=10))
                client.ping()
            eventually(lambda: control.status()["sonars"][0].get("gone"))
            for hours in HOURS:
                self.set_clock(hours)
                self.assertLess(abs(control.status()["sonars"][0]["gone"]["ago_s"]), 600)
                before = int(control.status()["poses"]["accepted"])
                done = daemon.ctl_to(f"{daemon.address}:14770", "pose", "once", "--xyz", "1,2,-3")  # stamped with WALL time
                self.assertEqual(done.returncode, 0, done.stderr)
                eventually(lambda: int(control.status()["poses"]["accepted"]) > before, 30)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as poses:
                for hours in HOURS:  # now the sender's clock is set
                    pose = {"timestamp": 1e9 + 3600 * hours, "position": [0, hours, 3], "attitude": [0, 0, 0]}
                    poses.sendto(json.dumps(pose).encode(), (daemon.address, 14771))
                    eventually(lambda: abs(control.status()["vehicles"][0]["position"].get("x", 0) - hours) < 0.01, 30)

    def test_doctor_reports_the_set_clock(self):
        with Sonard() as daemon:
            for hours in HOURS:
                self.set_clock(hours)
                done = run(SONARCTL, "doctor", daemon.address, "--status-on", daemon.address, "--control", f"{daemon.address}:14770",
                           "--within", "40")
                self.assertIn("the computer's clock was set", done.stdout)

    def test_a_recording_has_neither_gaps_nor_equal_times(self):
        with Sonard() as daemon:
            for hours in HOURS:
                self.set_clock(0)
                file = self.folder / f"{hours}.pcap"
                with subprocess.Popen([SONARCTL, "record", daemon.address, "--pcap", file, "--wait", "100", "--pings", "30"], stdout=subprocess.PIPE,
                                      text=True) as recorder:
                    self.assertIn("connected", recorder.stdout.readline())
                    self.set_clock(hours)
                    self.assertEqual(recorder.wait(300), 0)
                times = self.times_of(file.read_bytes())
                self.assertLess(max(abs(after - before) for before, after in zip(times, times[1:])), 100)
                self.assertGreaterEqual(len(set(times)), 30, "at least one per ping, also after the clock was set")

    @staticmethod
    def times_of(pcap):
        """Returns the times of the packets."""
        magic, = struct.unpack_from("<I", pcap)
        times, at = [], 24
        while at < len(pcap):
            seconds, parts, kept, _ = struct.unpack_from("<IIII", pcap, at)
            times.append(seconds + parts * (1e-9 if magic == 0xA1B23C4D else 1e-6))
            at += 16 + kept
        return times


if __name__ == "__main__":
    unittest.main()
