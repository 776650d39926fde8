"""Tracks (times and poses), common to all readers of this folder, and their output as a trajectory file."""
from __future__ import annotations

import bisect
import math
from dataclasses import dataclass, field
from typing import Callable, List, NamedTuple, Optional, Sequence, TextIO, Tuple, TypeVar, Union

from ..geodesy import Geodetic, LocalPlane
from ..rotations import Quaternion, Vector3, between

Warn = Callable[[str], None]  # called with one sentence, without the file's name
Value = TypeVar("Value")
Stream = List[Tuple[float, Value]]  # times in s
Place2 = Tuple[float, float]  # north, east [m]
LONG_GAP_S = 1.0
LONG_LACK_S = 3.0  # a longer time with positions only, or with attitudes only, is reported


class ConvertError(Exception):
    """The text names the file, the location if known, the cause and what to do."""


class Row(NamedTuple):
    t_s: float
    position_m: Vector3
    orientation: Quaternion  # w, x, y, z, body to world


@dataclass
class Track:
    frame: str  # "NED_FRD" or "ENU_FLU"
    source: str
    rows: List[Row]
    comments: List[str] = field(default_factory=list)
    held: bool = False  # north and east are not known


class Source(NamedTuple):
    """Attitudes and positions from one type of message, or from two."""
    name: str
    attitudes: Stream[Quaternion]
    positions: "Stream[Union[Vector3, Geodetic]]"
    held: bool = False  # north and east are not known and stay 0

    def __str__(self) -> str:
        return f"{self.name} ({min(len(self.attitudes), len(self.positions))} poses)"


def rising(stream: Stream[Value]) -> Stream[Value]:
    """Drops items whose time decreases. Of consecutive items with equal times, the last is kept."""
    kept: Stream[Value] = []
    for item in stream:
        if kept and item[0] == kept[-1][0]:
            kept[-1] = item
        elif not kept or item[0] > kept[-1][0]:
            kept.append(item)
    return kept


def _covered_s(source: Source) -> float:
    """Returns the time in which the source has both attitudes and positions."""
    a, p = source.attitudes, source.positions
    return max(0.0, min(a[-1][0], p[-1][0]) - max(a[0][0], p[0][0]))


def chosen(sources: Sequence[Source], wanted: Optional[str], name: str, warn: Warn) -> Source:
    """Returns the requested source, or the first with poses. Warns if another source has poses for much longer."""
    there = [s for s in sources if s.attitudes and s.positions]
    if wanted is not None:
        for source in there:
            if source.name == wanted:
                return source
        listed = ", ".join(map(str, there)) or "none"
        raise ConvertError(f"{name}: no poses of {wanted!r}; sources: {listed}")
    if not there:
        lacks = [what for what, has in (("attitudes", any(s.attitudes for s in sources)),
                                        ("positions and depths", any(s.positions for s in sources))) if not has]
        raise ConvertError(f"{name}: no poses: the file lacks {' and '.join(lacks) or 'attitudes and positions of one source'}; "
                           "docs/poses.md lists the messages that are read")
    longest = max(there, key=_covered_s)
    if _covered_s(longest) > 2 * _covered_s(there[0]) + LONG_LACK_S:
        warn(f"{there[0].name} gives poses for {_covered_s(there[0]):.1f} s only, --source {longest.name} for "
             f"{_covered_s(longest):.1f} s")
    return there[0]


