"""The ping protocol: Ping1D, Ping360, S500, Omniscan, Surveyor. The samples are the payload of a whole message; of a Ping360 also
its data alone, which a ROS driver publishes."""
from __future__ import annotations

import struct
import zlib
from typing import Dict, Iterator, Mapping, Optional

from ..truth import LOOKS_DOWN, Make, TruePing, WholeMessages

# The messages whose content a driver publishes, and the offset of the ping number in their payload.
_NUMBER_AT: Dict[int, Optional[int]] = {1300: 8, 1308: 0, 1223: None, 2198: None, 2300: None, 2301: None, 3012: 20}
_DATA_AT = {2300: 14, 2301: 20}  # offset of the data of a Ping360 in the payload
_FRAME = struct.Struct("<2sHHBB")  # "BR", length of the payload, message, source, destination; a 16-bit sum follows the payload


class PingReader(WholeMessages):
    magic = b"BR"

    def length(self, begin: int) -> int:
        if len(self._data) - begin < _FRAME.size:
            return -1
        return _FRAME.size + int.from_bytes(self._data[begin + 2:begin + 4], "little") + 2

    def is_damaged(self, message: bytes) -> bool:
        return sum(message[:-2]) & 0xFFFF != int.from_bytes(message[-2:], "little")

    def pings(self, message: bytes, begin: int) -> Iterator[TruePing]:
        kind = int.from_bytes(message[4:6], "little")
        if kind not in _NUMBER_AT:
            return
        payload, at = message[_FRAME.size:-2], _NUMBER_AT[kind]
        has_number = at is not None and len(payload) >= at + 4
        number = int.from_bytes(payload[at:at + 4], "little") if at is not None and has_number else self.unnumbered()
        crcs = frozenset({zlib.crc32(payload)} | ({zlib.crc32(payload[_DATA_AT[kind]:])} if kind in _DATA_AT else set()))
        yield TruePing(number, crcs, 1, len(payload), begin, begin + len(message))


def _make(*profiles: str, numbered: bool, sonar: Mapping[str, object]) -> Make:
    return Make(profiles, PingReader, lambda: PingReader(is_stream=False), lambda sent: sent[:2] == b"BR", numbered=numbered, sonar=sonar)


NUMBERED = _make("ping1d", "s500", numbered=True, sonar={})
UNNUMBERED = _make("ping360", "omniscan", numbered=False, sonar={})
SURVEYOR = _make("surveyor", numbered=True, sonar=LOOKS_DOWN)  # its messages contain points of a floor
