"""Telemetry logs of ground stations (.tlog): for every MAVLink frame the time of its arrival, microseconds since 1970 in eight
bytes, the highest first, and the frame.
"""
from __future__ import annotations

import math
import pathlib
from typing import Dict, Iterator, List, NamedTuple, Optional, Tuple

from ..geodesy import Geodetic
from ..rotations import Quaternion, quaternion_from_rpy, unit
from .mavlink import (BODY_FLU, BODY_FRD, BODY_NED, LOCAL_FRD, LOCAL_NED, MESSAGES, Frame, fields_of, frame_length,
                      read_frame)
from .track import ConvertError, Source, Stream, Track, Warn, chosen, track_of

STAMP_BYTES = 8
RESTART_S = 5.0  # frames that come late by less are only late
SILENCE_S = 5.0  # of a component, after which another one that sends the same message is listened to, as the daemon does
FULL = ("ODOMETRY", "SIM_STATE", "ATT_POS_MOCAP", "VISION_POSITION_ESTIMATE")
ATTITUDES, POSITIONS = ("ATTITUDE_QUATERNION", "ATTITUDE"), ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")


class Logged(NamedTuple):
    arrived_s: float
    frame: Frame


def _believable(data: bytes, at: int, frame: Frame) -> bool:
    """Whether a record begins there: an intact frame, or one of an unknown message with another record or the end behind it."""
    if frame.intact is not None:
        return frame.intact
    behind = at + STAMP_BYTES + frame.length
    return behind == len(data) or frame_length(data, behind + STAMP_BYTES) is not None


def records(data: bytes, warn: Warn) -> Iterator[Logged]:
    """The frames whose CRC holds, or cannot be judged since the message holds no pose."""
    at, skipped, first_skipped = 0, 0, -1
    while at + STAMP_BYTES < len(data):
        length = frame_length(data, at + STAMP_BYTES)
        if length is not None and at + STAMP_BYTES + length > len(data) and len(data) - at < STAMP_BYTES + 300:
            warn(f"ends within a frame, at byte {at}: what comes before it was read")
            break
        frame = read_frame(data, at + STAMP_BYTES) if length is not None else None
        if frame is None or not _believable(data, at, frame):
            first_skipped = at if first_skipped < 0 else first_skipped
            skipped += 1
            at += 1
            continue
        yield Logged(1e-6 * int.from_bytes(data[at:at + STAMP_BYTES], "big"), frame)
        at += STAMP_BYTES + frame.length
    if skipped:
        warn(f"{skipped} bytes are no intact frame, the first at byte {first_skipped}; they were passed over")


def _quaternion(f: Dict[str, float]) -> Optional[Quaternion]:
    parts = [f[f"q{i}"] for i in range(1, 5)]
    return unit(parts) if abs(sum(p * p for p in parts) - 1) < 1e-3 else None


def _is_served(f: Dict[str, float]) -> bool:
    """An ODOMETRY. The frame of the world, said for the body, is that of the velocity: the attitude is that of FRD then."""
    return f["frame_id"] in (LOCAL_NED, LOCAL_FRD) and f["child_frame_id"] in (BODY_NED, BODY_FRD, BODY_FLU, f["frame_id"])


def _of_frd(q: Quaternion) -> Quaternion:
    """From that of FLU: half a turn about the axis ahead comes before it, q (0, 1, 0, 0)."""
    return -q[1], q[0], q[3], -q[2]


def _angles(f: Dict[str, float]) -> Optional[Quaternion]:
    three = f["roll"], f["pitch"], f["yaw"]
    return quaternion_from_rpy(*three) if all(map(math.isfinite, three)) else None


def _metres(f: Dict[str, float]) -> "Optional[Tuple[float, float, float]]":
    three = f["x"], f["y"], f["z"]
    return three if all(map(math.isfinite, three)) else None


def _simulated_place(f: Dict[str, float]) -> Geodetic:
    """Older simulators send the places as float degrees only, steps of 0.4 m at middle latitudes."""
    if f["lat_int"] or f["lon_int"]:
        return Geodetic(1e-7 * f["lat_int"], 1e-7 * f["lon_int"], f["alt"])
    return Geodetic(f["lat"], f["lon"], f["alt"])


