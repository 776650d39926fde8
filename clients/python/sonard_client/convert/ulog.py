"""Reads logs of PX4 (.ulg): attitude with local or global position, the simulator's ground truth first.

Written from PX4's description of ULog. A message has a size of two bytes, its type and content; F describes formats, A gives a
format a number, D is data. A truncated log is read up to its last complete message.
"""
from __future__ import annotations

import math
import pathlib
import re
import struct
from typing import Dict, List, NamedTuple, Optional, Tuple, Union

from ..geodesy import Geodetic
from ..rotations import Quaternion, unit
from .track import ConvertError, Place2, Source, Stream, Track, Warn, chosen, depth_source, track_of

MAGIC = b"ULog\x01\x12\x35"
HEAD_BYTES = 16
_KINDS = {"int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i", "uint32_t": "I", "int64_t": "q",
          "uint64_t": "Q", "float": "f", "double": "d", "bool": "?", "char": "c"}
TRUTH = "_groundtruth"
ATTITUDE, LOCAL, GLOBAL = "vehicle_attitude", "vehicle_local_position", "vehicle_global_position"
WANTED = tuple(name + more for more in ("", TRUTH) for name in (ATTITUDE, LOCAL, GLOBAL))
LONGEST_FORMAT = 65535  # bytes of one message
_FIELD = re.compile(r"([a-z0-9_]+)(?:\[([0-9]{1,5})\])? ([A-Za-z0-9_]+)")
_REAL, _FLAG = ("float", "double"), ("bool", "uint8_t")
# The fields that are read: their types, and how many values they have.
_READ: Dict[str, Tuple[Tuple[str, ...], int]] = {
    **dict.fromkeys(("timestamp", "timestamp_sample"), (("uint64_t",), 1)), "q": (_REAL, 4),
    **dict.fromkeys(("x", "y", "z", "lat", "lon", "alt", "ref_lat", "ref_lon", "ref_alt"), (_REAL, 1)),
    **dict.fromkeys(("xy_valid", "z_valid", "xy_global", "z_global", "lat_lon_valid", "alt_valid"), (_FLAG, 1))}


class Layout(NamedTuple):
    body: struct.Struct  # up to the last field that is read; the padding at a format's end is not logged
    fields: Dict[str, Tuple[int, int]]  # by name: its first value and how many


def _layout(text: str) -> Union[Layout, str]:
    """The fields of _READ in a format such as "uint64_t timestamp;float[4] q;", or why it cannot be read."""
    codes, fields, at, size, read = "<", {}, 0, 0, 1
    for part in filter(None, text.split(";")):
        match = _FIELD.fullmatch(part)
        if match is None or match[1] not in _KINDS or match[2] is not None and int(match[2]) == 0:
            return f"{part[:80]!r} is not a field of a known type"
        number, name, code = int(match[2] or 1), match[3], _KINDS[match[1]]
        size += number * struct.calcsize("<" + code)
        if size > LONGEST_FORMAT:
            return f"it is longer than a message, {LONGEST_FORMAT} bytes"
        if name not in _READ:
            codes += f"{number * struct.calcsize('<' + code)}x"
            continue
        kinds, wanted = _READ[name]
        if name in fields:
            return f"{name} occurs twice"
        if match[1] not in kinds or number != wanted:
            return f"{name} is {part[:-len(name) - 1]}, not {' or '.join(kinds)}" + (f"[{wanted}]" if wanted > 1 else "")
        codes += f"{number}{code}"
        fields[name] = at, number
        at += number
        read = len(codes)
    if "timestamp" not in fields:
        return "it has no timestamp"
    return Layout(struct.Struct(codes[:read]), fields)


