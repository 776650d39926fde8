"""The judge's reader of an M3: docs/protocols/m3.md."""
import struct
import unittest

import judge_makes
from sonard_client.judge.makes import make_of, m3

ROWS, BEAMS = 6, 4


def packet(number, samples, body=None):
    size = struct.pack("<I", 8512 + len(samples) if body is None else body)
    head = b"\x00\x80" * 4 + b"\x02\x10" + bytes(42) + size
    front = bytes(52) + struct.pack("<I16xHH", ROWS, BEAMS, 0) + bytes(4096)
    back = bytes(36) + struct.pack("<I", number)
    return head + (front + back).ljust(8512, b"\0") + samples + size + bytes(40)


SAMPLES = [struct.pack(f"<{2 * ROWS * BEAMS}f", *(first + n for n in range(2 * ROWS * BEAMS))) for first in (0.5, 7)]


class Reader(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size, step = m3.M3, [7, 8], (ROWS, BEAMS), 401
    messages = [[packet(7, SAMPLES[0])], [packet(8, SAMPLES[1])]]
    samples = [SAMPLES[0]]
    junk_pieces = (b"\0\x80" * 3, b"\0\x80" * 4 + b"\x02\x10" + bytes(98) + b"\xff\xff\0\0" + bytes(16) + b"\xff\1" + bytes(9))

    def test_one_of_the_lengths_must_agree(self):
        whole = packet(7, SAMPLES[0])
        wrong = struct.pack("<I", 5)
        for head, foot, count in ((wrong, b"", 1), (b"", wrong, 1), (wrong, wrong, 0)):
            changed = bytearray(whole)
            changed[52:52 + len(head)] = head
            changed[len(whole) - 44:len(whole) - 44 + len(foot)] = foot
            self.assertEqual(len(self.found(bytes(changed))), count)

    def test_the_make_is_read(self):
        self.assertIs(make_of("m3"), m3.M3)
        self.assertFalse(m3.M3.needs_request)


if __name__ == "__main__":
    unittest.main()
