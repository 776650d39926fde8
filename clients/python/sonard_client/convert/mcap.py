"""Reads MCAP recordings sequentially, without the index. A record has an opcode, a length and content; chunks contain records.

The code follows the specification at mcap.dev. A truncated recording is read up to its last complete record.
"""
from __future__ import annotations

import pathlib
import struct
import zlib
from typing import BinaryIO, Dict, Iterator, List, NamedTuple, Optional

from .cdr import Broken
from .compression import Unreadable, unpack
from .messages import may_hold_poses
from .recording import Kept, Recorded, track_from
from .track import ConvertError, Track, Warn

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END, FOOTER = 0x03, 0x04, 0x05, 0x06, 0x0F, 0x02
RECORD_HEAD = struct.Struct("<BQ")
LARGEST_RECORD = 1 << 31


class Channel(NamedTuple):
    topic: str
    encoding: str
    schema: str


class _Fields:
    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def number(self, kind: str) -> int:
        size = struct.calcsize("<" + kind)
        if self.at + size > len(self.data):
            raise Broken("a record ends within a field")
        (value,) = struct.unpack_from("<" + kind, self.data, self.at)
        self.at += size
        return int(value)

    def block(self, kind: str) -> bytes:
        length = self.number(kind)
        if self.at + length > len(self.data):
            raise Broken(f"a field of {length} bytes passes the end of a record of {len(self.data)}")
        self.at += length
        return self.data[self.at - length:self.at]

    def text(self) -> str:
        return self.block("I").decode("utf-8", "replace")


class _Reader:
    def __init__(self, name: str, warn: Warn) -> None:
        self.name, self.warn = name, warn
        self.schemas: Dict[int, str] = {0: ""}
        self.channels: Dict[int, Channel] = {}
        self.refused = 0  # number of refused chunks
        self.why = ""

    def records(self, file: BinaryIO, size: int) -> Iterator[Recorded]:
        at = len(MAGIC)
        while at < size:
            head = file.read(RECORD_HEAD.size)
            opcode, length = RECORD_HEAD.unpack(head) if len(head) == RECORD_HEAD.size else (0, 0)
            if not opcode or length > min(LARGEST_RECORD, size - at - RECORD_HEAD.size):
                self.warn(f"ends within a record, at byte {at}; all records before it were read")
                return
            if opcode in (DATA_END, FOOTER):
                return
            if opcode in (SCHEMA, CHANNEL, MESSAGE, CHUNK):
                yield from self._record(opcode, file.read(length), at)
            else:
                file.seek(length, 1)
            at += RECORD_HEAD.size + length
        self.warn("was not closed: its end is missing; all records were read")

    def _record(self, opcode: int, content: bytes, at: int) -> Iterator[Recorded]:
        fields = _Fields(content)
        try:
            if opcode == SCHEMA:
                number = fields.number("H")
                self.schemas[number] = fields.text()
            elif opcode == CHANNEL:
                number, schema = fields.number("H"), fields.number("H")
                self.channels[number] = Channel(fields.text(), fields.text(), self.schemas.get(schema, ""))
            elif opcode == MESSAGE:
                channel = self.channels.get(fields.number("H"))
                fields.number("I")
                logged = fields.number("Q")
                fields.number("Q")
                if channel is not None and may_hold_poses(channel.encoding, channel.schema):
                    yield Recorded(channel.topic, channel.encoding, channel.schema, 1e-9 * logged, content[fields.at:], at)
            else:
                yield from self._chunk(fields, at)
        except Broken as error:
            self.warn(f"at byte {at}: {error}; the record was omitted")

    def _chunk(self, fields: _Fields, at: int) -> Iterator[Recorded]:
        fields.number("Q")
        fields.number("Q")
        size, crc, kind = fields.number("Q"), fields.number("I"), fields.text()
        try:
            data = unpack(kind, fields.block("Q"), size)
            if crc and zlib.crc32(data) != crc:
                raise Unreadable("its checksum is wrong")
        except Unreadable as error:
            self.refused += 1
            self.why = self.why or f"at byte {at}: a chunk is {error}" if str(error).startswith("compressed") else \
                self.why or f"at byte {at}: a chunk cannot be read: {error}"
            return
        inner = 0
        while inner + RECORD_HEAD.size <= len(data):
            opcode, length = RECORD_HEAD.unpack_from(data, inner)
            begin = inner + RECORD_HEAD.size
            if begin + length > len(data):
                raise Broken(f"a record of {length} bytes passes the end of a chunk of {len(data)}")
            if opcode in (SCHEMA, CHANNEL, MESSAGE):
                yield from self._record(opcode, data[begin:begin + length], at)
            inner = begin + length


def mcap_messages(path: pathlib.Path, warn: Warn, seen: Dict[str, str]) -> List[Recorded]:
    """Reads the messages. seen: receives the types of all topics."""
    reader = _Reader(str(path), warn)
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise ConvertError(f"{path}: at byte 0: not an MCAP file: the magic bytes are missing")
        messages = Kept(reader.records(file, path.stat().st_size))
    seen.update((channel.topic, channel.schema) for channel in reader.channels.values())
    if reader.refused and not messages:
        raise ConvertError(f"{path}: {reader.why}")
    if reader.refused:
        warn(f"{reader.why}; chunks omitted: {reader.refused}")
    return messages


def read_mcap(path: pathlib.Path, warn: Warn, topic: Optional[str] = None, frame: Optional[str] = None) -> Track:
    """Reads the poses of one topic; ROS and foxglove use ENU_FLU."""
    seen: Dict[str, str] = {}
    return track_from(mcap_messages(path, warn, seen), str(path), warn, topic, seen, frame)
