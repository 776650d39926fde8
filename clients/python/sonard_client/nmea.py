"""Parses NMEA 0183 sentences and derives poses from them, without sockets or clocks.

HDT, THS, HDG: heading. PRDID, PASHR: pitch, roll, heading. PHTRO: pitch and roll. GGA, RMC, GLL: position. DPT, DBT: depth of
water below a transducer.
"""
from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Set, Tuple

from .geodesy import Geodetic, LocalPlane
from .rotations import Vector3

DAY_S = 86400.0
FIX_KINDS = ("GGA", "RMC", "GLL")  # in order of preference; the others repeat the fix
TRUE_HEADINGS = {"HDT", "THS"}
WITH_HEADING = {"PRDID", "PASHR"}
ATTITUDE_KINDS = (*TRUE_HEADINGS, "HDG", *WITH_HEADING, "PHTRO")
DEPTH_KINDS = ("DPT", "DBT")
NO_CHECKSUM = "checksum is missing"
MOST_UNREAD = 12  # kinds of sentences to name


class NmeaError(ValueError):
    """The reason why a line is not a sentence."""


class Sentence(NamedTuple):
    kind: str  # "GGA" for "$GPGGA"; in full for proprietary sentences: "PRDID"
    fields: Tuple[str, ...]


def checksum(body: str) -> int:
    """Returns the checksum of the text between $ and *."""
    value = 0
    for byte in body.encode("latin-1", "replace"):
        value ^= byte
    return value


def parse_sentence(line: str, without_checksum: bool = False) -> Sentence:
    """Parses a line. Text before the $, such as a time, is skipped. A missing checksum is an error unless `without_checksum`."""
    start = line.find("$")
    if start < 0:
        raise NmeaError("not a sentence: $ is missing")
    body, star, given = line[start + 1:].strip().partition("*")
    if star:
        try:
            right = int(given[:2], 16) == checksum(body) and len(given.strip()) == 2
        except ValueError:
            right = False
        if not right:
            raise NmeaError(f"checksum is {given!r}, expected {checksum(body):02X}")
    elif not without_checksum:
        raise NmeaError(NO_CHECKSUM)
    address, *fields = body.split(",")
    if len(address) < 3 or not address.isalnum():
        raise NmeaError(f"{address[:12]!r} is not a sentence type")
    return Sentence(address if address.startswith("P") else address[-3:], tuple(fields))


def _number(text: str) -> Optional[float]:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _angle(text: str, half: str, degrees: int) -> Optional[float]:
    """Parses ddmm.mmm or dddmm.mmm with N, S, E or W."""
    minutes = _number(text[degrees:])
    if not text[:degrees].isdigit() or minutes is None or not 0 <= minutes < 60 or half not in ("N", "S", "E", "W"):
        return None
    value = int(text[:degrees]) + minutes / 60
    return -value if half in ("S", "W") else value


def _true_heading(fields: Tuple[str, ...]) -> Optional[float]:
    """Returns the true heading of HDG: magnetic heading, deviation and variation; None without a variation."""
    if len(fields) < 5:
        return None
    magnetic, deviation, variation = _number(fields[0]), _number(fields[1] or "0"), _number(fields[3])
    if magnetic is None or deviation is None or variation is None or fields[4] not in ("E", "W"):
        return None
    return (magnetic + (-deviation if fields[2] == "W" else deviation) + (-variation if fields[4] == "W" else variation)) % 360


def time_of_day_s(text: str) -> Optional[float]:
    """Converts hhmmss.ss to seconds."""
    seconds = _number(text[4:])
    if not text[:4].isdigit() or seconds is None or not 0 <= seconds < 61:
        return None
    return 3600.0 * int(text[:2]) + 60 * int(text[2:4]) + seconds


