"""Status datagrams: the broadcast by which Oculus sonars say where they are."""
from __future__ import annotations

import ipaddress
import socket
import struct
import time
from dataclasses import dataclass
from typing import Dict, List, Optional, Tuple

from . import layouts

_BODY = struct.Struct("<IHHI6I4s4s4s6s8dd")  # behind the header, 126 bytes


@dataclass(frozen=True)
class SonarFound:
    """What one status datagram says."""
    address: str             # where clients connect
    device_id: int
    part_number: int         # the product
    netmask: str
    mac: str
    connected: Optional[str]  # address of its client; None: it is free
    status_word: int
    temperature_c: float
    pressure_bar: float
    heard_from: str = ""     # sender of the datagram; differs behind address translation


def read_status(data: bytes, heard_from: str = "") -> Optional[SonarFound]:
    """None for whatever is no status datagram of exactly 142 bytes."""
    if len(data) != layouts.HEADER_BYTES + _BODY.size or data[:2] != layouts.MAGIC:
        return None
    header = layouts.read_header(data[:layouts.HEADER_BYTES])
    if header.type != layouts.STATUS or header.payload_bytes != _BODY.size:
        return None
    device_id, _, part, word, *rest = _BODY.unpack_from(data, layouts.HEADER_BYTES)
    address, mask, connected, mac = rest[6:10]
    client = str(ipaddress.IPv4Address(connected))
    return SonarFound(str(ipaddress.IPv4Address(address)), device_id, part, str(ipaddress.IPv4Address(mask)), mac.hex(":"),
                      None if client == "0.0.0.0" else client, word, rest[10], rest[18], heard_from)


def discover(seconds: float = 2.5, listen: str = "0.0.0.0", port: int = layouts.STATUS_PORT,
             enough: Optional[int] = None) -> List[SonarFound]:
    """The sonars whose status is heard within `seconds`, or sooner when they are `enough`, by address: the newest word of each.
    They speak once a second.

    The port may be shared with drivers that allow it: all of them hear broadcasts, but only one hears status messages that are
    sent to this computer alone. OSError when the port is another's."""
    found: Dict[Tuple[str, int], SonarFound] = {}
    deadline = time.monotonic() + seconds
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.bind((listen, port))
        while enough is None or len(found) < enough:
            left = deadline - time.monotonic()
            if left <= 0:
                break
            sock.settimeout(left)
            try:
                data, sender = sock.recvfrom(2048)
            except socket.timeout:
                break
            sonar = read_status(data, sender[0])
            if sonar is not None:
                found[(sonar.address, sonar.device_id)] = sonar
    return [found[key] for key in sorted(found)]
