"""The stream reader: golden messages at every split, junk, wrong lengths, recorded pings of a real device."""
import os
import pathlib
import random
import struct
import unittest

from common import GOLDEN, made_ping

from sonard_client import MessageReader
from sonard_client.layouts import DUMMY, PING
from sonard_client.ping import ping_from

DUMMY_BYTES = struct.pack("<5HIH", 0x4F53, 7001, 0, DUMMY, 0, 0, 0)
CAPTURES = os.environ.get("SONARD_CAPTURES")


def read(*pieces):
    reader, messages = MessageReader(), []
    for piece in pieces:
        reader.feed(piece)
        messages += list(reader)
    return reader, messages


class Splits(unittest.TestCase):
    def test_every_split_gives_the_same_messages(self):
        stream = DUMMY_BYTES + (GOLDEN / "ping_v2.bin").read_bytes() + (GOLDEN / "user_config.bin").read_bytes() + DUMMY_BYTES
        whole = [m.data for m in read(stream)[1]]
        self.assertEqual([len(data) for data in whole], [16, 2072, 28, 16])
        for at in range(len(stream)):
            reader, messages = read(stream[:at], stream[at:])
            self.assertEqual([m.data for m in messages], whole, at)
            self.assertEqual(reader.skipped_bytes, 0)

    def test_messages_are_read_byte_by_byte(self):
        stream = made_ping(2) + DUMMY_BYTES
        _, messages = read(*(stream[i:i + 1] for i in range(len(stream))))
        self.assertEqual([m.type for m in messages], [PING, DUMMY])

    def test_truncated_message_is_not_returned(self):
        stream = made_ping(1)
        for length in range(len(stream)):
            self.assertEqual(read(stream[:length])[1], [])

    def test_interrupted_iteration_loses_nothing(self):
        reader = MessageReader()
        reader.feed(made_ping(0, number=1) + made_ping(0, number=2))
        suspended = iter(reader)
        self.assertEqual(ping_from(next(suspended)).number, 1)
        reader.feed(made_ping(0, number=3))
        self.assertEqual([ping_from(m).number for m in reader], [2, 3])
        self.assertEqual(list(suspended), [])


class Junk(unittest.TestCase):
    def test_junk_is_skipped_and_counted(self):
        junk = b"no message S\x53\x53\x4f" + bytes(5)
        reader, messages = read(junk + made_ping(0) + b"xyz" + DUMMY_BYTES)
        self.assertEqual([m.type for m in messages], [PING, DUMMY])
        self.assertEqual(reader.skipped_bytes, len(junk) + 3)
        self.assertTrue(reader.last_fault)

    def test_junk_is_not_accumulated(self):
        reader = MessageReader()
        for _ in range(100):
            reader.feed(bytes(1000))
            self.assertEqual(list(reader), [])
        self.assertEqual(reader.skipped_bytes, 100_000)

    def test_wrong_length_affects_only_its_own_message(self):
        places = {"header size": (10, "<I", 0x00FFFFF0), "endless": (10, "<I", 0xFFFFFFFF), "a little": (10, "<I", 3000),
                  "message size": (118, "<I", 9), "image size": (114, "<I", 1 << 30), "image offset": (110, "<I", 60),
                  "rows": (106, "<H", 4000), "no beams": (108, "<H", 0), "width": (97, "<B", 200),
                  "spacing": (98, "<d", float("nan")), "version": (8, "<H", 3)}
        for name, (at, code, value) in places.items():
            with self.subTest(name):
                broken = bytearray(made_ping(0, number=1))
                struct.pack_into(code, broken, at, value)
                reader, messages = read(bytes(broken) + made_ping(0, number=2))
                self.assertEqual([ping_from(m).number for m in messages], [2])
                self.assertEqual(reader.skipped_bytes, len(broken))

    def test_dummy_with_a_payload_is_skipped(self):
        self.assertEqual([m.type for m in read(struct.pack("<5HIH", 0x4F53, 1, 0, DUMMY, 0, 400, 0) + made_ping(0))[1]], [PING])

    def test_flipped_bits_give_only_complete_messages(self):
        draw = random.Random(4)
        good = [made_ping(0), made_ping(2, 2, gains=[1, 2, 3]), DUMMY_BYTES, (GOLDEN / "status.bin").read_bytes()]
        for _ in range(1500):
            stream = bytearray(b"".join(draw.choice(good) for _ in range(3)))
            for _ in range(draw.randint(1, 6)):
                stream[draw.randrange(len(stream))] ^= 1 << draw.randrange(8)
            cut = draw.randrange(len(stream))
            for message in read(bytes(stream[:cut]), bytes(stream[cut:]), made_ping(1))[1]:
                self.assertEqual(len(message.data), 16 + message.header.payload_bytes)
                if message.type == PING:
                    ping = ping_from(message)
                    self.assertEqual((len(ping.ranges_m), len(ping.azimuths_rad)), (ping.rows, ping.beams))


@unittest.skipUnless(CAPTURES, "no recordings: SONARD_CAPTURES is not set")
class Captures(unittest.TestCase):
    def test_three_pings_of_a_real_device_are_read(self):
        below = pathlib.Path(CAPTURES, "oculus/three_pings_8bit.raw")
        reader, messages = read((below if below.exists() else pathlib.Path(CAPTURES, "three_pings_8bit.raw")).read_bytes())
        pings = [ping_from(m) for m in messages]
        self.assertEqual(reader.skipped_bytes, 0)
        self.assertEqual([p.number for p in pings], [415323, 415324, 415325])
        for ping in pings:
            self.assertEqual((ping.rows, ping.beams, ping.version, ping.device_id), (703, 256, 0, 7892))
            self.assertAlmostEqual(float(ping.ranges_m[-1]), 702.5 * 0.0028421889710794315)
            self.assertEqual(max(max(ping.row(row)) for row in range(0, 703, 10)), 254)
            self.assertAlmostEqual(float(ping.azimuths_rad[0]), 0.5235988, places=6)  # 30 degrees to port
            self.assertTrue(0.6 < ping.strongest(beyond_m=0.2).range_m < 1.3)


if __name__ == "__main__":
    unittest.main()
