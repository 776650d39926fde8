"""Rotations for poses: Hamilton quaternions (w, x, y, z), body to world."""
from __future__ import annotations

import math
from typing import Sequence, Tuple

Quaternion = Tuple[float, float, float, float]
Vector3 = Tuple[float, float, float]


def quaternion_from_rpy(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Converts intrinsic Z-Y-X angles: yaw first, then pitch, then roll."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return (cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy)


def three(name: str, values: Sequence[float]) -> Vector3:
    """Checks that the values are three finite numbers; else raises ValueError."""
    numbers = tuple(float(v) for v in values)
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{name} must be three finite numbers, not {values!r}")
    return numbers[0], numbers[1], numbers[2]


def unit(values: Sequence[float]) -> Quaternion:
    """Normalises a quaternion of nearly unit length; raises ValueError for others, which sonard would refuse."""
    numbers = [float(v) for v in values]
    if len(numbers) != 4 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"a quaternion is four finite numbers w, x, y, z, not {values!r}")
    norm = math.sqrt(sum(v * v for v in numbers))
    if abs(norm - 1) > 1e-3:
        raise ValueError(f"the quaternion has norm {norm:g}, not 1: normalise it before sending")
    return numbers[0] / norm, numbers[1] / norm, numbers[2] / norm, numbers[3] / norm


def orientation(quaternion: "Sequence[float] | None", rpy: "Sequence[float] | None") -> Quaternion:
    """Returns the given quaternion, or that of rpy; no rotation if neither is given."""
    if quaternion is not None and rpy is not None:
        raise ValueError("give quaternion or rpy, not both")
    if quaternion is not None:
        return unit(quaternion)
    return quaternion_from_rpy(*three("rpy", rpy)) if rpy is not None else (1.0, 0.0, 0.0, 0.0)


def to_body(q: Quaternion, v: Vector3) -> Vector3:
    """Rotates a vector from world axes to body axes."""
    w, x, y, z = q[0], -q[1], -q[2], -q[3]
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx


def between(a: Quaternion, b: Quaternion, u: float) -> Quaternion:
    """Returns the spherical linear interpolation from a (u = 0) to b (u = 1) along the shorter arc."""
    cosine = sum(p * q for p, q in zip(a, b))
    sign = -1.0 if cosine < 0 else 1.0
    angle = math.acos(min(1.0, abs(cosine)))
    if angle < 1e-6:
        return unit([p + u * (sign * q - p) for p, q in zip(a, b)])
    from_a, from_b = math.sin((1 - u) * angle) / math.sin(angle), sign * math.sin(u * angle) / math.sin(angle)
    return unit([from_a * p + from_b * q for p, q in zip(a, b)])
