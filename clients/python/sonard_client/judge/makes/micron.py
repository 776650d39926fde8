"""Micron: scan lines (mtHeadData). The samples are the payload of a line, or its bins alone, as sent."""
from __future__ import annotations

import zlib
from typing import Iterator, Tuple

from ..truth import Make, TruePing, WholeMessages

_HEADER, _LONGEST, _UNCOUNTED = 13, 4096, 6
_HEAD_DATA, _HEAD_COMMAND, _SEND_DATA = 2, 19, 25
_HEAD, _SIZE_AT = 31, 29  # of the payload before its bins


def _lengths(data: "bytes | bytearray", begin: int) -> Tuple[bytes, bytes]:
    """Returns the two lengths of a frame, as hexadecimal digits."""
    return bytes(data[begin + 1:begin + 5]), b"%04X" % int.from_bytes(data[begin + 5:begin + 7], "little")


def _size_by_bins(data: "bytes | bytearray", begin: int) -> int:
    at = begin + _HEADER + _SIZE_AT
    return _HEADER + _HEAD + int.from_bytes(data[at:at + 2], "little") + 1


class MicronReader(WholeMessages):
    """Of the two lengths of a frame and the number of bins, two must agree. A driver may omit a line in which one differs."""
    magic = b"@"

    def length(self, begin: int) -> int:
        if len(self._data) - begin < _HEADER + _HEAD:
            return -1
        digits, length = _lengths(self._data, begin)
        size = _size_by_bins(self._data, begin)
        if digits == length:
            size = int.from_bytes(self._data[begin + 5:begin + 7], "little") + _UNCOUNTED
        elif b"%04X" % (size - _UNCOUNTED) not in (digits, length):
            return 0
        return size if self._data[begin + 10] == _HEAD_DATA and _HEADER + _HEAD + 1 < size <= _LONGEST else 0

    def is_damaged(self, message: bytes) -> bool:
        at = 0
        while (at := message.find(self.magic, at + 1)) > 0:
            digits, length = _lengths(message, at)
            if digits == length:  # another frame inside means that this one lacks bytes
                return True
        return not message.endswith(b"\n")

    def pings(self, message: bytes, begin: int) -> Iterator[TruePing]:
        payload = message[_HEADER:-1]
        bins = payload[_HEAD:]
        digits, length = _lengths(message, 0)
        count = len(bins) if payload[5] & 1 else 2 * len(bins)  # 8 or 4 bits
        yield TruePing(self.unnumbered(), frozenset({zlib.crc32(payload), zlib.crc32(bins)}), count, 1, begin, begin + len(message),
                       digits == length and _size_by_bins(message, 0) == len(message))


def _is_request(sent: bytes) -> bool:
    return sent[:1] == b"@" and sent[10:11] in (bytes([_HEAD_COMMAND]), bytes([_SEND_DATA]))


MICRON = Make(("micron",), MicronReader, is_request=_is_request, numbered=False)
