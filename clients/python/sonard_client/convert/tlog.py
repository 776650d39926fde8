"""Reads telemetry logs of ground stations (.tlog): for every MAVLink frame its time of receipt (microseconds since 1970 as a
big-endian 64-bit integer) and the frame.
"""
from __future__ import annotations

import math
import pathlib
from typing import Dict, Iterator, List, NamedTuple, Optional, Tuple

from ..geodesy import Geodetic
from ..rotations import Quaternion, Vector3, quaternion_from_rpy, unit
from .mavlink import (BODY_FLU, ENU_WORLDS, FRD_BODIES, LOCAL_FLU, LOCAL_FRD, MESSAGES, NED_WORLDS, SUBMARINE, Frame, fields_of,
                      frame_length, frame_text, read_frame)
from .track import ConvertError, Place2, Source, Stream, Track, Warn, chosen, depth_source, track_of

STAMP_BYTES = 8
RESTART_S = 5.0  # a smaller step back is a delayed frame, not a restart
SILENCE_S = 5.0  # after this, another component with the same message is used, as in the daemon
FULL = ("ODOMETRY", "SIM_STATE", "ATT_POS_MOCAP", "VISION_POSITION_ESTIMATE")
PRESSURES = ("SCALED_PRESSURE2", "SCALED_PRESSURE3", "SCALED_PRESSURE")  # the first is the outer sensor of a BlueROV2
SURFACE_HPA, HPA_PER_M = 1013.25, 1025 * 9.80665 / 100
IN_WATER_HPA = 1100.0  # higher than any barometer in air
NO_AUTOPILOT = 8  # MAV_AUTOPILOT_INVALID: cameras, gimbals, companion computers
ATTITUDES, POSITIONS = ("ATTITUDE_QUATERNION", "ATTITUDE"), ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")


class Logged(NamedTuple):
    received_s: float
    frame: Frame


def _is_plausible(data: bytes, at: int, frame: Frame) -> bool:
    """Returns whether a record begins here: an intact frame, or an unknown message followed by another record or the end."""
    if frame.intact is not None:
        return frame.intact
    following = at + STAMP_BYTES + frame.length
    return following == len(data) or frame_length(data, following + STAMP_BYTES) is not None


def records(data: bytes, warn: Warn) -> Iterator[Logged]:
    """Yields the frames whose CRC is correct or, for messages without poses, unknown."""
    at, skipped, first_skipped = 0, 0, -1
    while at + STAMP_BYTES < len(data):
        length = frame_length(data, at + STAMP_BYTES)
        if length is not None and at + STAMP_BYTES + length > len(data) and len(data) - at < STAMP_BYTES + 300:
            warn(f"ends within a frame, at byte {at}; all frames before it were read")
            break
        frame = read_frame(data, at + STAMP_BYTES) if length is not None else None
        if frame is None or not _is_plausible(data, at, frame):
            first_skipped = at if first_skipped < 0 else first_skipped
            skipped += 1
            at += 1
            continue
        yield Logged(1e-6 * int.from_bytes(data[at:at + STAMP_BYTES], "big"), frame)
        at += STAMP_BYTES + frame.length
    if skipped:
        warn(f"{skipped} bytes outside intact frames were skipped, the first at byte {first_skipped}")


def _quaternion(f: Dict[str, float]) -> Optional[Quaternion]:
    parts = [f[f"q{i}"] for i in range(1, 5)]
    return unit(parts) if abs(sum(p * p for p in parts) - 1) < 1e-3 else None


def _is_supported(f: Dict[str, float]) -> bool:
    """Returns whether an ODOMETRY's frames are supported. If child_frame_id is a world frame, only the velocity is in it, and
    the body is FRD."""
    bodies = (*FRD_BODIES, BODY_FLU)
    if f["frame_id"] in (*NED_WORLDS, LOCAL_FRD):
        return f["child_frame_id"] in (*bodies, f["frame_id"])
    return f["frame_id"] in (*ENU_WORLDS, LOCAL_FLU) and f["child_frame_id"] in bodies


