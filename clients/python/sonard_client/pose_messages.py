"""Encodes poses as JSON lines or as PoseUpdate of protocol/control/control.proto, without a protobuf library."""
from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any, Dict, Optional, Sequence

from .rotations import Quaternion, Vector3, to_body

FRAMES = {"NED_FRD": 1, "ENU_FLU": 2}
CLOCKS = {"wall": 1, "sim": 2, "arrival": 3}


@dataclass(frozen=True)
class PoseMessage:
    """All vectors are in the world or body axes of `frame`. The caller checks the values."""
    position_m: Vector3
    orientation: Quaternion
    frame: str
    vehicle: str = ""
    velocity_mps: Optional[Vector3] = None           # world axes
    angular_velocity_radps: Optional[Vector3] = None  # body axes
    timestamp_s: Optional[float] = None
    clock: str = "sim"
    seq: int = 0
    reset_counter: int = 0


def json_line(pose: PoseMessage) -> bytes:
    """Encodes the keys of ArduPilot's JSON simulator interface, without seq and angular velocity."""
    line: Dict[str, Any] = {"frame": pose.frame, "position": pose.position_m, "quaternion": pose.orientation}
    if pose.timestamp_s is not None:
        line["timestamp"] = pose.timestamp_s
    if pose.vehicle:
        line["vehicle"] = pose.vehicle
    if pose.velocity_mps is not None:
        line["velocity"] = pose.velocity_mps
    return json.dumps(line, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def pose_update(pose: PoseMessage) -> bytes:
    """Encodes one datagram. Its velocities are in body axes."""
    stamped = pose.timestamp_s is not None
    time = _number(1, CLOCKS[pose.clock if stamped else "arrival"])
    if pose.timestamp_s is not None:
        time += _key(2, 1) + struct.pack("<q", round(pose.timestamp_s * 1e9))
    twist = b""
    if pose.velocity_mps is not None:
        twist += _field(1, _doubles(to_body(pose.orientation, pose.velocity_mps)))
    if pose.angular_velocity_radps is not None:
        twist += _field(2, _doubles(pose.angular_velocity_radps))
    return (_field(1, pose.vehicle.encode()) + _number(2, pose.seq) + _field(3, time) + _number(4, FRAMES[pose.frame]) +
            _field(5, _doubles(pose.position_m)) + _field(6, _doubles(pose.orientation)) + (_field(7, twist) if twist else b"") +
            _number(8, pose.reset_counter))


# Protobuf's wire format: a key is (field number << 3) | wire type; 0 varint, 1 eight bytes, 2 length and bytes.
def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def _key(field: int, wire_type: int) -> bytes:
    return _varint(field << 3 | wire_type)


def _number(field: int, value: int) -> bytes:
    return _key(field, 0) + _varint(value)


def _field(field: int, content: bytes) -> bytes:
    return _key(field, 2) + _varint(len(content)) + content


def _doubles(values: Sequence[float]) -> bytes:
    """Encodes a message of doubles with the field numbers 1, 2, 3, ..."""
    return b"".join(_key(field, 1) + struct.pack("<d", value) for field, value in enumerate(values, 1))
