"""Extracts poses from messages of a recording: ROS, JSON, and foxglove's protobuf schemas PoseInFrame and FrameTransform."""
from __future__ import annotations

import json
import math
import re
import struct
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple, Union

from ..pose_messages import FRAMES
from ..rotations import Quaternion, Vector3, orientation, unit
from .cdr import KINDS, Broken, decode, kind_of

FOXGLOVE = ("foxglove.PoseInFrame", "foxglove.FrameTransform")


_NED = re.compile(r"(?<![a-z])ned(?![a-z])", re.IGNORECASE)


def axes_of(frame_id: str) -> str:
    """Returns the axes of a named frame: those of ROS, except for names such as world_ned (Stonefish, MAVROS, UUV Simulator)."""
    return "NED_FRD" if _NED.search(frame_id) else "ENU_FLU"


class Found(NamedTuple):
    topic: str         # with suffix " parent->child" for transforms
    rank: int          # smaller is preferred
    t_s: Optional[float]  # None: the message has no timestamp
    position_m: Vector3
    orientation: Quaternion
    frame: str
    frame_id: str = ""


def may_hold_poses(encoding: str, schema: str) -> bool:
    if encoding in ("cdr", "ros1"):
        return bool(kind_of(schema))
    if encoding == "json":  # other schemas of foxglove and sonard are large, without poses
        return schema in FOXGLOVE or not schema.startswith(("foxglove.", "sonard."))
    return encoding == "protobuf" and schema in FOXGLOVE


def poses_in(topic: str, encoding: str, schema: str, data: bytes) -> List[Found]:
    """Returns the poses of a message. Raises Broken if the bytes do not match the channel; JSON may have no poses."""
    if encoding == "json":
        return _from_json(topic, data)
    if encoding == "protobuf":
        return [_from_protobuf(topic, schema, data)]
    kind = kind_of(schema)
    return [Found(topic + more, KINDS.index(kind), t or None, *_checked(position, xyzw), axes_of(frame_id), frame_id)
            for more, t, frame_id, (position, xyzw) in decode(kind, data, encoding == "ros1")]


def _checked(position: Vector3, xyzw: "Tuple[float, ...]") -> Tuple[Vector3, Quaternion]:
    if not all(map(math.isfinite, position)):
        raise Broken("the position is not finite")
    try:
        return position, unit((xyzw[3], xyzw[0], xyzw[1], xyzw[2]))
    except ValueError as error:
        raise Broken(str(error).split(":")[0]) from None


def _members(value: Any, names: str) -> Optional[Tuple[float, ...]]:
    if not isinstance(value, dict) or not all(isinstance(value.get(n), (int, float)) for n in names):
        return None
    return tuple(float(value[n]) for n in names)


def _json_time(value: Dict[str, Any]) -> Optional[float]:
    header = value.get("header")
    stamp = value.get("timestamp", header.get("stamp") if isinstance(header, dict) else None)
    if isinstance(stamp, (int, float)):
        return float(stamp)
    if isinstance(stamp, dict):
        seconds, rest = stamp.get("sec", stamp.get("secs")), stamp.get("nsec", stamp.get("nanosec", stamp.get("nsecs", 0)))
        if isinstance(seconds, (int, float)) and isinstance(rest, (int, float)):
            return seconds + 1e-9 * rest
    return None


def _from_json(topic: str, data: bytes) -> List[Found]:
    """Accepts sonard's JSON lines, and objects with position and orientation, at the top level or in `pose`."""
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):
        raise Broken("not JSON") from None
    if not isinstance(value, dict):
        return []
    t = _json_time(value)
    if isinstance(value.get("position"), list):
        try:
            position = [float(p) for p in value["position"]]
            turn = orientation(value.get("quaternion"), value.get("attitude"))
        except (TypeError, ValueError):
            raise Broken("the pose has invalid numbers") from None
        if len(position) != 3 or not all(map(math.isfinite, position)):
            raise Broken("the position is not three finite numbers")
        if value.get("frame", "NED_FRD") not in FRAMES:
            raise Broken("the frame is neither NED_FRD nor ENU_FLU")
        return [Found(topic, 1, t, (position[0], position[1], position[2]), turn, str(value.get("frame", "NED_FRD")))]
    inner: Any = value
    for _ in range(2):
        inner = inner.get("pose", inner) if isinstance(inner, dict) else inner
    place = _members(inner.get("position", inner.get("translation")) if isinstance(inner, dict) else None, "xyz")
    turned = _members(inner.get("orientation", inner.get("rotation")) if isinstance(inner, dict) else None, "xyzw")
    if place is None or turned is None:
        return []
    return [Found(topic, 2, t, *_checked((place[0], place[1], place[2]), turned), "ENU_FLU")]


def _protobuf(data: bytes) -> "Iterator[Tuple[int, Union[int, float, bytes]]]":
    """Yields the number and the value of each field. A value is a varint, a double or bytes."""
    at = 0

    def varint() -> int:
        nonlocal at
        value = 0
        for shift in range(0, 70, 7):
            if at >= len(data):
                raise Broken("ends within a number")
            byte = data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value
        raise Broken("a varint is too long")

    while at < len(data):
        key = varint()
        if key & 7 == 0:
            yield key >> 3, varint()
            continue
        size = {1: 8, 5: 4}.get(key & 7) if key & 7 != 2 else varint()
        if size is None or at + size > len(data):
            raise Broken("ends within a field, or is not protobuf")
        raw = data[at:at + size]
        at += size
        yield key >> 3, struct.unpack("<d", raw)[0] if key & 7 == 1 else raw


def _fields(data: Any) -> Dict[int, Any]:
    return dict(_protobuf(data)) if isinstance(data, bytes) else {}


def _from_protobuf(topic: str, schema: str, data: bytes) -> Found:
    """PoseInFrame: timestamp, frame_id, pose (position, orientation). FrameTransform: timestamp, parent, child, translation,
    rotation. Vectors are x, y, z, quaternions x, y, z, w; zeros are not encoded."""
    fields = _fields(data)
    frame_id = bytes(fields.get(2, b"")).decode("utf-8", "replace")
    stamp = _fields(fields.get(1, b""))
    t = float(stamp.get(1, 0)) + 1e-9 * float(stamp.get(2, 0))
    if schema == "foxglove.FrameTransform":
        child = bytes(fields.get(3, b"")).decode("utf-8", "replace")
        topic, place, turn = f"{topic} {frame_id}->{child}", _fields(fields.get(4, b"")), _fields(fields.get(5, b""))
    else:
        pose = _fields(fields.get(3, b""))
        place, turn = _fields(pose.get(1, b"")), _fields(pose.get(2, b""))
    x, y, z = (float(place.get(n, 0.0)) for n in (1, 2, 3))
    xyzw = tuple(float(turn.get(n, 0.0)) for n in (1, 2, 3, 4))
    return Found(topic, 2, t or None, *_checked((x, y, z), xyzw), axes_of(frame_id), frame_id)
