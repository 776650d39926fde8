"""Tests the messages that a driver gets, with the independent reader: sizes, versions, sample widths, bearings, standby, the
end."""
import os
import pathlib
import signal
import subprocess
import time
import unittest

from oculus_reader import Client, Ping, expected_bearings, fire_message
from running_sonard import SONARD, Sonard


class Served(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard(scene="tank-rod.yaml").__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def test_every_version_width_and_size(self):
        last = 0
        with Client(self.daemon.address) as client:
            for mode, version, flags, extended, sample_bytes, beams in [
                    (2, 0, 0x09, 0, 1, 256), (2, 1, 0x49, 0, 1, 512), (1, 0, 0x4D, 0, 1, 512), (2, 2, 0x4F, 0, 2, 512),
                    (2, 2, 0x4B, 0x200, 4, 512), (1, 2, 0x0B, 0, 2, 256)]:
                with self.subTest(version=version, flags=flags, extended=extended):
                    ping = client.ping_made_with(fire_message(mode=mode, version=version, flags=flags, extended=extended, range_=4.0))
                    self.assertEqual((ping.version, ping.sample_bytes, ping.beams), (version, sample_bytes, beams))
                    self.assertEqual(ping.extended, extended)
                    self.assertGreater(ping.id, last, "ids rise across settings")
                    last = ping.id
                    self.assertEqual(len(ping.gains), ping.rows if flags & 4 else 0)
                    self.assertTrue(all(g >= 1 for g in ping.gains))
                    self.assertLessEqual(ping.rows, 720)
                    self.assertAlmostEqual(ping.rows * ping.resolution, 4.0, delta=ping.resolution)
                    self.expect_bearings(ping, 30 if mode == 2 else 65)

    def expect_bearings(self, ping, half_aperture_deg):
        """Compares with the bearings of captured pings. Values very close to a whole hundredth of a degree may be truncated to
        the neighbouring one."""
        differences = [abs(a - b) for a, b in zip(ping.bearings, expected_bearings(ping.beams, half_aperture_deg))]
        self.assertLessEqual(max(differences), 1)
        self.assertLessEqual(sum(differences), ping.beams // 100)
        self.assertEqual((ping.bearings[0], ping.bearings[-1]), (-100 * half_aperture_deg, 100 * half_aperture_deg))

    def test_settings_come_back_and_pings_come_at_their_rate(self):
        with Client(self.daemon.address) as client:
            self.assertEqual(client.ping_made_with(fire_message(flags=0x19)).flags, 0x19)
            self.assertEqual(client.stale, 0, "on a new connection the first ping has the requested settings")
            ping = client.ping_made_with(fire_message(range_=2.0, gain=30.0, sound_speed=1490.0, salinity=35.0, flags=0x19))
            self.assertEqual((ping.gain, ping.sound_speed, ping.salinity, ping.sound_speed_used), (30.0, 1490.0, 35.0, 1490.0))
            ids, start = [ping.id], time.monotonic()
            while len(ids) < 11:
                ids.append(client.ping().id)
            self.assertGreater(time.monotonic() - start, 0.5, "ten pings at 10 Hz cannot take less")
            self.assertEqual(ids, sorted(set(ids)))

    def test_a_client_that_announces_no_payload_is_understood(self):
        with Client(self.daemon.address) as client:
            self.assertEqual(client.ping_made_with(fire_message(range_=3.0, payload_size=0)).range, 3.0)

    def test_standby_sends_dummies_and_another_rate_resumes(self):
        with Client(self.daemon.address) as client:
            client.ping_made_with(fire_message(range_=3.0))
            client.send(fire_message(range_=3.0, rate_hz=0))
            kinds = []
            while kinds[-2:] != [0xFF, 0xFF]:
                kinds.append(client.message()[0])
                self.assertLess(len(kinds), 30, "still pinging in standby")
            client.send(fire_message(range_=3.0))
            self.assertEqual(client.ping().range, 3.0)

    def test_the_second_client_is_refused_without_a_byte(self):
        with Client(self.daemon.address) as first:
            first.ping_made_with(fire_message())
            with Client(self.daemon.address) as second, self.assertRaises((EOFError, ConnectionResetError)):
                second.message()
            self.assertEqual(first.ping().mode, 2)
        with Client(self.daemon.address) as third:
            self.assertEqual(third.ping_made_with(fire_message()).mode, 2)


class Ending(unittest.TestCase):
    def test_sigterm_ends_within_two_seconds_with_a_reader_and_a_stalled_client(self):
        with Sonard(scene="tank-rod.yaml", profile="oculus-m1200d") as daemon:
            with Client(daemon.address) as stalled:
                stalled.ping_made_with(fire_message(rate_hz=40, flags=0x4B, version=2, extended=0x200))
                time.sleep(1)  # the client reads nothing, so its window fills
                code, seconds = daemon.stop()
            self.assertEqual(code, 0, daemon.log())
            self.assertLess(seconds, 20)  # the documented limit is 2 s


class Capture(unittest.TestCase):
    def test_the_reader_reads_a_real_device(self):
        folder = os.environ.get("SONARD_CAPTURES")
        if not folder:
            self.skipTest("SONARD_CAPTURES names no folder of recordings")
        below = pathlib.Path(folder, "oculus/three_pings_8bit.raw")
        data = (below if below.exists() else pathlib.Path(folder, "three_pings_8bit.raw")).read_bytes()
        pings = [Ping(data[i:i + 182016]) for i in range(0, len(data), 182016)]
        self.assertEqual([p.id for p in pings], [415323, 415324, 415325])
        self.assertEqual((pings[0].rows, pings[0].beams, pings[0].image_offset), (703, 256, 2048))
        self.assertEqual(list(pings[0].bearings), expected_bearings(256, 30))
        self.assertEqual(max(max(row) for row in pings[0].image), 254)


class TheReaderOfTheLogEnds(unittest.TestCase):
    """sonard 2>&1 | head: the log is lost, the service continues."""

    def test_clients_are_still_served(self):
        configured = Sonard("tank-rod.yaml", pose="{frame: ENU_FLU, xyz_m: [0, 0, -3]}")
        configured.address = "127.0.0.9"
        self.addCleanup(configured.folder.cleanup)
        daemon = subprocess.Popen([str(SONARD), "run", str(configured.write_config())], stdin=subprocess.DEVNULL,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        try:
            self.assertTrue(any(b"ready in" in line for line in daemon.stdout))
            daemon.stdout.close()
            for _ in range(2):  # each causes some log lines
                with Client(configured.address) as client:
                    client.ping_made_with(fire_message(range_=4.0))
            self.assertIsNone(daemon.poll())
            daemon.send_signal(signal.SIGTERM)
            self.assertEqual(daemon.wait(20), 0)
        finally:
            daemon.kill()
            daemon.wait()


if __name__ == "__main__":
    unittest.main()
