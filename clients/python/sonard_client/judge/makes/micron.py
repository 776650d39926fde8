"""Micron: scan lines (mtHeadData). The samples are the payload of a line, or its bins alone, as sent."""
from __future__ import annotations

import zlib
from typing import Iterator

from ..truth import Make, TruePing, WholeMessages

_HEADER, _LONGEST, _UNCOUNTED = 13, 4096, 6
_HEAD_DATA, _HEAD_COMMAND, _SEND_DATA = 2, 19, 25
_HEAD, _SIZE_AT = 31, 29  # of the payload before its bins


class MicronReader(WholeMessages):
    magic = b"@"

    def length(self, begin: int) -> int:
        return self._length(self._data, begin)

    @staticmethod
    def _length(data: "bytes | bytearray", begin: int) -> int:
        head = data[begin:begin + 7]
        if len(head) < 7:
            return -1
        size = int.from_bytes(head[5:7], "little")
        return size + _UNCOUNTED if head[1:5] == b"%04X" % size and 8 <= size <= _LONGEST - _UNCOUNTED else 0

    def is_damaged(self, message: bytes) -> bool:
        at = 0
        while (at := message.find(self.magic, at + 1)) > 0:
            if self._length(message, at) > 0:  # another frame inside: this one lacks bytes
                return True
        return not message.endswith(b"\n")

    def pings(self, message: bytes, begin: int) -> Iterator[TruePing]:
        payload = message[_HEADER:-1]
        bins = payload[_HEAD:]
        if message[10] != _HEAD_DATA or len(payload) <= _HEAD or int.from_bytes(payload[_SIZE_AT:_HEAD], "little") != len(bins):
            return
        count = len(bins) if payload[5] & 1 else 2 * len(bins)  # 8 or 4 bits
        yield TruePing(self.unnumbered(), frozenset({zlib.crc32(payload), zlib.crc32(bins)}), count, 1, begin, begin + len(message))


def _is_request(sent: bytes) -> bool:
    return sent[:1] == b"@" and sent[10:11] in (bytes([_HEAD_COMMAND]), bytes([_SEND_DATA]))


MICRON = Make(("micron",), MicronReader, is_request=_is_request, numbered=False)
