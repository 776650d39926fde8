"""A minimal driver: connects, requests pings, prints one JSON line per ping. Replace it with yours in test_driver.py.

usage: tiny_driver.py ADDRESS
"""
import json
import math
import socket
import struct
import sys
import time

HEADER, FIRE = struct.Struct("<HHHHHIH"), struct.Struct("<BBBBBdddd")
RESULT = struct.Struct("<IIddddIBdHHIII")  # version 1, from byte 53


def fire_message():
    # Mode 2, 10 Hz, gamma 127; flags: metres, gain as requested, simple results, 512 beams; 10 m, 20 %, salinity 30.
    body = FIRE.pack(2, 0, 255, 127, 0x59, 10.0, 20.0, 0.0, 30.0)
    return HEADER.pack(0x4F53, 0, 0, 0x15, 0, len(body), 0) + body


def receive_exactly(sonar, size):
    data = b""
    while len(data) < size:
        chunk = sonar.recv(size - len(data))
        if not chunk:
            raise ConnectionError("connection closed by the sonar")
        data += chunk
    return data


def bright_spots(message):
    """Number of the ping, and range [m] and bearing [deg] of the strongest bright sample in each cell of 0.5 m x 5 deg."""
    number, *_, resolution, rows, beams, offset, _, _ = RESULT.unpack_from(message, 53)
    bearings = struct.unpack_from(f"<{beams}h", message, 122)
    image, best = message[offset:], {}
    floor = max(image) * 0.6
    for at, value in enumerate(image[:rows * beams]):
        if value > floor:
            range_m, bearing_deg = (at // beams + 0.5) * resolution, bearings[at % beams] / 100
            square = math.floor(range_m / 0.5), math.floor(bearing_deg / 5)
            best[square] = max(best.get(square, (0,)), (value, range_m, bearing_deg))
    return number, [(round(r, 2), round(b, 1)) for _, r, b in best.values()]


def listen(address):
    with socket.create_connection((address, 52100), timeout=3) as sonar:
        sonar.sendall(fire_message())
        while True:
            header = receive_exactly(sonar, HEADER.size)
            _, _, _, kind, _, size, _ = HEADER.unpack(header)
            message = header + receive_exactly(sonar, size)
            if kind == 0x23:
                number, bright = bright_spots(message)
                print(json.dumps({"number": number, "bright": bright}), flush=True)


while True:
    try:
        listen(sys.argv[1])
    except OSError as problem:
        print(f"{problem}; reconnecting", file=sys.stderr)
        time.sleep(0.5)
