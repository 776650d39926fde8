"""Latitude and longitude (WGS 84) as metres north, east and down in the tangent plane of an origin."""
from __future__ import annotations

import math
from typing import NamedTuple, Tuple

from .rotations import Vector3

EQUATOR_M, FLATTENING = 6378137.0, 1 / 298.257223563
_E2 = FLATTENING * (2 - FLATTENING)  # first eccentricity, squared


class Geodetic(NamedTuple):
    """Altitudes refer to the ellipsoid or to mean sea level, the same for the origin and for positions relative to it."""
    latitude_deg: float
    longitude_deg: float
    altitude_m: float = 0.0

    @property
    def is_fix(self) -> bool:
        """True if the position is possible. 0, 0 is not, because receivers without a fix report it."""
        return all(map(math.isfinite, self)) and abs(self.latitude_deg) <= 90 and abs(self.longitude_deg) <= 360 and \
            (self.latitude_deg, self.longitude_deg) != (0, 0)

    def __str__(self) -> str:
        return f"{self.latitude_deg:.8f},{self.longitude_deg:.8f},{self.altitude_m:.3f}"


def parse_origin(text: str) -> Geodetic:
    """Parses "LAT,LON" or "LAT,LON,ALT": degrees, metres."""
    try:
        numbers = [float(part) for part in text.split(",")]
        place = Geodetic(*numbers)
    except (ValueError, TypeError):
        raise ValueError(f"origin {text!r} is not LAT,LON,ALT in degrees and metres") from None
    if not (all(map(math.isfinite, place)) and abs(place.latitude_deg) <= 90 and abs(place.longitude_deg) <= 360):
        raise ValueError(f"origin {text!r} is out of range: latitude within 90 degrees, longitude within 360")
    return place


def ecef(place: Geodetic) -> Vector3:
    """Returns Earth-centred, Earth-fixed coordinates [m]: axes to 0 N 0 E, 0 N 90 E and the north pole."""
    latitude, longitude = math.radians(place.latitude_deg), math.radians(place.longitude_deg)
    normal_m = EQUATOR_M / math.sqrt(1 - _E2 * math.sin(latitude) ** 2)
    radius_m = (normal_m + place.altitude_m) * math.cos(latitude)
    return (radius_m * math.cos(longitude), radius_m * math.sin(longitude),
            (normal_m * (1 - _E2) + place.altitude_m) * math.sin(latitude))


class LocalPlane:
    """Tangent plane at an origin: coordinates north, east, down [m]."""

    def __init__(self, origin: Geodetic) -> None:
        self.origin = origin
        self._centre = ecef(origin)
        latitude, longitude = math.radians(origin.latitude_deg), math.radians(origin.longitude_deg)
        sl, cl, so, co = math.sin(latitude), math.cos(latitude), math.sin(longitude), math.cos(longitude)
        self._axes: Tuple[Vector3, ...] = ((-sl * co, -sl * so, cl), (-so, co, 0.0), (-cl * co, -cl * so, -sl))

    def ned(self, place: Geodetic) -> Vector3:
        return self._from_ecef(ecef(place))

    def ned_from(self, other: "LocalPlane", ned: Vector3) -> Vector3:
        """Converts coordinates `ned` of another plane to this one."""
        x, y, z = (c + sum(ned[i] * other._axes[i][k] for i in range(3)) for k, c in enumerate(other._centre))
        return self._from_ecef((x, y, z))

    def _from_ecef(self, point: Vector3) -> Vector3:
        north, east, down = (sum(a * (p - c) for a, p, c in zip(axis, point, self._centre)) for axis in self._axes)
        return north, east, down
