"""The judge's reader of a Norbit: docs/protocols/norbit.md."""
import struct
import unittest
import zlib

import judge_makes
from sonard_client.judge.makes import make_of, norbit

BEAMS, ROWS = 5, 7


def packet(kind, body):
    return struct.pack("<6I", 0xDEADBEEF, kind, 24 + len(body), 4, 0, zlib.crc32(body)) + body


def bathymetry(number, beams):
    return packet(1, struct.pack("<ffII", 1500, 78125, BEAMS, number).ljust(88, b"\0") + beams)


def column(number, pixels, pixel_type=2):
    front = struct.pack("<ffIIdI", 1500, 78125, BEAMS, ROWS, 0, pixel_type).ljust(84, b"\0") + struct.pack("<I", number)
    return packet(2, front.ljust(168, b"\0") + pixels + bytes(4 * BEAMS))


DETECTIONS = [bytes(range(first, first + 20 * BEAMS)) for first in (0, 7)]
PIXELS = [bytes(range(first, first + 2 * ROWS * BEAMS)) for first in (0, 9)]


class Bathymetry(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size = norbit.NORBIT, [7, 8], (1, BEAMS)
    messages = [[bathymetry(7, DETECTIONS[0])], [bathymetry(8, DETECTIONS[1])]]
    samples = [DETECTIONS[0]]
    junk_pieces = (b"\xef\xbe\xad", b"\xef\xbe\xad\xde" + struct.pack("<II", 1, 0xFFFFFFFF), b"\xef\xbe\xad\xde" + struct.pack("<II", 2, 4000))

    def test_damage_is_no_ping(self):
        (message,), _ = self.messages
        for at in (4, 8, 20, 32, 36, 112, len(message) - 1):
            damaged = bytearray(message)
            damaged[at] ^= 1
            self.assertFalse(self.shows(self.found(bytes(damaged), bytes(300)), [message]), at)

    def test_a_number_of_beams_that_contradicts_the_size_is_refused(self):
        body = struct.pack("<ffII", 1500, 78125, BEAMS + 1, 7).ljust(88, b"\0") + DETECTIONS[0]
        self.assertEqual(self.found(packet(1, body)), [])

    def test_make_and_requests(self):
        for name in ("norbit-wbms", "norbit-fls"):
            self.assertIs(make_of(name), norbit.NORBIT, name)
        self.assertTrue(norbit.NORBIT.is_request(b"set_power 1\r\n"))
        self.assertFalse(norbit.NORBIT.is_request(b"temperature\r\n"))


class Column(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size, step = norbit.NORBIT, [7, 8], (ROWS, BEAMS), 3
    messages = [[column(7, PIXELS[0])], [column(8, PIXELS[1])]]
    samples = [PIXELS[0]]

    def test_a_driver_may_leave_it_out(self):
        needed = [ping.needed for ping in self.found(bathymetry(7, DETECTIONS[0]), column(7, PIXELS[0]))]
        self.assertEqual(needed, [True, False])

    def test_signed_pixels(self):
        self.assertEqual([ping.number for ping in self.found(column(7, PIXELS[0], 3))], [7])

    def test_other_pixels_are_not_judged(self):
        self.assertEqual(self.found(column(7, PIXELS[0], 1)), [])


if __name__ == "__main__":
    unittest.main()