def _of_frd(q: Quaternion) -> Quaternion:
    """Returns the attitude of the FRD body from that of the FLU body: q (0, 1, 0, 0), half a turn about the forward axis."""
    return -q[1], q[0], q[3], -q[2]


def _in_ned(frame_id: float, q: Quaternion, p: Vector3) -> Tuple[Quaternion, Vector3]:
    """Turns an attitude and a position from a local frame to NED: half a turn about the axis (1, 1, 0) from ENU, (1, 0, 0) from
    FLU."""
    w, x, y, z = q
    if frame_id in ENU_WORLDS:
        a = math.sqrt(0.5)
        return (-a * (x + y), a * (w + z), a * (w - z), a * (y - x)), (p[1], p[0], -p[2])
    if frame_id == LOCAL_FLU:
        return (-x, w, -z, y), (p[0], -p[1], -p[2])
    return q, p


def _angles(f: Dict[str, float]) -> Optional[Quaternion]:
    three = f["roll"], f["pitch"], f["yaw"]
    return quaternion_from_rpy(*three) if all(map(math.isfinite, three)) else None


def _metres(f: Dict[str, float]) -> "Optional[Tuple[float, float, float]]":
    three = f["x"], f["y"], f["z"]
    return three if all(map(math.isfinite, three)) else None


def _simulated_place(f: Dict[str, float]) -> Geodetic:
    """Returns the position. Older simulators send it as float degrees only, in steps of 0.4 m at middle latitudes."""
    if f["lat_int"] or f["lon_int"]:
        return Geodetic(1e-7 * f["lat_int"], 1e-7 * f["lon_int"], f["alt"])
    return Geodetic(f["lat"], f["lon"], f["alt"])


