"""Byte layout of Oculus messages, written independently of sonard's code from the public sources of docs/protocols/oculus.md.

All numbers are little-endian and packed. Lengths in messages are checked here before use.
"""
from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple

DATA_PORT, STATUS_PORT = 52100, 52102
MAGIC = b"\x53\x4f"
STATUS, FIRE, PING, USER_CONFIGURATION, LOG, DUMMY = 0x01, 0x15, 0x23, 0x55, 0x80, 0xFF
HEADER_BYTES = 16
LONGEST_MESSAGE = 4 << 20
LONGEST_SMALL_MESSAGE = 64 << 10  # limit for messages whose length no table gives
STANDBY = 5
RATE_CODES = {10: 0, 15: 1, 40: 2, 5: 3, 2: 4, 0: STANDBY}

METRES, WIDE_SAMPLES, ROW_GAINS, SIMPLE_PING, GAIN_ASSIST, MANY_BEAMS, TRIGGERED = 0x01, 0x02, 0x04, 0x08, 0x10, 0x40, 0x80
SAMPLES_32_BIT = 0x200  # extended flag

_HEADER = struct.Struct("<HHHHHIH")
_FIRE = struct.Struct("<5B4d")
_FIRE_TAIL = struct.Struct("<I2II5I")
_SHORT_PING = struct.Struct("<II4dIBdHHIII")         # after the fire message: versions 0 and 1
_LONG_PING = struct.Struct("<II3d3dddBdHH4IIII")     # version 2


class Header(NamedTuple):
    source: int
    destination: int
    type: int
    version: int
    payload_bytes: int
    part_number: int


def read_header(data: bytes) -> Header:
    """Parses 16 bytes that begin with the magic."""
    return Header(*_HEADER.unpack(data)[1:])


def header_bytes(kind: int, version: int, payload_bytes: int, destination: int = 0) -> bytes:
    return _HEADER.pack(0x4F53, 0, destination, kind, version, payload_bytes, 0)


@dataclass(frozen=True)
class FireSettings:
    """A fire message: the settings a client requests, and their echo in each ping."""
    mode: int = 2                    # 1 low frequency, 2 high
    rate_code: int = 0               # RATE_CODES
    network_speed: int = 0xFF
    gamma: int = 127                 # exponent of the samples = gamma / 255; 0 means 1
    flags: int = METRES | SIMPLE_PING
    range: float = 10.0              # m, or per cent where flag METRES is clear
    gain_percent: float = 50.0
    sound_speed_mps: float = 0.0     # 0: the sonar computes it
    salinity_ppt: float = 0.0
    extended: Tuple[int, ...] = (0,) * 9  # version 2: extFlags and the following words

    @property
    def row_gains(self) -> bool:
        return bool(self.flags & ROW_GAINS)

    def payload(self, version: int) -> bytes:
        fixed = _FIRE.pack(self.mode, self.rate_code, self.network_speed, self.gamma, self.flags, self.range, self.gain_percent,
                           self.sound_speed_mps, self.salinity_ppt)
        return fixed + _FIRE_TAIL.pack(*self.extended) if version == 2 else fixed


def fire_bytes(settings: FireSettings, version: int, destination: int = 0) -> bytes:
    """Encodes the whole message."""
    payload = settings.payload(version)
    return header_bytes(FIRE, version, len(payload), destination) + payload


def read_fire(data: bytes, version: int) -> FireSettings:
    """Parses the bytes after a header."""
    tail = _FIRE_TAIL.unpack_from(data, _FIRE.size) if version == 2 else (0,) * 9
    return FireSettings(*(_FIRE.unpack_from(data) + (tail,)))


class PingFields(NamedTuple):
    """The fixed part of a ping result after the echoed fire message."""
    number: int
    status: int
    frequency_hz: float
    temperature_c: float
    pressure_bar: float
    attitude_deg: Optional[Tuple[float, float, float]]  # heading, pitch, roll
    sound_speed_mps: float
    start_counter: Optional[int]
    start_time_s: Optional[float]
    sample_bytes: int
    row_m: float
    rows: int
    beams: int
    image_offset: int
    image_bytes: int
    message_bytes: int


def ping_head_bytes(version: int) -> int:
    """Returns the number of bytes from the start of the message to the bearings."""
    if version == 2:
        return HEADER_BYTES + _FIRE.size + _FIRE_TAIL.size + _LONG_PING.size
    return HEADER_BYTES + _FIRE.size + _SHORT_PING.size


def read_ping_fields(data: bytes, version: int) -> PingFields:
    """Parses a message of at least ping_head_bytes()."""
    if version == 2:
        f = _LONG_PING.unpack_from(data, HEADER_BYTES + _FIRE.size + _FIRE_TAIL.size)
        return PingFields._make(f[:5] + (f[5:8], f[8], None, f[9], f[10] + 1) + f[11:14] + f[18:])
    f = _SHORT_PING.unpack_from(data, HEADER_BYTES + _FIRE.size)
    return PingFields._make(f[:5] + (None, f[5], f[6], None, f[7] + 1) + f[8:])


def ping_fault(data: bytes, header: Header) -> str:
    """Returns the reason why these bytes are not the start of a ping; empty if all lengths are consistent."""
    if header.version > 2:
        return f"ping of version {header.version}"
    head = ping_head_bytes(header.version)
    f = read_ping_fields(data, header.version)
    if f.message_bytes != header.payload_bytes + HEADER_BYTES:
        return f"message size {f.message_bytes} where the header says {header.payload_bytes} + {HEADER_BYTES}"
    if f.image_offset + f.image_bytes != f.message_bytes:
        return f"image of {f.image_bytes} bytes at {f.image_offset} in a message of {f.message_bytes}"
    if f.sample_bytes > 4 or f.rows == 0 or f.beams == 0:
        return f"{f.rows} rows of {f.beams} beams of {f.sample_bytes} bytes"
    gains = 4 if read_fire(data[HEADER_BYTES:], header.version).row_gains else 0
    if f.image_bytes != f.rows * (f.beams * f.sample_bytes + gains):
        return f"image of {f.image_bytes} bytes for {f.rows} rows of {f.beams} beams of {f.sample_bytes} bytes"
    if f.image_offset < head + 2 * f.beams:
        return f"image at {f.image_offset}, within the bearings"
    if not (math.isfinite(f.row_m) and f.row_m > 0):
        return f"rows of {f.row_m} m"
    return ""
