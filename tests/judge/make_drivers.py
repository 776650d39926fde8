#!/usr/bin/env python3
"""Small drivers of several makes, each with its own decoders. Without a planted fault the judge must find no fault in them.

usage: make_drivers.py MAKE ADDRESS PORT [PLANT]
MAKE: aris, blueview, dvl, m3, micron, norbit, omniscan, ping1d, ping360, s500, surveyor, waterlinked
PLANT: drops (every fifth ping is not published), mirrors (every fifth ping is mirrored)
"""
import json
import socket
import struct
import sys
import time
import urllib.request
import zlib

SILENT_S = 1.5


class Stream:
    """Reads exact numbers of bytes from a TCP connection, or from successive datagrams."""

    def __init__(self, address, port, kind=socket.SOCK_STREAM):
        self.socket = socket.socket(socket.AF_INET, kind)
        self.socket.settimeout(SILENT_S)
        self.socket.connect((address, port))
        self.send, self.data = self.socket.sendall, bytearray()

    def take(self, count):
        while len(self.data) < count:
            received = self.socket.recv(1 << 18)
            if not received:
                raise ConnectionError("the sonar closed the connection")
            self.data += received
        taken = bytes(self.data[:count])
        del self.data[:count]
        return taken

    def until(self, mark):
        """Reads up to a mark, which is not returned."""
        while (at := self.data.find(mark)) < 0:
            have = len(self.data)
            self.data[:0] = self.take(have + 1)
        taken = self.take(at + len(mark))
        return taken[:-len(mark)]


def m3(address, port):
    """Yields (number or None, samples, mirrored samples) of each ping, like every function below."""
    sonar = Stream(address, port)
    while True:
        sonar.until(b"\x00\x80" * 4 + b"\x02\x10")
        front = sonar.take(46)
        body = sonar.take(int.from_bytes(front[-4:], "little"))
        sonar.take(44)
        samples, beams = int.from_bytes(body[52:56], "little"), int.from_bytes(body[72:74], "little")
        picture = body[8512:]
        one = 8 * samples
        mirrored = b"".join(picture[beam * one:(beam + 1) * one] for beam in reversed(range(beams)))
        yield int.from_bytes(body[4208:4212], "little"), picture, mirrored


def dvl(address, port):
    sonar = Stream(address, port)
    while True:
        report = json.loads(sonar.until(b"\r\n"))
        if report["type"] == "velocity":
            v = [report[name] for name in ("vx", "vy", "vz", "altitude")]
            yield None, struct.pack("<4d", *v), struct.pack("<4d", v[0], -v[1], *v[2:])


def micron(address, port):
    def send(number, payload):
        size = len(payload) + 8
        sonar.send(b"@%04X" % size + struct.pack("<HBBBBBB", size, 255, 2, size - 5, number, 0x80, 2) + payload + b"\n")

    sonar = Stream(address, port)
    head = struct.pack("<BHB16xHHHHBBBB4xBBHHHHHBBH", 1, 0x2305, 0x11, 0, 100, 1600, 4800, 255, 0, 105, 105, 25, 16, 52, 400, 500, 100,
                       1600, 1, 0, 0)
    send(19, head)
    asked = False
    while True:
        if not asked:
            send(25, bytes(4))
            asked = True
        sonar.until(b"@")
        size = int(sonar.take(4), 16) + 1
        frame = sonar.take(size)
        if frame[5] == 4:  # mtAlive: the head sends no lines; bit 7 of the state is set if it has parameters
            if not frame[8 + 7] & 0x80:
                send(19, head)
            send(25, bytes(4))
        if frame[5] == 2:
            asked = False
            yield None, frame[8:-1], frame[8:39] + frame[39:-1][::-1]


def ping_family(sonar, requests, data, number_at, front, item=1):
    """Sends requests and reads the messages of kind `data`. These have a number at `number_at`, and after `front` bytes
    items that can be mirrored."""
    for kind, payload in requests:
        body = b"BR" + struct.pack("<HHBB", len(payload), kind, 0, 0) + payload
        sonar.send(body + struct.pack("<H", sum(body) & 0xFFFF))
    while True:
        sonar.until(b"BR")
        size, kind = struct.unpack("<HHxx", sonar.take(6))
        payload = sonar.take(size + 2)[:-2]
        if kind == data:
            items = [payload[at:at + item] for at in range(front, size, item)]
            number = None if number_at is None else int.from_bytes(payload[number_at:number_at + 4], "little")
            yield number, payload, payload[:front] + b"".join(reversed(items))


