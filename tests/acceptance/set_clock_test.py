"""The computer's clock is set by hours while sonard or sonarctl runs, as NTP does after the start of a computer without a battery
for its clock. set_clock.cpp sets it for these programs only."""
import os
import pathlib
import struct
import subprocess
import tempfile
import unittest
from unittest import mock

from running_sonard import BUILD, SONARCTL, Sonard

HOURS = (2, -3)


class SetClock(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.file = self.folder / "shift"
        self.set_clock(0)
        library, = BUILD.glob("tests/acceptance/libset_clock.so")
        patch = mock.patch.dict(os.environ, {"LD_PRELOAD": str(library), "SET_CLOCK": str(self.file)})
        patch.start()
        self.addCleanup(patch.stop)

    def set_clock(self, hours):
        with open(self.file, "r+b" if self.file.exists() else "wb") as file:
            file.write(struct.pack("<q", 3600 * hours))

    def test_a_recording_has_neither_gaps_nor_equal_times(self):
        with Sonard() as daemon:
            for hours in HOURS:
                self.set_clock(0)
                file = self.folder / f"{hours}.pcap"
                with subprocess.Popen([SONARCTL, "record", daemon.address, "--pcap", file, "--pings", "30"], stdout=subprocess.PIPE,
                                      text=True) as recorder:
                    self.assertIn("connected", recorder.stdout.readline())
                    self.set_clock(hours)
                    self.assertEqual(recorder.wait(120), 0)
                times = self.times_of(file.read_bytes())
                self.assertGreater(times[-1] - times[0], 1)
                self.assertLess(times[-1] - times[0], 100)

    @staticmethod
    def times_of(pcap):
        """The times of the packets."""
        magic, = struct.unpack_from("<I", pcap)
        times, at = [], 24
        while at < len(pcap):
            seconds, parts, kept, _ = struct.unpack_from("<IIII", pcap, at)
            times.append(seconds + parts * (1e-9 if magic == 0xA1B23C4D else 1e-6))
            at += 16 + kept
        return times


if __name__ == "__main__":
    unittest.main()
