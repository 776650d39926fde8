"""python3 -m sonard_client.nmea_to_pose: converts NMEA 0183 from UDP, a file or standard input to poses for sonard.

For bench tests: sentences are infrequent and none contains all six degrees of freedom. Assumed values are listed on stderr.
"""
from __future__ import annotations

import argparse
import socket
import sys
import time
from typing import Iterator, List, Optional, TextIO, Tuple

from .endpoints import endpoint
from .geodesy import parse_origin
from .nmea import Assumptions, NmeaError, NmeaPoses, parse_sentence
from .poses import PoseSender

UDP_PORT = 10110  # registered for NMEA 0183
SILENCE_S = 5.0
LONGEST_WAIT_S = 10.0  # for a gap in a file


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python3 -m sonard_client.nmea_to_pose", description=__doc__)
    parser.add_argument("file", nargs="?", default=None, help="a log, or - for standard input (default: receive UDP)")
    parser.add_argument("--listen", default=f"0.0.0.0:{UDP_PORT}", metavar="HOST:PORT",
                        help="local address (%(default)s); port 0 selects a free port, shown on stderr")
    parser.add_argument("--to", default="127.0.0.1", help="sonard's poses.json: host or host:port")
    parser.add_argument("--vehicle", default="")
    parser.add_argument("--origin", metavar="LAT,LON", help="origin of the world (default: the first fix)")
    parser.add_argument("--at", nargs=2, type=float, metavar=("NORTH", "EAST"), help="position in m, used without a fix")
    parser.add_argument("--heading", type=float, metavar="DEG", help="heading, used until one is received")
    parser.add_argument("--depth", type=float, default=0.0, metavar="M", help="depth of the vehicle if no sentence gives it (0)")
    parser.add_argument("--bottom", type=float, metavar="M", help="depth of the bottom: the vehicle is DPT or DBT above it")
    parser.add_argument("--depth-is-vehicle", action="store_true", help="DPT and DBT give the vehicle's own depth")
    parser.add_argument("--without-checksum", action="store_true",
                        help="accept sentences without a checksum; wrong checksums are always rejected")
    parser.add_argument("--fast", action="store_true", help="send a file at once, not at the pace of its fixes")
    parser.add_argument("--count", type=int, help="stop after this number of poses")
    return parser


class Bridge:
    """Converts lines to poses and sends them."""

    def __init__(self, poses: NmeaPoses, sender: PoseSender, log: TextIO, without_checksum: bool = False) -> None:
        self.poses, self.sender, self.log, self.without_checksum = poses, sender, log, without_checksum
        self.lines = self.invalid = self.sent = 0
        self._reported: "Optional[List[str]]" = None

    def log_line(self, text: str) -> None:
        print(f"nmea_to_pose: {text}", file=self.log, flush=True)

    def feed(self, line: str) -> str:
        """Like NmeaPoses.feed(), for a line of text."""
        if not line.strip():
            return ""
        self.lines += 1
        try:
            return self.poses.feed(parse_sentence(line, self.without_checksum))
        except NmeaError as error:
            self.invalid += 1
            if self.invalid == 1:
                self.log_line(f"line {self.lines}: {error}; invalid lines are skipped")
            return ""

    def send(self, timestamp: Optional[float]) -> bool:
        pose = self.poses.pose()
        if pose is None:
            return False
        position, rpy = pose
        self.sender.send(position, rpy=rpy, frame="NED_FRD", timestamp=timestamp)
        self.sent += 1
        self.report_unknown()
        return True

    def report_unknown(self) -> None:
        """Logs which values are missing, once and after each change."""
        unknown = self.poses.unknown()
        if unknown != self._reported:
            self._reported = unknown
            received = ", ".join(sorted(self.poses.instruments.received)) or "nothing"
            self.log_line(f"received {received}" + ("; missing: " + "; ".join(unknown) if unknown else ""))

    def report_totals(self) -> None:
        self.log_line(f"{self.lines} lines, {self.invalid} invalid, {self.sent} poses")
        if not self.sent:
            self.report_unknown()


def _from_udp(address: Tuple[str, int], bridge: Bridge) -> Iterator[str]:
    """Yields lines as they arrive; a datagram contains one or several complete lines."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(address)
        receiver.settimeout(SILENCE_S)
        bridge.log_line(f"listening on UDP {address[0]}:{receiver.getsockname()[1]}")
        while True:
            try:
                data = receiver.recv(65536)
            except socket.timeout:
                if not bridge.sent:
                    bridge.report_unknown()
                continue
            yield from data.decode("latin-1").splitlines()


def _run_live(lines: Iterator[str], bridge: Bridge, count: Optional[int]) -> None:
    """Sends a pose for each attitude or position, without a timestamp, because few sentences contain a time."""
    for line in lines:
        if bridge.feed(line) in ("place", "attitude"):
            bridge.send(None)
        if count is not None and bridge.sent >= count:
            return


def _replay(lines: Iterator[str], bridge: Bridge, count: Optional[int], fast: bool) -> None:
    """Sends a pose for each fix, stamped with its time of day, at the pace of these times."""
    began: "Optional[Tuple[float, float]]" = None
    for line in lines:
        if bridge.feed(line) != "place":
            continue
        now = bridge.poses.instruments.fix_time_s
        if now is not None and not fast:
            began = began or (time.monotonic(), now)
            time.sleep(max(0.0, min(LONGEST_WAIT_S, began[0] + now - began[1] - time.monotonic())))
        bridge.send(now)
        if count is not None and bridge.sent >= count:
            return


def run(options: argparse.Namespace, log: TextIO) -> int:
    if options.bottom is not None and options.depth_is_vehicle:
        raise ValueError("--bottom and --depth-is-vehicle exclude each other: give one")
    assumed = Assumptions(parse_origin(options.origin) if options.origin else None, tuple(options.at) if options.at else None,
                          options.heading, options.depth, options.depth_is_vehicle, options.bottom)
    instruments = endpoint(options.listen, UDP_PORT, lowest=0)
    with PoseSender(options.to, vehicle=options.vehicle) as sender:
        bridge = Bridge(NmeaPoses(assumed), sender, log, options.without_checksum)
        try:
            if options.file is None:
                _run_live(_from_udp(instruments, bridge), bridge, options.count)
            elif options.file == "-":
                _run_live(iter(sys.stdin), bridge, options.count)
            else:
                with open(options.file, encoding="latin-1") as file:
                    _replay(iter(file), bridge, options.count, options.fast)
        finally:
            bridge.report_totals()
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
        print(f"nmea_to_pose: {error.filename}: file not found", file=sys.stderr)
        return 66
    except OSError as error:
        print(f"nmea_to_pose: {error}", file=sys.stderr)
        return 69


if __name__ == "__main__":
    sys.exit(main())
