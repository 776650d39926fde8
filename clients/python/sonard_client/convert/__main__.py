"""python3 -m sonard_client.convert IN -o OUT.csv: converts logs of autopilots, robots and instruments to trajectory files.

Reads ArduPilot dataflash (.bin), telemetry logs (.tlog), logs of PX4 (.ulg), recordings of ROS 2 (folders, .db3, MCAP) and ROS 1,
and NMEA 0183, detected by content.
"""
from __future__ import annotations

import argparse
import os
import pathlib
import re
import sys
from typing import List, Optional

from ..geodesy import parse_origin
from ..nmea import Assumptions
from .formats import FORMATS, convert, format_of
from .track import ConvertError, Place2, Track, dead_reckon, gap_warning, write_csv


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python3 -m sonard_client.convert", description=__doc__)
    parser.add_argument("file", type=pathlib.Path)
    parser.add_argument("-o", "--output", required=True, help="trajectory file, or - for standard output")
    parser.add_argument("--format", choices=FORMATS, help="if it cannot be detected")
    parser.add_argument("--source", help="dataflash: SIM, XKF1, XKF1:1 (second core), AHR2, ATT+POS, ..; "
                        "tlog: ODOMETRY, SIM_STATE, ATTITUDE+LOCAL_POSITION_NED, ..")
    parser.add_argument("--topic", help="topic of a recording; for transforms '/tf parent->child'")
    parser.add_argument("--system", type=int, help="MAVLink system of a telemetry log")
    parser.add_argument("--component", type=int, help="use only messages of this MAVLink component (autopilots are 1)")
    parser.add_argument("--origin", metavar="LAT,LON[,ALT]", help="origin of the world, degrees and m (default: the first fix)")
    parser.add_argument("--at", metavar="NORTH,EAST", help="place [m] of a vehicle whose log has depth and attitude only (0,0)")
    parser.add_argument("--dead-reckon", type=float, metavar="M/S", help="move such a vehicle ahead at this speed")
    parser.add_argument("--frame", choices=("ENU_FLU", "NED_FRD"), help="frame of a recording that does not use ROS's ENU_FLU")
    parser.add_argument("--body", help="adds a column `body` with this name, to combine several files")
    parser.add_argument("--keep-time", action="store_true", help="keep the log's times (default: start at 0)")
    parser.add_argument("--depth", type=float, default=0.0, metavar="M", help="NMEA: vehicle depth without DPT and DBT (0)")
    parser.add_argument("--bottom", type=float, metavar="M", help="NMEA: depth of the bottom; the vehicle is DPT or DBT above it")
    parser.add_argument("--depth-is-vehicle", action="store_true", help="NMEA: DPT and DBT give the vehicle's own depth")
    parser.add_argument("--heading", type=float, metavar="DEG", help="NMEA: heading, used until one is received")
    parser.add_argument("--without-checksum", action="store_true",
                        help="NMEA: accept sentences without a checksum; wrong checksums are always rejected")
    return parser


def _log(text: str) -> None:
    print(f"sonard_client.convert: {text}", file=sys.stderr)


def _check_output(options: argparse.Namespace) -> None:
    """Raises an error before the log is read, which may take minutes."""
    output = pathlib.Path(options.output)
    if options.output == "-":
        return
    if output.is_dir():
        raise ValueError(f"-o {output} is a folder: name a file")
    if output.exists() and options.file.exists() and output.samefile(options.file):
        raise ValueError(f"-o {output} is the log that is read: name another file")
    if not output.parent.is_dir():
        raise FileNotFoundError(f"cannot write {output}: its folder does not exist; make it first")


def _write(track: Track, options: argparse.Namespace) -> None:
    if options.output == "-":
        write_csv(track, sys.stdout, options.body or "", options.keep_time)
        return
    unfinished = options.output + ".part"
    try:
        with open(unfinished, "w", encoding="utf-8") as out:
            write_csv(track, out, options.body or "", options.keep_time)
        os.replace(unfinished, options.output)
    except OSError:
        pathlib.Path(unfinished).unlink(missing_ok=True)
        raise


def _place(text: Optional[str]) -> Optional[Place2]:
    if text is None:
        return None
    try:
        north, east = (float(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"--at {text!r} is not NORTH,EAST in metres") from None
    if not (abs(north) <= 1e7 and abs(east) <= 1e7):
        raise ValueError(f"--at {text!r} is out of range: within 1e7 m")
    return north, east


def _run(options: argparse.Namespace) -> None:
    if options.body is not None and not re.fullmatch(r"[^\s,#\"]{1,64}", options.body):
        raise ValueError(f"body {options.body!r}: a name has at most 64 characters, without spaces, commas, quotes and #")
    if options.bottom is not None and options.depth_is_vehicle:
        raise ValueError("--bottom and --depth-is-vehicle exclude each other: give one")
    _check_output(options)
    warned: List[str] = []

    def warn(text: str) -> None:
        warned.append(text)
        _log(f"{options.file}: {text}")

    if options.dead_reckon is not None and not abs(options.dead_reckon) <= 100:
        raise ValueError(f"--dead-reckon {options.dead_reckon:g} is out of range: within 100 m/s")
    if options.component is not None and not 0 <= options.component <= 255:
        raise ValueError(f"component {options.component}: it must be 0 to 255")
    origin = parse_origin(options.origin) if options.origin else None
    kind = options.format or format_of(options.file)
    assumed = Assumptions(heading_deg=options.heading, depth_m=options.depth, depth_is_vehicle=options.depth_is_vehicle,
                          bottom_m=options.bottom)
    track = convert(options.file, kind, options.source, options.topic, origin, options.system, assumed, warn,
                    options.component, _place(options.at), options.frame, options.without_checksum)
    if options.dead_reckon is not None:
        if not track.held:
            raise ValueError(f"--dead-reckon is for logs without horizontal position: {track.source} has one")
        dead_reckon(track, options.dead_reckon)
        warn(f"dead reckoned at {options.dead_reckon:g} m/s ahead: the error grows with time")
    gap = gap_warning(track.rows)
    if gap:
        warn(gap)
    _write(track, options)
    _log(f"{options.file}: {len(track.rows)} poses of {track.source} over {track.rows[-1].t_s - track.rows[0].t_s:.1f} s, "
         f"{track.frame}")


def main(arguments: Optional[List[str]] = None) -> int:
    options = _parser().parse_args(arguments)
    try:
        _run(options)
    except ConvertError as error:
        _log(str(error))
        return 65
    except ValueError as error:
        _log(str(error))
        return 64
    except (FileNotFoundError, IsADirectoryError) as error:
        _log(f"{error.filename}: file not found" if error.filename else str(error))
        return 66
    except OSError as error:
        _log(str(error))
        return 74
    return 0


if __name__ == "__main__":
    sys.exit(main())
