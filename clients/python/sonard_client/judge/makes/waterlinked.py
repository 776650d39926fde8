"""Sonar 3D-15: images as datagrams. The samples are the ranges of a RangeImage, little-endian: its 32-bit numbers, or metres as
32-bit floats; a driver may also publish the bytes of the strengths."""
from __future__ import annotations

import array
import struct
import sys
import zlib
from typing import List, Optional

from ..truth import Make, TruePing
from . import protobuf

_LARGEST = 1 << 20  # content of a datagram, unpacked


def unpacked(block: bytes) -> bytes:
    """Returns the content of a block of Snappy. Raises ValueError."""
    size, at = protobuf.varint(block, 0)
    out = bytearray()
    while at < len(block) and len(out) < size <= _LARGEST:
        tag, at = block[at], at + 1
        kind = tag & 3
        more = max(0, (tag >> 2) - 59) if kind == 0 else (1, 2, 4)[kind - 1]  # bytes of a length or an offset
        number, at = int.from_bytes(block[at:at + more], "little"), at + more
        if kind == 0:
            length = (number if more else tag >> 2) + 1
            out += block[at:at + length]
            at += length
            continue
        back, length = (number | (tag >> 5) << 8, (tag >> 2 & 7) + 4) if kind == 1 else (number, (tag >> 2) + 1)
        if not 0 < back <= len(out):
            raise ValueError("a copy of bytes that are not there")
        begin = len(out) - back
        piece = bytes(out[begin:begin + length])
        out += (piece * (length // len(piece) + 1))[:length]  # a copy may overlap its output
    if len(out) != size or at != len(block):
        raise ValueError("another size than announced")
    return bytes(out)


def content_of(datagram: bytes) -> Optional[bytes]:
    """Returns the packet in a datagram; None if it is damaged or something else."""
    if datagram[:4] not in (b"RIP1", b"RIP2") or len(datagram) < 12 or int.from_bytes(datagram[4:8], "little") != len(datagram) or \
            zlib.crc32(datagram[:-4]) != int.from_bytes(datagram[-4:], "little"):
        return None
    try:
        return unpacked(datagram[8:-4]) if datagram[3:4] == b"2" else datagram[8:-4]
    except ValueError:
        return None


def _little_endian(numbers: "array.array[int] | array.array[float]") -> bytes:
    if sys.byteorder == "big":
        numbers.byteswap()
    return numbers.tobytes()


class WaterlinkedReader:
    def __init__(self) -> None:
        self._at = 0

    def feed(self, datagram: bytes) -> List[TruePing]:
        begin, self._at = self._at, self._at + len(datagram)
        content = content_of(datagram)
        try:
            kind = protobuf.fields(protobuf.block(protobuf.fields(content or b""), 1))
            name = protobuf.block(kind, 1).rpartition(b".")[2]
            image = protobuf.fields(protobuf.block(kind, 2))
            number = protobuf.number(protobuf.fields(protobuf.block(image, 1)), 2)
            if name == b"RangeImage":
                width, height = protobuf.number(image, 5), protobuf.number(image, 6)
                ranges = array.array("I", protobuf.varints(protobuf.block(image, 10)))
                scale_m, = struct.unpack("<f", protobuf.block(image, 9) or bytes(4))
                metres = array.array("f", (n * scale_m for n in ranges))
                samples, count = [_little_endian(form) for form in (ranges, metres)][:2 if scale_m else 1], len(ranges)
            elif name == b"BitmapImageGreyscale8" and protobuf.number(image, 5) == 0:
                width, height = protobuf.number(image, 6), protobuf.number(image, 7)
                samples = [protobuf.block(image, 10)]
                count = len(samples[0])
            else:
                return []
        except (ValueError, OverflowError, struct.error):
            return []
        if not count or count != width * height:
            return []
        return [TruePing(number, frozenset(map(zlib.crc32, samples)), height, width, begin, self._at, name == b"RangeImage")]


WATERLINKED = Make(("waterlinked",), datagrams=WaterlinkedReader, is_request=lambda sent: sent.startswith(b"POST "),
                   is_pushed=lambda datagram: datagram[:3] == b"RIP")
