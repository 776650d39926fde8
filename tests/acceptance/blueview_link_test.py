"""Tests the BlueView link with an independent program: discovery, greeting, settings, and the positions of the L targets in pings."""
import struct
import threading
import time
import unittest

from blueview_host import (GAIN, PING, PING_DATA, RANGE, SOUND_SPEED, SUBSCRIBE, TRANSMIT, Host, PingData, Refused, discover)
from running_sonard import Sonard

A, B, C = (3.9, -20), (3.9, 10), (6.9, -8)  # range m, bearing deg clockwise: the nearest points of scenes/l-targets.yaml


def brightest(ping, near_m, far_m, from_deg, to_deg):
    beams = [j for j in range(ping.beams) if from_deg <= ping.bearing(j) <= to_deg]
    bins = [k for k in range(ping.bins) if near_m <= ping.range_m(k) <= far_m]
    _, beam, k = max((ping.at(j, k), j, k) for j in beams for k in bins)
    return ping.range_m(k), ping.bearing(beam)


class BlueViewLink(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard(scene="l-targets.yaml", profile="blueview-p900-90", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}").__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def host(self):
        return Host(self.daemon.address).greet()

    def test_discovery_names_the_sonar(self):
        found = discover(self.daemon.address)
        self.assertEqual((found["address"], found["port"], found["model"]), (self.daemon.address, 14750, "BlueView P900-90"))

    def test_the_greeting_describes_the_head(self):
        with self.host() as host:
            self.assertEqual(host.hello["model"], "BlueView P900-90")
            head, = host.hello["heads"]
            self.assertEqual((head["id"], head["beams"], head["centre_hz"]), (0, 512, 900000))
            self.assertAlmostEqual(head["fov"][1], 45, places=3)

    def test_targets_have_their_ranges_and_bearings(self):
        with self.host() as host:
            host.set_integer(SOUND_SPEED, 1490)
            host.set_numbers(RANGE, 1, 9)
            ping = host.ping()
        self.assertEqual(ping.beams, 512)
        self.assertAlmostEqual(ping.stop, 9, delta=0.05)
        self.assertLess(abs(ping.time_s - time.time()), 5)
        for (range_m, bearing), sector in ((A, (-30, -12)), (B, (2, 20)), (C, (-12, -4))):
            found = brightest(ping, 2, 8.5, *sector)
            self.assertAlmostEqual(found[0], range_m, delta=0.15)
            self.assertAlmostEqual(found[1], bearing, delta=1.2)

    def test_the_start_range_cuts_the_near_field_off(self):
        with self.host() as host:
            host.set_numbers(RANGE, 5, 9)
            ping = host.ping()
        self.assertAlmostEqual(ping.start, 5, places=3)
        self.assertAlmostEqual(brightest(ping, 5, 8.5, -12, -4)[0], C[0], delta=0.15)

    def test_gain_raises_the_samples_and_without_transmission_only_noise_remains(self):
        with self.host() as host:
            host.set_numbers(RANGE, 1, 9)
            host.set_numbers(GAIN, -20)
            quiet = host.ping()
            host.set_numbers(GAIN, -14)
            loud = host.ping()
            peak = lambda p: max(p.samples)
            self.assertLess(peak(loud), 65535)
            self.assertAlmostEqual(peak(loud) / peak(quiet), 2.0, delta=0.1)  # 6 dB
            host.set_integer(TRANSMIT, 0)
            deaf = host.ping()
            self.assertLess(peak(deaf), peak(quiet) / 4)
            self.assertGreater(peak(deaf), 0)
            host.set_integer(TRANSMIT, 1)
            host.set_numbers(GAIN, 0)

    def test_hosts_share_the_settings_and_refusals_have_numbers(self):
        with self.host() as one, self.host() as two:
            self.assertEqual(one.set_numbers(RANGE, 0, 500), (0, 100))
            two_sees = struct.unpack("<Bff", two.ask(3, struct.pack("<iH", 0, RANGE)))
            self.assertEqual(two_sees[1:], (0, 100))
            with self.assertRaises(Refused) as refused:
                one.ping(head=5)
            self.assertEqual(refused.exception.code, 2010)
            one.set_numbers(RANGE, 2, 10)

    def test_a_subscriber_gets_pings_without_requests(self):
        with self.host() as host:
            host.set_numbers(RANGE, 1, 9)
            host.ask(SUBSCRIBE, struct.pack("<iI", 0, 100))
            numbers = []
            for _ in range(5):
                kind, request, payload = host.receive()
                self.assertEqual((kind, request), (PING_DATA, 0))
                numbers.append(PingData(payload).number)
            self.assertEqual(numbers, sorted(set(numbers)))

    def test_hosts_share_pings_and_all_get_theirs(self):
        pings_each, seen, failures = 20, {}, []

        def work(index):
            try:
                with self.host() as host:
                    seen[index] = [host.ping().number for _ in range(pings_each)]
            except Exception as e:  # pylint: disable=broad-except
                failures.append(e)

        hosts = [threading.Thread(target=work, args=(i,)) for i in range(4)]
        start = time.monotonic()
        for h in hosts:
            h.start()
        for h in hosts:
            h.join(120)
        self.assertFalse(failures)
        took = time.monotonic() - start
        for numbers in seen.values():
            self.assertEqual(len(set(numbers)), pings_each)
            self.assertEqual(numbers, sorted(numbers))
        shared = len(set().union(*seen.values()))
        self.assertLess(shared, 4 * pings_each * 3 // 4, "four hosts must not cost four times the pings")
        print(f"4 hosts, {pings_each} pings each: {shared} pings computed, {pings_each / took:.1f} a second and host")


class TwoHeads(unittest.TestCase):
    def test_hosts_of_different_heads_take_turns_and_each_ping_is_of_its_own_settings(self):
        ranges, pings_each, seen, failures = {0: (1, 6), 1: (1, 3)}, 12, {}, []

        def work(address, head):
            try:
                with Host(address).greet() as host:
                    host.set_numbers(RANGE, *ranges[head], head=head)
                    seen[head] = [(p.head, p.start, round(p.stop, 1), p.beams)
                                  for p in (host.ping(head=head) for _ in range(pings_each))]
            except Exception as e:  # pylint: disable=broad-except
                failures.append(e)

        with Sonard(scene="l-targets.yaml", profile="blueview-m900-2250-130",
                    pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}") as daemon:
            hosts = [threading.Thread(target=work, args=(daemon.address, head)) for head in ranges]
            for h in hosts:
                h.start()
            for h in hosts:
                h.join(120)
        self.assertFalse(failures)
        self.assertEqual(seen, {head: [(head, *ranges[head], beams)] * pings_each for head, beams in ((0, 768), (1, 256))})


class Deflate(unittest.TestCase):
    def test_packed_samples_are_the_same(self):
        images = []
        for compression in ("none", "deflate"):
            with Sonard(scene="l-targets.yaml", profile="blueview-p900-90", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}",
                        mount="{frame: FLU, xyz_m: [0, 0, 0]}\n    options: {compression: " + compression + "}",
                        more="engine: {noise: off}") as daemon, Host(daemon.address) as host:
                ping = host.greet().ping()
                images.append(ping.samples)
                self.assertEqual(ping.compression, 1 if compression == "deflate" else 0)
        self.assertEqual(images[0], images[1])


if __name__ == "__main__":
    unittest.main()
