"""Converts between ROS and sonard: frames, poses to lines of JSON, the daemon's status, beams to laser scans. It needs no ROS.

sonard and ROS (REP 103) use the same frames: the world is ENU, the body is FLU. Only the order of a quaternion differs: x, y, z, w
in ROS, w, x, y, z in sonard. The images of oculus_sonar_driver (marine_acoustic_msgs) have their own frame: z points ahead, in the
middle of the fan, y points to port, and x points down.
"""
from __future__ import annotations

import json
import math
import re
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

Vector3 = Tuple[float, float, float]
Quaternion = Tuple[float, float, float, float]  # w, x, y, z
LATEST_STAMP_S = 4.5e9
NORM_ALLOWED = 1e-3


class Unusable(ValueError):
    """A message cannot be converted. The text is one sentence with the reason."""


def wxyz(xyzw: Sequence[float]) -> Quaternion:
    """Converts a quaternion from ROS's order to sonard's and normalises it. Raises Unusable if its length is not nearly 1: ROS
    leaves a quaternion that is not set at zero."""
    norm = math.sqrt(sum(v * v for v in xyzw))
    if len(xyzw) != 4 or not math.isfinite(norm) or abs(norm - 1) > NORM_ALLOWED:
        raise Unusable(f"orientation {tuple(xyzw)} has length {norm:g}, not 1")
    x, y, z, w = (v / norm for v in xyzw)
    return w, x, y, z


def xyzw(q: Sequence[float]) -> Quaternion:
    """Converts a quaternion from sonard's order to ROS's."""
    return q[1], q[2], q[3], q[0]


def rotate(q: Quaternion, v: Sequence[float]) -> Vector3:
    """Rotates a vector from body axes to the world axes that q refers to."""
    w, x, y, z = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx


def enu_from_ned(v: Sequence[float]) -> Vector3:
    """Converts a vector from NED to ENU, and from ENU to NED: the function is its own inverse."""
    return v[1], v[0], -v[2]


def flu_from_frd(v: Sequence[float]) -> Vector3:
    """Converts a vector from FRD to FLU, and from FLU to FRD."""
    return v[0], -v[1], -v[2]


def enu_flu_from_ned_frd(q: Quaternion) -> Quaternion:
    """Converts an orientation (body to world) from the axes NED and FRD to ENU and FLU. Applied twice, it returns -q, which is the
    same orientation."""
    w, x, y, z = q
    s = math.sqrt(0.5)
    return s * (w + z), s * (x + y), s * (x - y), s * (w - z)


def flu_from_image(v: Sequence[float]) -> Vector3:
    """Converts a vector from the image frame of oculus_sonar_driver to sonard's sonar frame (x ahead, y to port, z up)."""
    return v[2], v[1], -v[0]


def image_from_flu(v: Sequence[float]) -> Vector3:
    return -v[2], v[1], v[0]


# Rotation x, y, z, w of a static transform whose parent is the sonar's FLU frame and whose child is its image frame.
IMAGE_IN_FLU_XYZW = (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))


_NED = re.compile(r"(?<![a-z])ned(?![a-z])", re.IGNORECASE)


def axes_of(frame_id: str) -> str:
    """Returns the axes of a named frame: those of ROS, except for names such as world_ned (Stonefish, MAVROS, UUV Simulator)."""
    return "NED_FRD" if _NED.search(frame_id) else "ENU_FLU"


def json_line(position: Sequence[float], orientation: Quaternion, stamp_s: Optional[float] = None, vehicle: str = "",
              velocity_in_body: Optional[Sequence[float]] = None, frame: str = "ENU_FLU") -> bytes:
    """Makes the line that sonard receives over UDP. The velocity is in body axes, as in ROS; the line has it in world axes."""
    if len(position) != 3 or not all(map(math.isfinite, position)):
        raise Unusable(f"position {tuple(position)} is not three finite numbers")
    line: Dict[str, Any] = {"frame": frame, "position": list(position), "quaternion": list(orientation)}
    if stamp_s is not None:
        if not 0 <= stamp_s <= LATEST_STAMP_S:
            raise Unusable(f"stamp {stamp_s:g} s is not between 0 and 4.5e9")
        line["timestamp"] = stamp_s
    if vehicle:
        line["vehicle"] = vehicle
    if velocity_in_body is not None and all(map(math.isfinite, velocity_in_body)):
        line["velocity"] = list(rotate(orientation, velocity_in_body))
    return json.dumps(line, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def stamp_s(seconds: int, nanoseconds: int) -> Optional[float]:
    """Returns None for a stamp that is not set; sonard then uses the time of receipt."""
    return seconds + 1e-9 * nanoseconds if seconds or nanoseconds else None


def vehicle_in(status: Dict[str, Any], name: str) -> "Optional[Tuple[Vector3, Quaternion]]":
    """Finds a vehicle by its name in a status of the daemon; an empty name finds the only vehicle. Returns its position and its
    orientation w, x, y, z."""
    vehicles = [v for v in status.get("vehicles", []) if not name or v.get("name") == name]
    if len(vehicles) != 1 or "orientation" not in vehicles[0]:
        return None
    place, turn = vehicles[0].get("position", {}), vehicles[0]["orientation"]
    position = float(place.get("x", 0)), float(place.get("y", 0)), float(place.get("z", 0))
    return position, (float(turn.get("w", 0)), float(turn.get("x", 0)), float(turn.get("y", 0)), float(turn.get("z", 0)))


def stamp_ns(status: Dict[str, Any]) -> int:
    """Returns the daemon's time in a status, or 0 if the status has none."""
    stated = status.get("now_ns", 0)
    return int(stated) if isinstance(stated, int) or (isinstance(stated, str) and stated.isdigit()) else 0


def endpoint(text: str, port: int) -> Tuple[str, int]:
    """Splits "host" or "host:port"; `port` is the default."""
    host, colon, number = text.partition(":")
    if not host or (colon and not (number.isascii() and number.isdigit() and 0 < int(number) < 65536)):
        raise ValueError(f"{text!r} is not host:port")
    return host, int(number) if colon else port


def name_in_topic(sonar: str) -> str:
    """Makes a valid part of a topic from a sonar's name: letters, digits and underscores, the first of them not a digit."""
    name = "".join(c if c.isascii() and c.isalnum() else "_" for c in sonar)
    return "_" + name if name[:1].isdigit() else name


class Scan(NamedTuple):
    """Ranges at equally spaced angles from starboard to port, as in sensor_msgs/LaserScan. Angles to port are positive. A range of
    inf means that the beam hits nothing."""
    first_rad: float
    step_rad: float
    range_m: List[float]


def scan_of(azimuth_rad: Sequence[float], range_m: Sequence[float]) -> Scan:
    """Returns the scan: each angle has the range of the nearest beam. The beams are ordered from port to starboard; their
    range is 0 where they hit nothing."""
    if not 2 <= len(azimuth_rad) == len(range_m):
        raise Unusable(f"{len(range_m)} ranges of {len(azimuth_rad)} beams are not a scan")
    beams = sorted(zip(azimuth_rad, range_m))
    first, last = beams[0][0], beams[-1][0]
    step = (last - first) / (len(beams) - 1)
    ranges, at = [], 0
    for i in range(len(beams)):
        angle = first + i * step
        while at + 1 < len(beams) and abs(beams[at + 1][0] - angle) <= abs(beams[at][0] - angle):
            at += 1
        ranges.append(beams[at][1] or math.inf)
    return Scan(first, step, ranges)
