"""The stream of an Oculus sonar cut into messages: bytes go in in any pieces, whole messages come out.

It has no socket. What cannot be a message is skipped byte by byte to the next `53 4F`, and counted.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Iterator

from . import layouts
from .layouts import HEADER_BYTES, Header

_EXACT = {layouts.DUMMY: 0, layouts.USER_CONFIGURATION: 12, layouts.STATUS: 126}


@dataclass(frozen=True)
class Message:
    """One whole message; `data` is all of it, header included."""
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
        self._waiting = bytearray()
        self.skipped_bytes = 0
        self.last_fault = ""  # of what was skipped

    def feed(self, received: bytes) -> None:
        self._waiting += received

    def __iter__(self) -> Iterator[Message]:
        """The whole messages that are there; the rest waits for the next feed()."""
        at = 0
        try:
            while True:
                at = self._next_magic(at)
                if len(self._waiting) - at < HEADER_BYTES:
                    return
                header = layouts.read_header(self._waiting[at:at + HEADER_BYTES])
                fault = _header_fault(header)
                if not fault and header.type == layouts.PING:
                    head = layouts.ping_head_bytes(header.version)
                    if len(self._waiting) - at < head:
                        return
                    fault = layouts.ping_fault(self._waiting[at:at + head], header)
                if fault:
                    self._skip(1, fault)
                    at += 1
                    continue
                end = at + HEADER_BYTES + header.payload_bytes
                if len(self._waiting) < end:
                    return
                data, at = bytes(self._waiting[at:end]), end
                yield Message(header, data)
        finally:
            del self._waiting[:at]

    def _next_magic(self, at: int) -> int:
        """Where the next header may begin: at the magic, or at a last byte that may be half of one."""
        found = self._waiting.find(layouts.MAGIC, at)
        if found < 0:
            found = len(self._waiting)
            if found > at and self._waiting[-1] == layouts.MAGIC[0]:
                found -= 1
        if found > at:
            self._skip(found - at, "bytes that are no message")
        return found

    def _skip(self, count: int, why: str) -> None:
        self.skipped_bytes += count
        self.last_fault = why


def _header_fault(header: Header) -> str:
    """Why no message has this header. Lengths are limited before anything waits for so many bytes."""
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
