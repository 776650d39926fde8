"""BlueView over sonard's own link (BVE1). Accepted samples: 16 bits, little-endian, beam by beam as sent, or row by row."""
from __future__ import annotations

import array
import struct
import zlib
from typing import Iterator, Optional

from ..truth import Make, TruePing, WholeMessages

_HEADER = struct.Struct("<4sHHII")
_PING, _SUBSCRIBE, _PING_DATA, _LONGEST = 4, 5, 0x8004, 64 << 20
_NUMBER_AT, _FORM_AT, _NAVIGATION_AT = 4, 44, 52  # in the payload
_FORM = struct.Struct("<HHBBH")  # beams, bins, format, compression, fields of navigation data
_NAVIGATION_BYTES = (8, 8, 8, 4, 4, 4, 4, 4, 4, 4)  # of each field; the next one is a text


def _samples(payload: bytes, navigation: int, is_deflated: int, size: int) -> Optional[bytes]:
    """Returns the samples if their size is right; else None. The size field itself may be wrong."""
    at = _NAVIGATION_AT + sum(wide for bit, wide in enumerate(_NAVIGATION_BYTES) if navigation >> bit & 1)
    if navigation >> len(_NAVIGATION_BYTES) & 1:
        at += 2 + int.from_bytes(payload[at:at + 2], "little")
    samples = payload[at + 4:]
    if is_deflated:
        try:
            samples = zlib.decompressobj().decompress(samples, size + 1)
        except zlib.error:
            return None
    return samples if len(samples) == size else None


class BlueViewReader(WholeMessages):
    magic = b"BVE1"

    def length(self, begin: int) -> int:
        if len(self._data) - begin < _HEADER.size:
            return -1
        size = _HEADER.unpack_from(self._data, begin)[4]
        return _HEADER.size + size if size <= _LONGEST else 0

    def is_damaged(self, message: bytes) -> bool:
        return message.find(self.magic, 1) > 0  # another frame inside means that this one lacks bytes

    def pings(self, message: bytes, begin: int) -> Iterator[TruePing]:
        payload = message[_HEADER.size:]
        if _HEADER.unpack_from(message)[1] != _PING_DATA or len(payload) < _NAVIGATION_AT:
            return
        beams, bins, form, is_deflated, navigation = _FORM.unpack_from(payload, _FORM_AT)
        samples = _samples(payload, navigation, is_deflated, 2 * beams * bins)
        if form != 1 or not samples:
            return
        values, rows = array.array("H", samples), array.array("H")
        for row in range(bins):
            rows.extend(values[row::bins])
        number = int.from_bytes(payload[_NUMBER_AT:_NUMBER_AT + 4], "little")
        yield TruePing(number, frozenset({zlib.crc32(samples), zlib.crc32(rows.tobytes())}), bins, beams, begin, begin + len(message))


def _is_request(sent: bytes) -> bool:
    return sent[:4] == BlueViewReader.magic and int.from_bytes(sent[4:6], "little") in (_PING, _SUBSCRIBE)


BLUEVIEW = Make(("blueview",), BlueViewReader, is_request=_is_request)
