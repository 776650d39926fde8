"""Chunks of recordings, unpacked: bz2 by the standard library, lz4 and zstd where their modules are installed."""
from __future__ import annotations

import bz2
import importlib
from typing import Any, Callable, Optional

LARGEST_CHUNK = 1 << 30


class Unreadable(Exception):
    """Why these bytes cannot be unpacked here."""


def _module(*names: str) -> Any:
    for name in names:
        try:
            return importlib.import_module(name)
        except ImportError:
            continue
    return None


def _unpacker(kind: str) -> Optional[Callable[[bytes, int], bytes]]:
    if kind in ("", "none"):
        return lambda data, _: data
    if kind == "bz2":
        return lambda data, _: bz2.decompress(data)
    if kind == "lz4":
        lz4 = _module("lz4.frame")
        return None if lz4 is None else lambda data, _: bytes(lz4.decompress(data))
    if kind == "zstd":
        newer = _module("compression.zstd")
        if newer is not None:
            return lambda data, _: bytes(newer.decompress(data))
        older = _module("zstandard")
        return None if older is None else lambda data, size: bytes(older.ZstdDecompressor().decompress(data, size))
    raise Unreadable(f"compressed by {kind!r}, which is not known here")


def unpack(kind: str, data: bytes, size: int) -> bytes:
    """Exactly `size` bytes, or Unreadable."""
    if size > LARGEST_CHUNK:
        raise Unreadable(f"a chunk of {size} bytes: more than 1 GiB is not believed")
    unpacker = _unpacker(kind)
    if unpacker is None:
        package = {"lz4": "python3-lz4", "zstd": "python3-zstandard"}[kind]
        raise Unreadable(f"compressed by {kind}: install {package} (apt) or {package[8:]} (pip), or write the recording again "
                         "without compression")
    try:
        out = unpacker(data, size)
    except Exception as error:  # each module has its own kinds
        raise Unreadable(f"its {kind} data cannot be unpacked: {error}") from None
    if len(out) != size:
        raise Unreadable(f"unpacks to {len(out)} bytes where {size} were promised")
    return out
