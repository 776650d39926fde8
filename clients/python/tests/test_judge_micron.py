"""The judge's reader of a Micron: docs/protocols/micron.md."""
import struct
import unittest

import judge_makes
from sonard_client.judge.makes import make_of, micron


def frame(number, payload):
    size = len(payload) + 8
    return b"@%04X" % size + struct.pack("<HBBBBBB", size, 2, 255, 0, number, 0x80, 2) + payload + b"\n"


def line(bins, control=1):
    head = struct.pack("<HBBBHH", 31 + len(bins), 0x11, 0, 0, control, 100) + bytes(20) + struct.pack("<H", len(bins))
    assert len(head) == 31
    return head + bins


BINS = [bytes(n * 7 % 251 for n in range(first, first + 120)) for first in (3, 50)]


class Reader(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size, step = micron.MICRON, None, (120, 1), 1
    messages = [[frame(2, line(BINS[0]))], [frame(2, line(BINS[1]))]]
    samples = [line(BINS[0]), BINS[0]]
    junk_pieces = (b"@", b"@0FFF\xff\x0f", frame(4, bytes(8)))

    def test_bins_of_4_bits_are_read(self):
        (ping,) = self.found(frame(2, line(BINS[0], control=0)))
        self.assertEqual(ping.rows, 240)

    def test_lines_without_bins_and_other_messages_are_no_pings(self):
        for message in (frame(2, b""), frame(2, line(b"")), frame(4, line(BINS[0])), frame(2, line(bytes(4096)))):
            self.assertEqual(self.found(message), [])

    def test_two_of_three_lengths_must_agree(self):
        whole, bins_at = frame(2, line(BINS[0])), 13 + 29
        for changes, found in (((), [True]), ((4,), [False]), ((5,), [False]), ((bins_at,), [False]), ((4, 5), []), ((4, bins_at), []),
                               ((5, bins_at), [])):
            changed = bytearray(whole)
            for at in changes:
                changed[at] ^= 1
            self.assertEqual([ping.needed for ping in self.found(bytes(changed))], found, changes)

    def test_requests_are_read(self):
        self.assertIs(make_of("micron"), micron.MICRON)
        self.assertEqual([micron.MICRON.is_request(frame(number, bytes(4))) for number in (25, 19, 23)], [True, True, False])


if __name__ == "__main__":
    unittest.main()
