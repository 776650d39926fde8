"""Tests an emulated Sonar 3D-15 with a program (settings over HTTP, images by multicast and unicast) and with tshark."""
import json
import pathlib
import socket
import struct
import tempfile
import unittest
import urllib.error
import urllib.request
import zlib

import tshark as shark
from pcap_writer import Capture
from running_sonard import ROOT, SONARCTL, Sonard, eventually, expect_quiet, run

GROUP, PORT = "224.0.0.96", 4747
START = {"acoustics_at_start": "enabled", "udp_at_start": "multicast"}


def why_not():
    with socket.socket() as probe:
        try:
            probe.bind(("127.99.0.1", 80))
        except OSError as error:
            return f"port 80 cannot be bound here: {error}"
    return None


def sonar(scene="l-targets.yaml", **options):
    """Returns a daemon whose sonar has these options."""
    daemon = Sonard(scene=scene, profile="waterlinked-3d15", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}")
    if options:
        daemon.profile += "\n    options: {" + ", ".join(f'{k}: "{v}"' for k, v in options.items()) + "}"
    return daemon


def receiver(address=None):
    """Opens a socket for multicast, or for unicast at an address."""
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    udp.settimeout(30)
    if address:
        udp.bind((address, 0))
        return udp
    udp.bind((GROUP, PORT))
    udp.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1"))
    return udp


def varint(data, at):
    value = shift = 0
    while True:
        value |= (data[at] & 127) << shift
        shift += 7
        at += 1
        if data[at - 1] < 128:
            return value, at


def unpacked(block):
    """Returns the content of a raw Snappy block."""
    size, at = varint(block, 0)
    out = bytearray()
    while at < len(block):
        tag = block[at]
        at += 1
        if tag & 3 == 0:
            length = (tag >> 2) + 1
            if length > 60:
                more = length - 60
                length = int.from_bytes(block[at:at + more], "little") + 1
                at += more
            out += block[at:at + length]
            at += length
            continue
        bytes_of_offset = (1, 2, 4)[(tag & 3) - 1]
        offset, length = int.from_bytes(block[at:at + bytes_of_offset], "little"), (tag >> 2) + 1
        if tag & 3 == 1:
            offset, length = offset | tag >> 5 << 8, (tag >> 2 & 7) + 4
        at += bytes_of_offset
        for _ in range(length):
            out.append(out[-offset])
    assert len(out) == size
    return bytes(out)


def fields(message):
    values, at = {}, 0
    while at < len(message):
        key, at = varint(message, at)
        if key & 7 == 0:
            value, at = varint(message, at)
        else:
            size = 4
            if key & 7 == 2:
                size, at = varint(message, at)
            value, at = message[at:at + size], at + size
        values.setdefault(key >> 3, []).append(value)
    return values


class Image:
    def __init__(self, datagram):
        assert datagram[:4] == b"RIP2" and struct.unpack_from("<I", datagram, 4)[0] == len(datagram)
        assert struct.unpack("<I", datagram[-4:])[0] == zlib.crc32(datagram[:-4])
        any_of = fields(fields(unpacked(datagram[8:-4]))[1][0])
        self.kind = any_of[1][0].rsplit(b".", 1)[1].decode()
        self.fields = fields(any_of[2][0])
        header = fields(self.fields[1][0]) if self.kind != "ImuBatch" else {}
        self.stamp, self.sequence = header.get(1), header.get(2, [0])[0]
        self.pixels = self.fields.get(10, [b""])[0]
        if self.kind == "RangeImage":
            values, at = [], 0
            while at < len(self.pixels):
                value, at = varint(self.pixels, at)
                values.append(value)
            self.pixels = values

    def range_of(self, column, row):
        return self.pixels[256 * row + column] * 50 / 65536