class Instruments:
    """The latest values; None = unknown. Heading is true, clockwise from north; pitch is positive bow up, roll starboard down."""

    def __init__(self) -> None:
        self.heading_deg: Optional[float] = None
        self.pitch_deg: Optional[float] = None
        self.roll_deg: Optional[float] = None
        self.place: Optional[Geodetic] = None  # without altitude: the antenna's height is not the vehicle's depth
        self.fix_time_s: Optional[float] = None  # time of day; exceeds 86400 after midnight
        self.water_below_m: Optional[float] = None
        self.received: Set[str] = set()
        self.unread: Set[str] = set()  # other kinds of sentences
        self._fixes_by: Optional[str] = None

    def feed(self, sentence: Sentence) -> str:
        """Returns what the sentence changed: "place", "attitude", "depth", or empty."""
        kind, fields = sentence
        if kind in FIX_KINDS:
            return self._fix(kind, fields)
        if kind in ATTITUDE_KINDS:
            return self._attitude(kind, fields)
        if kind in DEPTH_KINDS:
            return self._depth(kind, fields)
        if len(self.unread) < MOST_UNREAD:
            self.unread.add(kind)
        return ""

    def _fix(self, kind: str, fields: Tuple[str, ...]) -> str:
        if self._fixes_by is not None and FIX_KINDS.index(self._fixes_by) < FIX_KINDS.index(kind):
            return ""
        first, clock, valid = {"GGA": (1, 0, 5), "RMC": (2, 0, 1), "GLL": (0, 4, 5)}[kind]
        if len(fields) < 4 + first:
            return ""
        status = fields[valid] if len(fields) > valid else "A"
        if status in ("0", "V", ""):
            return ""
        latitude = _angle(fields[first], fields[first + 1], 2)
        longitude = _angle(fields[first + 2], fields[first + 3], 3)
        if latitude is None or longitude is None or not Geodetic(latitude, longitude).is_fix:
            return ""
        self._fixes_by = kind
        self.place = Geodetic(latitude, longitude)
        now = time_of_day_s(fields[clock]) if len(fields) > clock else None  # old GLL sentences have no time and no status
        if now is not None:
            before = self.fix_time_s
            while before is not None and now < before - DAY_S / 2:
                now += DAY_S
            self.fix_time_s = now
        self.received.add(kind)
        return "place"

    def _attitude(self, kind: str, fields: Tuple[str, ...]) -> str:
        numbers: List[Optional[float]] = [_number(f) for f in fields]
        if kind in TRUE_HEADINGS and numbers and numbers[0] is not None and not (kind == "THS" and fields[1:2] == ("V",)):
            self.heading_deg = numbers[0]
        elif kind == "HDG" and (true := _true_heading(fields)) is not None:
            if not self.received & (TRUE_HEADINGS | WITH_HEADING):
                self.heading_deg = true
        elif kind == "PRDID" and len(numbers) >= 3 and None not in numbers[:3]:
            self.pitch_deg, self.roll_deg = numbers[0], numbers[1]
            if not self.received & TRUE_HEADINGS:
                self.heading_deg = numbers[2]
        elif kind == "PASHR" and len(numbers) >= 5 and fields[2] == "T" and None not in numbers[3:5]:
            self.roll_deg, self.pitch_deg = numbers[3], numbers[4]
            if numbers[1] is None:
                return "attitude"  # HDG still gives the heading
            if not self.received & TRUE_HEADINGS:
                self.heading_deg = numbers[1]
        elif kind == "PHTRO" and len(numbers) >= 4 and numbers[0] is not None and numbers[2] is not None and \
                fields[1] in ("M", "P") and fields[3] in ("B", "T"):
            self.pitch_deg = numbers[0] if fields[1] == "M" else -numbers[0]  # M: bow up
            self.roll_deg = numbers[2] if fields[3] == "T" else -numbers[2]   # T: port up
        else:
            return ""
        self.received.add(kind)
        return "attitude"

    def _depth(self, kind: str, fields: Tuple[str, ...]) -> str:
        depth = _number(fields[0 if kind == "DPT" else 2]) if len(fields) > (0 if kind == "DPT" else 2) else None
        if depth is None or depth < 0:
            return ""
        self.water_below_m = depth
        self.received.add(kind)
        return "depth"


class Assumptions(NamedTuple):
    """Values that sentences do not contain, given by the user."""
    origin: Optional[Geodetic] = None       # default: the first fix
    north_east_m: Optional[Tuple[float, float]] = None  # used without a fix
    heading_deg: Optional[float] = None     # used until a heading is received
    depth_m: float = 0.0
    depth_is_vehicle: bool = False          # DPT and DBT give the vehicle's own depth
    bottom_m: Optional[float] = None        # depth of the bottom: the vehicle is DPT or DBT above it


class NmeaPoses:
    """Derives NED_FRD poses from sentences and assumptions."""

    def __init__(self, assumed: Assumptions = Assumptions()) -> None:
        self.assumed, self.instruments = assumed, Instruments()
        self._plane = LocalPlane(Geodetic(*assumed.origin[:2])) if assumed.origin else None

    @property
    def origin(self) -> Optional[Geodetic]:
        return self._plane.origin if self._plane else None

    def feed(self, sentence: Sentence) -> str:
        changed = self.instruments.feed(sentence)
        if self._plane is None and self.instruments.place is not None:
            self._plane = LocalPlane(self.instruments.place)
        return changed

    def pose(self) -> "Optional[Tuple[Vector3, Vector3]]":
        """Returns position north, east, down [m] and roll, pitch, yaw [rad]; None while position or heading is unknown."""
        now, assumed = self.instruments, self.assumed
        heading = now.heading_deg if now.heading_deg is not None else assumed.heading_deg
        if heading is None:
            return None
        if now.place is not None and self._plane is not None:
            north, east, _ = self._plane.ned(now.place)  # ignore down: it contains the Earth's curvature
        elif assumed.north_east_m is not None:
            north, east = assumed.north_east_m
        else:
            return None
        down = assumed.depth_m
        if now.water_below_m is not None and assumed.depth_is_vehicle:
            down = now.water_below_m
        elif now.water_below_m is not None and assumed.bottom_m is not None:
            down = assumed.bottom_m - now.water_below_m
        angles = (math.radians(now.roll_deg or 0.0), math.radians(now.pitch_deg or 0.0), math.radians(heading))
        return (north, east, down), angles

    def unknown(self) -> List[str]:
        """Describes each value of the poses that no sentence has given."""
        now, assumed = self.instruments, self.assumed
        out = []
        if now.place is None:
            out.append("no position (a fix of GGA, RMC or GLL)" + (": --at is used" if assumed.north_east_m else ""))
        if now.heading_deg is None:
            out.append("no heading (HDT, THS, PRDID, PASHR, or HDG with the variation): --heading " +
                       ("is used" if assumed.heading_deg is not None else "DEG sets one"))
        if now.pitch_deg is None:
            out.append("no pitch and roll (PRDID, PASHR or PHTRO): 0 is used")
        if now.water_below_m is None:
            out.append(f"no depth (DPT or DBT): {assumed.depth_m:g} m is used")
        elif not assumed.depth_is_vehicle and assumed.bottom_m is None:
            out.append(f"no vehicle depth: DPT and DBT give the water below it ({assumed.depth_m:g} m is used; set --bottom or "
                       "--depth-is-vehicle)")
        return out