def paired(attitudes: Stream[Quaternion], positions: Stream[Vector3]) -> List[Row]:
    """Returns poses at the times of the more frequent stream; the other stream is interpolated, never extrapolated."""
    by_attitude = len(attitudes) >= len(positions)
    times_of_other = [t for t, _ in (positions if by_attitude else attitudes)]
    rows = []
    for t, value in (attitudes if by_attitude else positions):
        after = bisect.bisect_left(times_of_other, t)
        if after == len(times_of_other) or (after == 0 and times_of_other[0] != t):
            continue
        before = after if times_of_other[after] == t else after - 1
        u = 0.0 if before == after else (t - times_of_other[before]) / (times_of_other[after] - times_of_other[before])
        if by_attitude:
            p, q = positions[before][1], positions[after][1]
            rows.append(Row(t, (p[0] + u * (q[0] - p[0]), p[1] + u * (q[1] - p[1]), p[2] + u * (q[2] - p[2])), value))
        else:
            rows.append(Row(t, value, between(attitudes[before][1], attitudes[after][1], u)))
    return rows


def track_of(source: Source, name: str, warn: Warn, origin: Optional[Geodetic] = None,
             own_origin: Optional[Geodetic] = None, at: Optional[Place2] = None, surface_m: Optional[float] = None) -> Track:
    """Makes a track in NED_FRD. origin: the requested one. own_origin: origin of the file's metres, if it has one. at: north and
    east of a vehicle that has no horizontal position. surface_m: altitude of z = 0 if no origin is requested (default: that of
    the first fix)."""
    attitudes, positions = rising(source.attitudes), rising(source.positions)
    late = len(source.attitudes) + len(source.positions) - len(attitudes) - len(positions)
    if late:
        warn(f"messages of {source.name} omitted because their time does not increase: {late}")
    geodetic = isinstance(positions[0][1], Geodetic)
    comments: List[str] = []
    is_held = False
    if geodetic:
        from_here = origin or next((p for _, p in positions if isinstance(p, Geodetic)), None)
        assert from_here is not None
        if not origin and surface_m is not None:
            from_here = from_here._replace(altitude_m=surface_m)
        comments.append(f"origin: {from_here}" + ("" if origin else " (the first fix" + ("" if surface_m is None else
                                                                                       ", at the surface") + ")"))
        plane = LocalPlane(from_here)
        local = [(t, plane.ned(p)) for t, p in positions if isinstance(p, Geodetic)]
    else:
        local = [(t, (p[0], p[1], p[2])) for t, p in positions]
        stays = not source.held and _stays(local)
        if source.held or (stays and (at is not None or (origin is None and own_origin is None))):
            held = at or local[0][1][:2]
            warn(f"no horizontal position (no DVL, UGPS or the like): north and east are held at {held[0]:g}, {held[1]:g}" +
                 ("; " if at else "; --at NORTH,EAST sets them, ") + "--dead-reckon M/S moves the vehicle ahead" +
                 ("" if origin is None else "; the origin is not used"))
            comments.append(f"north and east are held at {held[0]:g}, {held[1]:g}: the log has no horizontal position")
            local = [(t, (held[0], held[1], p[2])) for t, p in local]
            at, stays, is_held = None, False, True
        elif own_origin is not None:
            comments.append(f"origin: {origin or own_origin}")
            if origin is not None:
                mine, theirs = LocalPlane(origin), LocalPlane(own_origin)
                local = [(t, mine.ned_from(theirs, p)) for t, p in local]
        elif origin is not None:
            raise ConvertError(f"{name}: positions of {source.name} are metres from an unknown origin; omit the origin, or "
                               "select a source with latitude and longitude")
        if stays:
            warn("north and east do not change: the vehicle stands still, or its horizontal position is not known; --at "
                 "NORTH,EAST places it elsewhere")
    if at is not None:
        raise ValueError(f"--at is for logs without horizontal position: {source.name} has one")
    rows = paired(attitudes, local)
    if not rows:
        raise ConvertError(f"{name}: attitudes and positions of {source.name} do not overlap in time")
    if local[0][0] != attitudes[0][0] or len(local) != len(attitudes):
        _warn_of_lack(rows, [t for t, _ in attitudes], [t for t, _ in local], warn)
    return Track("NED_FRD", source.name, rows, comments, is_held)


