"""Decompresses chunks of recordings: bz2 with the standard library, lz4 and zstd if their modules are installed."""
from __future__ import annotations

import bz2
import importlib
from typing import Any, Callable, Optional

LARGEST_CHUNK = 1 << 30
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


class Unreadable(Exception):
    """The reason why a chunk cannot be decompressed."""


def _module(*names: str) -> Any:
    for name in names:
        try:
            return importlib.import_module(name)
        except ImportError:
            continue
    return None


def _bounded(stream: Any, data: bytes, size: int) -> bytes:
    """Limits the output to one byte more than declared, because a few bytes can expand beyond the available memory."""
    out = bytes(stream.decompress(data, max_length=size + 1))
    if len(out) <= size and not stream.eof:
        raise EOFError("the data is truncated")
    return out


def _read(reader: Any, size: int) -> bytes:
    """Like _bounded(), for a file-like object that may return less than requested."""
    out = b""
    while len(out) <= size:
        part = reader.read(size + 1 - len(out))
        if not part:
            break
        out += part
    return out


def _unpacker(kind: str) -> Optional[Callable[[bytes, int], bytes]]:
    if kind in ("", "none"):
        return lambda data, _: data
    if kind == "bz2":
        return lambda data, size: _bounded(bz2.BZ2Decompressor(), data, size)
    if kind == "lz4":
        lz4 = _module("lz4.frame")
        return None if lz4 is None else lambda data, size: _bounded(lz4.LZ4FrameDecompressor(), data, size)
    if kind == "zstd":
        newer = _module("compression.zstd")
        if newer is not None:
            return lambda data, size: _bounded(newer.ZstdDecompressor(), data, size)
        older = _module("zstandard")
        return None if older is None else lambda data, size: _read(older.ZstdDecompressor().stream_reader(data), size)
    raise Unreadable(f"compressed by {kind!r}, which is not supported")


def unpack(kind: str, data: bytes, size: int) -> bytes:
    """Returns exactly `size` bytes, or raises Unreadable."""
    if size > LARGEST_CHUNK:
        raise Unreadable(f"a chunk of {size} bytes exceeds the limit of 1 GiB")
    out = unpack_at_most(kind, data, size)
    if len(out) != size:
        raise Unreadable(f"decompresses to {len(out)} of {size} declared bytes")
    return out


def unpack_at_most(kind: str, data: bytes, size: int) -> bytes:
    """Returns the decompressed bytes, or raises Unreadable if there are more than `size`."""
    unpacker = _unpacker(kind)
    if unpacker is None:
        package = {"lz4": "python3-lz4", "zstd": "python3-zstandard"}[kind]
        raise Unreadable(f"compressed by {kind}: install {package} (apt) or {package[8:]} (pip), or write the recording "
                         "without compression")
    try:
        out = unpacker(data, size)
    except Exception as error:  # each module has its own exceptions
        raise Unreadable(f"its {kind} data cannot be decompressed: {error}") from None
    if len(out) > size:
        raise Unreadable(f"decompresses to more than the declared {size} bytes")
    return out
