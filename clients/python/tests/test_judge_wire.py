"""The judge's reading of packets: connections, datagrams, captures."""
import os
import socket
import struct
import time
import unittest
import unittest.mock as mock

from common import made_ping

from sonard_client.judge import wire
from sonard_client.judge.makes import oculus, ping
from sonard_client.judge.truth import Make, TruePing


class Packets(unittest.TestCase):
    """Packets of one connection: repeated ones, ones out of order, acknowledgements."""

    def setUp(self):
        self.connection = wire.Connection(1, "10.0.0.1:4000", 0.0, oculus.OculusReader(), oculus.is_fire)
        self.connection.from_device(0.1, 999, wire._SYN | wire._ACK, b"")

    def send(self, at, data):
        self.connection.from_device(1.0, (1000 + at) % (1 << 32), wire._ACK, data)

    def test_order_and_repetition_are_repaired(self):
        stream = made_ping(number=1) + made_ping(number=2)
        half = len(stream) // 2
        self.send(half, stream[half:])
        self.assertEqual(self.connection.sent, 0)
        self.send(0, stream[:half])
        self.send(0, stream[:half])
        self.send(100, stream[100:half + 50])
        self.assertEqual(bytes(self.connection.stream), stream)
        self.assertEqual([s.ping.number for s in self.connection.pings], [1, 2])

    def test_acknowledged_bytes_are_counted(self):
        self.send(0, bytes(500))
        for ack, acked in ((1000, 0), (1300, 300), (1200, 300), (9999, 500)):
            self.connection.from_driver(1.0, 1, ack, wire._ACK, 100, b"")
            self.assertEqual(self.connection.acked, acked)

    def test_settings_ends_and_zero_windows_are_found(self):
        fire = b"SO" + bytes(4) + b"\x15\0" + bytes(45)
        self.connection.from_driver(1.0, 5, 1000, wire._ACK, 100, fire)
        self.connection.from_driver(1.1, 5, 1000, wire._ACK, 100, fire)  # a retransmission by TCP, not by the driver
        self.connection.from_driver(1.2, 58, 1000, wire._ACK, 0, b"")
        self.connection.from_driver(1.3, 58, 1000, wire._ACK | wire._FIN, 100, b"")
        self.connection.from_device(1.4, 1000, wire._RST, b"")
        self.assertEqual((len(self.connection.fires), self.connection.zero_windows), (1, 1))
        self.assertEqual((self.connection.ended, self.connection.ended_by), (1.3, "driver FIN"))

    def test_pcapng_is_written(self):
        written = wire.pcapng([(1_700_000_000_123_456_789, b"\1" * 61)], "a case")
        kinds, at = [], 0
        while at < len(written):
            kind, size = struct.unpack_from("<II", written, at)
            self.assertEqual(struct.unpack_from("<I", written, at + size - 4)[0], size)
            kinds.append(kind)
            at += size
        self.assertEqual(kinds, [0x0A0D0D0A, 1, 6])

    def test_hex_dumps_mark_the_byte(self):
        lines = wire.hex_around(bytes(range(256)), 100)
        self.assertEqual([line[0] for line in lines].count(">"), 1)
        self.assertIn("00000060", next(line for line in lines if line[0] == ">"))


class Times(unittest.TestCase):
    @unittest.skipIf(os.geteuid(), "reading packets needs root")
    def test_packets_that_are_read_late_have_the_time_of_their_sending(self):
        capture = wire.Capture("lo", "127.0.0.2", 52199, Make((), datagrams=Whole))
        before = time.monotonic()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as driver:
            driver.sendto(b"x", ("127.0.0.2", 52199))
        sent = time.monotonic()
        time.sleep(0.5)
        capture.start()
        capture.catch_up(60)
        capture.stop()
        (fire,) = capture.connections[0].fires
        self.assertTrue(before - 0.1 < fire < sent + 0.1, (before, fire, sent))


