"""Detects the format of a log by its first bytes and converts it."""
from __future__ import annotations

import pathlib
from typing import Callable, Optional, Union

from ..geodesy import Geodetic
from ..nmea import Assumptions
from . import dataflash, mcap, rosbag
from .dataflash import read_dataflash
from .mavlink import frame_length
from .mcap import read_mcap
from .nmea_log import read_nmea
from .rosbag import read_rosbag
from .tlog import STAMP_BYTES, read_tlog
from .track import ConvertError, Track, Warn

FORMATS = ("dataflash", "tlog", "mcap", "rosbag", "nmea")
_HEAD_BYTES = 4096


def format_of(path: pathlib.Path) -> str:
    """Returns one of FORMATS, or raises ConvertError."""
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    if not head:
        raise ConvertError(f"{path}: the file is empty")
    for magic, name in ((dataflash.MAGIC, "dataflash"), (mcap.MAGIC, "mcap"), (rosbag.MAGIC, "rosbag")):
        if head.startswith(magic):
            return name
    if frame_length(head, STAMP_BYTES) is not None or path.suffix == ".tlog":
        return "tlog"
    if b"$" in head and b"," in head and all(byte < 128 for byte in head):
        return "nmea"
    raise ConvertError(f"{path}: at byte 0: none of {', '.join(FORMATS)}; if its beginning is damaged, name the format "
                       "with --format")


def convert(path: "Union[str, pathlib.Path]", kind: Optional[str] = None, source: Optional[str] = None,
            topic: Optional[str] = None, origin: Optional[Geodetic] = None, system: Optional[int] = None,
            assumed: Assumptions = Assumptions(), warn: Warn = lambda text: None, component: Optional[int] = None) -> Track:
    """Reads the track of one vehicle. kind: one of FORMATS; default: detected. source: messages of a dataflash or telemetry log.
    topic: topic of a recording. system, component: MAVLink system and component of a telemetry log. Raises ConvertError and
    OSError."""
    file = pathlib.Path(path)
    chosen = kind or format_of(file)
    readers: "dict[str, Callable[[], Track]]" = {
        "dataflash": lambda: read_dataflash(file, warn, source, origin),
        "tlog": lambda: read_tlog(file, warn, source, origin, system, component),
        "mcap": lambda: read_mcap(file, warn, topic),
        "rosbag": lambda: read_rosbag(file, warn, topic),
        "nmea": lambda: read_nmea(file, warn, origin, assumed)}
    if chosen not in readers:
        raise ValueError(f"format is {chosen!r}: it must be one of {', '.join(FORMATS)}")
    if origin is not None and chosen in ("mcap", "rosbag"):
        raise ValueError("an origin needs positions in degrees; poses of recordings are in metres")
    return readers[chosen]()
