#!/usr/bin/env python3
"""Holds a vehicle above the bed with DISTANCE_SENSOR messages, as an autopilot does: docs/poses.md, "Distances".

`sonard run depth_hold.yaml` sends the distances to this program, which answers with poses.
    depth_hold.py [--listen 127.0.0.1:14552] [--sonard 127.0.0.1] [--altitude 2] [--steps 300]
"""
import argparse
import pathlib
import socket
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients/python"))
from sonard_client import Control  # noqa: E402

STEP_S, GAIN_PER_S, FASTEST_MPS, AHEAD_MPS, SURE = 0.1, 1.5, 0.5, 0.3, 50


def distances(link):
    """Distance [m] and signal quality [%] of each DISTANCE_SENSOR (132) that has arrived."""
    while True:
        try:
            frame = link.recv(512)
        except BlockingIOError:
            return
        if frame[0] == 0xFD and int.from_bytes(frame[7:10], "little") == 132:
            fields = struct.unpack("<IHHHBBBBff16sB", frame[10:10 + frame[1]].ljust(39, b"\0"))
            yield fields[3] / 100, fields[-1]


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--listen", default="127.0.0.1:14552")
    options.add_argument("--sonard", default="127.0.0.1")
    options.add_argument("--altitude", type=float, default=2)
    options.add_argument("--steps", type=int, default=300)
    options = options.parse_args()
    host, port = options.listen.rsplit(":", 1)
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.bind((host, int(port)))
    link.setblocking(False)
    control, x, z, speed = Control(options.sonard), 0.0, -3.0, 0.0
    for _ in range(options.steps):
        control.send_pose((x, 0, z))
        control.step(STEP_S)
        for distance, quality in distances(link):
            error = options.altitude - distance if quality >= SURE else 0
            speed = max(-FASTEST_MPS, min(FASTEST_MPS, GAIN_PER_S * error))
            print(f"x {x:.3f} z {z:.3f} distance {distance:.2f} m quality {quality}", flush=True)
        x, z = x + AHEAD_MPS * STEP_S, z + speed * STEP_S


if __name__ == "__main__":
    main()
