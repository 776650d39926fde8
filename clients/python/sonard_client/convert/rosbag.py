"""Reads ROS 1 bags, format 2.0: records have named header fields and data; chunks contain connections and messages."""
from __future__ import annotations

import pathlib
import struct
from typing import Dict, Iterator, Optional, Tuple

from .cdr import Broken
from .compression import Unreadable, unpack
from .messages import may_hold_poses
from .recording import Kept, Recorded, track_from
from .track import ConvertError, Track, Warn

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, CHUNK, CONNECTION = 2, 5, 7
Header = Dict[str, bytes]


def _header(raw: bytes) -> Header:
    fields: Header = {}
    at = 0
    while at + 4 <= len(raw):
        (length,) = struct.unpack_from("<I", raw, at)
        name, equals, value = raw[at + 4:at + 4 + length].partition(b"=")
        if not equals or at + 4 + length > len(raw):
            raise Broken("a header field has no name")
        fields[name.decode("latin-1")] = value
        at += 4 + length
    return fields


def _number(header: Header, name: str) -> int:
    value = header.get(name, b"")
    if len(value) not in (1, 4, 8):
        raise Broken(f"a record has no {name}")
    return int.from_bytes(value, "little")


def _records(data: bytes, begin: int) -> "Iterator[Tuple[int, Header, bytes]]":
    """Yields offset, header and data. Raises Broken if the bytes end within a record."""
    at = begin
    while at < len(data):
        start = at
        parts = []
        for _ in range(2):
            if at + 4 > len(data) or at + 4 + int.from_bytes(data[at:at + 4], "little") > len(data):
                raise Broken(f"ends within a record, at byte {start}; all records before it were read")
            length = int.from_bytes(data[at:at + 4], "little")
            parts.append(data[at + 4:at + 4 + length])
            at += 4 + length
        yield start, _header(parts[0]), parts[1]


class _Bag:
    def __init__(self, warn: Warn) -> None:
        self.warn = warn
        self.connections: Dict[int, Tuple[str, str]] = {}  # topic, type
        self.unreadable = ""

    def messages(self, data: bytes, begin: int, outer: Optional[int] = None) -> Iterator[Recorded]:
        try:
            for at, header, content in _records(data, begin):
                if outer is not None and _number(header, "op") == CHUNK:
                    raise Broken("contains another chunk")
                yield from self._one(header, content, at if outer is None else outer)
        except Broken as error:
            self.warn(str(error) if outer is None else f"at byte {outer}: a chunk: {error}")

    def _one(self, header: Header, content: bytes, at: int) -> Iterator[Recorded]:
        kind = _number(header, "op")
        if kind == CONNECTION:
            topic = header.get("topic", b"").decode("utf-8", "replace")
            self.connections[_number(header, "conn")] = topic, _header(content).get("type", b"").decode("utf-8", "replace")
        elif kind == MESSAGE:
            topic, schema = self.connections.get(_number(header, "conn"), ("", ""))
            stamp = header.get("time", b"").ljust(8, b"\0")
            if may_hold_poses("ros1", schema):
                logged = int.from_bytes(stamp[:4], "little") + 1e-9 * int.from_bytes(stamp[4:8], "little")
                yield Recorded(topic, "ros1", schema, logged, content, at)
        elif kind == CHUNK:
            how = header.get("compression", b"none").decode("latin-1")
            try:
                inner = unpack(how, content, _number(header, "size"))
            except Unreadable as error:
                self.unreadable = self.unreadable or f"at byte {at}: a chunk cannot be read: {error}"
                return
            yield from self.messages(inner, 0, at)


def read_rosbag(path: pathlib.Path, warn: Warn, topic: Optional[str] = None, frame: Optional[str] = None) -> Track:
    data = path.read_bytes()
    if not data.startswith(MAGIC):
        raise ConvertError(f"{path}: at byte 0: not a ROS 1 bag of format 2.0")
    bag = _Bag(warn)
    messages = Kept(bag.messages(data, len(MAGIC)))
    if bag.unreadable and not messages:
        raise ConvertError(f"{path}: {bag.unreadable}")
    if bag.unreadable:
        warn(bag.unreadable)
    return track_from(messages, str(path), warn, topic, dict(bag.connections.values()), frame)
