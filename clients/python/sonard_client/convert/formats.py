"""Detects the format of a log by its first bytes and converts it."""
from __future__ import annotations

import pathlib
import re
from typing import Callable, Optional, Union

from ..geodesy import Geodetic
from ..nmea import Assumptions
from ..pose_messages import FRAMES
from . import dataflash, mcap, rosbag, rosbag2, ulog
from .dataflash import read_dataflash
from .mavlink import frame_length
from .mcap import read_mcap
from .nmea_log import read_nmea
from .rosbag import read_rosbag
from .rosbag2 import files_of, read_rosbag2, recording_at
from .tlog import STAMP_BYTES, read_tlog
from .track import ConvertError, Place2, Track, Warn
from .ulog import read_ulog

FORMATS = ("dataflash", "tlog", "mcap", "rosbag", "db3", "ulog", "nmea")
RECORDINGS = ("mcap", "rosbag", "db3")  # their positions are metres from an unknown origin
_HEAD_BYTES = 4096
_SENTENCE = re.compile(rb"\$(P[A-Z]{3,4}|[A-Z]{2}[A-Z0-9]{3}),")
_WRITE = "write poses as CSV, in metres: sonard_client.geodesy converts degrees (docs/poses.md)"
# Common formats that cannot be read: first bytes, name of the format, advice; {} is the file.
_OTHERS = (
    (b"\x28\xb5\x2f\xfd", "compressed by zstd; unpack it first: zstd -d {}"),
    (b"\x04\x22\x4d\x18", "compressed by lz4; unpack it first: lz4 -d {}"),
    (b"\x1f\x8b", "compressed by gzip; unpack it first: gunzip -k {}"),
    (b"BZh", "compressed by bzip2; unpack it first: bunzip2 -k {}"),
    (b"\xfd7zXZ\x00", "compressed by xz; unpack it first: unxz -k {}"),
    (b"7z\xbc\xaf", "a 7z archive; unpack it first: 7z x {}"),
    (b"PK\x03\x04", "a ZIP archive; unpack it first: unzip {}"),
    (b"#ROSBAG V1", "a ROS 1 bag of an old format; rewrite it: rosbag migrate {} NEW.bag"),
    (b"FMT, 128, ", "a dataflash log as text; give the .bin file that it was made from"),
    (b"\x89HDF\r\n", "HDF5, as .mat files of MATLAB 7.3 and grids (BAG, S-102) are; write its poses as CSV (docs/poses.md), or name "
     "the grid in the scene (docs/scenes.md)"),
    (b"LASF", "a cloud of points (LAS, LAZ), not a track; give the log of the vehicle"),
    (b"version https://git-lfs", "a pointer of Git LFS, not the file itself; to fetch the file: git lfs pull"),
    (b"<", "XML, such as GPX and KML, without attitudes; " + _WRITE),
    (b"CDF", "NetCDF; write its poses as CSV (docs/poses.md)"),
    (b"\xd4\xc3\xb2\xa1", "a capture of packets; give the log of the vehicle"),
    (b"\n\r\r\n", "a capture of packets; give the log of the vehicle"),
    (b"{", "JSON; " + _WRITE),
    (b"!AIVD", "AIS messages, without attitudes and seconds; give the log of the vehicle's own instruments"),
    (b"\xff\xfe", "text in UTF-16; save it as UTF-8"),
    (b"MATLAB 5.0", "a MATLAB file; write its poses as CSV (docs/poses.md)"),
)


def _described(path: pathlib.Path, head: bytes) -> str:
    """Names the format of a file that cannot be read, with advice; empty if the format is unknown."""
    plain = head[3:].lstrip() if head.startswith(b"\xef\xbb\xbf") else head.lstrip()
    if plain[:15].lower().startswith((b"<!doctype html", b"<html")):
        return "a web page, not the file itself; was the download refused? Fetch it again"
    for magic, text in _OTHERS:
        if head.startswith(magic) or plain.startswith(magic):
            return text.format(path)
    if head[8:12] == b".FIT":
        return "a track of a watch or a GPS (FIT), without attitudes; " + _WRITE
    frame = frame_length(head, 0)
    if frame is not None and frame_length(head, frame) is not None:
        return ("MAVLink frames without times; give the telemetry log of a ground station (.tlog) or the autopilot's own log "
                "(.bin), or send the frames to a running sonard (docs/poses.md)")
    first = next((line for line in head.split(b"\n") if line.strip() and not line.startswith(b"#")), head)
    if re.search(rb"(?i)(^|[,;\t ])\"?(lat|lon|latitude|longitude|lng)(_deg)?\"?([,;\t ]|$)", first.strip()):
        return "text with latitudes and longitudes; " + _WRITE
    if all(9 <= byte < 128 for byte in head) and (set(first) <= set(b"0123456789+-.eE, \t\r") or first[:1] in b"tT"):
        return ("text; sonard plays TUM, EuRoC, KITTI and CSV with a header unconverted: name the file in `trajectory:` "
                "(docs/poses.md)")
    return ""


