"""Converts logs to trajectory files: `python3 -m sonard_client.convert IN -o OUT.csv`, or convert(IN).

The code needs only the standard library, and lz4 or zstandard for logs with these compressions.
"""
from ..geodesy import Geodetic
from .formats import FORMATS, convert, format_of
from .track import ConvertError, Track, write_csv

__all__ = ["FORMATS", "ConvertError", "Geodetic", "Track", "convert", "format_of", "write_csv"]