def _warn_of_lack(rows: Sequence[Row], attitudes_s: Sequence[float], positions_s: Sequence[float], warn: Warn) -> None:
    """Describes long times with attitudes only, or with positions only."""
    for what, times_s, others_s in (("position", positions_s, attitudes_s), ("attitude", attitudes_s, positions_s)):
        lacking_s = [s for s in (times_s[0] - others_s[0], others_s[-1] - times_s[-1]) if s > LONG_LACK_S]
        if lacking_s:
            warn(f"without a {what} for {' and '.join(f'{s:.1f} s' for s in lacking_s)} at the beginning or the end: omitted")
        gap_s, after_s = max(((b - a, a) for a, b in zip(times_s, times_s[1:])), default=(0.0, 0.0))
        meanwhile_s = [t for t in others_s if after_s < t < after_s + gap_s]
        if meanwhile_s and meanwhile_s[-1] - meanwhile_s[0] > LONG_LACK_S:
            warn(f"no {what} for {gap_s:.1f} s after second {after_s - rows[0].t_s:.1f}, interpolated linearly")


def dead_reckon(track: Track, speed_m_s: float) -> None:
    """Moves a vehicle without horizontal position ahead at a constant speed, starting at its fixed position."""
    north, east, rows = 0.0, 0.0, track.rows
    moved = rows[:1]
    for before, row in zip(rows, rows[1:]):
        w, x, y, z = before.orientation
        ahead = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z)  # the body's forward axis in the world, north and east
        north += speed_m_s * (row.t_s - before.t_s) * ahead[0]
        east += speed_m_s * (row.t_s - before.t_s) * ahead[1]
        p = row.position_m
        moved.append(row._replace(position_m=(p[0] + north, p[1] + east, p[2])))
    track.rows = moved
    track.comments.append(f"north and east are dead reckoned at {speed_m_s:g} m/s ahead")


def depth_source(attitude: str, attitudes: Stream[Quaternion], depths: Stream[float]) -> Source:
    """Makes the track of a vehicle that has a depth but no horizontal position, such as a BlueROV2 without DVL."""
    return Source(f"{attitude}+depth", attitudes, [(t, (0.0, 0.0, down)) for t, down in depths], held=True)


def _stays(positions: Stream[Vector3]) -> bool:
    """Returns whether the position never changes, as in filters without a horizontal position."""
    first = positions[0][1]
    return len(positions) > 1 and all(math.hypot(p[0] - first[0], p[1] - first[1]) < 1e-3 for _, p in positions)


def gap_warning(rows: Sequence[Row]) -> str:
    """Describes the longest gap between poses; empty if it is short."""
    longest = max(((b.t_s - a.t_s, a.t_s) for a, b in zip(rows, rows[1:])), default=(0.0, 0.0))
    if longest[0] <= LONG_GAP_S:
        return ""
    return f"no pose for {longest[0]:.1f} s after second {longest[1] - rows[0].t_s:.1f}; playback interpolates linearly"


def write_csv(track: Track, out: TextIO, body: str = "", keep_time: bool = False) -> None:
    """Writes the track. Times start at 0 unless keep_time; a comment gives the original start. `body` adds a column with that
    name."""
    zero_s = 0.0 if keep_time else track.rows[0].t_s
    out.write(f"# frame: {track.frame}\n")
    for comment in [f"source: {track.source}"] + track.comments + ([] if keep_time else [f"t = 0 was {zero_s:.6f} s"]):
        out.write("# " + comment.replace("\n", " ") + "\n")
    out.write("t,x,y,z,qw,qx,qy,qz" + (",body" if body else "") + "\n")
    tail = f",{body}" if body else ""
    for row in track.rows:
        place = ",".join(f"{value:.6f}" for value in row.position_m)
        turn = ",".join(f"{value:.9f}" for value in row.orientation)
        out.write(f"{row.t_s - zero_s:.9f},{place},{turn}{tail}\n")
