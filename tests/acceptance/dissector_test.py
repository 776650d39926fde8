"""Tests the Wireshark dissector (protocol/oculus/oculus.lua) with tshark: three decoders in three languages must read the same
values.

Every field of every message is compared with a reader in Python (oculus_fields) and with our own decoder (dump_oculus). The
messages are a recorded run of sonard, the golden messages, and captured pings of a real device if SONARD_CAPTURES is set.
"""
import json
import os
import pathlib
import random
import re
import socket
import struct
import subprocess
import sys
import tempfile
import unittest

from oculus_fields import fields_of
from oculus_reader import HEADER, Client, Ping, fire_message
from pcap_writer import Capture, pieces
from running_sonard import BUILD, ROOT, Sonard
from tshark import messages, tshark, why_not

sys.path.insert(0, str(ROOT / "tests/reliability"))
from record import record  # noqa: E402  the folder above

GOLDEN = ROOT / "tests/protocol/oculus/golden"
WHY_NOT = why_not()
FLAGS = ["rangeInMetres", "samples16Bit", "rowGains", "simpleResult", "gainAssist", "lowPower", "beams512", "networkTrigger"]
JUNK = b"\0S\0SO" + b"\xff" * 20 + b"S"  # half and whole ids; the last byte is directly before a header
ASK_CONFIG = HEADER.pack(0x4F53, 0, 0, 0x55, 0, 12, 0) + bytes(12)


def golden(name):
    return (GOLDEN / f"{name}.bin").read_bytes()


def with_bytes(message, offset, kind, value):
    changed = bytearray(message)
    struct.pack_into("<" + kind, changed, offset, value)
    return bytes(changed)


def framed(kind, version, payload):
    return HEADER.pack(0x4F53, 7001, 0, kind, version, len(payload), 0) + payload


def same(shown, value):
    """Returns whether tshark shows this value; it prints floating-point numbers with 15 digits."""
    if isinstance(value, float):
        return float(shown) == value or abs(float(shown) - value) <= 1e-14 * abs(value)
    return int(shown, 0) == value if isinstance(value, int) else shown == value


def dumped_values(line):
    """Returns a line of dump_oculus with the dissector's names: {name: [values]}."""
    values, kind = {}, line["kind"]
    for name, value in line["fields"].items():
        part = {"header": "header", "fire": "fire", "extension": "fire", "sizes": "ping"}.get(name)
        for inner, content in (value.items() if part else [(name, value)]):
            if inner in ("ipAddr", "ipMask", "connectedIpAddr"):
                octets = content if kind == "status" else content.to_bytes(4, "big")
                content = ".".join(str(octet) for octet in octets)
            elif inner == "macAddr":
                content = bytes(content).hex(":")
            elif inner == "pingStartTime" and isinstance(content, float):
                inner = "pingStartTimeSeconds"
            values[f"{part or kind}.{inner}"] = content if isinstance(content, list) else [content]
    return values