class _Log:
    def __init__(self, data: bytes, name: str, warn: Warn) -> None:
        self.attitudes: Dict[str, Stream[Quaternion]] = {}
        self.positions: "Dict[str, Stream]" = {}
        self.depths: Stream[float] = []  # down [m], of local positions, whose x and y may be invalid
        self.origin: Optional[Geodetic] = None
        self._layouts: Dict[str, Layout] = {}
        self._short: Dict[str, int] = {}  # messages that are shorter than their format
        self._named: Dict[int, str] = {}  # subscriptions of the first instance
        at = HEAD_BYTES
        while at + 3 <= len(data):
            size, kind = struct.unpack_from("<HB", data, at)
            if at + 3 + size > len(data):
                warn(f"ends within a message, at byte {at}; all messages before it were read")
                break
            self._take(chr(kind), data[at + 3:at + 3 + size], at, warn)
            at += 3 + size
        for label, count in sorted(self._short.items()):
            warn(f"messages of {label} omitted because they are shorter than their format: {count}")

    def _take(self, kind: str, content: bytes, at: int, warn: Warn) -> None:
        if kind == "F":
            name, _, fields = content.decode("latin-1").partition(":")
            if name in WANTED:
                layout = _layout(fields)
                if isinstance(layout, Layout):
                    self._layouts[name] = layout
                else:
                    self._layouts.pop(name, None)
                    warn(f"at byte {at}: {name} is omitted: its format cannot be read: {layout}")
        elif kind == "A" and len(content) > 3 and content[0] == 0:
            self._named[int.from_bytes(content[1:3], "little")] = content[3:].decode("latin-1")
        elif kind == "D" and len(content) > 2:
            name = self._named.get(int.from_bytes(content[:2], "little"), "")
            known = self._layouts.get(name)
            if known is not None and len(content) < 2 + known.body.size:
                self._short[name] = self._short.get(name, 0) + 1
            elif known is not None:
                values = known.body.unpack_from(content, 2)
                self._add(name, {label: values[first] if number == 1 else values[first:first + number]
                                 for label, (first, number) in known.fields.items()})

    def _add(self, name: str, fields: Dict) -> None:
        t = 1e-6 * (fields.get("timestamp_sample") or fields.get("timestamp") or 0)
        if name.startswith(ATTITUDE):
            q = fields.get("q")
            if isinstance(q, tuple) and len(q) == 4 and abs(sum(p * p for p in q) - 1) < 1e-3:
                self.attitudes.setdefault(name, []).append((t, unit(q)))
        elif name.startswith(LOCAL):
            place = tuple(fields.get(axis, math.nan) for axis in "xyz")
            z_valid = fields.get("z_valid", True) and math.isfinite(place[2])
            if z_valid and name == LOCAL:
                self.depths.append((t, place[2]))
            if z_valid and fields.get("xy_valid", True) and all(map(math.isfinite, place)):
                self.positions.setdefault(name, []).append((t, place))
            if self.origin is None and fields.get("xy_global") and fields.get("z_global"):
                there = Geodetic(fields.get("ref_lat", 0.0), fields.get("ref_lon", 0.0), fields.get("ref_alt", 0.0))
                self.origin = there if there.is_fix else None
        else:
            there = Geodetic(fields.get("lat", 0.0), fields.get("lon", 0.0), fields.get("alt", 0.0))
            if there.is_fix and fields.get("lat_lon_valid", True) and fields.get("alt_valid", True):
                self.positions.setdefault(name, []).append((t, there))

    def sources(self) -> List[Source]:
        return [Source(f"{ATTITUDE}{more}+{position}{more}", self.attitudes.get(ATTITUDE + more, []),
                       self.positions.get(position + more, [])) for more in (TRUTH, "") for position in (LOCAL, GLOBAL)] + \
            [depth_source(ATTITUDE, self.attitudes.get(ATTITUDE, []), self.depths)]


def read_ulog(path: pathlib.Path, warn: Warn, source: Optional[str] = None, origin: Optional[Geodetic] = None,
              at: Optional[Place2] = None) -> Track:
    """Reads the vehicle's track: NED_FRD, seconds since the autopilot started."""
    data = path.read_bytes()
    if not data.startswith(MAGIC):
        raise ConvertError(f"{path}: at byte 0: not a log of PX4: it does not begin with ULog")
    log = _Log(data, str(path), warn)
    wanted = chosen(log.sources(), source, str(path))
    return track_of(wanted, str(path), warn, origin, log.origin if wanted.name == f"{ATTITUDE}+{LOCAL}" else None, at)
