"""Finds the pings in a stream with faults. A driver may publish these pings and no others.

A ping of an Oculus counts if all samples that it announces are there: image, dimensions and one of the length fields agree, and the
header of another message does not follow too early. A driver may therefore use any of the length fields.
"""
from __future__ import annotations

import struct
import zlib
from typing import Callable, Dict, FrozenSet, List, NamedTuple, Optional, Protocol

from .. import layouts

_LONGEST = layouts.LONGEST_MESSAGE
_FEWEST_SAMPLES, _MOST_SAMPLES = 4, 1 << 22  # limits for an image: no sonar has fewer or more


class TruePing(NamedTuple):
    """A ping found in a stream. crcs: CRC-32 of its samples, without and with row gains."""
    number: int
    crcs: FrozenSet[int]
    rows: int
    beams: int
    begin: int       # offset in the stream
    end: int
    start_s: float   # start of the ping in the device's clock; versions 0 and 1: the raw counter


class Reader(Protocol):
    """Finds the pings of one make in the bytes of a connection; feed() returns those that became complete."""

    def feed(self, received: bytes) -> List[TruePing]: ...


def sample_crcs(image: bytes, rows: int, row_bytes: int, has_gains: bool) -> FrozenSet[int]:
    """Returns the CRC-32 of an image as sent and, if it has row gains, also the CRC-32 of the samples without the gains."""
    found = {zlib.crc32(image)}
    if has_gains:
        crc, stride = 0, row_bytes + 4
        for row in range(rows):
            crc = zlib.crc32(image[row * stride + 4:(row + 1) * stride], crc)
        found.add(crc)
    return frozenset(found)


class TruthReader:
    """Finds the pings of an Oculus at any offset of a stream."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._base = 0  # offset of _data[0] in the stream

    def feed(self, received: bytes) -> List[TruePing]:
        self._data += received
        found: List[TruePing] = []
        at = 0
        while True:
            at = self._data.find(layouts.MAGIC, at)
            if at < 0:
                at = len(self._data) - (self._data[-1:] == layouts.MAGIC[:1])
                break
            step = self._ping_at(at, found)
            if step == 0:  # incomplete: wait for more data
                break
            at += step
        del self._data[:at]
        self._base += at
        return found

    def _ping_at(self, at: int, found: List[TruePing]) -> int:
        """Returns how many bytes to advance, or 0 if more data are needed. Appends a ping that begins at `at`."""
        data = self._data
        if len(data) - at < layouts.HEADER_BYTES:
            return 0
        header = layouts.read_header(bytes(data[at:at + layouts.HEADER_BYTES]))
        if header.type != layouts.PING:
            return 1
        version = min(header.version, 2)  # reads later versions as the last known one
        head = layouts.ping_head_bytes(version)
        if len(data) - at < head:
            return 0
        front = bytes(data[at:at + head])
        f = layouts.read_ping_fields(front, version)
        has_gains = layouts.read_fire(front[layouts.HEADER_BYTES:], version).row_gains
        row_bytes = f.beams * f.sample_bytes
        image_bytes = f.rows * (row_bytes + (4 if has_gains else 0))
        end = f.image_offset + image_bytes
        declared = {f.message_bytes, header.payload_bytes + layouts.HEADER_BYTES}
        row_short = end - row_bytes - (4 if has_gains else 0)  # if both lengths lack one row, a driver may accept or refuse the ping
        if end not in declared and declared == {row_short}:
            end, image_bytes = row_short, row_short - f.image_offset
        elif end not in declared:
            return 1
        if f.sample_bytes > 4 or not _FEWEST_SAMPLES <= f.rows * f.beams <= _MOST_SAMPLES or end > _LONGEST or \
                f.image_offset < head + 2 * f.beams:
            return 1
        if len(data) - at < end:
            # If another message begins inside, this one will never be complete; go on with the other.
            other = data.find(front[:6], at + 1)
            return other - at if 0 <= other < at + end else 0
        message = bytes(data[at:at + end])
        other = message.find(front[:6], 1)  # the start of another message: bytes of this one are missing
        if other > 0:
            return other
        image = message[f.image_offset:]
        start = f.start_time_s if f.start_time_s is not None else float(f.start_counter or 0)
        found.append(TruePing(f.number, sample_crcs(image, f.rows, row_bytes, has_gains), f.rows, f.beams, self._base + at,
                              self._base + at + end, start))
        return end


# Messages of the ping protocol that hold samples, with the offset of the ping's number in the payload.
_PROFILE, _MONO_PROFILE, _DEVICE_DATA, _AUTO_DEVICE_DATA, _ATOF = 1300, 2198, 2300, 2301, 3012
_NUMBER_AT: Dict[int, Optional[int]] = {_PROFILE: 8, _MONO_PROFILE: None, _DEVICE_DATA: None, _AUTO_DEVICE_DATA: None, _ATOF: 20}
_FRAME = struct.Struct("<2sHHBB")  # "BR", payload length, message, source, destination; after the payload a 16-bit sum


class PingProtocolReader:
    """Finds undamaged messages of the ping protocol at any offset. Their payload counts as the samples. Pings without a number get
    -1, -2, ..., so that they differ from each other and from every number that a driver can print."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._base = self._without_number = 0

    def feed(self, received: bytes) -> List[TruePing]:
        self._data += received
        found: List[TruePing] = []
        at, waiting = 0, -1  # waiting: the first incomplete message; a complete one after it shows that it was none
        while (begin := self._data.find(b"BR", at)) >= 0:
            end = self._end(begin)
            if end > 0:
                self._add(begin, end, found)
            elif end < 0 and waiting < 0:
                waiting = begin
            at, waiting = (end, -1) if end > 0 else (begin + 1, waiting)
        kept = waiting if waiting >= 0 else max(at, len(self._data) - self._data.endswith(b"B"))
        del self._data[:kept]
        self._base += kept
        return found

    def _end(self, begin: int) -> int:
        """Returns the end of an undamaged message, 0 if no message begins here, or -1 while bytes are missing."""
        if len(self._data) - begin < _FRAME.size:
            return -1
        end = begin + _FRAME.size + int.from_bytes(self._data[begin + 2:begin + 4], "little") + 2
        if len(self._data) < end:
            return -1
        return end if sum(self._data[begin:end - 2]) & 0xFFFF == int.from_bytes(self._data[end - 2:end], "little") else 0

    def _add(self, begin: int, end: int, found: List[TruePing]) -> None:
        message = int.from_bytes(self._data[begin + 4:begin + 6], "little")
        if message not in _NUMBER_AT:
            return
        payload = bytes(self._data[begin + _FRAME.size:end - 2])
        number_at = _NUMBER_AT[message]
        if number_at is None or len(payload) < number_at + 4:
            self._without_number -= 1
            number = self._without_number
        else:
            number = int.from_bytes(payload[number_at:number_at + 4], "little")
        found.append(TruePing(number, frozenset({zlib.crc32(payload)}), 1, len(payload), self._base + begin, self._base + end, 0.0))


def reader_for(profile: str) -> Optional[Callable[[], Reader]]:
    """Returns the reader for a product, or None if there is none; then the driver's data are not judged."""
    if profile.startswith("oculus"):
        return TruthReader
    return PingProtocolReader if profile.startswith(("ping", "omniscan", "surveyor")) else None