class _Vehicle:
    """Poses of one MAVLink system. component: use only messages of this component."""

    def __init__(self, component: Optional[int] = None) -> None:
        self.component = component
        self.senders: "set[int]" = set()  # components that sent any message
        self.attitudes: Dict[str, Stream[Quaternion]] = {}
        self.positions: "Dict[str, Stream]" = {}
        self.depths: Dict[str, Stream[float]] = {}  # down [m], of messages without a fix
        self.pressures: Dict[str, Stream[float]] = {}  # [hPa]
        self.is_submarine = False
        self.autopilot: Optional[int] = None  # component of the autopilot, known from its first heartbeat on
        self._homes_m: Dict[int, float] = {}  # by component: altitude of the home; for submarines, of the surface
        self._origins: Dict[int, Geodetic] = {}  # by component
        self.unsupported: "Dict[Tuple[float, float], int]" = {}  # ODOMETRY, by frame_id and child_frame_id
        self._local_headings: Dict[int, bool] = {}  # by component
        self.restarts = 0
        self._boot: "Optional[Tuple[float, float]]" = None  # the latest time since start, and its time of receipt
        self._before_s = 0.0  # offset of times since start, after restarts
        self._current: "Dict[str, Tuple[int, float]]" = {}  # by message: its component and its last time of receipt
        # By message: the components used, in sequence, each with the lengths of the message's streams at its first message.
        self._runs: "Dict[str, List[Tuple[int, List[int]]]]" = {}
        self._used: "Dict[str, Dict[int, int]]" = {}  # by message: the number of messages of each component used
        self.omitted: "Dict[str, Dict[int, int]]" = {}  # by message: the other components and their number of messages

    def add(self, logged: Logged) -> None:
        fields = fields_of(logged.frame)
        name = MESSAGES[logged.frame.message_id].name if fields is not None else "HEARTBEAT"
        if fields is not None and name == "HEARTBEAT":
            self.is_submarine |= fields["type"] == SUBMARINE
            if fields["autopilot"] != NO_AUTOPILOT and self.autopilot is None:
                self.autopilot = logged.frame.component
        if fields is None or name == "HEARTBEAT" or not self._is_used(name, logged):
            return
        component = logged.frame.component
        if name == "GPS_GLOBAL_ORIGIN":
            place = Geodetic(1e-7 * fields["latitude"], 1e-7 * fields["longitude"], 1e-3 * fields["altitude"])
            if place.is_fix:
                self._origins.setdefault(component, place)
            return
        # Attitude and position are paired by the vehicle's clock if both have it, else by time of receipt.
        t = self._since_start(1e-3 * fields["time_boot_ms"], logged.received_s) if "time_boot_ms" in fields else \
            1e-6 * fields["time_usec"] if fields.get("time_usec") else logged.received_s
        if name in PRESSURES:
            if math.isfinite(fields["press_abs"]):
                self.pressures.setdefault(name, []).append((t, fields["press_abs"]))
            return
        if name == "VFR_HUD":  # has no time; submarines: altitude above the surface; others: above sea level or home
            if math.isfinite(fields["alt"]) and self._boot is not None:  # else its time since start is not known yet
                now = self._before_s + self._boot[0] + logged.received_s - self._boot[1]
                self.depths.setdefault(name, []).append((now, -fields["alt"]))
            return
        attitude: Optional[Quaternion] = None
        position: "Optional[tuple]" = None
        if name == "ODOMETRY" and not _is_supported(fields):
            frames = fields["frame_id"], fields["child_frame_id"]
            self.unsupported[frames] = self.unsupported.get(frames, 0) + 1
            return
        if name in ("ODOMETRY", "ATT_POS_MOCAP", "ATTITUDE_QUATERNION", "SIM_STATE"):
            attitude = _quaternion(fields)
            if attitude is not None and fields.get("child_frame_id") == BODY_FLU:
                attitude = _of_frd(attitude)
        elif name in ("ATTITUDE", "VISION_POSITION_ESTIMATE"):
            attitude = _angles(fields)
        if name in ("ODOMETRY", "ATT_POS_MOCAP", "VISION_POSITION_ESTIMATE", "LOCAL_POSITION_NED"):
            position = _metres(fields)
            if name == "ODOMETRY" and attitude is not None and position is not None:
                attitude, position = _in_ned(fields["frame_id"], attitude, position)
        elif name in ("SIM_STATE", "GLOBAL_POSITION_INT"):
            place = _simulated_place(fields) if name == "SIM_STATE" else \
                Geodetic(1e-7 * fields["lat"], 1e-7 * fields["lon"], 1e-3 * fields["alt"])
            position = place if place.is_fix else None
            if position is not None and name == "GLOBAL_POSITION_INT":
                self._homes_m.setdefault(component, 1e-3 * (fields["alt"] - fields["relative_alt"]))
            if position is None and name == "GLOBAL_POSITION_INT":
                self.depths.setdefault(name, []).append((t, -1e-3 * fields["relative_alt"]))
        if name in FULL and (attitude is None or position is None):
            return
        if fields.get("frame_id") in (LOCAL_FRD, LOCAL_FLU):
            self._local_headings[component] = True
        if attitude is not None:
            self.attitudes.setdefault(name, []).append((t, attitude))
        if position is not None:
            self.positions.setdefault(name, []).append((t, position))

    def _is_used(self, name: str, logged: Logged) -> bool:
        """Returns whether a message is used. Of the components that send it only one is used at a time, so that their tracks are
        not mixed: the autopilot, else the first."""
        component = logged.frame.component
        self.senders.add(component)
        if self.component is not None and component != self.component:
            return name == "GPS_GLOBAL_ORIGIN"  # valid for the whole system
        known = self._current.get(name)
        if component == self.autopilot:
            self._forget_others(name)
            known = None
        if known is not None and known[0] != component and logged.received_s - known[1] <= SILENCE_S:
            counts = self.omitted.setdefault(name, {})
            counts[component] = counts.get(component, 0) + 1
            return False
        self._current[name] = component, logged.received_s
        runs = self._runs.setdefault(name, [])
        if not runs or runs[-1][0] != component:
            runs.append((component, self._lengths(name)))
        used = self._used.setdefault(name, {})
        used[component] = used.get(component, 0) + 1
        return True

    @property
    def _streams(self) -> "Tuple[Dict[str, Stream], ...]":
        return self.attitudes, self.positions, self.depths, self.pressures

    def _lengths(self, name: str) -> List[int]:
        return [len(streams.get(name, ())) for streams in self._streams]

    def _forget_others(self, name: str) -> None:
        """Drops this message from components other than the autopilot."""
        runs = self._runs.get(name, [])
        if all(component == self.autopilot for component, _ in runs):
            return
        ends = [begins for _, begins in runs[1:]] + [self._lengths(name)]
        for i, streams in enumerate(self._streams):
            if name in streams:
                streams[name] = [sample for (component, begins), end in zip(runs, ends) if component == self.autopilot
                                 for sample in streams[name][begins[i]:end[i]]]
        counts = self.omitted.setdefault(name, {})
        for component in [c for c in self._used[name] if c != self.autopilot]:
            counts[component] = counts.get(component, 0) + self._used[name].pop(component)
        facts: "Dict[str, dict]" = {"GLOBAL_POSITION_INT": self._homes_m, "GPS_GLOBAL_ORIGIN": self._origins,
                                    "ODOMETRY": self._local_headings}
        for component in [c for c in facts.get(name, {}) if c != self.autopilot]:
            del facts[name][component]
        self._runs[name] = [(component, [0] * len(self._streams)) for component, _ in runs if component == self.autopilot][:1]

    def choices(self) -> List[str]:
        """Describes which components were used, for messages that several components sent."""
        return [f"{name}: component {', later '.join(map(str, used))} (omitted: " +
                (", ".join(f"{n} messages of {c}" for c, n in sorted(self.omitted.get(name, {}).items())) or "none") + ")"
                for name, used in ((name, [c for c, _ in runs]) for name, runs in sorted(self._runs.items()))
                if name in self.omitted or len(used) > 1]

    @property
    def home_m(self) -> Optional[float]:
        return next(iter(self._homes_m.values()), None)

    @property
    def origin(self) -> Optional[Geodetic]:
        return next(iter(self._origins.values()), None)

    @property
    def heading_is_local(self) -> bool:
        return bool(self._local_headings)

    def _since_start(self, boot_s: float, received_s: float) -> float:
        """Returns the time since the first start. The pause of a restart is taken from the times of receipt."""
        if self._boot is not None and boot_s < self._boot[0] - RESTART_S:
            self._before_s += self._boot[0] - boot_s + max(0.0, received_s - self._boot[1])
            self.restarts += 1
        self._boot = boot_s, received_s
        return self._before_s + boot_s

    def sources(self) -> List[Source]:
        pairs = [(n, n) for n in FULL[:2]] + [(a, p) for p in POSITIONS for a in ATTITUDES] + [(n, n) for n in FULL[2:]]
        depths = self.depths.get("GLOBAL_POSITION_INT") or (self.depths.get("VFR_HUD") if self.is_submarine else None) or \
            [(t, (hpa - SURFACE_HPA) / HPA_PER_M) for t, hpa in self.pressures.get(self.pressure_of_depth, [])]
        return [Source(a if a == p else f"{a}+{p}", self.attitudes.get(a, []), self.positions.get(p, [])) for a, p in pairs] + \
            [depth_source(a, self.attitudes.get(a, []), depths) for a in ATTITUDES]

    @property
    def pressure_of_depth(self) -> str:
        """Returns the message of a sensor that was in the water, if no message has the depth; empty if there is none."""
        if self.depths.get("GLOBAL_POSITION_INT") or (self.is_submarine and self.depths.get("VFR_HUD")):
            return ""
        return next((name for name in PRESSURES if any(hpa > IN_WATER_HPA for _, hpa in self.pressures.get(name, []))), "")

    @property
    def weight(self) -> int:
        return max(min(len(s.attitudes), len(s.positions)) for s in self.sources())