class _Vehicle:
    """What one system of the network said of itself; `component`: the only one of its components that is listened to."""

    def __init__(self, component: Optional[int] = None) -> None:
        self.component = component
        self.there: "set[int]" = set()  # components that sent anything
        self.attitudes: Dict[str, Stream[Quaternion]] = {}
        self.positions: "Dict[str, Stream]" = {}
        self.origin: Optional[Geodetic] = None
        self.left_out: "Dict[Tuple[float, float], int]" = {}  # ODOMETRY, by frame_id and child_frame_id
        self.heading_is_local = False
        self.restarts = 0
        self._boot: "Optional[Tuple[float, float]]" = None  # the last time since start, and when it arrived
        self._before_s = 0.0  # what times since start are counted from, after a restart
        self._heard: "Dict[str, Tuple[int, float]]" = {}  # of each message its component, and when that was last heard
        self.components: Dict[str, List[int]] = {}  # of each message those listened to, one after the other
        self.unheard: "Dict[str, Dict[int, int]]" = {}  # of each message those that were not, and how often

    def take(self, logged: Logged) -> None:
        fields = fields_of(logged.frame)
        name = MESSAGES[logged.frame.message_id].name if fields is not None else "HEARTBEAT"
        if fields is None or name == "HEARTBEAT" or not self._is_heard(name, logged):
            return
        if name == "GPS_GLOBAL_ORIGIN":
            place = Geodetic(1e-7 * fields["latitude"], 1e-7 * fields["longitude"], 1e-3 * fields["altitude"])
            self.origin = self.origin or (place if place.is_fix else None)
            return
        # Attitude and position are paired by the vehicle's clock where both carry it; otherwise arrival has to do.
        t = self._since_start(1e-3 * fields["time_boot_ms"], logged.arrived_s) if "time_boot_ms" in fields else \
            1e-6 * fields["time_usec"] if fields.get("time_usec") else logged.arrived_s
        attitude: Optional[Quaternion] = None
        position: "Optional[tuple]" = None
        if name == "ODOMETRY" and not _is_served(fields):
            frames = fields["frame_id"], fields["child_frame_id"]
            self.left_out[frames] = self.left_out.get(frames, 0) + 1
            return
        if name in ("ODOMETRY", "ATT_POS_MOCAP", "ATTITUDE_QUATERNION", "SIM_STATE"):
            attitude = _quaternion(fields)
            if attitude is not None and fields.get("child_frame_id") == BODY_FLU:
                attitude = _of_frd(attitude)
        elif name in ("ATTITUDE", "VISION_POSITION_ESTIMATE"):
            attitude = _angles(fields)
        if name in ("ODOMETRY", "ATT_POS_MOCAP", "VISION_POSITION_ESTIMATE", "LOCAL_POSITION_NED"):
            position = _metres(fields)
        elif name in ("SIM_STATE", "GLOBAL_POSITION_INT"):
            place = _simulated_place(fields) if name == "SIM_STATE" else \
                Geodetic(1e-7 * fields["lat"], 1e-7 * fields["lon"], 1e-3 * fields["alt"])
            position = place if place.is_fix else None
        if name in FULL and (attitude is None or position is None):
            return
        self.heading_is_local |= fields.get("frame_id") == LOCAL_FRD
        if attitude is not None:
            self.attitudes.setdefault(name, []).append((t, attitude))
        if position is not None:
            self.positions.setdefault(name, []).append((t, position))

    def _is_heard(self, name: str, logged: Logged) -> bool:
        """Of several components that send the same message one is listened to: tracks of two are never woven into one."""
        component = logged.frame.component
        self.there.add(component)
        if self.component is not None and component != self.component:
            return name == "GPS_GLOBAL_ORIGIN"  # is the whole system's, whoever tells it
        known = self._heard.get(name)
        if known is not None and known[0] != component and logged.arrived_s - known[1] <= SILENCE_S:
            counts = self.unheard.setdefault(name, {})
            counts[component] = counts.get(component, 0) + 1
            return False
        self._heard[name] = component, logged.arrived_s
        if known is None or known[0] != component:
            self.components.setdefault(name, []).append(component)
        return True

    def choices(self) -> List[str]:
        """Of components, where there was one."""
        return [f"{name}: component {', later '.join(map(str, taken))} (left out: " +
                (", ".join(f"{n} messages of {c}" for c, n in sorted(self.unheard.get(name, {}).items())) or "none") + ")"
                for name, taken in sorted(self.components.items()) if name in self.unheard or len(taken) > 1]

    def _since_start(self, boot_s: float, arrived_s: float) -> float:
        """Goes on by the time of arrival when the vehicle starts again."""
        if self._boot is not None and boot_s < self._boot[0] - RESTART_S:
            self._before_s += self._boot[0] - boot_s + max(0.0, arrived_s - self._boot[1])
            self.restarts += 1
        self._boot = boot_s, arrived_s
        return self._before_s + boot_s

    def sources(self) -> List[Source]:
        pairs = [(n, n) for n in FULL[:2]] + [(a, p) for p in POSITIONS for a in ATTITUDES] + [(n, n) for n in FULL[2:]]
        return [Source(a if a == p else f"{a}+{p}", self.attitudes.get(a, []), self.positions.get(p, [])) for a, p in pairs]

    @property
    def weight(self) -> int:
        return max(min(len(s.attitudes), len(s.positions)) for s in self.sources())


