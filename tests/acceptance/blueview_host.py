"""A host on the BlueView link, written only from docs/protocols/blueview-link.md, independent of the daemon's code."""
import array
import socket
import struct
import sys
import zlib

PORT, DISCOVERY_PORT = 14750, 14751
HELLO, SET, GET, PING, SUBSCRIBE, KEEPALIVE, PING_DATA, ERROR = 1, 2, 3, 4, 5, 6, 0x8004, 0xFFFF
START, STOP, RANGE, SOUND_SPEED, GAIN, TVG, TRANSMIT = 1, 2, 3, 4, 5, 6, 8


def text(value):
    return struct.pack("<H", len(value)) + value.encode()


class Fields:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, layout):
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += struct.calcsize("<" + layout)
        return values[0] if len(values) == 1 else values

    def text(self):
        size = self.take("H")
        self.at += size
        return self.data[self.at - size:self.at].decode()

    def rest(self):
        return self.data[self.at:]


class Refused(Exception):
    def __init__(self, code, why):
        super().__init__(f"{code}: {why}")
        self.code = code


class PingData:
    def __init__(self, payload):
        f = Fields(payload)
        (self.head, self.number, self.time_s, _, self.start, self.stop, self.sound_speed, self.fov_min, self.fov_max, self.bin_m,
         self.beams, self.bins, self.format, self.compression, nav) = f.take("iIdiffifffHHBBH")
        self.nav = {}
        for bit, (name, layout) in enumerate([("time", "d"), ("latitude", "d"), ("longitude", "d"), ("depth", "f"), ("altitude", "f"),
                                              ("pitch", "f"), ("roll", "f"), ("heading", "f"), ("velocity", "f"), ("course", "f")]):
            if nav >> bit & 1:
                self.nav[name] = f.take(layout)
        size = f.take("I")
        body = f.rest()
        if self.compression == 1:
            body = zlib.decompress(body)
        assert len(body) == size == 2 * self.beams * self.bins, (len(body), size, self.beams, self.bins)
        self.samples = array.array("H", body)
        if sys.byteorder == "big":
            self.samples.byteswap()

    def at(self, beam, bin_index):
        return self.samples[beam * self.bins + bin_index]

    def bearing(self, beam):
        return self.fov_min + (beam + 0.5) * (self.fov_max - self.fov_min) / self.beams

    def range_m(self, bin_index):
        return self.start + (bin_index + 0.5) * self.bin_m


class Host:
    def __init__(self, address, patience_s=60):
        self.socket = socket.create_connection((address, PORT), timeout=patience_s)
        self.last_id = 0
        self.hello = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, kind, payload=b""):
        self.last_id += 1
        self.socket.sendall(b"BVE1" + struct.pack("<HHII", kind, 0, self.last_id, len(payload)) + payload)
        return self.last_id

    def receive_exactly(self, size):
        data = bytearray()
        while len(data) < size:
            piece = self.socket.recv(min(1 << 20, size - len(data)))
            if not piece:
                raise ConnectionError("closed by the sonar")
            data += piece
        return bytes(data)

    def receive(self):
        """Returns type, request id and payload of the next frame that is not a keep-alive."""
        while True:
            magic, kind, _, request, size = struct.unpack("<4sHHII", self.receive_exactly(16))
            assert magic == b"BVE1", magic
            payload = self.receive_exactly(size)
            if kind != KEEPALIVE:
                return kind, request, payload

    def ask(self, kind, payload=b""):
        number = self.send(kind, payload)
        got, request, answer = self.receive()
        assert request == number, (request, number)
        if got == ERROR:
            f = Fields(answer)
            raise Refused(f.take("i"), f.text())
        assert got == kind | 0x8000, hex(got)
        return answer

    def greet(self):
        f = Fields(self.ask(HELLO, struct.pack("<HH", 1, 4) + text("acceptance test")))
        self.hello = {"version": f.take("H"), "model": f.text(), "name": f.text(), "serial": f.text(), "firmware": f.text(),
                      "temperature": f.take("f"), "caps": f.take("I"), "heads": []}
        for _ in range(f.take("B")):
            head = {"id": f.take("i"), "name": f.text()}
            for key in ("min", "max", "start", "stop"):
                head[key] = f.take("f")
            head["centre_hz"] = f.take("i")
            head["fov"] = f.take("ff")
            head["beams"], head["sound_speed"] = f.take("Hi")
            head["gain"], head["tvg"], head["fluid"] = f.take("ffi")
            self.hello["heads"].append(head)
        assert f.at == len(f.data)
        return self

    def set_numbers(self, key, *values, head=0):
        f = Fields(self.ask(SET, struct.pack(f"<iHB{len(values)}f", head, key, 1, *values)))
        kind = f.take("B")
        return f.take("i") if kind == 0 else f.take("f" * len(values))

    def set_integer(self, key, value, head=0):
        f = Fields(self.ask(SET, struct.pack("<iHBi", head, key, 0, value)))
        return f.take("Bi")[1]

    def ping(self, head=0, timeout_ms=10000):
        return PingData(self.ask(PING, struct.pack("<iI", head, timeout_ms)))


def discover(address, patience_s=30):
    """Returns model, serial and TCP port of the sonar at an address, or None."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        s.settimeout(patience_s)
        s.sendto(b"BVE?" + struct.pack("<H", 1), (address, DISCOVERY_PORT))
        data, source = s.recvfrom(2048)
    f = Fields(data)
    assert f.take("4s") == b"BVE!" and f.take("H") == 1
    port = f.take("H")
    return {"port": port, "model": f.text(), "serial": f.text(), "address": source[0]}
