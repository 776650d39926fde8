"""Sends poses of a vehicle to sonard, over UDP or TCP."""
from __future__ import annotations

import math
import socket
from typing import Any, Dict, Optional, Sequence

from .endpoints import endpoint
from .pose_messages import CLOCKS, FRAMES, PoseMessage, json_line, pose_update
from .rotations import orientation, three

JSON_PORT, PROTOBUF_PORT = 14771, 14770
LATEST_TIMESTAMP_S = 4.5e9


class PoseSender:
    """with PoseSender() as poses: poses.send((0, 0, -3), rpy=(0, 0.1, 0), timestamp=t)

    Each sender is a separate source: a new one starts a new pose history. UDP has no reply. `undelivered` counts the datagrams
    for which the system reported a closed port; the daemon's log reports refused poses with the reason."""

    def __init__(self, address: str = "127.0.0.1", encoding: str = "json", transport: str = "udp", vehicle: str = "",
                 clock: str = "sim") -> None:
        """encoding: "json" or "protobuf"; transport: "udp", or "tcp" for JSON lines. clock of the timestamps: "sim" (the
        sender's own) or "wall" (UNIX time; protobuf only). Default port: that of the encoding."""
        if encoding not in ("json", "protobuf"):
            raise ValueError(f'encoding is {encoding!r}: it must be "json" or "protobuf"')
        if transport not in ("udp", "tcp"):
            raise ValueError(f'transport is {transport!r}: it must be "udp" or "tcp"')
        if transport == "tcp" and encoding == "protobuf":
            raise ValueError("protobuf is sent over UDP only: use encoding=\"json\" for TCP, or Control.send_pose()")
        if clock not in CLOCKS or clock == "arrival":
            raise ValueError(f'clock is {clock!r}: it must be "sim" or "wall"; poses without a timestamp use the time of receipt')
        if clock == "wall" and encoding == "json":
            raise ValueError("JSON timestamps are of the sender's own clock: use encoding=\"protobuf\" for UNIX time")
        self.address = endpoint(address, JSON_PORT if encoding == "json" else PROTOBUF_PORT)
        self.encoding, self.transport, self.vehicle, self.clock = encoding, transport, vehicle, clock
        self.undelivered = 0
        self._seq: Dict[str, int] = {}
        if transport == "tcp":
            self._socket = socket.create_connection(self.address, timeout=5)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        else:
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.connect(self.address)

    def send(self, position: Sequence[float], quaternion: Optional[Sequence[float]] = None,
             rpy: Optional[Sequence[float]] = None, frame: str = "ENU_FLU", velocity: Optional[Sequence[float]] = None,
             angular_velocity: Optional[Sequence[float]] = None, vehicle: Optional[str] = None,
             timestamp: Optional[float] = None, reset_counter: int = 0) -> None:
        """Sends one pose. Raises ValueError for values that sonard would refuse.

        position: m, in the world axes of `frame`: east, north, up ("ENU_FLU") or north, east, down ("NED_FRD").
        quaternion: w, x, y, z, body to world; or rpy: roll, pitch, yaw in rad, intrinsic Z-Y-X; default: no rotation.
        velocity: m/s, world axes. angular_velocity: rad/s, body axes; protobuf only, as is reset_counter.
        timestamp: s; default: the time of receipt."""
        if frame not in FRAMES:
            raise ValueError(f'frame is {frame!r}: it must be "ENU_FLU" or "NED_FRD"')
        if self.encoding == "json" and (angular_velocity is not None or reset_counter):
            raise ValueError("angular_velocity and reset_counter need encoding=\"protobuf\"")
        if timestamp is not None and not (math.isfinite(timestamp) and abs(timestamp) <= LATEST_TIMESTAMP_S):
            raise ValueError(f"timestamp is {timestamp}: it must be seconds, at most 4.5e9")
        name = self.vehicle if vehicle is None else vehicle
        seq = self._seq[name] = self._seq.get(name, 0) + 1
        linear = None if velocity is None else three("velocity", velocity)
        angular = None if angular_velocity is None else three("angular_velocity", angular_velocity)
        self._write(PoseMessage(three("position", position), orientation(quaternion, rpy), frame, name, linear, angular,
                                timestamp, self.clock, seq, reset_counter))

    def _write(self, pose: PoseMessage) -> None:
        data = json_line(pose) if self.encoding == "json" else pose_update(pose)
        if self.transport == "tcp":
            self._socket.sendall(data)
            return
        try:
            self._socket.send(data)
        except ConnectionRefusedError:  # caused by an earlier datagram; a restart of the daemon must not stop the sender
            self.undelivered += 1

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> PoseSender:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()
