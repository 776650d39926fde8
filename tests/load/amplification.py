"""Measures how much each emulated sonar sends after one datagram whose sender may be forged: the figures of
tests/reliability/README.md, "Datagrams with a forged sender". Run by hand: SONARD_BUILD=build/release python3
tests/load/amplification.py [SECONDS]

The sender's port stays open and silent, which is the worst case: a closed port ends a stream at once.
"""
import pathlib
import socket
import struct
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/acceptance")]
from running_sonard import Sonard  # noqa: E402

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 15


def frame(number, payload):
    bare = b"BR" + struct.pack("<HHBB", len(payload), number, 0, 0) + payload
    return bare + struct.pack("<H", sum(bare) & 0xFFFF)


def request(number):
    return frame(6, struct.pack("<H", number))


# profile, request, port, datagram
ASKED = [
    ("oculus-m1200d", "anything", 52102, b"\0" * 16),
    ("blueview-p900-90", "discovery", 14751, b"BVE?" + struct.pack("<H", 1)),
    ("aris-3000", "anything", 56124, b"\0" * 16),
    ("waterlinked-3d15", "anything", 4747, b"\0" * 16),
    ("ping360", "Discovery", 30303, b"Discovery"),
    ("ping360", "6 for 4", 12345, request(4)),
    ("ping360", "2601, one ping", 12345, frame(2601, struct.pack("<BBHHHHHBB", 1, 0, 100, 32, 80, 740, 1200, 1, 0))),
    ("ping360", "2602, a scan", 12345, frame(2602, struct.pack("<BBHHHHHHBB", 1, 0, 32, 80, 740, 1200, 0, 399, 1, 0))),
    ("surveyor-240", "3023, pings", 62312,
     frame(3023, struct.pack("<iifhhHBBBBBBiHHf", 0, 5000, 1500.0, -1, 50, 0, 0, 1, 0, 0, 1, 1, 240000, 400, 0, 1.5))),
    ("omniscan-450", "2197, pings", 51200,
     frame(2197, struct.pack("<IIIffffhHBBBB", 0, 5000, 0, 0, 0, 0.002, 0.0015, -1, 1200, 1, 0, 0, 0))),
    ("ping1d", "1400, profiles", 9090, frame(1400, struct.pack("<H", 1300))),
    ("s500", "1015, profiles", 51200, frame(1015, struct.pack("<IIhhHHHBB", 0, 5000, -1, 100, 0, 1308, 0, 0, 0))),
]


def measured(profile, port, datagram):
    """Returns (bytes of the answers, datagrams, seconds until the last)."""
    with Sonard(profile=profile, scene="demo.yaml") as daemon, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.bind(("127.0.0.1", 0))
        stranger.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
        stranger.sendto(datagram, (daemon.address, port))
        begin, size, count, last = time.monotonic(), 0, 0, 0.0
        stranger.settimeout(0.2)
        while time.monotonic() < begin + SECONDS:
            try:
                size += len(stranger.recv(65536))
            except (TimeoutError, ConnectionRefusedError):
                continue
            count, last = count + 1, time.monotonic() - begin
        return size, count, last


def main():
    print("| sonar | one datagram | bytes | answer in %g s | times | still coming |\n|---|---|---|---|---|---|" % SECONDS)
    for profile, what, port, datagram in ASKED:
        size, count, last = measured(profile, port, datagram)
        goes_on = f"yes, {size / max(last, 1) / 1000:.0f} kB/s" if count > 10 and last > SECONDS - 2 else "no"
        print(f"| {profile} | {what} | {len(datagram)} | {size} | {size / len(datagram):.0f} | {goes_on} |", flush=True)


if __name__ == "__main__":
    main()
