"""The judge's reader of the ping protocol, over TCP and UDP: docs/protocols/ping.md."""
import struct
import unittest
import zlib

import judge_makes
from sonard_client.judge.makes import make_of, ping


def frame(message, payload):
    body = b"BR" + struct.pack("<HHBB", len(payload), message, 1, 0) + payload
    return body + struct.pack("<H", sum(body) & 0xFFFF)


def profile(number):
    return bytes(8) + struct.pack("<I", number) + bytes([number]) * 210


class Stream(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size, step = ping.NUMBERED, [7, 8], (1, 222), 1
    messages = [[frame(1300, profile(7))], [frame(1300, profile(8))]]
    samples = [profile(7)]
    junk_pieces = (b"B", b"BR\xff\xff", frame(5, bytes(4)))

    def test_damage_is_no_ping(self):
        (message,), _ = self.messages
        for at in (3, 8, 40, len(message) - 1):
            damaged = bytearray(message)
            damaged[at] ^= 1
            self.assertFalse(self.shows(self.found(bytes(damaged), bytes(300)), [message]), at)

    def test_makes_and_requests_are_read(self):
        for name in ("ping1d", "s500"):
            self.assertIs(make_of(name), ping.NUMBERED, name)
        self.assertIs(make_of("surveyor-240"), ping.SURVEYOR)
        for name in ("ping360", "omniscan-450"):
            self.assertIs(make_of(name), ping.UNNUMBERED, name)
        self.assertTrue(ping.NUMBERED.is_request(frame(6, b"\x14\x05")))
        self.assertFalse(ping.NUMBERED.is_request(b"GET /"))


class Sectors(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size, step = ping.UNNUMBERED, None, (1, 214), 9
    messages = [[frame(2300, bytes(14) + bytes(range(200)))], [frame(2301, bytes(14) + bytes(range(1, 201)))]]
    samples = [bytes(14) + bytes(range(200)), bytes(range(200))]
    junk_pieces = (b"B",)

    def test_the_data_of_a_sector_scan_are_read(self):
        found, = ping.PingReader().pings(frame(2301, bytes([1]) * 20 + bytes(range(200))), 0)
        self.assertIn(zlib.crc32(bytes(range(200))), found.crcs)


class ProfilesOfAnS500(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size, step = ping.NUMBERED, [0x01020307, 8], (1, 166), 5
    messages = [[frame(1308, struct.pack("<I", number) + bytes(62) + bytes([number & 255]) * 100)] for number in (0x01020307, 8)]
    samples = [messages[0][0][8:-2]]


class PointsOfASurveyor(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size, step = ping.SURVEYOR, [7, 8], (1, 88), 3
    messages = [[frame(3012, bytes(20) + struct.pack("<I", number) + bytes([number]) * 64)] for number in (7, 8)]
    samples = [messages[0][0][8:-2]]


class Datagrams(judge_makes.DatagramChecks, unittest.TestCase):
    make, numbers, size, step = ping.NUMBERED, [7, 8], (1, 222), 3
    messages, samples = Stream.messages, Stream.samples


if __name__ == "__main__":
    unittest.main()
