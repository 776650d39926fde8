"""Reads recordings of ROS 2: SQLite files (.db3) and the folders that `ros2 bag record` makes, of SQLite or MCAP files."""
from __future__ import annotations

import contextlib
import pathlib
import re
import sqlite3
from typing import Dict, Iterator, List, Optional
from urllib.parse import quote

from .mcap import MAGIC as MCAP_MAGIC
from .mcap import mcap_messages
from .messages import may_hold_poses
from .recording import MOST_MESSAGE_BYTES, Kept, Recorded, track_from
from .track import ConvertError, Track, Warn

MAGIC = b"SQLite format 3\0"
METADATA = "metadata.yaml"
COLUMNS = {"topics": ("id", "name", "type", "serialization_format"), "messages": ("id", "topic_id", "timestamp", "data")}
MOST_TOPICS = 500  # limit for topics that may hold poses
ROW_BYTES = 8  # minimum overhead of a stored message
STEPS_PER_BYTE = 10  # instructions of SQLite; a scan needs about 20 per row
_STEPS_AT_ONCE = 100_000
_PARTS_NAMED = 20
_PART = re.compile(r"^[ \t]*-[ \t]+[\"']?([^\"'\s:]+\.(?:db3|mcap)(?:\.zstd)?)[\"']?[ \t\r]*$", re.MULTILINE)


def _unmerged(path: pathlib.Path) -> Optional[pathlib.Path]:
    """Returns the file beside a database that has its last changes, which exists if the writer did not end regularly."""
    beside = (path.with_name(path.name + end) for end in ("-wal", "-journal"))
    return next((p for p in beside if p.is_file() and p.stat().st_size), None)


class _Base:
    """A database that may be hostile: only stored tables are read, with no more rows than the file can contain."""

    def __init__(self, path: pathlib.Path, unmerged: Optional[pathlib.Path]) -> None:
        resolved = path.resolve()
        self.bytes_left = resolved.stat().st_size + (unmerged.stat().st_size if unmerged else 0)
        self._steps_left = STEPS_PER_BYTE * (self.bytes_left + (1 << 20))
        self.exceeded = False
        options = "mode=ro" if unmerged else "mode=ro&immutable=1"
        self.base = sqlite3.connect(f"file:{quote(str(resolved))}?{options}", uri=True)
        self.base.text_factory = lambda raw: raw.decode("utf-8", "replace")
        self.base.set_progress_handler(self._is_too_long, _STEPS_AT_ONCE)
        if hasattr(self.base, "setlimit"):  # since Python 3.11
            self.base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(1 << 20, min(self.bytes_left, (1 << 31) - 1)))

    def close(self) -> None:
        self.base.close()

    def _is_too_long(self) -> bool:
        self._steps_left -= _STEPS_AT_ONCE
        self.exceeded |= self._steps_left < 0
        return self.exceeded

    def _check(self) -> None:
        """Refuses views, virtual tables and generated columns, which are programs, not data."""
        self.base.execute("PRAGMA trusted_schema=OFF")
        if self.base.execute("SELECT 1 FROM sqlite_master WHERE name = 'message_types'").fetchone():
            raise ConvertError("a log of Gazebo, which is not read; play it (gz sim --playback FOLDER) and take the "
                               "poses from clients/gazebo_bridge")
        for table, needed in COLUMNS.items():
            kinds = self.base.execute("SELECT type, rootpage FROM sqlite_master WHERE name = ? COLLATE NOCASE",
                                      (table,)).fetchall()
            if not kinds:
                raise sqlite3.DatabaseError(f"no such table: {table}")
            if len(kinds) > 1 or kinds[0][0] != "table" or not kinds[0][1]:
                raise sqlite3.DatabaseError(f"{table} is not a stored table")
            hidden = {str(row[1]).lower(): row[6] for row in self.base.execute(f"PRAGMA table_xinfo({table})")}
            for column in needed:
                if hidden.get(column, 0):
                    raise sqlite3.DatabaseError(f"column {column} of {table} is not stored")

    def rows(self, warn: Warn, seen: Dict[str, str]) -> Iterator[Recorded]:
        self._check()
        topics = {}
        for number, *texts in self.base.execute(f"SELECT {', '.join(COLUMNS['topics'])} FROM topics"):
            topic, schema, encoding = map(str, texts)
            if len(seen) < MOST_TOPICS:
                seen[topic] = schema
            if isinstance(number, int) and may_hold_poses(encoding, schema):
                topics[number] = topic, encoding, schema
            if len(topics) > MOST_TOPICS:
                raise sqlite3.DatabaseError(f"more than {MOST_TOPICS} topics with poses")
        # There is no ORDER BY, because with it SQLite copies all rows before it returns the first.
        select = ("SELECT id, topic_id, timestamp, CASE WHEN typeof(data) = 'blob' AND length(data) <= ? THEN data END FROM "
                  f"messages WHERE topic_id IN ({','.join('?' * len(topics))})")
        odd: Dict[str, int] = {}
        for row, number, stamp_ns, data in self.base.execute(select, (MOST_MESSAGE_BYTES, *topics)):
            topic, encoding, schema = topics[number]
            self.bytes_left -= ROW_BYTES + (len(data) if isinstance(data, bytes) else 0)
            if self.bytes_left < 0:
                self.exceeded = True
                return
            if isinstance(row, int) and isinstance(stamp_ns, int) and isinstance(data, bytes):
                yield Recorded(topic, encoding, schema, 1e-9 * stamp_ns, data, row, "message")
            else:
                odd[topic] = odd.get(topic, 0) + 1
        for topic, count in sorted(odd.items()):
            warn(f"messages of {topic} omitted because they have no time, no bytes or more than {MOST_MESSAGE_BYTES >> 20} MiB: "
                 f"{count}")