@unittest.skipIf(WHY_NOT, WHY_NOT)
class Dissected(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return pathlib.Path(self.folder.name) / name

    def dissect(self, capture, *arguments):
        capture.write(self.path("run.pcap"))
        return messages(self.path("run.pcap"), *arguments)

    def dump(self, what, data):
        self.path("raw").write_bytes(data)
        done = subprocess.run([BUILD / "tests/acceptance/dump_oculus", what, self.path("raw")], capture_output=True, text=True,
                              timeout=60, check=True)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def dissect_stream(self, stream, sizes=(), **settings):
        capture = Capture(**settings)
        capture.connect()
        for piece in pieces(stream, sizes):
            capture.tcp("device", piece)
        return self.dissect(capture)

    def expect_as_python(self, found, message):
        """Compares names, order, bytes and values, without missing or additional fields."""
        expected = fields_of(message)
        self.assertEqual([f[:2] for f in found.fields], [f[:2] for f in expected])
        for (name, _, shown), (_, _, value) in zip(found.fields, expected):
            self.assertTrue(same(shown, value), f"{name}: tshark shows {shown}, it is {value}")
        self.assertEqual(found.shown("length"), [str(len(message))])
        values = {name: value for name, _, value in expected}
        if "fire.flags" in values:
            self.assertEqual([found.shown(f"fire.flags.{flag}") for flag in FLAGS],
                             [[str(values["fire.flags"] >> place & 1)] for place in range(8)])
        if values["header.msgId"] == 0x23:
            self.expect_tail_as_python(found, message)

    def expect_tail_as_python(self, found, message):
        ping = Ping(message)
        self.assertEqual([int(shown) for shown in found.shown("ping.bearing")], list(ping.bearings))
        self.assertEqual([float(found.shown(f"ping.{end}Bearing")[0]) for end in ("first", "last")],
                         [ping.bearings[0] / 100, ping.bearings[-1] / 100])
        self.assertEqual([int(shown) for shown in found.shown("ping.rowGain")], ping.gains)
        self.assertEqual(found.raw("ping.image"), message[ping.image_offset:])
        self.assertEqual(found.shown("ping.bits"), [str(8 * ping.sample_bytes)])
        unit = "m" if ping.flags & 1 else "%"
        self.assertEqual(found.title, f"Oculus, ping {ping.id}: {ping.beams} x {ping.rows}, {8 * ping.sample_bytes} bit, "
                                      f"{ping.range:.6g} {unit}")

    def expect_as_ours(self, found, line):
        shown = {}
        for name, _, text in found.fields:
            shown.setdefault(name, []).append(text)
        expected = dumped_values(line)
        self.assertEqual(set(shown), set(expected))
        for name, values in expected.items():
            self.assertEqual(len(shown[name]), len(values), name)
            self.assertTrue(all(same(s, v) for s, v in zip(shown[name], values)), f"{name}: tshark {shown[name]}, ours {values}")
        if line["kind"] == "ping":
            self.assertEqual([int(s) for s in found.shown("ping.bearing")], line["bearings"])
            self.assertEqual([int(s) for s in found.shown("ping.rowGain")], line["rowGains"])
            rows, gain_bytes, image = expected["ping.nRanges"][0], 4 if line["rowGains"] else 0, found.raw("ping.image")
            step = len(image) // rows
            self.assertEqual(b"".join(image[r * step + gain_bytes:(r + 1) * step] for r in range(rows)).hex(), line["samples"])
        if line["kind"] == "log":
            self.assertEqual(found.raw("log.text").decode("ascii"), line["text"])

    def expect_agreement(self, found, sent, dumped):
        """Compares tshark, the reader in Python and our decoder on the same messages."""
        self.assertEqual(len(found), len(sent))
        self.assertEqual(len(dumped), len(sent))
        for message, data, line in zip(found, sent, dumped):
            with self.subTest(message.title):
                self.expect_as_python(message, data)
                self.expect_as_ours(message, line)


class RecordedRun(Dissected):
    SETTINGS = [  # mode, version, flags, extended flags, range: every sample width, both beam counts, gains, metres and per cent
        dict(mode=2, version=0, flags=0x09, range_=0.5), dict(mode=1, version=0, flags=0x4D, range_=3.0, sound_speed=1490.5),
        dict(mode=2, version=1, flags=0x0B, range_=0.7, salinity=35.0),
        dict(mode=2, version=1, flags=0x5F, range_=0.4, gain=12.25), dict(mode=1, version=2, flags=0x48, range_=1.0),
        dict(mode=2, version=2, flags=0x0F, range_=0.3),
        dict(mode=2, version=2, flags=0x4F, extended=0x200, range_=0.5)]

    def record(self, daemon):
        """Returns [(sender, [messages])] of a conversation with the shipped daemon, and a status datagram while a client is
        connected."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener, Client(daemon.address) as client:
            listener.bind((daemon.address, 52102))
            listener.settimeout(20)
            turns = [("device", [client.message()[1]])]  # the text sent to every client (option boot_text)
            for settings in self.SETTINGS:
                fire = fire_message(**settings)
                client.send(fire)
                turns += [("client", [fire]), ("device", self.until_made_with(client, fire))]
            standby = fire_message(**self.SETTINGS[0] | {"rate_hz": 0})
            client.send(standby)
            turns += [("client", [standby]), ("device", self.until(client, 0xFF))]
            client.send(ASK_CONFIG)
            turns += [("client", [ASK_CONFIG]), ("device", self.until(client, 0x55))]
            listener.recv(2000)  # a datagram from before the connection may be waiting
            return turns, listener.recv(2000)

    def until(self, client, kind):
        got = []
        while not got or struct.unpack_from("<H", got[-1], 6)[0] != kind:
            got.append(client.message()[1])
            self.assertLess(len(got), 100)
        return got

    def until_made_with(self, client, fire):
        """Returns messages up to the second ping made with these settings."""
        got, matching = [], 0
        while matching < 2:
            got += self.until(client, 0x23)
            matching += got[-1][20:29] == fire[20:29]  # flags and range
            self.assertLess(len(got), 100)
        return got

    def test_tshark_agrees_with_our_decoder(self):
        with Sonard(scene="tank-rod.yaml", profile="oculus-m1200d\n    options: {boot_text: on}") as daemon:
            turns, status = self.record(daemon)
        capture, dice = Capture(device=daemon.address, client="127.90.0.2"), random.Random(5)
        capture.connect()
        capture.udp(status)
        streams, sent, junk_runs = {"device": b"", "client": b""}, {"device": [], "client": []}, 0
        for number, (sender, data) in enumerate(turns):
            block = b"".join(data) if sender == "client" or number % 4 else data[0] + JUNK + b"".join(data[1:])
            junk_runs += JUNK in block
            streams[sender] += block
            sent[sender] += data
            for piece in pieces(block, iter(lambda: dice.choice([1, 2, 15, 16, 17, 100, 1448, 9000, 60000]), 0)):
                capture.tcp(sender, piece)
        self.check_run(self.dissect(capture), status, streams, sent, junk_runs)
        record("dissector", f"{1 + sum(len(s) for s in sent.values())} messages, every field equal", "equal, field by field", True,
               "python3 tests/acceptance/dissector_test.py")

    def check_run(self, found, status, streams, sent, junk_runs):
        self.assertGreater(junk_runs, 2)
        kinds = {struct.unpack_from("<H", message, 6)[0] for message in sent["device"]}
        self.assertEqual(kinds, {0x23, 0x55, 0x80, 0xFF})
        self.assertEqual(b"".join(m.raw("junk") for m in found if m.is_junk()), JUNK * junk_runs)
        rest = [m for m in found if not m.is_junk()]
        self.expect_agreement(rest[:1], [status], self.dump("status", status))
        self.assertTrue(rest[0].title.endswith("taken by 127.0.0.1"), rest[0].title)
        from_client = [m for m in rest[1:] if dict((f[0], f[2]) for f in m.fields)["header.srcDeviceId"] == "0"]
        from_device = [m for m in rest[1:] if m not in from_client]
        self.expect_agreement(from_client, sent["client"], self.dump("client", streams["client"]))
        self.expect_agreement(from_device, sent["device"], self.dump("device", streams["device"]))
        complaints = [e for m in rest for e in m.experts if e[0] != "note"]
        self.assertEqual(complaints, [], "messages of a correct device cause no warnings")


class HandMade(Dissected):
    def test_every_golden_message(self):
        """All values are different, so that exchanged fields are detected."""
        capture = Capture()
        capture.connect()
        capture.udp(golden("status"))
        client, device = [golden("fire_v0"), golden("fire_v2"), golden("user_config")], [golden("dummy"), golden("ping_v0"),
                                                                                          golden("ping_v1"), golden("ping_v2")]
        capture.tcp("client", b"".join(client))
        for piece in pieces(b"".join(device), [17, 1, 3, 1000, 1060, 2]):
            capture.tcp("device", piece)
        found = self.dissect(capture)
        self.expect_agreement(found[:1], [golden("status")], self.dump("status", golden("status")))
        self.expect_agreement(found[1:4], client, self.dump("client", b"".join(client)))
        self.expect_agreement(found[4:], device, self.dump("device", b"".join(device)))

    def test_a_client_may_announce_no_payload(self):
        sent = [fire_message(payload_size=0), fire_message(version=2, extended=0x200, payload_size=0),
                with_bytes(ASK_CONFIG, 10, "I", 0), fire_message(range_=3.5)]
        capture = Capture()
        capture.connect()
        capture.tcp("client", b"00".join(sent))  # a keep-alive that one driver sends
        found = [m for m in self.dissect(capture) if not m.is_junk()]
        self.expect_agreement(found, sent, self.dump("client", b"00".join(sent)))

    def test_every_broken_identity_is_reported(self):
        v1, v2 = golden("ping_v1"), golden("ping_v2")
        cases = [(with_bytes(v1, 10, "I", 2057) + b"\0", "messageSize"), (with_bytes(v1, 118, "I", 2073), "messageSize"),
                 (with_bytes(v1, 110, "I", 2040), "imageOffset + imageSize"), (with_bytes(v1, 114, "I", 25), "imageSize is 25"),
                 (with_bytes(v1, 110, "I", 100), "must exceed 122"), (with_bytes(v1, 110, "I", 124), "inside the bearing table"),
                 (with_bytes(v1, 97, "B", 4), "does not exist"), (with_bytes(v1, 97, "B", 1), "the echoed flags promise 8 bit"),
                 (with_bytes(v1, 122, "h", 3100), "do not ascend"), (with_bytes(v1, 2048, "I", 0), "row gain of 0"),
                 (with_bytes(v1, 98, "d", -1.0), "rangeResolution must be above 0"),
                 (with_bytes(v1, 61, "d", float("nan")), "frequency must be above 0"), (with_bytes(v1, 106, "H", 0), "no row"),
                 (with_bytes(v1, 108, "H", 0), "no beam"), (with_bytes(v1, 2, "H", 0), "srcDeviceId is 0"),
                 (with_bytes(v2, 198, "I", 7), "messageSize"), (with_bytes(v2, 190, "I", 203), "inside the bearing table"),
                 (with_bytes(v2, 8, "H", 3), "versions are 0 to 2")]
        stream = b"".join(golden("dummy") + message for message, _ in cases)
        found, ours = self.dissect_stream(stream), self.dump("device", stream)
        self.assertEqual((len(found), len(ours)), (2 * len(cases), 2 * len(cases)))
        for number, (_, expected) in enumerate(cases):
            with self.subTest(expected):
                self.assertEqual(found[2 * number].experts, [], "a dummy has no fault")
                told = found[2 * number + 1].experts
                self.assertTrue(any(expected in text for _, text in told), told)
                self.assertNotEqual(ours[2 * number + 1]["violations"], [], "our decoder must find a fault, too")
        first, again = self.dissect_stream(v1 + v1)
        self.assertFalse(any("does not rise" in text for _, text in first.experts))
        self.assertTrue(any("does not rise" in text for _, text in again.experts))

    def test_faults_of_a_status_are_reported(self):
        status = golden("status")
        cases = [(status + b"\0", "142 bytes"), (with_bytes(status, 2, "H", 5), "srcDeviceId is 5"),
                 (with_bytes(status, 24, "I", 1), "firmware does not run"),
                 (with_bytes(status, 24, "I", 3 | 1 << 15), "overTemperatureShutdown"),
                 (with_bytes(status, 52, "I", 0), "clients connect to ipAddr"),
                 (with_bytes(status, 118, "d", 36.0), "standby at 35"), (status[:141], "pressure at byte 134")]
        capture = Capture()
        for datagram, _ in cases:
            capture.udp(datagram)
        for found, (_, expected) in zip(self.dissect(capture), cases, strict=True):
            self.assertTrue(any(expected in text for _, text in found.experts), (expected, found.experts))


class Malformed(Dissected):
    """The script survives any bytes (tshark() checks that), and finds the next message after them."""

    def test_every_length_of_every_message(self):
        stream = b""
        for name, version in [("ping_v0", 0), ("ping_v2", 2), ("fire_v0", 0), ("fire_v2", 2), ("user_config", 0), ("status", 0)]:
            kind, body = struct.unpack_from("<H", golden(name), 6)[0], golden(name)[16:]
            stream += b"".join(framed(kind, version, body[:size]) for size in range(min(len(body), 230)))
        stream += b"".join(framed(kind, 1, bytes(size)) for kind in (0x22, 0x80, 0xFF, 0x77) for size in range(0, 600, 37))
        stream += golden("ping_v1")
        found = self.dissect_stream(stream, [60000])
        self.assertEqual(sum(len(m.fields) > 0 for m in found), len(found), "no message is reported as junk")
        self.expect_as_python(found[-1], golden("ping_v1"))
        for short in found[:100]:  # 16 to 115 bytes of a ping of 122
            self.assertTrue(any(kind == "short" for kind, _ in short.experts), short.title)

    def test_huge_counts_and_offsets(self):
        stream = b""
        for name, places in [("ping_v1", [(106, "H"), (108, "H"), (110, "I"), (114, "I"), (118, "I")]),
                             ("ping_v2", [(170, "H"), (172, "H"), (190, "I"), (194, "I"), (198, "I")])]:
            for value in (0, 1, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF):
                everywhere = golden(name)
                for offset, kind in places:
                    fitting = value & (0xFFFF if kind == "H" else 0xFFFFFFFF)
                    everywhere = with_bytes(everywhere, offset, kind, fitting)
                    stream += with_bytes(golden(name), offset, kind, fitting)
                stream += everywhere
        found = self.dissect_stream(stream + golden("dummy"), [60000])
        self.assertEqual((len(found), found[-1].title), (73, "Oculus, dummy"))

    def test_lengths_beyond_the_limits_are_junk(self):
        for payload in (4 * 1024 * 1024 - 15, 0x7FFFFFFF, 0xFFFFFFFF):
            header = HEADER.pack(0x4F53, 7001, 0, 0x23, 0, payload, 0)
            found = self.dissect_stream(header + golden("dummy"))
            self.assertEqual([m.is_junk() for m in found], [True, False], payload)
        capture = Capture()  # the limit for messages of clients is lower
        capture.connect()
        capture.tcp("client", HEADER.pack(0x4F53, 0, 0, 0x15, 0, 4097, 0) + golden("fire_v0"))
        self.assertEqual([m.is_junk() for m in self.dissect(capture)], [True, False])

    def test_junk_that_trickles_in_is_shown_once(self):
        sent = [golden("dummy"), golden("ping_v1"), golden("dummy")]
        found = self.dissect_stream(sent[0] + JUNK + JUNK.join(sent[1:]), [*[1] * 50, 2074, 20, *[1] * 20])
        self.assertEqual(b"".join(m.raw("junk") for m in found if m.is_junk()), JUNK * 2)
        self.expect_agreement([m for m in found if not m.is_junk()], sent, self.dump("device", JUNK.join(sent)))

    def test_random_damage(self):
        dice, stream = random.Random(11), b""
        for _ in range(150):
            message = bytearray(golden(dice.choice(["ping_v0", "ping_v2", "user_config", "fire_v2", "status"])))
            for _ in range(dice.randint(1, 6)):
                message[dice.randrange(16, min(len(message), 230))] = dice.randrange(256)
            stream += bytes(message) + dice.randbytes(dice.choice([0, 0, 1, 3, 40]))
        found = self.dissect_stream(stream + golden("dummy"), iter(lambda: dice.choice([1, 15, 100, 1448]), 0))
        self.assertEqual(found[-1].title, "Oculus, dummy")

    def test_packets_cut_short_and_segments_lost(self):
        for message, snap_length in (golden("ping_v1"), 400), (golden("ping_v2"), 60):
            found = self.dissect_stream(message, snap_length=snap_length)
            self.assertTrue(any("cut short by the capture" in text for _, text in found[0].experts))
        capture = Capture()
        capture.connect()
        stream = golden("ping_v1") + golden("ping_v2") + golden("dummy")
        for number, piece in enumerate(pieces(stream, [700] * 9)):
            capture.tcp("device", piece)
            if number == 1:
                del capture.packets[-1]  # the capture does not contain it
        self.assertEqual(self.dissect(capture)[-1].title, "Oculus, dummy")

    def test_a_status_of_every_length_and_foreign_datagrams(self):
        capture = Capture()
        for size in range(142):
            capture.udp(golden("status")[:size])
        capture.udp(b"something else on this port, of any length")
        capture.udp(golden("status"))
        found = self.dissect(capture)
        self.assertEqual(len(found), 142 - 16 + 1)
        self.expect_as_python(found[-1], golden("status"))


class Used(Dissected):
    """Uses the dissector as clients/wireshark/README.md describes."""

    def capture(self, **settings):
        capture = Capture(**settings)
        capture.connect()
        capture.tcp("client", golden("fire_v0"))
        capture.tcp("device", golden("ping_v1") + golden("ping_v2"))
        return capture

    def test_other_ports_can_be_set(self):
        capture = self.capture(device_port=52200)
        self.assertEqual(self.dissect(capture), [], "by default this port is not dissected")
        for way in (["-o", "oculus.tcp_ports:52100,52200-52203"], ["-d", "tcp.port==52200,oculus"]):
            titles = [m.title for m in self.dissect(capture, *way)]
            self.assertEqual([title.split()[1].rstrip(":") for title in titles], ["fire", "ping", "ping"])

    def test_fields_as_columns_and_filters(self):
        path = self.path("run.pcap")
        self.capture().write(path)
        table = tshark("-r", path, "-Y", "oculus.ping.pingId", "-T", "fields", "-E", "header=y", "-E", "separator=,", "-E",
                       "occurrence=f", "-e", "oculus.ping.pingId", "-e", "oculus.ping.nBeams", "-e", "oculus.fire.range")
        self.assertEqual(table.splitlines(), ["oculus.ping.pingId,oculus.ping.nBeams,oculus.fire.range", "415323,4,2.54"])
        info = tshark("-r", path, "-Y", "oculus", "-T", "fields", "-e", "_ws.col.Info")
        self.assertEqual(info.splitlines(), ["fire: high frequency, 15 Hz, 2.54 m, gain 70 %",
                                             "ping 415323: 4 x 3, 8 bit, 2.54 m; ping 415323: 4 x 3, 8 bit, 2.54 m"])
        self.assertNotIn("ping", tshark("-r", path, "-Y", "oculus.ping.temperature > 30"))

    def test_every_filter_of_the_manual_works(self):
        manual = (ROOT / "clients/wireshark/README.md").read_text(encoding="utf-8")
        filters = re.findall(r"^\| `(oculus[^`]+)` \|", manual, re.M)
        self.assertGreater(len(filters), 8)
        path = self.path("run.pcap")
        self.capture().write(path)
        tshark("-r", path, "-Y", " or ".join(f"({f})" for f in filters))
        known = {line.split("\t")[2] for line in tshark("-G", "fields").splitlines() if line.startswith("F\t")}
        named = set(re.findall(r"\boculus\.(?!(?:lua|md|tcp_ports|udp_ports)\b)\w+(?:\.\w+)*", manual))
        self.assertEqual(named - known, set())


class RealDevice(Dissected):
    def setUp(self):
        super().setUp()
        folder = pathlib.Path(os.environ.get("SONARD_CAPTURES", self.folder.name))
        found = [p for p in (folder / "three_pings_8bit.raw", folder / "oculus/three_pings_8bit.raw") if p.exists()]
        if not found:
            self.skipTest("SONARD_CAPTURES names no folder with three_pings_8bit.raw")
        self.recorded = found[0].read_bytes()

    def test_captured_pings(self):
        length = len(self.recorded) // 3
        sent = [self.recorded[i * length:(i + 1) * length] for i in range(3)]
        found = self.dissect_stream(self.recorded, [7, 9, 1448, 60000, 60000, 60000, 500, 1, 15])
        self.expect_agreement(found, sent, self.dump("device", self.recorded))
        self.assertEqual(found[0].title, "Oculus, ping 415323: 256 x 703, 8 bit, 2 m")
        self.assertEqual({expert for m in found for expert in m.experts}, set())


if __name__ == "__main__":
    unittest.main()
