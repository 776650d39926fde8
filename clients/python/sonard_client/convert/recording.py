"""From the messages of a recording, MCAP or bag, to the way of one body: which topic it is, and times without jumps back."""
from __future__ import annotations

from typing import Dict, Iterable, List, NamedTuple, Optional

from .cdr import Broken
from .messages import Found, may_hold_poses, poses_in
from .track import ConvertError, Row, Stream, Track, Warn, rising


class Recorded(NamedTuple):
    topic: str
    encoding: str
    schema: str
    logged_s: float
    data: bytes
    at: int  # byte in the file that an error names


class _Topic:
    def __init__(self, rank: int, frame: str) -> None:
        self.rank, self.frame = rank, frame
        self.rows: Stream[Found] = []


def _choice(topics: Dict[str, _Topic], wanted: Optional[str], name: str) -> str:
    listed = ", ".join(f"{topic!r} ({len(t.rows)} poses)" for topic, t in sorted(topics.items()))
    if wanted is not None:
        if wanted not in topics:
            raise ConvertError(f"{name}: no poses on topic {wanted!r}; there is {listed or 'no topic with poses'}")
        return wanted
    if not topics:
        raise ConvertError(f"{name}: no poses: no message of nav_msgs/Odometry, geometry_msgs/PoseStamped, a transform, or JSON "
                           "with a position and an orientation")
    best = min(t.rank for t in topics.values())
    candidates = [topic for topic, t in topics.items() if t.rank == best]
    if len(candidates) > 1:
        raise ConvertError(f"{name}: several topics hold poses: {listed}; say which with --topic")
    return candidates[0]


def track_from(messages: Iterable[Recorded], name: str, warn: Warn, topic: Optional[str] = None) -> Track:
    topics: Dict[str, _Topic] = {}
    faults: List[str] = []
    for message in messages:
        if not may_hold_poses(message.encoding, message.schema):
            continue
        try:
            found = poses_in(message.topic, message.encoding, message.schema, message.data)
        except Broken as error:
            faults.append(f"at byte {message.at}, topic {message.topic}: {error}")
            continue
        for pose in found:
            there = topics.setdefault(pose.topic, _Topic(pose.rank, pose.frame))
            there.rows.append((message.logged_s if pose.t_s is None else pose.t_s, pose))
    if faults:
        warn(f"{faults[0]}" + (f"; {len(faults)} messages were left out" if len(faults) > 1 else "; it was left out"))
    chosen = _choice(topics, topic, name)
    of_it = topics[chosen]
    rows = rising(of_it.rows)
    if len(rows) < len(of_it.rows):
        warn(f"{len(of_it.rows) - len(rows)} poses of {chosen} whose time does not rise were left out")
    return Track(of_it.frame, chosen, [Row(t, f.position_m, f.orientation) for t, f in rows])
