"""A controller of ARIS sonars in Python, written from docs/protocols/aris.md; it shares nothing with the C++ code."""
import socket
import struct
import time

COMMANDS, BEACONS = 56888, 56124
SO_TIMESTAMPNS = 35  # Linux
CHANNELS = (10, 2, 14, 6, 8, 0, 12, 4, 11, 3, 15, 7, 9, 1, 13, 5)
PINGS = {1: 3, 3: 6, 6: 4, 9: 8}
RECEIVER, ACOUSTICS, SALINITY, PING = 1, 3, 4, 14


def varint(value):
    out = bytearray()
    while value > 127:
        out.append(value % 128 + 128)
        value //= 128
    return bytes(out) + bytes([value])


def field(number, value):
    if isinstance(value, float):
        return varint(number * 8 + 5) + struct.pack("<f", value)
    if isinstance(value, bytes):
        return varint(number * 8 + 2) + varint(len(value)) + value
    return varint(number * 8) + varint(value)



def read_varint(data, at):
    value = shift = 0
    while True:
        byte = data[at]
        value, shift, at = value | (byte & 127) << shift, shift + 7, at + 1
        if byte < 128:
            return value, at


def fields(data):
    """Returns {number: [values]} of a message; numbers that are missing in it are left out."""
    found, at = {}, 0
    while at < len(data):
        key, at = read_varint(data, at)
        if key % 8 == 0:
            value, at = read_varint(data, at)
        elif key % 8 == 5:
            value, at = struct.unpack_from("<f", data, at)[0], at + 4
        else:
            size, at = read_varint(data, at)
            value, at = data[at:at + size], at + size
        found.setdefault(key // 8, []).append(value)
    return found


def acoustics(cookie, rate=10.0, samples=1600, delay=1360, cycle=None, period=6, pulse=8, mode=9, gain=12.0, frequency=1):
    cycle = delay + period * samples + 360 if cycle is None else cycle
    values = (cookie, rate, samples, delay, cycle, period, pulse, mode, 1, frequency, 1, gain)
    return b"".join(field(number, value) for number, value in enumerate(values, 1))


class Frame:
    def __init__(self, index, header, raw):
        self.index, self.header = index, header
        self.mode, self.samples = self.u32(436), self.u32(468)
        self.beams = 16 * PINGS[self.mode]
        assert len(raw) == self.beams * self.samples
        assert self.u32(516) == 0  # not reordered by the device
        self.picture = bytearray(len(raw))
        pings = PINGS[self.mode]
        for ping in range(pings):
            for channel, place in enumerate(CHANNELS):
                first = ping * self.samples * 16 + channel
                self.picture[place * pings + ping::self.beams] = raw[first:first + self.samples * 16:16]

    def u32(self, at):
        return struct.unpack_from("<I", self.header, at)[0]

    def f32(self, at):
        return struct.unpack_from("<f", self.header, at)[0]

    def brightest(self, beams, near_m, far_m):
        """Returns (range, beam) of the largest sample in a window."""
        start, length = self.f32(52), self.f32(56)
        rows = [s for s in range(self.samples) if near_m <= start + s * length / self.samples <= far_m]
        _, row, beam = max((self.picture[row * self.beams + beam], row, beam) for row in rows for beam in beams)
        return start + row * length / self.samples, beam


class Controller:
    def __init__(self, address, receiver=True):
        self.tcp = socket.create_connection((address, COMMANDS), timeout=30)
        self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self.udp.bind(("127.0.0.1", 0))
        self.udp.settimeout(30)
        self.sent, self.datagrams, self.incomplete = [], [], 0
        if receiver:
            self.command(RECEIVER, 3, field(1, self.udp.getsockname()[1]) + field(2, b"127.0.0.1"))

    def command(self, kind, number=16, body=b""):
        data = field(1, kind) + field(number, body)
        self.sent.append(struct.pack(">I", len(data)) + data)
        self.tcp.sendall(self.sent[-1])

    def set(self, *values, **named):
        self.command(ACOUSTICS, 5, acoustics(*values, **named))

    def frame(self):
        """Returns the next whole frame."""
        index, header, raw, total = None, b"", {}, 0
        while True:
            data = self.udp.recv(2048)
            self.datagrams.append(data)
            part = fields(data)
            assert {1, 2, 4, 5} <= part.keys()
            if part[1][0] != index:
                self.incomplete += index is not None
                index, total, header, raw = part[1][0], part[2][0], b"", {}
            header = part.get(3, [header])[0]
            raw[part[5][0]] = part[4][0]
            if header and sum(map(len, raw.values())) == total:
                return Frame(index, header, b"".join(raw[at] for at in sorted(raw)))

    def close(self):
        self.tcp.close()
        self.udp.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class Beacons:
    def __init__(self, address):
        self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.udp.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self.udp.bind((address, BEACONS))
        self.arrived_s = 0.0  # when the kernel received the last beacon

    def next(self, patience_s=30.0):
        self.udp.settimeout(patience_s)
        data, beside, _, source = self.udp.recvmsg(256, socket.CMSG_SPACE(16))
        seconds, nanoseconds = struct.unpack("qq", beside[0][2])
        self.arrived_s = seconds + 1e-9 * nanoseconds
        return fields(data), source[0], data

    def until_state(self, state, patience_s):
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            if self.next(patience_s)[0][4][0] == state:
                return True
        return False

    def close(self):
        self.udp.close()
