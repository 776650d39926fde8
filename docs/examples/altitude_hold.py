#!/usr/bin/env python3
"""Holds a vehicle at an altitude by a Ping1D that looks down: the distance of each ping sets the vertical speed.

sonard is device and vehicle: it takes the poses that this program sends. Against a real vehicle the speed goes to its autopilot.
    altitude_hold.py [--sonar 127.0.0.2] [--sonard 127.0.0.1] [--altitude 1.5] [--pings 300]
"""
import argparse
import json
import socket
import struct
import time

GAIN_PER_S, FASTEST_MPS, AHEAD_MPS = 0.8, 0.5, 0.2
SURE = 50  # per cent of confidence


def frame(number, payload):
    body = b"BR" + struct.pack("<HHBB", len(payload), number, 0, 0) + payload
    return body + struct.pack("<H", sum(body) & 0xFFFF)


def distances(sonar):
    """Distance [m] and confidence of each ping, from a stream of message 1212."""
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.settimeout(60)
    link.connect((sonar, 9090))
    link.send(frame(1003, b"\1"))  # range and gain are the device's own business
    link.send(frame(1400, struct.pack("<H", 1212)))
    while True:
        message = link.recv(4096)
        if struct.unpack_from("<H", message, 4)[0] == 1212:
            millimetres, confidence = struct.unpack_from("<IH", message, 8)
            yield millimetres / 1000, confidence


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--sonar", default="127.0.0.2")
    options.add_argument("--sonard", default="127.0.0.1")
    options.add_argument("--altitude", type=float, default=1.5)
    options.add_argument("--pings", type=int, default=300)
    options.add_argument("--start", type=float, nargs=3, default=(0, -7, 3), metavar=("NORTH", "EAST", "DOWN"))
    options = options.parse_args()
    north, east, down = options.start
    poses = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    before = time.monotonic()
    for ping, (distance, confidence) in zip(range(options.pings), distances(options.sonar)):
        now = time.monotonic()
        step_s, before = min(now - before, 0.2), now
        speed = GAIN_PER_S * (distance - options.altitude) if confidence >= SURE else 0
        down += max(-FASTEST_MPS, min(FASTEST_MPS, speed)) * step_s
        north += AHEAD_MPS * step_s
        pose = {"timestamp": now, "position": [north, east, down], "attitude": [0, 0, 0]}
        poses.sendto(json.dumps(pose).encode(), (options.sonard, 14771))
        print(f"{ping} distance {distance:.3f} m confidence {confidence} depth {down:.3f} m", flush=True)


if __name__ == "__main__":
    main()
