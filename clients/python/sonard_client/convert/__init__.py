"""Logs of others as trajectory files: `python3 -m sonard_client.convert IN -o OUT.csv`, or convert(IN).

Every format is read by code of this folder; the standard library only, but lz4 and zstandard for logs compressed by these.
"""
from ..geodesy import Geodetic
from .formats import FORMATS, convert, format_of
from .track import ConvertError, Track, write_csv

__all__ = ["FORMATS", "ConvertError", "Geodetic", "Track", "convert", "format_of", "write_csv"]
