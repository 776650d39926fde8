"""The judge's reader of an ARIS: docs/protocols/aris.md."""
import struct
import unittest
import zlib

from common import ROOT  # noqa: F401

import judge_makes
from sonard_client.judge.makes import aris, make_of

BEAMS, ROWS, LONGEST = 32, 6, 80
FIRST_BEAMS = (10, 2, 14, 6, 8, 0, 12, 4, 11, 3, 15, 7, 9, 1, 13, 5)


def varint(value):
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes(out) + bytes([value])


def number(field, value):
    return varint(field << 3) + varint(value)


def block(field, data):
    return varint(field << 3 | 2) + varint(len(data)) + data


def raw_of(picture):
    """Returns the samples ping by ping, sample by sample, channel by channel."""
    return bytes(picture[row * BEAMS + first * 2 + ping] for ping in range(2) for row in range(ROWS) for first in FIRST_BEAMS)


def parts(index, samples, reordered=0, header_bytes=744):
    header = bytearray(744)
    struct.pack_into("<I", header, 468, ROWS)
    struct.pack_into("<I", header, 516, reordered)
    found = []
    for at in range(0, len(samples), LONGEST):
        start = block(3, bytes(header[:header_bytes])) if at == 0 else b""
        found.append(number(1, index) + number(2, len(samples)) + start + block(4, samples[at:at + LONGEST]) + number(5, at))
    return found


PICTURES = [bytes((row * 37 + beam * first) & 255 for row in range(ROWS) for beam in range(BEAMS)) for first in (3, 5)]


class Reader(judge_makes.DatagramChecks, unittest.TestCase):
    make, numbers, size, step = aris.ARIS, [7, 8], (ROWS, BEAMS), 13
    messages = [parts(7, raw_of(PICTURES[0])), parts(8, raw_of(PICTURES[1]))]
    samples = [PICTURES[0], raw_of(PICTURES[0])]

    def test_samples_may_be_in_the_order_of_the_picture(self):
        (ping,) = self.found(*parts(7, PICTURES[0], reordered=1))
        self.assertEqual(ping.crcs, {zlib.crc32(PICTURES[0])})

    def test_a_short_header_does_not_say_the_order(self):
        (ping,) = self.found(*parts(7, raw_of(PICTURES[0]), header_bytes=128))
        self.assertEqual(ping.crcs, {zlib.crc32(raw_of(PICTURES[0]))})

    def test_repeated_and_reordered_parts_are_read(self):
        first, second, *rest = self.messages[0]
        for order in ([first, first, second, *rest, *rest], [second, first, *rest], [*rest, second, second, first]):
            self.assertEqual([(ping.number, ping.needed) for ping in self.found(*order)], [(7, True)])

    def test_a_part_of_an_older_frame_comes_between(self):
        a, b = self.messages
        pings = self.found(*a[:-1], b[0], a[-1], *b[1:])
        self.assertEqual([(ping.number, ping.needed) for ping in pings], [(7, False), (8, False)])
        self.assertTrue(self.shows(pings, a) and self.shows(pings, b))
        self.assertEqual([ping.number for ping in self.found(*a, *b[:1], a[0], *b[1:])], [7, 8])

    def test_numbers_begin_again_with_a_connection(self):
        again = parts(7, raw_of(PICTURES[1]))
        for before in (self.messages[0], self.messages[0][:2]):
            pings = self.found(*before, *again)
            self.assertEqual([(ping.number, ping.needed) for ping in pings][-1], (7, True))
            self.assertTrue(self.shows(pings, again))

    def test_frames_are_pushed_and_beacons_are_not(self):
        self.assertIs(make_of("aris-explorer-3000"), aris.ARIS)
        beacon = number(1, 7) + number(2, 1) + block(3, number(1, 2)) + number(4, 0) + block(5, b"") + number(7, 1)
        self.assertTrue(all(aris.ARIS.is_pushed(part) for part in self.messages[0]))
        for other in (beacon, b"", b"\xff" * 20, number(1, 7) + number(2, 9) + block(4, bytes(10))):
            self.assertFalse(aris.ARIS.is_pushed(other), other)


if __name__ == "__main__":
    unittest.main()