def _rows(path: pathlib.Path, warn: Warn, seen: Dict[str, str]) -> Iterator[Recorded]:
    unmerged = _unmerged(path.resolve())
    with contextlib.closing(_Base(path, unmerged)) as base:
        try:
            yield from base.rows(warn, seen)
        except ConvertError as error:
            raise ConvertError(f"{path}: {error}") from None
        except sqlite3.Error as error:
            if unmerged and not base.exceeded:
                raise ConvertError(f"{path}: its writer did not end as it should: {unmerged.name} belongs to it, and the two "
                                   f"cannot be read together: {error}; copy both and repair the copy: sqlite3 COPY 'PRAGMA "
                                   "journal_mode=DELETE'") from None
            if not base.exceeded:
                raise
        if base.exceeded:
            raise ConvertError(f"{path}: its tables list more than a file of this size can hold; it is damaged or not a "
                               "recording of ROS 2")


def db3_messages(path: pathlib.Path, warn: Warn, seen: Dict[str, str]) -> List[Recorded]:
    """Reads the messages with poses. seen: receives the types of all topics."""
    found = Kept()
    try:
        found.extend(_rows(path, warn, seen))
    except (sqlite3.Error, OverflowError, UnicodeError) as error:
        if not found:
            raise ConvertError(f"{path}: not a recording of ROS 2, or damaged: {error}; a damaged one may be repaired by "
                               "ros2 bag reindex") from None
        warn(f"is damaged ({error}); {len(found)} messages before that were read")
    return sorted(found, key=lambda message: (message.logged_s, message.at))


def _warn_of_missing(folder: pathlib.Path, there: List[pathlib.Path], listed: List[str], warn: Warn) -> None:
    """Names the parts of a recording that are not read, because they are missing or compressed."""
    names = {p.name for p in there}
    plain = dict.fromkeys(name[:-len(".zstd")] if name.endswith(".zstd") else name for name in listed)
    packed = [p.name for p in sorted(folder.glob("*.zstd")) if p.name[:-len(".zstd")] not in names]
    absent = [name for name in plain if name not in names and name + ".zstd" not in packed]
    for missing, what in ((packed, "are compressed, so they are omitted; unpack them first: zstd -d"),
                          (absent, f"are omitted: {METADATA} lists them, and they are not in the folder")):
        if missing:
            shown = ["".join(c if c.isprintable() else "?" for c in name[:200]) for name in missing[:_PARTS_NAMED]]
            more = f" and {len(missing) - _PARTS_NAMED} more" if len(missing) > _PARTS_NAMED else ""
            warn(f"parts of the recording {what}: {', '.join(shown)}{more}")


def files_of(folder: pathlib.Path, warn: Warn = lambda text: None) -> List[pathlib.Path]:
    """Returns the files of a recording's folder. Warns of files that its metadata lists and that are missing."""
    there = sorted(p for p in folder.iterdir() if p.suffix in (".db3", ".mcap") and p.is_file())
    try:
        with (folder / METADATA).open("rb") as file:
            text = file.read(1 << 20).decode("utf-8", "replace")
    except FileNotFoundError:
        text = ""
    listed = [name.rpartition("/")[2] for name in _PART.findall(text)]  # older versions write the folder, too
    if not there:
        packed = sorted(p.name for p in folder.glob("*.zstd"))
        if packed:
            raise ConvertError(f"{folder}: {packed[0]} is compressed; unpack it first: zstd -d {folder / packed[0]}")
        raise ConvertError(f"{folder}: a folder without .db3 and .mcap files; give a log, or the folder of a recording")
    _warn_of_missing(folder, there, listed, warn)
    return there


def recording_at(path: pathlib.Path) -> pathlib.Path:
    """Returns the recording that a path names; the path of a metadata file means its folder."""
    return path.parent if path.name == METADATA and path.is_file() else path


def read_rosbag2(path: pathlib.Path, warn: Warn, topic: Optional[str] = None, frame: Optional[str] = None) -> Track:
    """Reads the poses of one topic of a file or a folder, ENU_FLU."""
    parts: List[List[Recorded]] = []
    seen: Dict[str, str] = {}
    for file in files_of(path, warn) if path.is_dir() else [path]:
        with file.open("rb") as opened:
            is_mcap = opened.read(len(MCAP_MAGIC)) == MCAP_MAGIC
        parts.append(mcap_messages(file, warn, seen) if is_mcap else db3_messages(file, warn, seen))
    parts.sort(key=lambda part: part[0].logged_s if part else 0.0)  # names do not sort by time: run_10.db3 precedes run_2.db3
    messages = Kept(message for part in parts for message in part)
    return track_from(messages, str(path), warn, topic, seen, frame)
