"""Reads recordings of ROS 2: SQLite files (.db3) and the folders that `ros2 bag record` makes, of SQLite or MCAP files."""
from __future__ import annotations

import pathlib
import re
import sqlite3
from typing import Iterator, List, Optional
from urllib.parse import quote

from .mcap import MAGIC as MCAP_MAGIC
from .mcap import mcap_messages
from .messages import may_hold_poses
from .recording import Recorded, track_from
from .track import ConvertError, Track, Warn

MAGIC = b"SQLite format 3\0"
METADATA = "metadata.yaml"
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_MESSAGES = "SELECT id, timestamp, data FROM messages WHERE topic_id = ? ORDER BY timestamp, id"


def _rows(path: pathlib.Path, warn: Warn) -> Iterator[Recorded]:
    base = sqlite3.connect(f"file:{quote(str(path.resolve()))}?mode=ro&immutable=1", uri=True)
    try:
        base.text_factory = lambda raw: raw.decode("utf-8", "replace")
        for number, topic, schema, encoding in base.execute("SELECT id, name, type, serialization_format FROM topics").fetchall():
            if not may_hold_poses(str(encoding), str(schema)):
                continue
            odd = 0
            for row, stamp_ns, data in base.execute(_MESSAGES, (number,)):
                if isinstance(row, int) and isinstance(stamp_ns, int) and isinstance(data, bytes):
                    yield Recorded(str(topic), str(encoding), str(schema), 1e-9 * stamp_ns, data, row, "message")
                else:
                    odd += 1
            if odd:
                warn(f"messages of {topic} omitted because they have no time or no bytes: {odd}")
    finally:
        base.close()


def db3_messages(path: pathlib.Path, warn: Warn) -> List[Recorded]:
    found: List[Recorded] = []
    try:
        for message in _rows(path, warn):
            if message.data.startswith(ZSTD_MAGIC):
                raise ConvertError(f"{path}: its messages are compressed one by one; write them without compression: ros2 bag "
                                   "convert -i RECORDING -o options.yaml, with `output_bags: [{uri: plain, storage_id: mcap}]`")
            found.append(message)
    except (sqlite3.Error, OverflowError, UnicodeError) as error:
        if not found:
            raise ConvertError(f"{path}: not a recording of ROS 2, or damaged: {error}; a damaged one may be repaired by "
                               "ros2 bag reindex") from None
        warn(f"is damaged ({error}); {len(found)} messages before that were read")
    return found


def files_of(folder: pathlib.Path) -> List[pathlib.Path]:
    """The files of a recording's folder in the order of time: as its metadata lists them, else by name."""
    there = sorted(p for p in folder.iterdir() if p.suffix in (".db3", ".mcap") and p.is_file())
    try:
        with (folder / METADATA).open("rb") as file:
            text = file.read(1 << 20).decode("utf-8", "replace")
    except FileNotFoundError:
        text = ""
    listed = re.findall(r"^\s*-\s+[\"']?([^\"'\s:]+\.(?:db3|mcap)(?:\.zstd)?)[\"']?\s*$", text, re.MULTILINE)
    rank = {name: number for number, name in reversed(list(enumerate(listed)))}
    if not there:
        packed = sorted(p.name for p in folder.glob("*.zstd"))
        if packed:
            raise ConvertError(f"{folder}: {packed[0]} is compressed; unpack it first: zstd -d {folder / packed[0]}")
        raise ConvertError(f"{folder}: a folder without .db3 and .mcap files; give a log, or the folder of a recording")
    return sorted(there, key=lambda p: (rank.get(p.name, len(rank)), p.name))


def read_rosbag2(path: pathlib.Path, warn: Warn, topic: Optional[str] = None) -> Track:
    """Reads the poses of one topic of a file or a folder, ENU_FLU."""
    messages: List[Recorded] = []
    for file in files_of(path) if path.is_dir() else [path]:
        with file.open("rb") as opened:
            is_mcap = opened.read(len(MCAP_MAGIC)) == MCAP_MAGIC
        messages += mcap_messages(file, warn) if is_mcap else db3_messages(file, warn)
    return track_from(messages, str(path), warn, topic)
