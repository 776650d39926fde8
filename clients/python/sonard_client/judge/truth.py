"""Finds the intact pings among the bytes that a sonar sends under faults. A driver may publish only these. Each make has a row
in makes/__init__.py and a file beside it."""
from __future__ import annotations

from typing import Callable, FrozenSet, Iterator, List, Mapping, NamedTuple, Optional, Protocol, Tuple


class TruePing(NamedTuple):
    """A ping found in a stream. crcs: CRC-32 of its samples in each form in which a driver may publish them."""
    number: int
    crcs: FrozenSet[int]
    rows: int
    beams: int
    begin: int       # offset in the stream, or in all datagrams of a flow
    end: int
    needed: bool = True  # False: a driver may omit the ping


class Reader(Protocol):
    """Finds the pings in one connection. feed(): the next bytes of a stream, or one datagram; returns the pings that became
    complete."""

    def feed(self, received: bytes) -> List[TruePing]: ...


class NoPings:
    """Reads a transport over which a make sends no pings."""

    def feed(self, received: bytes) -> List[TruePing]:
        return []


class Make(NamedTuple):
    """The rules of a make of sonar that the judge needs."""
    profiles: Tuple[str, ...]                    # prefixes of its product names
    stream: Callable[[], Reader] = NoPings       # reads a TCP connection
    datagrams: Callable[[], Reader] = NoPings    # reads a flow of datagrams
    is_request: Callable[[bytes], bool] = bool   # whether bytes of a driver are settings or a request for pings
    needs_request: bool = True                   # False: the sonar pings as soon as a client connects
    is_pushed: Optional[Callable[[bytes], bool]] = None  # whether an unrequested datagram belongs to a ping
    numbered: bool = True                        # False: its pings have no numbers, or other numbers than the journal's
    sonar: Mapping[str, object] = {}             # additional keys of the sonar's configuration


LOOKS_DOWN = {"mount": {"frame": "FRD", "xyz_m": [0, 0, 0], "rpy_deg": [0, -90, 0]}}  # Make.sonar of sonars that see only a floor


class WholeMessages:
    """Finds whole messages at any offset, with any bytes between them. An incomplete message does not hide later ones.

    is_stream: False drops what a datagram leaves incomplete."""
    magic = b""

    def __init__(self, is_stream: bool = True) -> None:
        self._data = bytearray()
        self._base = 0             # offset of _data[0] in the stream
        self._open: List[int] = []  # offsets in _data at which incomplete messages begin
        self._looked = 0           # offset in _data at which the search for further messages continues
        self._unnumbered = 0
        self._is_stream = is_stream

    def length(self, begin: int) -> int:
        """Returns the number of bytes of the message there; 0 if there is no message, -1 if more bytes are needed to decide."""
        raise NotImplementedError

    def pings(self, message: bytes, begin: int) -> Iterator[TruePing]:
        """Yields the pings in a whole message. begin: its offset in the stream."""
        raise NotImplementedError

    def is_damaged(self, message: bytes) -> bool:
        """Returns whether a message of the right length is invalid."""
        return False

    def feed(self, received: bytes) -> List[TruePing]:
        self._data += received
        found: List[TruePing] = []
        still_open: List[int] = []
        done = 0  # no message begins before this offset
        for begin in self._begins():
            if begin < done:
                continue
            size = self.length(begin)
            if size == 0:
                continue
            if size < 0 or begin + size > len(self._data):
                still_open.append(begin)
                continue
            message = bytes(self._data[begin:begin + size])
            if not self.is_damaged(message):
                found.extend(self.pings(message, self._base + begin))
                still_open, done = [], begin + size  # earlier messages lack bytes
        looked = max(done, len(self._data) - len(self.magic) + 1)
        kept = still_open[0] if still_open else min(looked, len(self._data))
        if not self._is_stream:
            still_open, kept = [], len(self._data)
        del self._data[:kept]
        self._base += kept
        self._open, self._looked = [begin - kept for begin in still_open], max(looked - kept, 0)
        return found

    def unnumbered(self) -> int:
        """Returns a number for a ping that has none: -1, -2 and so on, which no driver prints."""
        self._unnumbered -= 1
        return self._unnumbered

    def _begins(self) -> Iterator[int]:
        yield from self._open
        at = self._looked
        while (at := self._data.find(self.magic, at)) >= 0:
            yield at
            at += 1
