"""What every reader of this folder ends with: times and poses, and how they are written as a trajectory file."""
from __future__ import annotations

import bisect
from dataclasses import dataclass, field
from typing import Callable, List, NamedTuple, Optional, Sequence, TextIO, Tuple, TypeVar, Union

from ..geodesy import Geodetic, LocalPlane
from ..rotations import Quaternion, Vector3, between

Warn = Callable[[str], None]  # one sentence; the file's name is put before it
Value = TypeVar("Value")
Stream = List[Tuple[float, Value]]  # times in s
LONG_GAP_S = 1.0


class ConvertError(Exception):
    """One sentence: the file, the place in it where there is one, what is wrong, and what to do."""


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


class Source(NamedTuple):
    """Attitudes and positions of one origin; both of the same messages, or of two kinds."""
    name: str
    attitudes: Stream[Quaternion]
    positions: "Stream[Union[Vector3, Geodetic]]"

    def __str__(self) -> str:
        return f"{self.name} ({min(len(self.attitudes), len(self.positions))} poses)"


def rising(stream: Stream[Value]) -> Stream[Value]:
    """Without what comes at or before the time of its predecessor."""
    kept: Stream[Value] = []
    for item in stream:
        if not kept or item[0] > kept[-1][0]:
            kept.append(item)
    return kept


def chosen(sources: Sequence[Source], wanted: Optional[str], name: str) -> Source:
    """The one asked for, or the first that has anything."""
    there = [s for s in sources if s.attitudes and s.positions]
    if wanted is not None:
        for source in there:
            if source.name == wanted:
                return source
        listed = ", ".join(map(str, there)) or "nothing that is a pose"
        raise ConvertError(f"{name}: no poses of {wanted!r}; there is {listed}")
    if not there:
        raise ConvertError(f"{name}: no poses: they need attitude and position, and this file has neither or one of them")
    return there[0]


def paired(attitudes: Stream[Quaternion], positions: Stream[Vector3]) -> List[Row]:
    """Poses at the times of whichever comes more often; the other is taken between its neighbours, nowhere beyond its ends."""
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
             own_origin: Optional[Geodetic] = None) -> Track:
    """In NED_FRD. origin: the one asked for. own_origin: what the file's metres are measured from, where it says so."""
    attitudes, positions = rising(source.attitudes), rising(source.positions)
    late = len(source.attitudes) + len(source.positions) - len(attitudes) - len(positions)
    if late:
        warn(f"{late} messages of {source.name} whose time does not rise were left out")
    geodetic = isinstance(positions[0][1], Geodetic)
    comments: List[str] = []
    if geodetic:
        from_here = origin or next((p for _, p in positions if isinstance(p, Geodetic)), None)
        assert from_here is not None
        comments.append(f"origin: {from_here}" + ("" if origin else " (the first fix)"))
        plane = LocalPlane(from_here)
        local = [(t, plane.ned(p)) for t, p in positions if isinstance(p, Geodetic)]
    else:
        local = [(t, (p[0], p[1], p[2])) for t, p in positions]
        if own_origin is not None:
            comments.append(f"origin: {origin or own_origin}")
            if origin is not None:
                mine, theirs = LocalPlane(origin), LocalPlane(own_origin)
                local = [(t, mine.ned_from(theirs, p)) for t, p in local]
        elif origin is not None:
            raise ConvertError(f"{name}: positions of {source.name} are metres from a place that the file does not tell; leave "
                               "the origin out, or choose a source with latitude and longitude")
    rows = paired(attitudes, local)
    if not rows:
        raise ConvertError(f"{name}: attitudes and positions of {source.name} do not overlap in time")
    return Track("NED_FRD", source.name, rows, comments)


def gap_warning(rows: Sequence[Row]) -> str:
    """Of the longest time without a pose; empty where there is none worth a word."""
    longest = max(((b.t_s - a.t_s, a.t_s) for a, b in zip(rows, rows[1:])), default=(0.0, 0.0))
    if longest[0] <= LONG_GAP_S:
        return ""
    return f"no pose for {longest[0]:.1f} s after second {longest[1] - rows[0].t_s:.1f}; players go straight on between poses"


def write_csv(track: Track, out: TextIO, body: str = "", keep_time: bool = False) -> None:
    """Times begin at 0 unless keep_time; a comment tells what 0 is. With a body's name there is a column for it."""
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