def s500(address, port):
    request = struct.pack("<IIhhHHHBB", 0, 5000, -1, 100, 0, 1308, 0, 0, 0)
    return ping_family(Stream(address, port), [(1015, request)], 1308, 0, 66)


def ping1d(address, port):
    requests = [(1003, b"\1"), (1004, struct.pack("<H", 100)), (1400, struct.pack("<H", 1300))]
    return ping_family(Stream(address, port, socket.SOCK_DGRAM), requests, 1300, 8, 26)


def ping360(address, port):
    request = struct.pack("<BBHHHHHHBB", 1, 1, 32, 222, 740, 600, 0, 399, 1, 0)
    return ping_family(Stream(address, port, socket.SOCK_DGRAM), [(2602, request)], 2301, None, 20)


def omniscan(address, port):
    request = struct.pack("<IIIffffhHBB", 0, 5000, 100, 0, 0, 0.002, 0.0015, -1, 600, 1, 0)
    return ping_family(Stream(address, port), [(2197, request)], 2198, None, 52, 2)


def surveyor(address, port):
    request = struct.pack("<iifhhHBBBBBBiHHf", 0, 10000, 1500, -1, 100, 0, 0, 1, 0, 0, 0, 1, 240000, 400, 0, 1.5)
    return ping_family(Stream(address, port), [(3023, request)], 3012, 20, 40, 16)


def norbit(address, port):
    sonar, commands = Stream(address, port), Stream(address, port - 1)
    commands.send(b"set_range 0 10\r\nset_rate 10\r\nset_power 1\r\n")
    while True:
        sonar.until(b"\xef\xbe\xad\xde")
        kind, size = struct.unpack("<II12x", sonar.take(20))
        body = sonar.take(size - 24)
        if kind == 1:
            beams = [body[at:at + 20] for at in range(88, len(body), 20)]
            yield int.from_bytes(body[12:16], "little"), b"".join(beams), b"".join(reversed(beams))


def blueview(address, port):
    def send(kind, payload):
        sonar.send(b"BVE1" + struct.pack("<HHII", kind, 0, 1, len(payload)) + payload)

    def receive():
        kind, size = struct.unpack("<4xH6xI", sonar.take(16))
        return kind, sonar.take(size)

    sonar = Stream(address, port)
    send(1, struct.pack("<HHH", 1, 4, 0))
    _, greeting = receive()
    at = 2
    for _ in range(4):
        at += 2 + int.from_bytes(greeting[at:at + 2], "little")
    head = greeting[at + 9:at + 13]  # the id of the first head
    asked = time.monotonic()
    send(4, head + bytes(4))
    while True:
        kind, payload = receive()
        if kind == 0x8004:
            send(4, head + bytes(4))
            beams, bins = struct.unpack_from("<HH", payload, 44)
            number, samples = int.from_bytes(payload[4:8], "little"), payload[-2 * beams * bins:]
            assert payload[49] == 0, "compressed"
            one = 2 * bins
            yield number, samples, b"".join(samples[beam * one:(beam + 1) * one] for beam in reversed(range(beams)))
        elif time.monotonic() - asked > 2:
            asked = time.monotonic()
            send(6, b"")


def varint(data, at):
    value = shift = 0
    while True:
        value |= (data[at] & 127) << shift
        at, shift = at + 1, shift + 7
        if data[at - 1] < 128:
            return value, at


def message(data):
    """Returns the fields of a protobuf message; of fields with equal numbers the last one."""
    found, at = {}, 0
    while at < len(data):
        key, at = varint(data, at)
        if key & 7 == 0:
            found[key >> 3], at = varint(data, at)
        else:
            size, at = varint(data, at) if key & 7 == 2 else ({1: 8, 5: 4}[key & 7], at)
            found[key >> 3], at = data[at:at + size], at + size
    return found


def number_field(field, value):
    out = bytearray()
    for rest in (field << 3, value):
        while rest > 127:
            out.append(rest & 127 | 128)
            rest >>= 7
        out.append(rest)
    return bytes(out)


def block_field(field, data):
    assert len(data) < 128
    return bytes([field << 3 | 2, len(data)]) + data


