"""The judge's reader for Oculus pings: docs/protocols/oculus.md."""
import struct
import unittest
import zlib

from common import made_ping

import judge_makes
from sonard_client.judge.makes import make_of
from sonard_client.judge.makes.oculus import OCULUS, OculusReader


def set_in(message, at, form, value):
    changed = bytearray(message)
    struct.pack_into(form, changed, at, value)
    return bytes(changed)


def numbers(*pieces):
    reader = OculusReader()
    return [ping.number for piece in pieces for ping in reader.feed(piece)]


class Oculus(unittest.TestCase):
    """The pings that a driver may publish. Offsets of fields: docs/protocols/oculus.md, version 0."""

    def setUp(self):
        self.a, self.b, self.c = (made_ping(rows=12, beams=16, number=n) for n in (7, 8, 9))

    def test_every_split_gives_the_same_pings(self):
        stream = self.a + bytes(16) + self.b
        for size in (1, 7, 16, 701, len(stream)):
            self.assertEqual(numbers(*(stream[at:at + size] for at in range(0, len(stream), size))), [7, 8])

    def test_samples_and_their_place_are_read(self):
        for gains in (None, [5] * 3):
            for version in (0, 2):
                message = made_ping(version=version, gains=gains)
                (ping,) = OculusReader().feed(b"?" + message)
                samples = b"".join(bytes(16 * row + beam for beam in range(4)) for row in range(3))
                self.assertIn(zlib.crc32(samples), ping.crcs)
                self.assertEqual((ping.begin, ping.end, ping.rows, ping.beams), (1, 1 + len(message), 3, 4))

    def test_wrong_lengths_do_not_hide_true_samples(self):
        for at, form, value in ((10, "<I", 0), (10, "<I", 0xFFFFFFF0), (10, "<I", len(self.b) - 100)):
            self.assertEqual(numbers(self.a, set_in(self.b, at, form, value), self.c), [7, 8, 9])

    def test_impossible_dimensions_are_no_pings(self):
        rows, beams, offset = 106, 108, 110
        for at, form, value in ((rows, "<H", 65535), (rows, "<H", 0), (beams, "<H", 1), (offset, "<I", 0),
                                (offset, "<I", 1 << 31)):
            self.assertEqual(numbers(self.a, set_in(self.b, at, form, value), self.c), [7, 9])

    def test_a_ping_without_its_last_row_is_not_glued_to_the_next(self):
        self.assertEqual(numbers(self.a, self.b[:-16], self.c), [7, 9])

    def test_a_missing_row_that_the_lengths_admit_may_be_published(self):
        short = self.b[:-16]
        for at, form, value in ((10, "<I", len(short) - 16), (118, "<I", len(short))):
            short = set_in(short, at, form, value)
        self.assertEqual(numbers(self.a, short, self.c), [7, 8, 9])

    def test_garbage_and_false_headers_are_skipped(self):
        for garbage in (b"\0", b"S", b"SO", b"SO" + b"\xff" * 14, b"SO" * 500):
            self.assertEqual(numbers(self.a, garbage, self.b), [7, 8])

    def test_an_image_may_contain_the_magic(self):
        samples = [[0x53, 0x4F] * 8] * 12
        self.assertEqual(numbers(made_ping(rows=12, beams=16, samples=samples, number=5), self.a), [5, 7])


class Reader(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size, step = OCULUS, [7, 8], (12, 16), 29
    messages = [[made_ping(rows=12, beams=16, number=7, samples=[[5] * 16] * 12)], [made_ping(rows=12, beams=16, number=8)]]
    samples = [bytes([5]) * 192]
    junk_pieces = (b"SO", b"SO" + b"\xff" * 14)

    def test_requests_are_read(self):
        self.assertIs(make_of("oculus-m1200d"), OCULUS)
        self.assertTrue(OCULUS.is_request(b"SO" + bytes(4) + b"\x15\0" + bytes(45)))
        self.assertFalse(OCULUS.is_request(b"SO" + bytes(4) + b"\x55\0"))


if __name__ == "__main__":
    unittest.main()