def _vehicle(vehicles: Dict[int, _Vehicle], system: Optional[int], name: str, warn: Warn) -> _Vehicle:
    with_poses = sorted((n for n, v in vehicles.items() if v.weight), key=lambda n: -vehicles[n].weight)
    if system is not None:
        if system not in vehicles:
            raise ConvertError(f"{name}: system {system} is not in the log; systems: " +
                               (", ".join(map(str, sorted(vehicles))) or "none"))
        return vehicles[system]
    if len(with_poses) > 1:
        warn(f"systems with poses: {', '.join(map(str, sorted(with_poses)))}; using {with_poses[0]}, which has most: --system N "
             "selects another")
    if with_poses:
        return vehicles[with_poses[0]]
    return max(vehicles.values(), key=lambda v: (bool(v.unsupported), len(v.attitudes) + len(v.positions) + len(v.depths)))


def read_tlog(path: pathlib.Path, warn: Warn, source: Optional[str] = None, origin: Optional[Geodetic] = None,
              system: Optional[int] = None, component: Optional[int] = None, at: Optional[Place2] = None) -> Track:
    """Reads the vehicle's track, NED_FRD; from one component if given."""
    data = path.read_bytes()
    vehicles: Dict[int, _Vehicle] = {}
    frames = 0
    for logged in records(data, warn):
        frames += 1
        vehicles.setdefault(logged.frame.system, _Vehicle(component)).add(logged)
    if not frames:
        raise ConvertError(f"{path}: at byte 0: not a telemetry log: it has no MAVLink frame after an eight-byte time")
    vehicle = _vehicle(vehicles, system, str(path), warn)
    if component is not None and not vehicle.weight and not vehicle.unsupported:
        there = sorted(set().union(*(v.senders for n, v in vehicles.items() if system in (None, n))))
        if component not in there:
            raise ConvertError(f"{path}: component {component} sends no poses; components: " +
                               (", ".join(map(str, there)) or "none"))
    if vehicle.unsupported:
        warn("ODOMETRY with " + ", ".join(f"frame_id {frame_text(world)} and child_frame_id {frame_text(body)} ({n} messages)"
                                          for (world, body), n in sorted(vehicle.unsupported.items())) +
             " was omitted: supported are frames fixed to the earth in NED, ENU, FRD and FLU (1, 4, 14 to 21) with bodies in FRD "
             "(8, 9, 12, or the world frame of NED and FRD) or FLU (13)")
    choices = vehicle.choices()
    if choices:
        warn("several components send the same message; using the autopilot's, else the first, and another one "
             f"after {SILENCE_S:.0f} s of silence: {'; '.join(choices)}")
    wanted = chosen(vehicle.sources(), source, str(path), warn)
    if wanted.held and vehicle.pressure_of_depth:
        warn(f"no message has the depth; it is that of {vehicle.pressure_of_depth} in sea water (1025 kg/m3) below "
             f"{SURFACE_HPA:g} hPa")
    if wanted.name == "ODOMETRY" and vehicle.heading_is_local:
        warn("ODOMETRY is in a local frame that may not point north; x is used as north")
    if vehicle.restarts:
        warn(f"the vehicle restarted ({vehicle.restarts} x); its clock was continued with the times of receipt")
    local = not isinstance(wanted.positions[0][1], Geodetic)
    surface_m = vehicle.home_m if vehicle.is_submarine and wanted.name.endswith("GLOBAL_POSITION_INT") else None
    of_local = vehicle.origin if local and wanted.name.endswith("LOCAL_POSITION_NED") else None
    return track_of(wanted, str(path), warn, origin, of_local, at, surface_m)
