"""Makes the track of one body from the messages of a recording (MCAP or bag): selects the topic, drops decreasing times."""
from __future__ import annotations

from typing import Dict, Iterable, List, Mapping, NamedTuple, Optional

from .cdr import KINDS, Broken, is_path
from .compression import ZSTD_MAGIC, Unreadable, unpack_at_most
from .messages import Found, may_hold_poses, poses_in
from .track import ConvertError, Row, Stream, Track, Warn, rising


CLOCK_RESET_S = 1.0
LONGEST_SIMULATION_S = 1e8  # 3 years; stamps of the UNIX clock are greater
MOST_MESSAGE_BYTES = 16 << 20


class Recorded(NamedTuple):
    topic: str
    encoding: str
    schema: str
    logged_s: float
    data: bytes
    at: int  # byte offset in the file, for errors
    unit: str = "byte"  # unit of `at`


class Kept(List[Recorded]):
    """The messages of a recording. A path grows from message to message, so only the last path of each topic is kept."""

    def __init__(self, messages: Iterable[Recorded] = ()) -> None:
        super().__init__()
        self._paths: Dict[str, int] = {}
        self.extend(messages)

    def append(self, message: Recorded) -> None:
        if not is_path(message.schema):
            super().append(message)
        elif message.topic not in self._paths:
            self._paths[message.topic] = len(self)
            super().append(message)
        elif message.logged_s >= self[self._paths[message.topic]].logged_s:
            self[self._paths[message.topic]] = message

    def extend(self, messages: Iterable[Recorded]) -> None:
        for message in messages:
            self.append(message)


class _Topic:
    def __init__(self, rank: int, frame: str) -> None:
        self.rank, self.frame = rank, frame
        self.rows: Stream[Found] = []  # with the times of the recording


def _others(seen: Mapping[str, str]) -> str:
    """Lists the topics of a recording without poses, with their types."""
    most = 20
    listed = [f"{topic!r} ({kind or 'no type'})" for topic, kind in sorted(seen.items())]
    return ", ".join(listed[:most]) + (f" and {len(listed) - most} more" if len(listed) > most else "") or "none"


def _choice(topics: Dict[str, _Topic], wanted: Optional[str], name: str, seen: Mapping[str, str]) -> str:
    listed = ", ".join(f"{topic!r} ({len(t.rows)} poses)" for topic, t in sorted(topics.items()))
    if wanted is not None:
        if wanted not in topics:
            raise ConvertError(f"{name}: no poses on topic {wanted!r}; topics with poses: {listed or 'none'}")
        return wanted
    if not topics:
        raise ConvertError(f"{name}: no poses found: expected nav_msgs/Odometry, geometry_msgs/PoseStamped or Pose, a transform, "
                           f"nav_msgs/Path, or JSON with position and orientation; its topics: {_others(seen)}")
    best = min(t.rank for t in topics.values())
    candidates = [topic for topic, t in topics.items() if t.rank == best]
    if len(candidates) > 1:
        raise ConvertError(f"{name}: several topics have poses: {listed}; select one with --topic")
    return candidates[0]


def _timed(logged: Stream[Found], warn: Warn) -> Stream[Found]:
    """Returns poses at their stamps. Without any stamp the times of the recording count. If only some poses have the stamp 0, it
    is the start of a simulated clock, or the pose has no time."""
    stamps = [pose.t_s for _, pose in logged if pose.t_s is not None]
    if not stamps:
        return logged
    is_simulated = min(stamps) < LONGEST_SIMULATION_S
    timed = [(pose.t_s or 0.0, pose) for _, pose in logged if is_simulated or pose.t_s is not None]
    if len(timed) < len(logged):
        warn(f"poses omitted because they have no time stamp, which others have: {len(logged) - len(timed)}")
    return timed


def _clock_reset(rows: Stream[Found]) -> str:
    """Returns advice if the clock jumped back; all later poses are omitted until the clock has caught up."""
    back_s, number = max(((a[0] - b[0], i) for i, (a, b) in enumerate(zip(rows, rows[1:]), 1)), default=(0.0, 0))
    return "" if back_s < CLOCK_RESET_S else f"; the clock went back by {back_s:.1f} s at pose {number + 1}: split the recording there"


def _unpacked(message: Recorded, name: str) -> bytes:
    """Decompresses a message if needed, because some recordings of ROS 2 compress each message."""
    if message.encoding != "cdr" or not message.data.startswith(ZSTD_MAGIC):
        return message.data
    try:
        return unpack_at_most("zstd", message.data, MOST_MESSAGE_BYTES)
    except Unreadable as error:
        raise ConvertError(f"{name}: its messages are compressed one by one: {error}") from None


def track_from(messages: Iterable[Recorded], name: str, warn: Warn, topic: Optional[str] = None,
               seen: Mapping[str, str] = {}, frame: Optional[str] = None) -> Track:
    """Makes the track. seen: the types of all topics of the recording. frame: the axes that the user named; None = those of the
    recording."""
    topics: Dict[str, _Topic] = {}
    faults: List[str] = []
    for message in messages:
        if not may_hold_poses(message.encoding, message.schema):
            continue
        data = _unpacked(message, name)
        try:
            found = poses_in(message.topic, message.encoding, message.schema, data)
        except Broken as error:
            faults.append(f"at {message.unit} {message.at}, topic {message.topic}: {error}")
            continue
        for pose in found:
            there = topics.setdefault(pose.topic, _Topic(pose.rank, pose.frame))
            there.rows.append((message.logged_s, pose))
    if faults:
        warn(f"{faults[0]}" + f"; messages omitted: {len(faults)}")
    chosen = _choice(topics, topic, name, seen)
    selected = topics[chosen]
    timed = _timed(selected.rows, warn)
    rows = rising(timed)
    frame_id = selected.rows[0][1].frame_id
    if frame is None and frame_id and selected.frame == "NED_FRD":
        warn(f"its poses are in the frame {frame_id!r}, so the axes are NED_FRD; --frame ENU_FLU if they are not")
    if selected.rank == KINDS.index("Path") and len(rows) == 1 and len(timed) > 1:
        raise ConvertError(f"{name}: the poses of {chosen} have no time stamps, so they are not a track")
    if len(rows) < len(timed):
        warn(f"poses of {chosen} omitted because their time does not increase: {len(timed) - len(rows)}" + _clock_reset(timed))
    return Track(frame or selected.frame, chosen, [Row(t, f.position_m, f.orientation) for t, f in rows])
