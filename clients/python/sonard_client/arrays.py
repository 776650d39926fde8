"""Grids and vectors: numpy arrays if numpy is installed, else memoryviews and tuples.

Both kinds of grid are indexed as grid[row, beam] and have shape and tolist().
"""
from __future__ import annotations

import sys
from typing import Any, Iterable

numpy: Any
try:
    import numpy
except ImportError:
    numpy = None

Grid = Any    # numpy.ndarray of rows x beams, or a memoryview of that shape
Vector = Any  # numpy.ndarray, or a tuple of floats

_CODES = {1: "B", 2: "H", 4: "I"}


def grid(little_endian: bytes, rows: int, columns: int, width: int) -> Grid:
    """Returns a read-only grid of unsigned samples of `width` bytes, row by row. 3-byte samples become 4 bytes wide."""
    if width == 3:
        wide = bytearray(len(little_endian) // 3 * 4)
        for place in range(3):
            wide[place::4] = little_endian[place::3]
        little_endian, width = bytes(wide), 4
    if numpy is not None:
        return numpy.frombuffer(little_endian, dtype=f"<u{width}").reshape(rows, columns)
    if sys.byteorder == "big" and width > 1:
        swapped = bytearray(len(little_endian))
        for place in range(width):
            swapped[place::width] = little_endian[width - 1 - place::width]
        little_endian = bytes(swapped)
    return memoryview(little_endian).cast(_CODES[width], shape=[rows, columns])


def vector(values: Iterable[float]) -> Vector:
    return numpy.array(tuple(values), dtype=float) if numpy is not None else tuple(values)
