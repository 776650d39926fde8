"""Reads ArduPilot's dataflash logs (.bin). Every message starts with A3 95 and its type; FMT messages, type 128, describe the
others.

The format characters are those of ArduPilot's AP_Logger. Layouts are read from the log, so logs of any version are readable.
"""
from __future__ import annotations

import math
import pathlib
import struct
from typing import Dict, Iterator, List, NamedTuple, Optional, Tuple

from ..geodesy import Geodetic
from ..rotations import Quaternion, quaternion_from_rpy, unit
from .track import ConvertError, Place2, Source, Stream, Track, Warn, chosen, depth_source, track_of

MAGIC = b"\xa3\x95"
FMT = 128
_FMT = struct.Struct("<BB4s16s64s")  # type, length, name, format, labels
# Format characters: struct's format and the scale factor; 0 = not a number, left out.
_KINDS: Dict[str, Tuple[str, float]] = {
    "a": ("64s", 0), "b": ("b", 1), "B": ("B", 1), "h": ("h", 1), "H": ("H", 1), "i": ("i", 1), "I": ("I", 1), "f": ("f", 1),
    "d": ("d", 1), "g": ("e", 1), "n": ("4s", 0), "N": ("16s", 0), "Z": ("64s", 0), "c": ("h", 0.01), "C": ("H", 0.01),
    "e": ("i", 0.01), "E": ("I", 0.01), "L": ("i", 1e-7), "M": ("B", 1), "q": ("q", 1), "Q": ("Q", 1)}
# In order of preference: the simulator's ground truth, then estimates.
FULL = ("SIM", "XKF1", "NKF1", "EKF1", "AHR2")
LOCAL = ("XKF1", "NKF1", "EKF1")  # metres from the filter's origin
# For logs without positions: messages and fields with the height above home, best first. BARO:1: ArduSub's outer pressure sensor.
HEIGHTS = (("POS", "RelHomeAlt"), ("CTUN", "Alt"), ("BARO:1", "Alt"), ("BARO", "Alt"))
STATES = {"XKF4": "XKF1", "NKF4": "NKF1"}  # message whose field PI is the core in use: pose message of the same filter
WANTED = FULL + ("ATT", "POS", "GPS", "ORGN", "CTUN", "BARO") + tuple(STATES)
EKF_ORIGIN = 0  # type of an ORGN message; 1 is the home of the attitude system
FIX_2D = 2


class Format(NamedTuple):
    name: str
    length: int
    body: Optional[struct.Struct]  # None if the description is inconsistent or has unknown characters; also for FMT
    labels: Tuple[str, ...]
    factors: Tuple[float, ...]


def _text(raw: bytes) -> str:
    return raw.split(b"\0")[0].decode("latin-1")


def _format(data: bytes, at: int) -> "Tuple[int, Format]":
    kind, length, name, characters, labels = _FMT.unpack_from(data, at + 3)
    known = [_KINDS.get(c) for c in _text(characters)]
    names = tuple(_text(labels).split(",")) if _text(labels) else ()
    body = struct.Struct("<" + "".join(k[0] for k in known if k)) if all(known) else None
    if body is not None and (body.size + 3 != length or len(names) != len(known)):
        body = None
    return kind, Format(_text(name), length, body, names, tuple(k[1] for k in known if k))


def records(data: bytes, warn: Warn) -> "Iterator[Tuple[str, Dict[str, float]]]":
    """Yields the name and numeric fields of each wanted message, in degrees and metres. Unreadable bytes are skipped up to the next
    message and reported at the end."""
    formats: Dict[int, Format] = {FMT: Format("FMT", 3 + _FMT.size, None, (), ())}
    at, skipped, first_skipped = 0, 0, -1
    while at + 3 <= len(data):
        described = formats.get(data[at + 2]) if data[at:at + 2] == MAGIC else None
        if described is None or described.length < 3:
            following = data.find(MAGIC, at + 1)
            following = len(data) if following < 0 else following
            skipped += following - at
            first_skipped = at if first_skipped < 0 else first_skipped
            at = following
            continue
        if at + described.length > len(data):
            warn(f"ends within a message, at byte {at}; all messages before it were read")
            break
        if data[at + 2] == FMT:
            kind, description = _format(data, at)
            if kind != FMT:
                formats[kind] = description
                if description.body is None and description.name in WANTED:
                    warn(f"at byte {at}: the description of {description.name} is inconsistent; these messages are omitted")
        elif described.name in WANTED and described.body is not None:
            values = described.body.unpack_from(data, at + 3)
            scaled = zip(described.labels, values, described.factors)
            yield described.name, {label: value * factor for label, value, factor in scaled if factor}
        at += described.length
    if skipped:
        warn(f"{skipped} bytes outside messages were skipped, the first at byte {first_skipped}")


