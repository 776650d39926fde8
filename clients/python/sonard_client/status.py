"""Status datagrams, which Oculus sonars broadcast with their address."""
from __future__ import annotations

import ipaddress
import socket
import struct
import time
from dataclasses import dataclass
from typing import Dict, List, Optional, Tuple

from . import layouts

_BODY = struct.Struct("<IHHI6I4s4s4s6s8dd")  # after the header, 126 bytes


@dataclass(frozen=True)
class SonarFound:
    """Contents of a status datagram."""
    address: str             # where clients connect
    device_id: int
    part_number: int         # the product
    netmask: str
    mac: str
    connected: Optional[str]  # address of its client; None = free
    status_word: int
    temperature_c: float
    pressure_bar: float
    sender: str = ""         # source of the datagram; differs if addresses are translated


def read_status(data: bytes, sender: str = "") -> Optional[SonarFound]:
    """Parses a status datagram. Returns None for other datagrams; a status has exactly 142 bytes."""
    if len(data) != layouts.HEADER_BYTES + _BODY.size or data[:2] != layouts.MAGIC:
        return None
    header = layouts.read_header(data[:layouts.HEADER_BYTES])
    if header.type != layouts.STATUS or header.payload_bytes != _BODY.size:
        return None
    device_id, _, part, word, *rest = _BODY.unpack_from(data, layouts.HEADER_BYTES)
    address, mask, connected, mac = rest[6:10]
    client = str(ipaddress.IPv4Address(connected))
    return SonarFound(str(ipaddress.IPv4Address(address)), device_id, part, str(ipaddress.IPv4Address(mask)), mac.hex(":"),
                      None if client == "0.0.0.0" else client, word, rest[10], rest[18], sender)


def discover(seconds: float = 2.5, listen: str = "0.0.0.0", port: int = layouts.STATUS_PORT,
             enough: Optional[int] = None) -> List[SonarFound]:
    """Receives for `seconds`, or until `enough` sonars are found. Returns the latest status of each sonar, sorted by address.
    Sonars send a status once a second.

    Drivers may share the port: all of them receive broadcasts, but only one receives unicast status datagrams. Raises OSError
    if another program has bound the port exclusively."""
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
                data, source = sock.recvfrom(2048)
            except socket.timeout:
                break
            sonar = read_status(data, source[0])
            if sonar is not None:
                found[(sonar.address, sonar.device_id)] = sonar
    return [found[key] for key in sorted(found)]
