"""Addresses with ports, as users write them."""
from __future__ import annotations

from typing import Tuple


def endpoint(address: str, port: int, lowest: int = 1) -> Tuple[str, int]:
    """Splits "host" or "host:port" into ("host", port). lowest: 0 for listeners, where port 0 means any free port."""
    host, colon, number = address.rpartition(":")
    if not colon:
        return address, port
    if not number.isdigit() or not lowest <= int(number) < 65536:
        raise ValueError(f"{address}: the port must be a number from {lowest} to 65535")
    return host, int(number)