def _time_s(fields: Dict[str, float]) -> Optional[float]:
    if "TimeUS" in fields:
        return 1e-6 * fields["TimeUS"]
    return 1e-3 * fields["TimeMS"] if "TimeMS" in fields else None


def _attitude(fields: Dict[str, float]) -> Optional[Quaternion]:
    if all(f"Q{i}" in fields for i in range(1, 5)):
        parts = [fields[f"Q{i}"] for i in range(1, 5)]
        if abs(sum(p * p for p in parts) - 1) < 1e-3:
            return unit(parts)
    if not all(name in fields and math.isfinite(fields[name]) for name in ("Roll", "Pitch", "Yaw")):
        return None
    return quaternion_from_rpy(*(math.radians(fields[name]) for name in ("Roll", "Pitch", "Yaw")))


def _geodetic(fields: Dict[str, float]) -> Optional[Geodetic]:
    if not all(name in fields for name in ("Lat", "Lng", "Alt")):
        return None
    place = Geodetic(fields["Lat"], fields["Lng"], fields["Alt"])
    return place if place.is_fix and fields.get("Status", 3) >= FIX_2D else None


class _Gathered:
    def __init__(self) -> None:
        self.attitudes: Dict[str, Stream[Quaternion]] = {}
        self.positions: "Dict[str, Stream]" = {}
        self.depths: Dict[str, Stream[float]] = {}
        self.origin: Optional[Geodetic] = None
        self._in_use: "Dict[str, Dict[int, int]]" = {}  # by filter: its cores, and the number of messages that name each

    def add(self, name: str, fields: Dict[str, float]) -> None:
        t = _time_s(fields)
        if name == "ORGN" and fields.get("Type", EKF_ORIGIN) == EKF_ORIGIN:
            self.origin = self.origin or _geodetic(fields)
        if name in STATES and "PI" in fields:
            cores = self._in_use.setdefault(STATES[name], {})
            cores[int(fields["PI"])] = cores.get(int(fields["PI"]), 0) + 1
        if t is None or name == "ORGN" or name in STATES:
            return
        instance = int(fields.get("C", fields.get("I", 0)))
        key = f"{name}:{instance}" if instance else name
        height = fields.get(dict(HEIGHTS).get(key, ""), math.nan)
        if math.isfinite(height):
            self.depths.setdefault(key, []).append((t, -height))
        attitude = _attitude(fields)
        if attitude is not None:
            self.attitudes.setdefault(key, []).append((t, attitude))
        if name in LOCAL:
            local = tuple(fields.get(n, math.nan) for n in ("PN", "PE", "PD"))
            if all(map(math.isfinite, local)):
                self.positions.setdefault(key, []).append((t, local))
            return
        place = _geodetic(fields)
        if place is not None:
            self.positions.setdefault(key, []).append((t, place))

    def cores(self, key: str) -> "Dict[str, int]":
        """Returns the source name and the count of each core of this filter that the autopilot used, most used first."""
        used = sorted(self._in_use.get(key.split(":")[0], {}).items(), key=lambda core: -core[1])
        return {f"{key.split(':')[0]}:{core}" if core else key.split(":")[0]: count for core, count in used}

    def sources(self) -> List[Source]:
        def rank(key: str) -> "Tuple[int, int, str]":
            return FULL.index(key.split(":")[0]), key != next(iter(self.cores(key)), key), key
        full = sorted((k for k in self.attitudes if k.split(":")[0] in FULL), key=rank)
        found = [Source(key, self.attitudes[key], self.positions.get(key, [])) for key in full]
        found += [Source(f"ATT+{p}", self.attitudes.get("ATT", []), self.positions.get(p, [])) for p in ("POS", "GPS")]
        depths: Stream[float] = next((self.depths[key] for key, _ in HEIGHTS if key in self.depths), [])
        return found + [depth_source(a, self.attitudes.get(a, []), depths) for a in ("ATT", "AHR2")]


def read_dataflash(path: pathlib.Path, warn: Warn, source: Optional[str] = None, origin: Optional[Geodetic] = None,
                   at: Optional[Place2] = None) -> Track:
    """Reads the vehicle's track: NED_FRD, seconds since the autopilot started."""
    data = path.read_bytes()
    if not data.startswith(MAGIC):
        raise ConvertError(f"{path}: at byte 0: not a dataflash log: it does not begin with A3 95")
    gathered = _Gathered()
    for name, fields in records(data, warn):
        gathered.add(name, fields)
    wanted = chosen(gathered.sources(), source, str(path), warn)
    local = wanted.name.split(":")[0] in LOCAL
    cores = gathered.cores(wanted.name)
    if cores and list(cores) != [wanted.name]:
        total = sum(cores.values())
        warn(f"cores that the autopilot used: {', '.join(f'{core} ({100 * n / total:.0f} %)' for core, n in cores.items())}; "
             f"using {wanted.name} throughout")
    return track_of(wanted, str(path), warn, origin, gathered.origin if local else None, at)
