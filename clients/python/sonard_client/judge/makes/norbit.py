"""Norbit: packets of bathymetry and of the water column, each on its own port. Accepted samples: the beams of a bathymetry as sent; the
pixels of the water column are optional."""
from __future__ import annotations

import zlib
from typing import Iterator

from ..truth import Make, TruePing, WholeMessages

_HEADER, _TYPE_AT, _SIZE_AT, _CRC_AT, _BEAMS_AT = 24, 4, 8, 20, 32
_16_BITS = (2, 3)  # types of pixels: uint16, int16
_BATHYMETRY, _COLUMN = 1, 2
_BATHYMETRY_FRONT, _BATHYMETRY_NUMBER_AT, _BEAM = 88, 36, 20
_COLUMN_FRONT, _ROWS_AT, _PIXELS_AT, _COLUMN_NUMBER_AT, _PIXEL, _DIRECTION = 168, 36, 48, 108, 2, 4
_LONGEST = 1 << 22


def _u32(data: "bytes | bytearray", at: int) -> int:
    return int.from_bytes(data[at:at + 4], "little")


def _size_by_counts(message: bytes) -> int:
    beams = _u32(message, _BEAMS_AT)
    if _u32(message, _TYPE_AT) == _BATHYMETRY:
        return _HEADER + _BATHYMETRY_FRONT + _BEAM * beams
    return _HEADER + _COLUMN_FRONT + beams * (_PIXEL * _u32(message, _ROWS_AT) + _DIRECTION)


class NorbitReader(WholeMessages):
    magic = b"\xef\xbe\xad\xde"

    def length(self, begin: int) -> int:
        if len(self._data) - begin < _HEADER:
            return -1
        front = {_BATHYMETRY: _BATHYMETRY_FRONT, _COLUMN: _COLUMN_FRONT}.get(_u32(self._data, begin + _TYPE_AT))
        size = _u32(self._data, begin + _SIZE_AT)
        return size if front is not None and _HEADER + front < size <= _LONGEST else 0

    def is_damaged(self, message: bytes) -> bool:
        return _size_by_counts(message) != len(message) or zlib.crc32(memoryview(message)[_HEADER:]) != _u32(message, _CRC_AT)

    def pings(self, message: bytes, begin: int) -> Iterator[TruePing]:
        beams, end = _u32(message, _BEAMS_AT), begin + len(message)
        if _u32(message, _TYPE_AT) == _BATHYMETRY:
            crc = zlib.crc32(memoryview(message)[_HEADER + _BATHYMETRY_FRONT:])
            yield TruePing(_u32(message, _BATHYMETRY_NUMBER_AT), frozenset({crc}), 1, beams, begin, end)
        elif _u32(message, _PIXELS_AT) in _16_BITS:
            crc = zlib.crc32(memoryview(message)[_HEADER + _COLUMN_FRONT:-_DIRECTION * beams])
            yield TruePing(_u32(message, _COLUMN_NUMBER_AT), frozenset({crc}), _u32(message, _ROWS_AT), beams, begin, end, False)


NORBIT = Make(("norbit",), NorbitReader, is_request=lambda sent: sent.startswith(b"set_"))
