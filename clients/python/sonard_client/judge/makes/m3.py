"""M3: packets of beam-formed samples, streamed to every client that connects. The samples are I and Q as sent, beam by beam."""
from __future__ import annotations

import struct
import zlib
from typing import Iterator

from ..truth import Make, TruePing, WholeMessages

_DIMENSIONS = struct.Struct("<I16xH")  # samples of a beam, beams
_BODY_SIZE_AT, _DIMENSIONS_AT, _NUMBER_AT, _SAMPLES_AT, _FOOT = 52, 108, 4264, 56 + 8512, 44
_MOST_BEAMS, _LONGEST = 1024, 1 << 25


def _u32(data: "bytes | bytearray", at: int) -> int:
    return int.from_bytes(data[at:at + 4], "little")


class M3Reader(WholeMessages):
    """The numbers of samples and beams determine the length of a packet; at least one of its two length fields must agree."""
    magic = b"\x00\x80" * 4 + b"\x02\x10"

    def length(self, begin: int) -> int:
        if len(self._data) - begin < _DIMENSIONS_AT + _DIMENSIONS.size:
            return -1
        samples, beams = _DIMENSIONS.unpack_from(self._data, begin + _DIMENSIONS_AT)
        size = 8 * samples * beams
        return _SAMPLES_AT + size + _FOOT if 0 < beams <= _MOST_BEAMS and 0 < size <= _LONGEST else 0

    def is_damaged(self, message: bytes) -> bool:
        body = len(message) - 56 - _FOOT
        return body not in (_u32(message, _BODY_SIZE_AT), _u32(message, len(message) - _FOOT)) or message.find(self.magic, 1) > 0

    def pings(self, message: bytes, begin: int) -> Iterator[TruePing]:
        samples, beams = _DIMENSIONS.unpack_from(message, _DIMENSIONS_AT)
        crc = zlib.crc32(memoryview(message)[_SAMPLES_AT:-_FOOT])
        yield TruePing(_u32(message, _NUMBER_AT), frozenset({crc}), samples, beams, begin, begin + len(message))


M3 = Make(("m3",), M3Reader, needs_request=False)
