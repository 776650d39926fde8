"""Reads protobuf messages without their description."""
from __future__ import annotations

from typing import Dict, Iterator, Tuple, Union

Value = Union[int, bytes]


def varint(data: bytes, at: int) -> Tuple[int, int]:
    """Returns the number and the offset of its end. Raises ValueError."""
    value = shift = 0
    while at < len(data) and shift < 64:
        value |= (data[at] & 127) << shift
        if data[at] < 128:
            return value, at + 1
        at, shift = at + 1, shift + 7
    raise ValueError("a number is cut short")


def varints(data: bytes) -> Iterator[int]:
    at = 0
    while at < len(data):
        value, at = varint(data, at)
        yield value


def fields(data: bytes) -> Dict[int, Value]:
    """Returns the last value of each field: a number, or bytes. Raises ValueError."""
    found: Dict[int, Value] = {}
    at = 0
    while at < len(data):
        key, at = varint(data, at)
        size = {1: 8, 5: 4}.get(key & 7, 0)
        if key & 7 == 0:
            found[key >> 3], at = varint(data, at)
            continue
        if key & 7 == 2:
            size, at = varint(data, at)
        elif not size:
            raise ValueError("an unknown kind of field")
        if at + size > len(data):
            raise ValueError("a field is cut short")
        found[key >> 3], at = data[at:at + size], at + size
    return found


def number(message: Dict[int, Value], field: int) -> int:
    """Returns a number; 0 if it is missing. Raises ValueError."""
    value = message.get(field, 0)
    if not isinstance(value, int):
        raise ValueError(f"field {field} is not a number")
    return value


def block(message: Dict[int, Value], field: int) -> bytes:
    """Returns bytes, a text or a message; empty if it is missing. Raises ValueError."""
    value = message.get(field, b"")
    if not isinstance(value, bytes):
        raise ValueError(f"field {field} is a number")
    return value
