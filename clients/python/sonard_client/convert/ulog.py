"""Reads logs of PX4 (.ulg): attitude with local or global position, the simulator's ground truth first.

The code follows PX4's description of ULog. A message has a size of two bytes, its type and content; F describes formats, A gives
a number to a format, D is data. A truncated log is read up to its last complete message.
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
# The fields that are read: their types and numbers of values.
_READ: Dict[str, Tuple[Tuple[str, ...], int]] = {
    **dict.fromkeys(("timestamp", "timestamp_sample"), (("uint64_t",), 1)), "q": (_REAL, 4),
    **dict.fromkeys(("x", "y", "z", "lat", "lon", "alt", "ref_lat", "ref_lon", "ref_alt"), (_REAL, 1)),
    **dict.fromkeys(("xy_valid", "z_valid", "xy_global", "z_global", "lat_lon_valid", "alt_valid"), (_FLAG, 1))}


Instance = Tuple[str, int]  # of a message: its name and number


class Layout(NamedTuple):
    body: struct.Struct  # up to the last field that is read; the padding at a format's end is not logged
    fields: Dict[str, Tuple[int, int]]  # by name: index of the first value, number of values


def _layout(text: str) -> Union[Layout, str]:
    """Returns the fields of _READ in a format such as "uint64_t timestamp;float[4] q;", or the reason why it cannot be read."""
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
        # By message and instance; the lowest instance with values is used.
        self.attitudes: Dict[Instance, Stream[Quaternion]] = {}
        self.positions: "Dict[Instance, Stream]" = {}
        self.depths: Dict[Instance, Stream[float]] = {}  # down [m], of local positions, whose x and y may be invalid
        self._origins: Dict[Instance, Geodetic] = {}
        self._layouts: Dict[str, Layout] = {}
        self._short: Dict[str, int] = {}  # messages that are shorter than their format
        self._subscribed: Dict[int, Instance] = {}
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
        elif kind == "A" and len(content) > 3:
            self._subscribed[int.from_bytes(content[1:3], "little")] = content[3:].decode("latin-1"), content[0]
        elif kind == "D" and len(content) > 2:
            instance = name, _ = self._subscribed.get(int.from_bytes(content[:2], "little"), ("", 0))
            known = self._layouts.get(name)
            if known is not None and len(content) < 2 + known.body.size:
                self._short[name] = self._short.get(name, 0) + 1
            elif known is not None:
                values = known.body.unpack_from(content, 2)
                self._add(instance, {label: values[first] if number == 1 else values[first:first + number]
                                     for label, (first, number) in known.fields.items()})

    def _add(self, instance: Instance, fields: Dict) -> None:
        name = instance[0]
        t = 1e-6 * (fields.get("timestamp_sample") or fields.get("timestamp") or 0)
        if name.startswith(ATTITUDE):
            q = fields.get("q")
            if isinstance(q, tuple) and len(q) == 4 and abs(sum(p * p for p in q) - 1) < 1e-3:
                self.attitudes.setdefault(instance, []).append((t, unit(q)))
        elif name.startswith(LOCAL):
            place = tuple(fields.get(axis, math.nan) for axis in "xyz")
            z_valid = fields.get("z_valid", True) and math.isfinite(place[2])
            if z_valid and name == LOCAL:
                self.depths.setdefault(instance, []).append((t, place[2]))
            if z_valid and fields.get("xy_valid", True) and all(map(math.isfinite, place)):
                self.positions.setdefault(instance, []).append((t, place))
            if instance not in self._origins and fields.get("xy_global") and fields.get("z_global"):
                there = Geodetic(fields.get("ref_lat", 0.0), fields.get("ref_lon", 0.0), fields.get("ref_alt", 0.0))
                if there.is_fix:
                    self._origins[instance] = there
        else:
            there = Geodetic(fields.get("lat", 0.0), fields.get("lon", 0.0), fields.get("alt", 0.0))
            if there.is_fix and fields.get("lat_lon_valid", True) and fields.get("alt_valid", True):
                self.positions.setdefault(instance, []).append((t, there))

    @property
    def origin(self) -> Optional[Geodetic]:
        return self._origins.get(_lowest(self.positions, LOCAL))

    def sources(self) -> List[Source]:
        def attitudes(name: str) -> Stream[Quaternion]:
            return self.attitudes.get(_lowest(self.attitudes, name), [])

        return [Source(f"{ATTITUDE}{more}+{position}{more}", attitudes(ATTITUDE + more),
                       self.positions.get(_lowest(self.positions, position + more), []))
                for more in (TRUTH, "") for position in (LOCAL, GLOBAL)] + \
            [depth_source(ATTITUDE, attitudes(ATTITUDE), self.depths.get(_lowest(self.depths, LOCAL), []))]

    def further_instances(self, source: Source) -> List[str]:
        """Returns the instances that the source uses, except the first ones."""
        used = [_lowest(values, name) for values, name in
                [(self.attitudes, name) for name in source.name.split("+")] +
                [(self.depths, LOCAL)] * source.held + [(self.positions, name) for name in source.name.split("+")]]
        return [f"{name} {number}" for name, number in used if number > 0]


def _lowest(values: Dict[Instance, Stream], name: str) -> Instance:
    return min((instance for instance in values if instance[0] == name), default=(name, 0))


def read_ulog(path: pathlib.Path, warn: Warn, source: Optional[str] = None, origin: Optional[Geodetic] = None,
              at: Optional[Place2] = None) -> Track:
    """Reads the vehicle's track: NED_FRD, seconds since the autopilot started."""
    data = path.read_bytes()
    if not data.startswith(MAGIC):
        raise ConvertError(f"{path}: at byte 0: not a log of PX4: it does not begin with ULog")
    log = _Log(data, str(path), warn)
    wanted = chosen(log.sources(), source, str(path), warn)
    further = log.further_instances(wanted)
    if further:
        warn(f"without values of the first instance; used: {', '.join(further)}")
    return track_of(wanted, str(path), warn, origin, log.origin if wanted.name == f"{ATTITUDE}+{LOCAL}" else None, at)