def aris(address, port):
    def send(kind, field, body):
        command = number_field(1, kind) + block_field(field, body)
        control.sendall(struct.pack(">I", len(command)) + command)

    def floating(field, value):
        return bytes([field << 3 | 5]) + struct.pack("<f", value)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as frames, \
            socket.create_connection((address, port), timeout=SILENT_S) as control:
        frames.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        frames.bind(("", 0))
        frames.settimeout(SILENT_S)
        acoustics = b"".join(number_field(n, v) for n, v in ((1, 1), (3, 512), (4, 930), (5, 6000), (6, 8), (7, 10), (8, 6), (9, 1),
                                                             (10, 1), (11, 1)))
        send(3, 5, acoustics + floating(2, 10) + floating(12, 12))
        send(1, 3, number_field(1, frames.getsockname()[1]))
        said = time.monotonic()
        index, parts, header = -1, {}, b""
        while True:
            part = message(frames.recv(65536))
            if part[1] != index:
                index, parts, header = part[1], {}, b""
            parts[part.get(5, 0)] = part[4]
            header = part.get(3, header)
            if time.monotonic() - said > 1:
                said = time.monotonic()
                send(14, 16, b"")
            if sum(map(len, parts.values())) == part[2] and header:
                raw = b"".join(data for _, data in sorted(parts.items()))
                samples, = struct.unpack_from("<I", header, 468)
                beams = len(raw) // samples
                pings = beams // 16
                rows = [bytearray(beams) for _ in range(samples)]
                at = 0
                for ping in range(pings):
                    for row in rows:
                        for sixteenth in (10, 2, 14, 6, 8, 0, 12, 4, 11, 3, 15, 7, 9, 1, 13, 5):
                            row[sixteenth * pings + ping] = raw[at]
                            at += 1
                yield index, b"".join(rows), b"".join(row[::-1] for row in rows)


def unsnapped(block):
    size, at = varint(block, 0)
    out = bytearray()
    while at < len(block):
        tag, at = block[at], at + 1
        if tag & 3 == 0:
            length = tag >> 2
            if length > 59:
                more = length - 59
                length, at = int.from_bytes(block[at:at + more], "little"), at + more
            out += block[at:at + length + 1]
            at += length + 1
        else:
            more = (1, 2, 4)[(tag & 3) - 1]
            back = int.from_bytes(block[at:at + more], "little") + ((tag >> 5) << 8 if tag & 3 == 1 else 0)
            at += more
            for _ in range((tag >> 2 & 7) + 4 if tag & 3 == 1 else (tag >> 2) + 1):
                out.append(out[-back])
    assert len(out) == size
    return bytes(out)


def waterlinked(address, port):
    def post(path, value):
        urllib.request.urlopen(urllib.request.Request(f"http://{address}:{port}/api/v1/integration/{path}", json.dumps(value).encode(),
                                                      {"Content-Type": "application/json"}), timeout=SILENT_S).close()

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as images:
        images.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        images.bind(("", 0))
        images.settimeout(SILENT_S)
        with socket.create_connection((address, port), timeout=SILENT_S) as looked:
            own = looked.getsockname()[0]
        post("udp", {"mode": "unicast", "unicast_destination_ip": own, "unicast_destination_port": images.getsockname()[1]})
        post("acoustics/enabled", True)
        while True:
            datagram = images.recv(65536)
            content = message(message(unsnapped(datagram[8:-4]))[1])
            if content[1].endswith(b"RangeImage"):
                image = message(content[2])
                packed, at, ranges = image[10], 0, []
                while at < len(packed):
                    value, at = varint(packed, at)
                    ranges.append(value)
                width = image[5]
                mirrored = [value for row in range(0, len(ranges), width) for value in reversed(ranges[row:row + width])]
                yield message(image[1])[2], *(struct.pack(f"<{len(ranges)}I", *values) for values in (ranges, mirrored))


def main():
    make, address, port = sys.argv[1], sys.argv[2], int(sys.argv[3])
    plant, seen = sys.argv[4] if len(sys.argv) > 4 else "", None
    pings = 0
    while True:
        try:
            for number, samples, mirrored in globals()[make](address, port):
                pings += 1
                is_planted = pings % 5 == 0
                if plant == "drops" and is_planted or number is not None and (number, samples) == seen:
                    continue
                seen = number, samples
                found = {"crc32": zlib.crc32(mirrored if plant == "mirrors" and is_planted else samples)}
                if not plant and number is not None:  # the judge requires 20 consecutive numbers
                    found["id"] = number
                print(json.dumps(found), flush=True)
        except (OSError, ValueError, IndexError, KeyError, struct.error) as problem:
            print(f"no ping: {problem}", file=sys.stderr, flush=True)
            print(json.dumps({"state": "lost"}), flush=True)
            time.sleep(0.3)


if __name__ == "__main__":
    main()
