"""ARIS: frames in several datagrams, sent to the receiver that a command names. Accepted samples: those of all parts in the order of
their offsets, or in the order of the picture (sample by sample, each from beam 0)."""
from __future__ import annotations

import zlib
from typing import Dict, List, NamedTuple, Optional

from ..truth import Make, TruePing
from . import protobuf

_CHANNELS, _LARGEST, _FRAMES_KEPT = 16, 4096 * 128, 4
_FIRST_BEAM = (10, 2, 14, 6, 8, 0, 12, 4, 11, 3, 15, 7, 9, 1, 13, 5)  # of each channel, in sixteenths
_SAMPLES_AT, _REORDERED_AT = 468, 516  # in the header


class Part(NamedTuple):
    index: int
    total: int
    header: bytes
    data: bytes
    offset: int


def part_of(datagram: bytes) -> Optional[Part]:
    """Returns None if the datagram is not part of a frame."""
    try:
        message = protobuf.fields(datagram)
        part = Part(protobuf.number(message, 1), protobuf.number(message, 2), protobuf.block(message, 3), protobuf.block(message, 4),
                    protobuf.number(message, 5))
    except ValueError:
        return None
    return part if set(message) <= set(range(1, 7)) and part.data and part.offset + len(part.data) <= part.total <= _LARGEST else None


def picture_of(raw: bytes, samples: int) -> bytes:
    """Converts samples from the order of the digitiser (by ping, sample, channel) to that of the picture."""
    beams = len(raw) // samples
    pings, picture = beams // _CHANNELS, bytearray(len(raw))
    for ping in range(pings):
        one = raw[ping * samples * _CHANNELS:(ping + 1) * samples * _CHANNELS]
        for channel, first in enumerate(_FIRST_BEAM):
            picture[first * pings + ping::beams] = one[channel::_CHANNELS]
    return bytes(picture)


class _Frame:
    def __init__(self, begin: int) -> None:
        self.parts: Dict[int, Part] = {}
        self.begin, self.received = begin, 0
        self.is_done = self.is_interrupted = False


class ArisReader:
    """If the parts of two frames are interleaved, a driver may omit these frames or assemble them. frame_index begins again with each
    connection, so different frames can have the same index."""

    def __init__(self) -> None:
        self._at = 0
        self._frames: Dict[int, _Frame] = {}  # the latest ones, by index
        self._last = -1

    def feed(self, datagram: bytes) -> List[TruePing]:
        begin, self._at = self._at, self._at + len(datagram)
        part = part_of(datagram)
        if part is None:
            return []
        if part.index != self._last:
            for interrupted in self._frames.values():
                interrupted.is_interrupted = True
        self._last = part.index
        frame = self._frames.get(part.index)
        known = frame.parts.get(part.offset) if frame is not None else None
        if frame is not None and known == part:
            return []  # a repeated part
        if frame is None or frame.is_done or known is not None:
            self._frames.pop(part.index, None)
            frame = self._frames[part.index] = _Frame(begin)
        if len(self._frames) > _FRAMES_KEPT:
            self._frames.pop(next(iter(self._frames)))
        frame.parts[part.offset] = part
        frame.received += len(part.data)
        header = frame.parts[0].header if 0 in frame.parts else b""
        if frame.received != part.total or not header:
            return []
        frame.is_done = True
        end = 0
        for at, one in sorted(frame.parts.items()):
            if at != end or one.total != part.total:
                return []
            end += len(one.data)
        raw = b"".join(one.data for _, one in sorted(frame.parts.items()))
        samples = int.from_bytes(header[_SAMPLES_AT:_SAMPLES_AT + 4], "little")
        crcs, beams = {zlib.crc32(raw)}, 0
        if samples and len(raw) % (samples * _CHANNELS) == 0:
            beams = len(raw) // samples
            if not any(header[_REORDERED_AT:_REORDERED_AT + 4]):
                crcs.add(zlib.crc32(picture_of(raw, samples)))
        return [TruePing(part.index, frozenset(crcs), samples, beams, frame.begin, self._at, not frame.is_interrupted)]


ARIS = Make(("aris",), datagrams=ArisReader, is_pushed=lambda datagram: part_of(datagram) is not None, numbered=False)
