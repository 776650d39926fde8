"""The judge's reader of the BlueView link: docs/protocols/blueview-link.md."""
import struct
import unittest
import zlib

import judge_makes
from sonard_client.judge.makes import blueview, make_of

BEAMS, BINS = 3, 4


def frame(kind, payload):
    return b"BVE1" + struct.pack("<HHII", kind, 0, 5, len(payload)) + payload


def ping(number, samples, deflated=False, navigation=0b10000000001, size=None):
    head = struct.pack("<iIdi2fi3f", 1, number, 0, 0, 0, 10, 1500, -45, 45, 0.1) + \
        struct.pack("<HHBBH", BEAMS, BINS, 1, deflated, navigation)
    place = bytes(8) + b"\x03\x00abc" if navigation else b""
    body = zlib.compress(samples) if deflated else samples
    return frame(0x8004, head + place + struct.pack("<I", len(samples) if size is None else size) + body)


def values(first):
    return [first + n for n in range(BEAMS * BINS)]


def packed(numbers):
    return struct.pack(f"<{len(numbers)}H", *numbers)


class Reader(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size, step = blueview.BLUEVIEW, [7, 8], (BINS, BEAMS), 1
    messages = [[ping(7, packed(values(1000)))], [ping(8, packed(values(300)))]]
    samples = [packed(values(1000)), packed([1000 + beam * BINS + bin for bin in range(BINS) for beam in range(BEAMS)])]
    junk_pieces = (b"BVE1", b"BVE1" + b"\xff" * 12, b"BVE1\4\x80\0\0" + bytes(4) + b"\0\0\1\0", frame(0x8001, bytes(60)))

    def test_compressed_samples_are_read(self):
        (found,) = self.found(ping(7, packed(values(1000)), deflated=True))
        self.assertIn(zlib.crc32(self.samples[0]), found.crcs)
        self.assertEqual(len(self.found(ping(7, packed(values(1000)), navigation=0))), 1)

    def test_stated_sizes_may_be_wrong_but_samples_must_be_complete(self):
        samples = packed(values(1000))
        for lie in (ping(7, samples, size=5), ping(7, samples, deflated=True, size=5)):
            self.assertEqual(len(self.found(lie)), 1)
        for bad in (ping(7, samples[:-2]), ping(7, samples + b"\0\0"),
                    ping(7, b""), ping(7, samples, deflated=True)[:-9].replace(b"BVE1", b"XXXX"), frame(0x8004, bytes(20))):
            self.assertEqual(self.found(bad), [])
        broken = bytearray(ping(7, samples, deflated=True))
        broken[-12] ^= 0xFF
        self.assertEqual(self.found(bytes(broken)), [])

    def test_requests_are_read(self):
        self.assertIs(make_of("blueview-p900-90"), blueview.BLUEVIEW)
        self.assertEqual([blueview.BLUEVIEW.is_request(frame(kind, b"")) for kind in (4, 5, 6)], [True, True, False])


if __name__ == "__main__":
    unittest.main()