def format_of(path: pathlib.Path) -> str:
    """Returns one of FORMATS (for a folder, that of its first recording), or raises ConvertError."""
    path = recording_at(path)
    if path.is_dir():
        path = files_of(path)[0]
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    if not head:
        raise ConvertError(f"{path}: the file is empty")
    for magic, name in ((dataflash.MAGIC, "dataflash"), (mcap.MAGIC, "mcap"), (rosbag.MAGIC, "rosbag"), (rosbag2.MAGIC, "db3"),
                        (ulog.MAGIC, "ulog")):
        if head.startswith(magic):
            return name
    if frame_length(head, STAMP_BYTES) is not None or (path.suffix == ".tlog" and not _described(path, head)):
        return "tlog"
    if (b"$" in head and b"," in head and all(byte < 128 for byte in head)) or (_SENTENCE.search(head) and min(head) >= 9):
        return "nmea"
    described = _described(path, head)
    if described:
        raise ConvertError(f"{path}: {described}")
    raise ConvertError(f"{path}: at byte 0: none of {', '.join(FORMATS)}; if its beginning is damaged, name the format "
                       "with --format")


def convert(path: "Union[str, pathlib.Path]", kind: Optional[str] = None, source: Optional[str] = None,
            topic: Optional[str] = None, origin: Optional[Geodetic] = None, system: Optional[int] = None,
            assumed: Assumptions = Assumptions(), warn: Warn = lambda text: None, component: Optional[int] = None,
            at: Optional[Place2] = None, frame: Optional[str] = None, without_checksum: bool = False) -> Track:
    """Reads the track of one vehicle. kind: one of FORMATS; default: detected. source: messages of an autopilot's log.
    topic: topic of a recording. system, component: MAVLink system and component of a telemetry log. at: north and east [m]
    of a vehicle whose log has a depth but no horizontal position. frame: axes of a recording, "ENU_FLU" or "NED_FRD"; default:
    as the recording states. without_checksum: accept NMEA sentences without one. Raises ConvertError and OSError."""
    file = recording_at(pathlib.Path(path))
    chosen = kind or format_of(file)
    readers: "dict[str, Callable[[], Track]]" = {
        "dataflash": lambda: read_dataflash(file, warn, source, origin, at),
        "tlog": lambda: read_tlog(file, warn, source, origin, system, component, at),
        "mcap": lambda: read_rosbag2(file, warn, topic, frame) if file.is_dir() else read_mcap(file, warn, topic, frame),
        "rosbag": lambda: read_rosbag(file, warn, topic, frame),
        "db3": lambda: read_rosbag2(file, warn, topic, frame),
        "ulog": lambda: read_ulog(file, warn, source, origin, at),
        "nmea": lambda: read_nmea(file, warn, origin, assumed, without_checksum)}
    if chosen not in readers:
        raise ValueError(f"format is {chosen!r}: it must be one of {', '.join(FORMATS)}")
    if origin is not None and chosen in RECORDINGS:
        raise ValueError("an origin needs positions in degrees; poses of recordings are in metres")
    of_nmea = "it assumes what NMEA sentences lack"
    for option, is_given, kinds, why in (
            ("--source", source is not None, ("dataflash", "tlog", "ulog"), "it names messages of an autopilot"),
            ("--topic", topic is not None, RECORDINGS, "topics are in recordings of robots"),
            ("--system", system is not None, ("tlog",), "systems are in MAVLink telemetry"),
            ("--component", component is not None, ("tlog",), "components are in MAVLink telemetry"),
            ("--depth", assumed.depth_m != 0, ("nmea",), of_nmea),
            ("--bottom", assumed.bottom_m is not None, ("nmea",), of_nmea),
            ("--depth-is-vehicle", assumed.depth_is_vehicle, ("nmea",), of_nmea),
            ("--heading", assumed.heading_deg is not None, ("nmea",), of_nmea),
            ("--without-checksum", without_checksum, ("nmea",), "only NMEA sentences may lack one")):
        if is_given and chosen not in kinds:
            raise ValueError(f"{option} has no effect on {chosen}, only on {', '.join(kinds)}: {why}")
    if frame is not None and frame not in FRAMES:
        raise ValueError(f'frame is {frame!r}: it must be one of {", ".join(FRAMES)}')
    if frame is not None and chosen not in RECORDINGS:
        raise ValueError(f"--frame is for recordings of ROS and MCAP only: {chosen} is always NED_FRD")
    if at is not None and chosen not in ("dataflash", "tlog", "ulog"):
        raise ValueError(f"--at is for logs of autopilots without horizontal position, not for {chosen}")
    return readers[chosen]()
