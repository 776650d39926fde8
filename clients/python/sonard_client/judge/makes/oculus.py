"""Oculus. A ping counts if its samples are complete: the image agrees with the dimensions and with at least one length field, and contains
no header of another message. So a driver may use any of the length fields.
"""
from __future__ import annotations

import struct
import zlib
from typing import FrozenSet, List

from ... import layouts
from ..truth import Make, TruePing

_LONGEST = layouts.LONGEST_MESSAGE
_FEWEST_SAMPLES, _MOST_SAMPLES = 4, 1 << 22  # limits for an image: no sonar has fewer or more


def sample_crcs(image: bytes, rows: int, row_bytes: int, has_gains: bool) -> FrozenSet[int]:
    """Returns the CRC-32 of an image as sent; with row gains also of the samples without them."""
    found = {zlib.crc32(image)}
    if has_gains:
        crc, stride = 0, row_bytes + 4
        for row in range(rows):
            crc = zlib.crc32(image[row * stride + 4:(row + 1) * stride], crc)
        found.add(crc)
    return frozenset(found)


class OculusReader:
    """Finds pings at any offset of a stream. feed() returns those that became complete."""

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
            if step == 0:  # incomplete: look again with more data
                break
            at += step
        del self._data[:at]
        self._base += at
        return found

    def _ping_at(self, at: int, found: List[TruePing]) -> int:
        """Returns the number of bytes to advance; 0 if more data are needed."""
        data = self._data
        if len(data) - at < layouts.HEADER_BYTES:
            return 0
        header = layouts.read_header(bytes(data[at:at + layouts.HEADER_BYTES]))
        if header.type != layouts.PING:
            return 1
        version = min(header.version, 2)  # later versions are read as version 2
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
        row_short = end - row_bytes - (4 if has_gains else 0)  # all lengths lack the last row: a driver may accept or refuse this
        if end not in declared and declared == {row_short}:
            end, image_bytes = row_short, row_short - f.image_offset
        elif end not in declared:
            return 1
        if f.sample_bytes > 4 or not _FEWEST_SAMPLES <= f.rows * f.beams <= _MOST_SAMPLES or end > _LONGEST or \
                f.image_offset < head + 2 * f.beams:
            return 1
        if len(data) - at < end:
            # A message that can never be complete must not hide later ones.
            other = data.find(front[:6], at + 1)
            return other - at if 0 <= other < at + end else 0
        message = bytes(data[at:at + end])
        other = message.find(front[:6], 1)  # magic and source of another message mean that this one lacks bytes
        if other > 0:
            return other
        image = message[f.image_offset:]
        found.append(TruePing(f.number, sample_crcs(image, f.rows, row_bytes, has_gains), f.rows, f.beams, self._base + at,
                              self._base + at + end))
        return end


def is_fire(sent: bytes) -> bool:
    return sent[:2] == layouts.MAGIC and sent[6:8] == struct.pack("<H", layouts.FIRE)


OCULUS = Make(("oculus",), stream=OculusReader, is_request=is_fire)
