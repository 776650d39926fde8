"""A second reader of the Oculus stream, written by hand from the sources of docs/protocols/oculus.md. It shares nothing with the
C++ code."""
import contextlib
import functools
import math
import socket
import struct
import threading
import time

HEADER = struct.Struct("<HHHHHIH")  # id, source, destination, type, version, payload size, spare
FIRE = struct.Struct("<BBBBBdddd")  # mode, rate, network speed, gamma, flags, range, gain, sound speed, salinity
RESULT_V1 = struct.Struct("<IIddddIBdHHIII")
RESULT_V2 = struct.Struct("<IIddddddddBdHH16sIII")
RATES = {10: 0, 15: 1, 40: 2, 5: 3, 2: 4, 0: 5}


def fire_message(mode=2, rate_hz=10, flags=0x49, range_=10.0, gain=50.0, sound_speed=0.0, salinity=0.0, version=0, extended=0,
                 gamma=127, payload_size=None):
    body = FIRE.pack(mode, RATES[rate_hz], 255, gamma, flags, range_, gain, sound_speed, salinity)
    if version >= 2:
        body += struct.pack("<9I", extended, *[0] * 8)
    return HEADER.pack(0x4F53, 0, 0, 0x15, version, len(body) if payload_size is None else payload_size, 0) + body


class Ping:
    def __init__(self, message):
        (self.magic, self.source, _, self.type, self.version, payload, _) = HEADER.unpack_from(message)
        assert payload + 16 == len(message), "payload size"
        (self.mode, self.rate, self.network_speed, self.gamma, self.flags, self.range, self.gain, self.sound_speed,
         self.salinity) = FIRE.unpack_from(message, 16)
        self.heading_deg = self.pitch_deg = self.roll_deg = None
        if self.version >= 2:
            self.extended = struct.unpack_from("<I", message, 53)[0]
            (self.id, self.status, self.frequency, self.temperature, self.pressure, self.heading_deg, self.pitch_deg, self.roll_deg,
             self.sound_speed_used, self.start_time, self.data_size, self.resolution, self.rows, self.beams, _, self.image_offset,
             self.image_size, message_size) = RESULT_V2.unpack_from(message, 89)
            table = 202
        else:
            self.extended = 0
            (self.id, self.status, self.frequency, self.temperature, self.pressure, self.sound_speed_used, self.start_time,
             self.data_size, self.resolution, self.rows, self.beams, self.image_offset, self.image_size,
             message_size) = RESULT_V1.unpack_from(message, 53)
            table = 122
        self.sample_bytes = {0: 1, 1: 2, 2: 3, 3: 4}[self.data_size]
        gain_bytes = 4 if self.flags & 4 else 0
        assert message_size == len(message), "message size"
        assert self.image_offset + self.image_size == len(message), "image offset and size"
        assert self.image_size == self.rows * (self.beams * self.sample_bytes + gain_bytes), "image size"
        assert self.image_offset >= table + 2 * self.beams, "image inside the bearing table"
        self.bearings = struct.unpack_from(f"<{self.beams}h", message, table)
        self.image_bytes = message[self.image_offset:]

    @functools.cached_property
    def _rows(self):
        """Returns for each row a tuple of its gain (empty if rows have none), and its samples. Slow, so done at the first use."""
        rows, at, width = [], 0, self.sample_bytes
        for _ in range(self.rows):
            gain = ()
            if self.flags & 4:
                gain = struct.unpack_from("<I", self.image_bytes, at)
                at += 4
            row = self.image_bytes[at:at + self.beams * width]
            at += len(row)
            rows.append((gain, list(row) if width == 1 else [int.from_bytes(row[i:i + width], "little") for i in range(0, len(row), width)]))
        return rows

    @functools.cached_property
    def gains(self):
        return [gain for gains, _ in self._rows for gain in gains]

    @functools.cached_property
    def image(self):
        return [samples for _, samples in self._rows]

    def brightest(self, row_begin=0, row_end=None):
        """Returns range [m], bearing [deg], value of the largest sample in rows [row_begin, row_end)."""
        rows = range(row_begin, self.rows if row_end is None else row_end)
        row = max(rows, key=lambda r: max(self.image[r]))
        beam = max(range(self.beams), key=lambda b: self.image[row][b])
        return (row + 0.5) * self.resolution, self.bearings[beam] / 100, self.image[row][beam]


class Client:
    """A driver of a few lines. Messages must follow each other without a byte between."""

    def __init__(self, address, port=52100, patience_s=120):
        deadline = time.monotonic() + patience_s
        while True:
            try:
                self.socket = socket.create_connection((address, port), timeout=patience_s)
                return
            except ConnectionRefusedError:
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.02)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, message):
        self.socket.sendall(message)

    def _exactly(self, size):
        data = b""
        while len(data) < size:
            chunk = self.socket.recv(size - len(data))
            if not chunk:
                raise EOFError("the device closed the connection")
            data += chunk
        return data

    def message(self):
        header = self._exactly(16)
        magic, _, _, kind, _, payload, _ = HEADER.unpack(header)
        assert magic == 0x4F53, f"stray bytes between messages: {header!r}"
        return kind, header + self._exactly(payload)

    def ping(self):
        """Returns the next ping; skips dummies and texts."""
        while True:
            kind, message = self.message()
            if kind == 0x23:
                return Ping(message)

    def ping_made_with(self, fire):
        """Sends settings and returns the first ping that repeats mode, flags and range. Counts earlier pings in `stale`."""
        self.send(fire)
        wanted = FIRE.unpack_from(fire, 16)
        self.stale = 0
        while True:
            ping = self.ping()
            if (ping.mode, ping.flags, ping.range) == (wanted[0], wanted[4], wanted[5]):
                return ping
            self.stale += 1


@contextlib.contextmanager
def reading(client):
    """Reads like a driver and disconnects at the end."""
    def read():
        with contextlib.suppress(OSError):
            while client.socket.recv(1 << 16):
                pass

    reader = threading.Thread(target=read)
    reader.start()
    try:
        yield
    finally:
        client.socket.shutdown(socket.SHUT_RDWR)
        reader.join()


def expected_bearings(beams, half_aperture_deg):
    """Returns bearings like those of captured pings: equal steps of the sine, truncated to hundredths of a degree."""
    top = math.sin(math.radians(half_aperture_deg))
    values = [math.degrees(math.asin(top * (2 * i / (beams - 1) - 1))) for i in range(beams)]
    return [int(100 * v + math.copysign(1e-6, v)) for v in values]