@unittest.skipIf(why_not(), why_not())
class Images(unittest.TestCase):
    def ask(self, daemon, path, value=None, method=None):
        """Returns status and body."""
        data = None if value is None else value if isinstance(value, bytes) else json.dumps(value).encode()
        request = urllib.request.Request(f"http://{daemon.address}/api/v1/integration{path}", data, {"Content-Type": "application/json"},
                                         method=method)
        try:
            with urllib.request.urlopen(request, timeout=10) as answer:
                return answer.status, answer.read()
        except urllib.error.HTTPError as error:
            return error.code, error.read()

    def test_settings_images_and_silence(self):
        with sonar() as daemon, receiver() as udp:
            self.assertEqual(json.loads(self.ask(daemon, "/udp")[1])["mode"], "disabled")
            self.assertEqual(self.ask(daemon, "/acoustics/enabled", True), (204, b""))
            self.assertEqual(self.ask(daemon, "/acoustics/enabled", b"{")[0], 400)
            self.assertEqual(self.ask(daemon, "/nothing")[0], 404)
            self.assertEqual(self.ask(daemon, "/udp", b" " * (2 << 20))[0], 413)
            self.assertEqual(self.ask(daemon, "/udp", {"mode": "multicast"})[0], 204)
            received = [udp.recvfrom(65507) for _ in range(8)]
            self.assertEqual({sender[0] for _, sender in received}, {daemon.address}, "the sender has the address of the HTTP API")
            images = [Image(datagram) for datagram, _ in received]
            for ranges, strengths in zip(images[::2], images[1::2]):
                self.assertEqual((ranges.kind, strengths.kind), ("RangeImage", "BitmapImageGreyscale8"))
                self.assertEqual((ranges.sequence, ranges.stamp), (strengths.sequence, strengths.stamp))
                self.assertEqual([r != 0 for r in ranges.pixels], [s != 0 for s in strengths.pixels])
            self.assertEqual([i.sequence - images[0].sequence for i in images[::2]], [0, 1, 2, 3])
            with receiver("127.0.0.1") as own:
                where = {"mode": "unicast", "unicast_destination_ip": "127.0.0.1", "unicast_destination_port": own.getsockname()[1]}
                self.assertEqual(self.ask(daemon, "/udp", where)[0], 204)
                self.assertEqual(json.loads(self.ask(daemon, "/udp")[1]), where)
                self.assertEqual(Image(own.recv(65507)).kind, "RangeImage")
            self.assertEqual(self.ask(daemon, "/udp", {"mode": "disabled"})[0], 204)
            expect_quiet(udp)

    def test_modes_and_imu(self):
        with sonar(**START) as daemon, receiver() as udp:
            self.assertEqual(self.ask(daemon, "/acoustics/mode", "high-frequency")[0], 204)
            self.assertEqual(self.ask(daemon, "/output/imu-batch/enabled", True)[0], 204)
            images = [Image(udp.recv(65507)) for _ in range(30)][-9:]
            self.assertEqual({i.kind for i in images}, {"RangeImage", "BitmapImageGreyscale8", "ImuBatch"})
            batch = next(i for i in images if i.kind == "ImuBatch")
            self.assertEqual(batch.fields[2][0] % 5, 0, "5 samples per 50 ms")
            self.assertEqual(struct.unpack("<3f", batch.fields[4][0][:12])[2], struct.unpack("<f", struct.pack("<f", -9.81))[0])
            self.assertEqual(next(i for i in images if i.kind == "RangeImage").fields[4], [20])

    def test_doctor_listen_and_a_recording(self):
        with tempfile.TemporaryDirectory() as folder:
            daemon = sonar(**START)
            daemon.more = f"recording: {{folder: {folder}}}\nfaults: {{armed: true}}"
            with daemon:
                control = ("--control", f"{daemon.address}:14770")
                begun = run(SONARCTL, "recording", "start", "run.sonar", *control)
                self.assertEqual(begun.returncode, 0, begun.stderr)
                said = run(SONARCTL, "doctor", "--within", 60, *control, "--http", f"{daemon.address}:8088")
                self.assertRegex(said.stdout, r"images over UDP, [0-9.]+ Hz \(5 requested\)")
                self.assertNotIn("A fault acts", said.stdout)
                self.assertEqual(run(SONARCTL, "fault", "add", "deaf-head", *control).returncode, 0)
                said = run(SONARCTL, "doctor", "--within", 60, *control, "--http", f"{daemon.address}:8088")
                self.assertIn("fail  A fault acts on front: deaf-head", said.stdout)
                run(SONARCTL, "fault", "reset", *control)
                eventually(lambda: int(daemon.status()["recordings"][0]["messages"]) > 10)
                run(SONARCTL, "recording", "stop", *control)
            recorded, at, kinds = (pathlib.Path(folder) / "run.sonar").read_bytes(), 0, []
            while at < len(recorded):
                size = struct.unpack_from("<I", recorded, at + 4)[0]
                kinds.append(Image(recorded[at:at + size]).kind)
                at += size
            self.assertGreater(len(kinds), 10)
            self.assertEqual(kinds[:2], ["RangeImage", "BitmapImageGreyscale8"])

    def test_sonarctl_listens_and_draws(self):
        with sonar() as daemon, tempfile.TemporaryDirectory() as folder:
            self.assertIn("leave out --as-it-is", daemon.ctl("listen", "--as-it-is").stderr)
            listened = daemon.ctl("listen", "--pings", 3, "--range", 12, "--mode", 2)
            self.assertEqual(listened.returncode, 0, listened.stderr)
            self.assertIn("a Sonar 3D-15", listened.stdout)
            self.assertRegex(listened.stdout, r"returns from \d+\.\d+ to \d+\.\d+ m\n")
            self.assertEqual(json.loads(self.ask(daemon, "/acoustics/range")[1])["max"], 12)
            self.assertEqual(json.loads(self.ask(daemon, "/acoustics/mode")[1]), "high-frequency")
            picture = pathlib.Path(folder) / "fan.png"
            drawn = daemon.ctl("view", "--png", picture, "--make", "waterlinked")
            self.assertEqual(drawn.returncode, 0, drawn.stderr)
            self.assertEqual(picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
            refused = daemon.ctl("listen", "--range", 16)
            self.assertEqual(refused.returncode, 64)
            self.assertIn("the range must start at 0 m or later, be at least 0.1 m long and end by 15 m (min, max)", refused.stderr)
            self.assertIn("--gain does not apply to a Sonar 3D-15", daemon.ctl("listen", "--gain", 50).stderr)
            where = {"mode": "unicast", "unicast_destination_ip": "127.0.0.1", "unicast_destination_port": 40999}
            self.assertEqual(self.ask(daemon, "/udp", where)[0], 204)
            self.assertIn("127.0.0.1", daemon.ctl("listen").stderr)

    @unittest.skipIf(shark.why_not(), shark.why_not())
    def test_dissector(self):
        with sonar(**START) as daemon, receiver() as udp:
            datagrams = [udp.recv(65507) for _ in range(2)]
        capture = Capture()
        for datagram in datagrams:
            capture.udp(datagram, PORT)
        image = Image(datagrams[0])
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "rip.pcap"
            capture.write(path)
            script = ROOT / "protocol/waterlinked/waterlinked.lua"
            lines = shark.tshark("-r", path, "-Y", "waterlinked", dissector=script)
            values = shark.tshark("-r", path, "-Y", "waterlinked", "-T", "fields", "-e", "waterlinked.kind", "-e", "waterlinked.sequence", "-e",
                                  "waterlinked.width", "-e", "waterlinked.fovHorizontal", dissector=script).splitlines()
            capture.udp(datagrams[0][:-5], PORT)
            capture.write(path)
            broken = shark.tshark("-r", path, "-Y", "waterlinked.expert.broken", dissector=script)
        self.assertIn(f"RangeImage {image.sequence}: 256 x 64 to 15 m", lines)
        self.assertEqual(values, [f"{kind}\t{image.sequence}\t256\t90" for kind in ("RangeImage", "BitmapImageGreyscale8")])
        self.assertEqual(len(broken.splitlines()), 1)


if __name__ == "__main__":
    unittest.main()
