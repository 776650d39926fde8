"""Makes the track of one body from the messages of a recording (MCAP or bag): selects the topic, drops decreasing times."""
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
    at: int  # byte offset in the file, for errors
    unit: str = "byte"  # unit of `at`


class _Topic:
    def __init__(self, rank: int, frame: str) -> None:
        self.rank, self.frame = rank, frame
        self.rows: Stream[Found] = []


def _choice(topics: Dict[str, _Topic], wanted: Optional[str], name: str) -> str:
    listed = ", ".join(f"{topic!r} ({len(t.rows)} poses)" for topic, t in sorted(topics.items()))
    if wanted is not None:
        if wanted not in topics:
            raise ConvertError(f"{name}: no poses on topic {wanted!r}; topics with poses: {listed or 'none'}")
        return wanted
    if not topics:
        raise ConvertError(f"{name}: no poses found: expected nav_msgs/Odometry, geometry_msgs/PoseStamped, a transform, or "
                           "JSON with position and orientation")
    best = min(t.rank for t in topics.values())
    candidates = [topic for topic, t in topics.items() if t.rank == best]
    if len(candidates) > 1:
        raise ConvertError(f"{name}: several topics have poses: {listed}; select one with --topic")
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
            faults.append(f"at {message.unit} {message.at}, topic {message.topic}: {error}")
            continue
        for pose in found:
            there = topics.setdefault(pose.topic, _Topic(pose.rank, pose.frame))
            there.rows.append((message.logged_s if pose.t_s is None else pose.t_s, pose))
    if faults:
        warn(f"{faults[0]}" + f"; messages omitted: {len(faults)}")
    chosen = _choice(topics, topic, name)
    selected = topics[chosen]
    rows = rising(selected.rows)
    if len(rows) < len(selected.rows):
        warn(f"poses of {chosen} omitted because their time does not increase: {len(selected.rows) - len(rows)}")
    return Track(selected.frame, chosen, [Row(t, f.position_m, f.orientation) for t, f in rows])