def _vehicle(vehicles: Dict[int, _Vehicle], system: Optional[int], name: str, warn: Warn) -> _Vehicle:
    with_poses = sorted((n for n, v in vehicles.items() if v.weight), key=lambda n: -vehicles[n].weight)
    if system is not None:
        if system not in vehicles:
            raise ConvertError(f"{name}: system {system} does not occur; there are " +
                               (", ".join(map(str, sorted(vehicles))) or "none"))
        return vehicles[system]
    if len(with_poses) > 1:
        warn(f"poses of systems {', '.join(map(str, sorted(with_poses)))}; taking {with_poses[0]}, which has most: --system N "
             "takes another")
    if with_poses:
        return vehicles[with_poses[0]]
    return next((v for v in vehicles.values() if v.left_out), _Vehicle())  # which can say why


def read_tlog(path: pathlib.Path, warn: Warn, source: Optional[str] = None, origin: Optional[Geodetic] = None,
              system: Optional[int] = None, component: Optional[int] = None) -> Track:
    """The vehicle's way, NED_FRD; as one component of it tells, where that is named."""
    data = path.read_bytes()
    vehicles: Dict[int, _Vehicle] = {}
    frames = 0
    for logged in records(data, warn):
        frames += 1
        vehicles.setdefault(logged.frame.system, _Vehicle(component)).take(logged)
    if not frames:
        raise ConvertError(f"{path}: at byte 0: no telemetry log: it holds no MAVLink frame behind a time of eight bytes")
    vehicle = _vehicle(vehicles, system, str(path), warn)
    if component is not None and not vehicle.weight and not vehicle.left_out:
        there = sorted(set().union(*(v.there for n, v in vehicles.items() if system in (None, n))))
        if component not in there:
            raise ConvertError(f"{path}: component {component} tells no pose; such messages come from " +
                               (", ".join(map(str, there)) or "none"))
    if vehicle.left_out:
        warn("ODOMETRY with " + ", ".join(f"frame_id {world:.0f} and child_frame_id {body:.0f} ({n} messages)"
                                          for (world, body), n in sorted(vehicle.left_out.items())) +
             " was left out: local NED and FRD (1, 20) are read, with bodies in FRD (12, 8 or that of the world) or FLU (13)")
    choices = vehicle.choices()
    if choices:
        warn("several components send the same message; taking the one heard first, another one after "
             f"{SILENCE_S:.0f} s of silence: {'; '.join(choices)}")
    wanted = chosen(vehicle.sources(), source, str(path))
    if wanted.name == "ODOMETRY" and vehicle.heading_is_local:
        warn("ODOMETRY is in a local frame whose heading need not be north; x is taken as north")
    if vehicle.restarts:
        warn(f"the vehicle started again ({vehicle.restarts} x); its clock is carried on by the times of arrival")
    local = not isinstance(wanted.positions[0][1], Geodetic)
    of_local = vehicle.origin if local and wanted.name.endswith("LOCAL_POSITION_NED") else None
    return track_of(wanted, str(path), warn, origin, of_local)
