"""The judge's reader of a Sonar 3D-15: docs/protocols/waterlinked.md."""
import struct
import unittest
import zlib

import judge_makes
from sonard_client.judge.makes import make_of, waterlinked
from test_judge_aris import block, number, varint

WIDTH, HEIGHT = 16, 4
RANGES = [[(first * n * 977) % 65536 for n in range(WIDTH * HEIGHT)] for first in (1, 3)]


def datagram(content, version=b"2", crc=0):
    packet = b"RIP" + version + struct.pack("<I", len(content) + 12) + content
    return packet + struct.pack("<I", zlib.crc32(packet) ^ crc)


def literals(content):
    """Snappy data without any repetition."""
    out = varint(len(content))
    for at in range(0, len(content), 60):
        piece = content[at:at + 60]
        out += bytes([len(piece) - 1 << 2]) + piece
    return out


def packet(name, image):
    return block(1, block(1, b"type.googleapis.com/waterlinked.sonar.protocol." + name) + block(2, image))


def range_image(sequence, ranges, width=WIDTH, scale_m=0.0):
    pixels = b"".join(map(varint, ranges))
    return packet(b"RangeImage", block(1, block(1, number(1, 99)) + number(2, sequence)) + b"\x15" + bytes(4) + number(4, 5) +
                  number(5, width) + number(6, HEIGHT) + b"\x4d" + struct.pack("<f", scale_m) + block(10, pixels))


def strengths(sequence, kind=0):
    return packet(b"BitmapImageGreyscale8", block(1, number(2, sequence)) + (number(5, kind) if kind else b"") + number(6, WIDTH) +
                  number(7, HEIGHT) + block(10, bytes(range(WIDTH * HEIGHT))))


class Reader(judge_makes.DatagramChecks, unittest.TestCase):
    make, numbers, size, step = waterlinked.WATERLINKED, [7, 8], (HEIGHT, WIDTH), 3
    messages = [[datagram(literals(range_image(7, RANGES[0])))], [datagram(range_image(8, RANGES[1]), b"1")]]
    samples = [struct.pack(f"<{WIDTH * HEIGHT}I", *RANGES[0])]

    def test_strengths_may_be_published_too(self):
        (ping,) = self.found(datagram(literals(strengths(7))))
        self.assertEqual((ping.number, ping.needed, ping.crcs), (7, False, {zlib.crc32(bytes(range(WIDTH * HEIGHT)))}))

    def test_ranges_may_be_in_metres(self):
        (ping,) = self.found(datagram(literals(range_image(7, RANGES[0], scale_m=0.1))))
        near = struct.unpack("<f", struct.pack("<f", 0.1))[0]
        self.assertIn(zlib.crc32(struct.pack(f"<{WIDTH * HEIGHT}f", *(n * near for n in RANGES[0]))), ping.crcs)

    def test_other_datagrams_are_no_pings(self):
        good = literals(range_image(7, RANGES[0]))
        for other in (datagram(good, crc=1), datagram(literals(strengths(7, kind=1))), datagram(literals(packet(b"ImuBatch", b""))),
                      datagram(literals(range_image(7, RANGES[0], width=17))), datagram(good[:-1]), datagram(good + b"\0a"),
                      datagram(literals(b"\xff" * 30)), datagram(b""), b"RIP2", b"",
                      datagram(literals(range_image(7, [2 ** 40] * WIDTH * HEIGHT)))):
            self.assertEqual(self.found(other), [])

    def test_snappy(self):
        for block_of, plain in ((b"\x04\x0cabcd", b"abcd"), (b"\x0a\x04ab\x11\x02", b"ab" * 5), (b"\x08\x04ab\x16\x02\x00", b"ab" * 4),
                                (b"\x07\x00a\x17\x01\x00\x00\x00", b"a" * 7),
                                (b"\x42\xf0\x3d" + b"x" * 62 + b"\x0cabcd", b"x" * 62 + b"abcd"),
                                (b"\xac\x02\xf4\x2b\x01" + b"y" * 300, b"y" * 300), (b"\x00", b"")):
            self.assertEqual(waterlinked.unpacked(block_of), plain)
        for bad in (b"", b"\xff", b"\x04\x0cabc", b"\x03\x0cabcd", b"\x05\x00a\x11\x02", b"\x05\x00a\x11\x00",
                    b"\xff\xff\xff\xff\x0f\x00a"):
            with self.assertRaises(ValueError):
                waterlinked.unpacked(bad)

    def test_make(self):
        make = make_of("waterlinked-3d15")
        self.assertIs(make, waterlinked.WATERLINKED)
        self.assertTrue(make.is_pushed(self.messages[0][0]))
        self.assertFalse(make.is_pushed(b"HTTP/1.1"))
        self.assertEqual([make.is_request(sent) for sent in (b"GET /api", b"POST /api")], [False, True])


if __name__ == "__main__":
    unittest.main()
