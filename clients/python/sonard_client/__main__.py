"""python3 -m sonard_client listen|discover|pose|status: inspect a sonar or the daemon, send one pose."""
from __future__ import annotations

import argparse
import json
import math
import os
import pathlib
import socket
import sys
from typing import List, Optional

from . import Control, ControlError, OculusClient, PoseSender, discover


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python3 -m sonard_client", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    listen = commands.add_parser("listen", help="print a line for each ping of a sonar")
    listen.add_argument("address", nargs="?", default="127.0.0.2")
    listen.add_argument("--range", type=float, default=10, help="m")
    listen.add_argument("--rate", type=int, default=10, help="pings per second: 2, 5, 10, 15 or 40")
    listen.add_argument("--gain", type=float, default=50, help="per cent")
    listen.add_argument("--count", type=int, help="number of pings (default: until Ctrl-C)")
    listen.add_argument("--timeout", type=float, default=10, help="longest time without a ping [s]")
    found = commands.add_parser("discover", help="list the sonars whose status datagrams arrive")
    found.add_argument("--seconds", type=float, default=2.5)
    found.add_argument("--listen", default="0.0.0.0", help="local address")
    found.add_argument("--enough", type=int, help="stop after this number of sonars")
    pose = commands.add_parser("pose", help="send one pose")
    pose.add_argument("xyz", nargs=3, type=float, help="m")
    pose.add_argument("--rpy", nargs=3, type=float, default=(0, 0, 0), metavar="DEG", help="roll pitch yaw")
    pose.add_argument("--frame", default="ENU_FLU", choices=("ENU_FLU", "NED_FRD"))
    pose.add_argument("--to", default="127.0.0.1", help="host or host:port")
    pose.add_argument("--encoding", default="json", choices=("json", "protobuf"))
    pose.add_argument("--vehicle", default="")
    status = commands.add_parser("status", help="print the daemon's status as JSON")
    status.add_argument("--host", default="127.0.0.1")
    status.add_argument("--port", type=int, default=8088)
    status.add_argument("--token-file", help="the daemon's control.token_file")
    return parser


def _listen(options: argparse.Namespace) -> None:
    with OculusClient(options.address) as sonar:
        sonar.fire(range_m=options.range, rate_hz=options.rate, gain_percent=options.gain)
        for ping in sonar.pings(options.timeout, options.count):
            best = ping.strongest(beyond_m=0.5)
            line = (f"ping {ping.number}  {ping.rows} x {ping.beams}  {ping.frequency_hz / 1e6:.3f} MHz  "
                    f"heading {ping.heading_deg or 0:.1f}  strongest {best.value:.0f} at {best.range_m:.2f} m, "
                    f"{math.degrees(best.azimuth_rad):+.1f} deg to port")
            try:
                print(line, flush=True)
            except BrokenPipeError:  # the reader has ended, as `head` does
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the interpreter flushes once more
                return


def _run(options: argparse.Namespace) -> None:
    if options.command == "listen":
        _listen(options)
    elif options.command == "discover":
        for sonar in discover(options.seconds, options.listen, enough=options.enough):
            print(f"{sonar.address}  id {sonar.device_id}  part {sonar.part_number}  " +
                  (f"connected to {sonar.connected}" if sonar.connected else "free"))
    elif options.command == "pose":
        with PoseSender(options.to, options.encoding, vehicle=options.vehicle) as poses:
            poses.send(options.xyz, rpy=[math.radians(a) for a in options.rpy], frame=options.frame)
    else:
        token = pathlib.Path(options.token_file).read_text(encoding="utf-8").strip() if options.token_file else None
        print(json.dumps(Control(options.host, options.port, token).status(), indent=2))


def main(arguments: Optional[List[str]] = None) -> int:
    options = _parser().parse_args(arguments)
    try:
        _run(options)
    except KeyboardInterrupt:
        return 130
    except ValueError as error:
        print(f"sonard_client: {error}", file=sys.stderr)
        return 64
    except socket.gaierror as error:
        place = {"listen": "address", "discover": "listen", "pose": "to", "status": "host"}[options.command]
        print(f"sonard_client: no address for {getattr(options, place)}: {error.strerror}", file=sys.stderr)
        return 69
    except (ControlError, OSError) as error:
        words = error.strerror if isinstance(error, OSError) and not error.filename and error.strerror else error
        if isinstance(error, OSError) and error.filename:
            words = f"cannot read {error.filename}: {error.strerror}"
        print(f"sonard_client: {words}", file=sys.stderr)
        return 69
    return 0


if __name__ == "__main__":
    sys.exit(main())
