"""python3 -m sonard_client.nmea_to_pose: NMEA 0183 from UDP, a file or standard input to poses for sonard.

For the bench: sentences come seldom, and none of them tells all six degrees of freedom; what is not told is said on stderr.
"""
from __future__ import annotations

import argparse
import socket
import sys
import time
from typing import Iterator, List, Optional, TextIO, Tuple

from .geodesy import parse_origin
from .nmea import Assumptions, NmeaError, NmeaPoses, parse_sentence
from .oculus import endpoint
from .poses import PoseSender

UDP_PORT = 10110  # registered for NMEA 0183
SILENCE_S = 5.0
SLOWEST_WAIT_S = 10.0  # of a gap in a file


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python3 -m sonard_client.nmea_to_pose", description=__doc__)
    parser.add_argument("file", nargs="?", default=None, help="a log; - is standard input; without it UDP is listened to")
    parser.add_argument("--listen", default=f"0.0.0.0:{UDP_PORT}", metavar="HOST:PORT",
                        help="(%(default)s); port 0 is any free one, named on stderr")
    parser.add_argument("--to", default="127.0.0.1", help="sonard's poses.json: host or host:port")
    parser.add_argument("--vehicle", default="")
    parser.add_argument("--origin", metavar="LAT,LON", help="where the world's 0, 0 is; without it at the first fix")
    parser.add_argument("--at", nargs=2, type=float, metavar=("NORTH", "EAST"), help="m; where to be as long as there is no fix")
    parser.add_argument("--heading", type=float, metavar="DEG", help="as long as none is heard")
    parser.add_argument("--depth", type=float, default=0.0, metavar="M", help="of the vehicle, where nothing tells it (0)")
    parser.add_argument("--bottom", type=float, metavar="M", help="depth of the bottom: the vehicle is DPT or DBT above it")
    parser.add_argument("--depth-is-vehicle", action="store_true", help="DPT and DBT are the vehicle's own depth")
    parser.add_argument("--without-checksum", action="store_true", help="take sentences that have none; wrong ones never")
    parser.add_argument("--fast", action="store_true", help="a file at once, not at the pace of its fixes")
    parser.add_argument("--count", type=int, help="ends after so many poses")
    return parser


class Bridge:
    """Lines in, poses out."""

    def __init__(self, poses: NmeaPoses, sender: PoseSender, log: TextIO, without_checksum: bool = False) -> None:
        self.poses, self.sender, self.log, self.without_checksum = poses, sender, log, without_checksum
        self.lines = self.refused = self.sent = 0
        self._told: "Optional[List[str]]" = None

    def say(self, text: str) -> None:
        print(f"nmea_to_pose: {text}", file=self.log, flush=True)

    def take(self, line: str) -> str:
        """What the line told, as NmeaPoses.feed()."""
        if not line.strip():
            return ""
        self.lines += 1
        try:
            return self.poses.feed(parse_sentence(line, self.without_checksum))
        except NmeaError as error:
            self.refused += 1
            if self.refused == 1:
                self.say(f"line {self.lines}: {error}; it and others like it are left out")
            return ""

    def send(self, timestamp: Optional[float]) -> bool:
        pose = self.poses.pose()
        if pose is None:
            return False
        position, rpy = pose
        self.sender.send(position, rpy=rpy, frame="NED_FRD", timestamp=timestamp)
        self.sent += 1
        self.tell_unknown()
        return True

    def tell_unknown(self) -> None:
        """Once, and again when it has changed."""
        unknown = self.poses.unknown()
        if unknown != self._told:
            self._told = unknown
            heard = ", ".join(sorted(self.poses.instruments.heard)) or "nothing"
            self.say(f"heard {heard}" + ("; not told: " + "; ".join(unknown) if unknown else ""))

    def ends(self) -> None:
        self.say(f"{self.lines} lines, {self.refused} refused, {self.sent} poses")
        if not self.sent:
            self.tell_unknown()


def _from_udp(address: Tuple[str, int], bridge: Bridge) -> Iterator[str]:
    """Lines as they come; a datagram holds one or several whole ones."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there:
        there.bind(address)
        there.settimeout(SILENCE_S)
        bridge.say(f"listens on UDP {address[0]}:{there.getsockname()[1]}")
        while True:
            try:
                data = there.recv(65536)
            except socket.timeout:
                if not bridge.sent:
                    bridge.tell_unknown()
                continue
            yield from data.decode("latin-1").splitlines()


def _live(lines: Iterator[str], bridge: Bridge, count: Optional[int]) -> None:
    """A pose whenever attitude or place are told: of the moment it is received, since few sentences have a time."""
    for line in lines:
        if bridge.take(line) in ("place", "attitude"):
            bridge.send(None)
        if count is not None and bridge.sent >= count:
            return


def _played(lines: Iterator[str], bridge: Bridge, count: Optional[int], fast: bool) -> None:
    """A pose at every fix, stamped with its time of day, at the pace of these times."""
    began: "Optional[Tuple[float, float]]" = None
    for line in lines:
        if bridge.take(line) != "place":
            continue
        now = bridge.poses.instruments.fix_time_s
        if now is not None and not fast:
            began = began or (time.monotonic(), now)
            time.sleep(max(0.0, min(SLOWEST_WAIT_S, began[0] + now - began[1] - time.monotonic())))
        bridge.send(now)
        if count is not None and bridge.sent >= count:
            return


def run(options: argparse.Namespace, log: TextIO) -> int:
    if options.bottom is not None and options.depth_is_vehicle:
        raise ValueError("--bottom and --depth-is-vehicle contradict each other: give one")
    assumed = Assumptions(parse_origin(options.origin) if options.origin else None, tuple(options.at) if options.at else None,
                          options.heading, options.depth, options.depth_is_vehicle, options.bottom)
    with PoseSender(options.to, vehicle=options.vehicle) as sender:
        bridge = Bridge(NmeaPoses(assumed), sender, log, options.without_checksum)
        try:
            if options.file is None:
                _live(_from_udp(endpoint(options.listen, UDP_PORT, lowest=0), bridge), bridge, options.count)
            elif options.file == "-":
                _live(iter(sys.stdin), bridge, options.count)
            else:
                with open(options.file, encoding="latin-1") as file:
                    _played(iter(file), bridge, options.count, options.fast)
        finally:
            bridge.ends()
        return 0 if bridge.sent else 65


def main(arguments: Optional[List[str]] = None) -> int:
    options = _parser().parse_args(arguments)
    try:
        return run(options, sys.stderr)
    except KeyboardInterrupt:
        return 130
    except ValueError as error:
        print(f"nmea_to_pose: {error}", file=sys.stderr)
        return 64
    except FileNotFoundError as error:
        print(f"nmea_to_pose: {error.filename}: there is no such file", file=sys.stderr)
        return 66
    except OSError as error:
        print(f"nmea_to_pose: {error}", file=sys.stderr)
        return 69


if __name__ == "__main__":
    sys.exit(main())
