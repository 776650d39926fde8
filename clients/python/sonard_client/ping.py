"""A decoded ping: samples by row and beam, with their ranges and directions.

Beam 0 is the outermost to port. Azimuths are positive to port, x is ahead and y to port; only `bearings_rad` is as on the wire.
"""
from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import Any, NamedTuple, Optional, Tuple

from . import arrays, layouts
from .arrays import Grid, Vector
from .stream import Message


class Peak(NamedTuple):
    """A sample and its position. `value` is the sample, divided by the root of its row's gain if there are gains."""
    value: float
    row: int
    beam: int
    range_m: float
    azimuth_rad: float  # positive to port
    x_m: float          # ahead of the sonar
    y_m: float          # to port


@dataclass(frozen=True, eq=False)
class Ping:
    """A checked ping result. Grids and vectors are numpy arrays if numpy is installed."""
    number: int
    device_id: int
    version: int                    # message version: 0, 1 or 2
    settings: layouts.FireSettings  # the sonar's echo of the fire message
    frequency_hz: float
    sound_speed_mps: float
    temperature_c: float
    pressure_bar: float
    heading_deg: Optional[float]    # from north, clockwise; version 2 only, as are the next three
    pitch_deg: Optional[float]      # bow up
    roll_deg: Optional[float]       # starboard down
    start_time_s: Optional[float]   # since power-up
    start_counter: Optional[int]    # versions 0 and 1: 32 bits, free-running
    row_m: float
    ranges_m: Vector                # centres of the rows
    azimuths_rad: Vector            # azimuths of the beams, positive to port
    sample_bits: int                # 8, 16, 24 or 32
    samples: Grid                   # samples[row, beam], as sent
    row_gains: Optional[Tuple[int, ...]]
    data: bytes                     # the whole message

    @property
    def rows(self) -> int:
        return int(self.samples.shape[0])

    @property
    def beams(self) -> int:
        return int(self.samples.shape[1])

    @property
    def bearings_rad(self) -> Vector:
        """Bearings as on the wire: positive to starboard."""
        return arrays.vector(-a for a in self.azimuths_rad)

    def row(self, row: int) -> Tuple[int, ...]:
        """Returns the samples of one row, beam 0 first."""
        return tuple(int(self.samples[row, beam]) for beam in range(self.beams))

    def amplitudes(self) -> Any:
        """Returns the samples divided by the root of their row's gain, so that rows are comparable: floats, rows x beams (without
        numpy a list of lists)."""
        gains = self.row_gains or (1,) * self.rows
        if arrays.numpy is not None:
            return self.samples / arrays.numpy.sqrt(arrays.numpy.array(gains, dtype=float))[:, None]
        return [[value / math.sqrt(gain) for value in row] for row, gain in zip(self.samples.tolist(), gains)]

    def xy(self, row: int, beam: int) -> Tuple[float, float]:
        """Returns metres ahead of the sonar and to port, in the plane of the image."""
        r, a = float(self.ranges_m[row]), float(self.azimuths_rad[beam])
        return r * math.cos(a), r * math.sin(a)

    def fan_xy(self) -> Tuple[Any, Any]:
        """Returns metres ahead and to port of every sample, two grids of rows x beams, as a colour mesh needs."""
        if arrays.numpy is not None:
            outer, a = arrays.numpy.outer, self.azimuths_rad
            return outer(self.ranges_m, arrays.numpy.cos(a)), outer(self.ranges_m, arrays.numpy.sin(a))
        ahead, port = [math.cos(a) for a in self.azimuths_rad], [math.sin(a) for a in self.azimuths_rad]
        return [[r * c for c in ahead] for r in self.ranges_m], [[r * s for s in port] for r in self.ranges_m]

    def strongest(self, beyond_m: float = 0.0) -> Peak:
        """Returns the strongest sample; of equal ones the nearest, then the outermost to port. `beyond_m` excludes the first
        rows, which contain the transmitter's leak."""
        first = min(max(math.ceil(beyond_m / self.row_m - 0.5), 0), self.rows - 1)
        if arrays.numpy is not None:
            place = int(self.amplitudes()[first:].argmax())
            row, beam = first + place // self.beams, place % self.beams
        else:
            row, beam = self._strongest_without_numpy(first)
        gain = self.row_gains[row] if self.row_gains else 1
        value = int(self.samples[row, beam]) / math.sqrt(gain)
        return Peak(value, row, beam, float(self.ranges_m[row]), float(self.azimuths_rad[beam]), *self.xy(row, beam))

    def _strongest_without_numpy(self, first: int) -> Tuple[int, int]:
        gains = self.row_gains or (1,) * self.rows
        best, found, where = -1.0, [0], first
        for row, samples in enumerate(self.samples.tolist()[first:], first):
            value = max(samples) / math.sqrt(gains[row])
            if value > best:
                best, found, where = value, samples, row
        return where, found.index(max(found))


def ping_from(message: Message) -> Ping:
    """Decodes a ping message of a MessageReader, which has checked its lengths."""
    data, version = message.data, message.header.version
    f = layouts.read_ping_fields(data, version)
    settings = layouts.read_fire(data[layouts.HEADER_BYTES:], version)
    bearings = struct.unpack_from(f"<{f.beams}h", data, layouts.ping_head_bytes(version))
    image, gains = data[f.image_offset:], None
    if settings.row_gains:
        stride = 4 + f.beams * f.sample_bytes
        gains = tuple(max(struct.unpack_from("<I", image, at)[0], 1) for at in range(0, len(image), stride))
        image = b"".join(image[at + 4:at + stride] for at in range(0, len(image), stride))
    heading, pitch, roll = f.attitude_deg or (None, None, None)
    return Ping(
        number=f.number, device_id=message.header.source, version=version, settings=settings, frequency_hz=f.frequency_hz,
        sound_speed_mps=f.sound_speed_mps, temperature_c=f.temperature_c, pressure_bar=f.pressure_bar, heading_deg=heading,
        pitch_deg=pitch, roll_deg=roll, start_time_s=f.start_time_s, start_counter=f.start_counter, row_m=f.row_m,
        ranges_m=arrays.vector((row + 0.5) * f.row_m for row in range(f.rows)),
        azimuths_rad=arrays.vector(-math.radians(b / 100) for b in bearings), sample_bits=8 * f.sample_bytes,
        samples=arrays.grid(image, f.rows, f.beams, f.sample_bytes), row_gains=gains, data=data)
