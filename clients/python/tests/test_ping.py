"""Pings: all versions and sample widths, golden messages, gains, positions in the image; with and without numpy."""
import json
import math
import os
import unittest

from common import GOLDEN, made_ping

from sonard_client import MessageReader, arrays, layouts
from sonard_client.endpoints import endpoint
from sonard_client.oculus import settings_of
from sonard_client.ping import ping_from
from sonard_client.status import read_status


def decoded(data):
    reader = MessageReader()
    reader.feed(data)
    (message,) = reader
    return ping_from(message)


def listed(values):
    """Returns the rows of either kind of grid as lists."""
    return values if isinstance(values, list) else values.tolist()


class Decoding(unittest.TestCase):
    def test_golden_pings_are_decoded(self):
        for version in (0, 1, 2):
            with self.subTest(version=version):
                ping = decoded((GOLDEN / f"ping_v{version}.bin").read_bytes())
                expected = json.loads((GOLDEN / f"ping_v{version}.json").read_text(encoding="utf-8"))
                fields, blocks = expected["fields"], expected["blocks"]
                self.assertEqual((ping.number, ping.version, ping.device_id), (fields["pingId"], version, 7001))
                self.assertEqual((ping.frequency_hz, ping.temperature_c, ping.pressure_bar), (2098880.5970149254, 12.5, 1.5))
                self.assertEqual((ping.sound_speed_mps, ping.row_m), (fields["speedOfSoundUsed"], fields["rangeResolution"]))
                attitude = tuple(fields.get(name) for name in ("heading", "pitch", "roll"))
                self.assertEqual((ping.heading_deg, ping.pitch_deg, ping.roll_deg), attitude)
                started = ping.start_time_s if version == 2 else ping.start_counter
                self.assertEqual(started, fields["pingStartTime"])
                self.assertEqual(listed(ping.samples), blocks["samples"])
                self.assertEqual(list(ping.row_gains), blocks["rowGains"])
                self.assertEqual([round(100 * math.degrees(b)) for b in ping.bearings_rad], blocks["bearings"])
                self.assertEqual(ping.settings.gain_percent, 70.0)
                if version == 2:
                    self.assertEqual(ping.settings.extended, (4, 1, 2, 3, 5, 6, 7, 8, 9))

    def test_every_version_and_width_is_decoded(self):
        for version in (0, 1, 2):
            for width in (1, 2, 3, 4):
                for gains in (None, [1, 4, 100]):
                    with self.subTest(version=version, width=width, gains=gains):
                        samples = [[(1 << 8 * width) - 1 - beam - 10 * row for beam in range(4)] for row in range(3)]
                        ping = decoded(made_ping(version, width, gains=gains, samples=samples))
                        self.assertEqual(listed(ping.samples), samples)
                        self.assertEqual((tuple(ping.samples.shape), ping.sample_bits), ((3, 4), 8 * width))
                        self.assertEqual(ping.samples[2, 1], samples[2][1])
                        self.assertEqual(ping.row(1), tuple(samples[1]))
                        self.assertEqual(ping.row_gains, tuple(gains) if gains else None)

    def test_numpy_is_optional(self):
        kind = memoryview if arrays.numpy is None else arrays.numpy.ndarray
        self.assertIsInstance(decoded(made_ping(0)).samples, kind)
        if arrays.numpy is None and os.environ.get("SONARD_CLIENT_NUMPY") != "hidden":
            self.skipTest("numpy is not installed: only its replacement was tested")


class Image(unittest.TestCase):
    def test_ranges_are_centres_and_port_is_positive(self):
        ping = decoded(made_ping(0, bearings=[-3000, -1000, 1000, 3000]))
        self.assertEqual([float(r) for r in ping.ranges_m], [0.25, 0.75, 1.25])
        self.assertAlmostEqual(float(ping.azimuths_rad[0]), math.radians(30))
        x, y = ping.xy(1, 0)
        self.assertAlmostEqual(x, 0.75 * math.cos(math.radians(30)))
        self.assertAlmostEqual(y, 0.375)  # to port
        fan_x, fan_y = ping.fan_xy()
        self.assertAlmostEqual(fan_x[1][0], x)
        self.assertAlmostEqual(fan_y[1][0], y)
        self.assertAlmostEqual(fan_y[2][3], -0.625)

    def test_gains_make_rows_comparable(self):
        ping = decoded(made_ping(0, gains=[4, 1, 100], samples=[[8, 0, 0, 0], [0, 5, 0, 0], [0, 0, 9, 20]]))
        self.assertEqual(listed(ping.amplitudes()), [[4, 0, 0, 0], [0, 5, 0, 0], [0, 0, 0.9, 2]])
        self.assertEqual(ping.strongest()[:3], (5, 1, 1))
        self.assertEqual(ping.strongest(beyond_m=1)[:3], (2, 2, 3))

    def test_strongest_is_the_nearest_of_equals(self):
        ping = decoded(made_ping(0, samples=[[0, 0, 0, 0], [0, 9, 9, 0], [9, 0, 0, 0]]))
        self.assertEqual(ping.strongest()[:4], (9, 1, 1, 0.75))
        self.assertEqual(ping.strongest(beyond_m=1e9).row, 2)


class Requests(unittest.TestCase):
    def test_fire_messages_equal_the_golden_ones(self):
        for version in (0, 2):
            golden = (GOLDEN / f"fire_v{version}.bin").read_bytes()
            settings = layouts.read_fire(golden[16:], version)
            self.assertEqual(layouts.fire_bytes(settings, version, layouts.read_header(golden[:16]).destination), golden)

    def test_settings_become_fields(self):
        good = dict(range_m=5, rate_hz=15, gain_percent=70, mode=1, beams=512, bits=16, gains=True, salinity=35, sound_speed=1490,
                    gamma=255, gain_assist=False, triggered=True)
        settings = settings_of(**good)
        self.assertEqual((settings.mode, settings.rate_code, settings.flags, settings.range), (1, 1, 0xCF, 5.0))
        self.assertEqual(settings_of(**dict(good, bits=32)).extended[0], 0x200)
        for name, value in (("rate_hz", 3), ("mode", 0), ("beams", 128), ("bits", 24), ("range_m", float("nan")), ("gamma", 256),
                            ("gain_percent", 101), ("salinity", -1), ("sound_speed", float("inf"))):
            with self.subTest(name), self.assertRaisesRegex(ValueError, name):
                settings_of(**dict(good, **{name: value}))

    def test_addresses_are_parsed(self):
        self.assertEqual(endpoint("127.0.0.2", 5), ("127.0.0.2", 5))
        self.assertEqual(endpoint("sonar:99", 5), ("sonar", 99))
        with self.assertRaisesRegex(ValueError, "port"):
            endpoint("sonar:0", 5)


class Status(unittest.TestCase):
    def test_the_golden_status_is_decoded(self):
        data = (GOLDEN / "status.bin").read_bytes()
        sonar = read_status(data, "10.0.0.9")
        self.assertEqual((sonar.address, sonar.netmask, sonar.connected), ("192.168.1.2", "255.255.255.0", "10.0.0.7"))
        self.assertEqual((sonar.device_id, sonar.part_number, sonar.status_word), (7001, 1042, 3))
        self.assertEqual((sonar.mac, sonar.temperature_c, sonar.pressure_bar), ("02:00:00:00:1b:59", 15.0, 1.5))
        for wrong in (data[:-1], data + b"\0", b"\0" + data[1:], data[:6] + b"\x02" + data[7:], b""):
            self.assertIsNone(read_status(wrong))


if __name__ == "__main__":
    unittest.main()
