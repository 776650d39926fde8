"""DVL: `velocity` lines of JSON. The samples are vx, vy, vz and altitude as 64-bit or 32-bit floats, little-endian."""
from __future__ import annotations

import json
import struct
import zlib
from typing import FrozenSet, List, Optional, Tuple

from ..truth import LOOKS_DOWN, Make, TruePing

_LONGEST = 1 << 16
_VALUES = ("vx", "vy", "vz", "altitude")


def _velocity(line: str) -> Optional[Tuple[FrozenSet[int], bool]]:
    """Returns CRCs of the values, and whether the values are valid; None for any other line."""
    try:
        report = json.loads(line)
        if not isinstance(report, dict) or report.get("type") != "velocity":
            return None
        values = [float(report[name]) for name in _VALUES]
        return frozenset(zlib.crc32(struct.pack(form, *values)) for form in ("<4d", "<4f")), report["velocity_valid"] is True
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
        return None


class DvlReader:
    """A driver may omit lines without a valid velocity, and lines that follow other bytes."""

    def __init__(self) -> None:
        self._rest, self._base, self._count = b"", 0, 0

    def feed(self, received: bytes) -> List[TruePing]:
        *lines, self._rest = (self._rest + received).split(b"\n")
        found: List[TruePing] = []
        for line in lines:
            end = self._base + len(line) + 1
            text = line.decode("utf-8", "replace")
            at = text.find("{")
            while at >= 0:
                velocity = _velocity(text[at:])
                if velocity is not None:
                    self._count -= 1
                    found.append(TruePing(self._count, velocity[0], 1, 1, self._base, end, velocity[1] and at == 0))
                    break
                at = text.find("{", at + 1)
            self._base = end
        if len(self._rest) > _LONGEST:
            self._base, self._rest = self._base + len(self._rest), b""
        return found


DVL = Make(("dvl",), DvlReader, needs_request=False, numbered=False, sonar=LOOKS_DOWN)