class Streams(unittest.TestCase):
    """The driver connects from the same port to several ports of the sonar."""
    DEVICE, DRIVER = bytes([127, 0, 0, 2]), bytes([127, 0, 0, 1])

    @staticmethod
    def packet(source, destination, ports, sequence, ack, flags, payload=b""):
        segment = struct.pack(">HHIIBBHHH", *ports, sequence, ack, 0x50, flags, 1000, 0, 0) + payload
        return bytes(12) + b"\x08\x00" + struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(segment), 5, 0, 64, 6, 0) + source + destination + segment

    def test_connections_to_further_ports_are_read(self):
        make = Make((), stream=Whole, is_request=lambda sent: sent == b"go")
        with mock.patch("socket.socket"):
            capture = wire.Capture("lo", "127.0.0.2", 2210, make, [2209, 2210])
        for port, sent, answer in ((2210, b"", b"\x07"), (2209, b"go", b""), (2211, b"go", b"\x08")):
            for packet in (self.packet(self.DRIVER, self.DEVICE, (4000, port), 0, 0, 0x02),
                           self.packet(self.DEVICE, self.DRIVER, (port, 4000), 0, 1, 0x12),
                           self.packet(self.DRIVER, self.DEVICE, (4000, port), 1, 1, 0x10, sent),
                           self.packet(self.DEVICE, self.DRIVER, (port, 4000), 1, 1, 0x10, answer),
                           self.packet(self.DRIVER, self.DEVICE, (4000, port), 1 + len(sent), 1 + len(answer), 0x10)):
                capture._packet(1.0, 0, packet)
        self.assertEqual([s.ping.number for s in capture.delivered()], [7])
        self.assertEqual([len(c.fires) for c in capture.connections], [0, 1])


class Whole:
    """Treats each datagram as one ping."""
    at = 0

    def feed(self, datagram):
        begin, self.at = self.at, self.at + len(datagram)
        return [TruePing(datagram[0], frozenset({1}), 1, 1, begin, self.at)]


class Datagrams(unittest.TestCase):
    DEVICE, DRIVER, GROUP = bytes([127, 0, 0, 2]), bytes([127, 0, 0, 1]), bytes([224, 0, 0, 96])

    def capture(self, make, *packets):
        with mock.patch("socket.socket"):
            capture = wire.Capture("lo", "127.0.0.2", 9090, make)
        for packet in packets:
            capture._packet(1.0, 0, packet)
        return capture

    @staticmethod
    def packets(source, destination, ports, payload, cut=None):
        datagram = struct.pack(">HHHH", *ports, 8 + len(payload), 0) + payload
        parts = [(0, datagram)] if cut is None else [(cut, datagram[cut:]), (0, datagram[:cut])]  # the last one comes first
        for at, part in parts:
            place = at // 8 | (0x2000 if at + len(part) < len(datagram) else 0)
            yield bytes(12) + b"\x08\x00" + struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(part), 5, place, 64, 17, 0) + \
                source + destination + part

    def test_datagrams_are_read_whole_and_in_fragments(self):
        def frame(message, payload):
            body = b"BR" + struct.pack("<HHBB", len(payload), message, 1, 0) + payload
            return body + struct.pack("<H", sum(body) & 0xFFFF)
        first, second = (frame(1300, bytes(8) + struct.pack("<I", number) + bytes(200)) for number in (7, 8))
        device, driver = self.DEVICE, self.DRIVER
        capture = self.capture(ping.NUMBERED,
                               *self.packets(device, driver, (9090, 4000), first),  # before the driver has sent anything
                               *self.packets(driver, device, (4000, 9090), frame(6, b"\x14\x05")),
                               *self.packets(device, driver, (9090, 4000), first),
                               *self.packets(device, driver, (9090, 4000), first[:100]),
                               *self.packets(device, driver, (9090, 4000), first[100:]),
                               *self.packets(device, driver, (9090, 4000), second, cut=64),
                               *self.packets(device, driver, (9999, 4000), second))
        self.assertEqual([s.ping.number for s in capture.delivered()], [7, 8])
        self.assertEqual([(c.peer, len(c.fires)) for c in capture.connections], [("127.0.0.1:4000", 1)])

    def test_flows_that_the_sonar_begins_are_read(self):
        make = Make((), datagrams=Whole, is_pushed=lambda datagram: datagram[0] < 100)
        capture = self.capture(make,
                               *self.packets(self.DEVICE, self.DRIVER, (5555, 4000), b"\1part"),
                               *self.packets(self.DEVICE, self.DRIVER, (5555, 56124), b"\xffbeacon"),
                               *self.packets(self.DEVICE, self.GROUP, (6666, 4747), b"\2"),
                               *self.packets(self.DRIVER, self.DEVICE, (4000, 4001), b"\3"),
                               *self.packets(self.DEVICE, self.DRIVER, (5555, 4000), b"\4"))
        self.assertEqual([(c.peer, [s.ping.number for s in c.pings]) for c in capture.connections],
                         [("127.0.0.1:4000", [1, 4]), ("224.0.0.96:4747", [2])])

    def test_an_unknown_make_has_no_pings(self):
        capture = self.capture(None, *self.packets(self.DRIVER, self.DEVICE, (4000, 9090), b"?"),
                               *self.packets(self.DEVICE, self.DRIVER, (9090, 4000), b"!"))
        self.assertEqual([(c.acked, c.pings) for c in capture.connections], [(1, [])])


if __name__ == "__main__":
    unittest.main()
