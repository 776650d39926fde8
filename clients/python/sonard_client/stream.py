"""Splits the byte stream of an Oculus sonar into messages, without sockets.

Bytes that cannot be a message are skipped one by one up to the next `53 4F`, and counted.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Iterator, Optional

from . import layouts
from .layouts import HEADER_BYTES, Header

_EXACT = {layouts.DUMMY: 0, layouts.USER_CONFIGURATION: 12, layouts.STATUS: 126}


@dataclass(frozen=True)
class Message:
    """A complete message; `data` includes the header."""
    header: Header
    data: bytes

    @property
    def type(self) -> int:
        return self.header.type

    @property
    def payload(self) -> bytes:
        return self.data[HEADER_BYTES:]


class MessageReader:
    """reader.feed(received); for message in reader: ..."""

    def __init__(self) -> None:
        self._waiting, self._at = bytearray(), 0  # bytes before _at are read or skipped
        self.skipped_bytes = 0
        self.last_fault = ""  # reason of the last skip

    def feed(self, received: bytes) -> None:
        del self._waiting[:self._at]
        self._at = 0
        self._waiting += received

    def __iter__(self) -> Iterator[Message]:
        """Yields the complete messages; an incomplete one remains for the next feed()."""
        while True:
            message = self._next()
            if message is None:
                return
            yield message

    def _next(self) -> Optional[Message]:
        while True:
            self._go_to_magic()
            if self._available() < HEADER_BYTES:
                return None
            header = layouts.read_header(self._peek(HEADER_BYTES))
            fault = _header_fault(header)
            if not fault and header.type == layouts.PING:
                head = layouts.ping_head_bytes(header.version)
                if self._available() < head:
                    return None
                fault = layouts.ping_fault(self._peek(head), header)
            if fault:
                self._skip(1, fault)
                continue
            size = HEADER_BYTES + header.payload_bytes
            if self._available() < size:
                return None
            data = self._peek(size)
            self._at += size
            return Message(header, data)

    def _available(self) -> int:
        return len(self._waiting) - self._at

    def _peek(self, count: int) -> bytes:
        return bytes(self._waiting[self._at:self._at + count])

    def _go_to_magic(self) -> None:
        """Skips to the next possible header: the magic, or a last byte that may be its first half."""
        found = self._waiting.find(layouts.MAGIC, self._at)
        if found < 0:
            found = len(self._waiting)
            if found > self._at and self._waiting[-1] == layouts.MAGIC[0]:
                found -= 1
        if found > self._at:
            self._skip(found - self._at, "bytes outside messages")

    def _skip(self, count: int, why: str) -> None:
        self._at += count
        self.skipped_bytes += count
        self.last_fault = why


def _header_fault(header: Header) -> str:
    """Returns the reason why a header is invalid, or an empty text. Limits the length before the reader waits for the payload."""
    if header.type == layouts.PING:
        if header.version > 2:
            return f"ping of version {header.version}"
        shortest = layouts.ping_head_bytes(header.version) - HEADER_BYTES
        if not shortest <= header.payload_bytes <= layouts.LONGEST_MESSAGE - HEADER_BYTES:
            return f"ping of {header.payload_bytes} bytes"
        return ""
    exact = _EXACT.get(header.type)
    if exact is not None and header.payload_bytes != exact:
        return f"message 0x{header.type:02x} of {header.payload_bytes} bytes"
    if header.payload_bytes > layouts.LONGEST_SMALL_MESSAGE:
        return f"message 0x{header.type:02x} of {header.payload_bytes} bytes"
    return ""
