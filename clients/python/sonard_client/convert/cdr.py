"""Decodes poses in ROS messages: CDR of ROS 2 and the unpadded encoding of ROS 1."""
from __future__ import annotations

import struct
from typing import List, Tuple


class Broken(ValueError):
    """The bytes do not match the type of the message. The text does not name the file."""


class Reader:
    """Reads fields in order. CDR aligns numbers to their own size, counted from the end of its four-byte header."""

    def __init__(self, data: bytes, ros1: bool = False) -> None:
        self._data, self._at, self._base, self._aligned, self._order = data, 0, 0, not ros1, "<"
        if ros1:
            return
        if len(data) < 4 or data[0] != 0 or data[1] > 1:
            raise Broken("not plain CDR: its first bytes are " + data[:4].hex(" "))
        self._order = "<" if data[1] else ">"
        self._at = self._base = 4

    def numbers(self, kind: str, count: int = 1) -> Tuple[float, ...]:
        size = struct.calcsize("=" + kind)
        if self._aligned:
            self._at += -(self._at - self._base) % size
        if self._at + size * count > len(self._data):
            raise Broken(f"ends after {len(self._data)} bytes, within a field at {self._at}")
        values = struct.unpack_from(f"{self._order}{count}{kind}", self._data, self._at)
        self._at += size * count
        return values

    def text(self) -> str:
        (length,) = self.numbers("I")
        end = self._at + int(length)
        if end > len(self._data):
            raise Broken(f"a text of {int(length)} bytes at {self._at} passes the end of the message at {len(self._data)}")
        raw = self._data[self._at:end]
        self._at = end
        return raw.rstrip(b"\0").decode("utf-8", "replace")


Pose = Tuple[Tuple[float, float, float], Tuple[float, float, float, float]]  # position; orientation x, y, z, w as encoded


def _header(reader: Reader, ros1: bool) -> Tuple[float, str]:
    if ros1:
        reader.numbers("I")  # seq
    (seconds,) = reader.numbers("I" if ros1 else "i")
    (nanoseconds,) = reader.numbers("I")
    return seconds + 1e-9 * nanoseconds, reader.text()


def _pose(reader: Reader) -> Pose:
    v = reader.numbers("d", 7)
    return (v[0], v[1], v[2]), (v[3], v[4], v[5], v[6])


def decode(kind: str, data: bytes, ros1: bool) -> List[Tuple[str, float, str, Pose]]:
    """Returns for each pose of a message: suffix of the topic's name; timestamp [s], 0 if it has none; name of the frame to
    which the pose refers; pose."""
    reader = Reader(data, ros1)
    if kind == "Path":
        _header(reader, ros1)
        (count,) = reader.numbers("I")
        return [("", *_header(reader, ros1), _pose(reader)) for _ in range(int(count))]
    if kind == "TFMessage":
        (count,) = reader.numbers("I")
        return [_transform(reader, ros1) for _ in range(int(count))]
    if kind == "TransformStamped":
        return [_transform(reader, ros1)]
    if kind == "Pose":
        return [("", 0.0, "", _pose(reader))]
    stamp, frame = _header(reader, ros1)
    if kind == "Odometry":
        reader.text()
    return [("", stamp, frame, _pose(reader))]


def _transform(reader: Reader, ros1: bool) -> Tuple[str, float, str, Pose]:
    stamp, parent = _header(reader, ros1)
    child = reader.text()
    return f" {parent}->{child}", stamp, parent, _pose(reader)


# Supported types, in order of preference.
KINDS = ("Odometry", "PoseStamped", "PoseWithCovarianceStamped", "TransformStamped", "TFMessage", "Pose", "Path")
PACKAGES = ("nav_msgs", "geometry_msgs", "tf2_msgs", "tf")


def is_path(schema: str) -> bool:
    """Returns whether each message contains a whole track, so that only the last message is used."""
    return kind_of(schema) == "Path"


def kind_of(schema: str) -> str:
    """Returns the type name in "nav_msgs/msg/Odometry" or "nav_msgs/Odometry"; empty for unsupported types."""
    parts = schema.split("/")
    return parts[-1] if parts[0] in PACKAGES and parts[-1] in KINDS else ""
