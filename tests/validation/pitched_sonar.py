"""A plate and a rod in a tank that stands at an angle to the sonar: ray sampling against raster sampling, and the default."""

import numpy as np

import page
from runs import db
from texts import table
from two_cylinders import KINDS

# As in scenes/tilted-tank.yaml: where plate and rod are [m], and a point and the two angles [deg] of each wall.
PLATE_M, ROD_M = (2.5, 0.6), (2.2, -0.7)
PLATE_HALF_M, ROD_RADIUS_M = 0.01, 0.03
WALLS = [((4.0, 1.5), 35.0), ((4.0, -1.5), -55.0)]
TIPPED_DEG = 5.0
WINDOW_M = 0.3
SHADOWS_DEG = 3.0  # beams so near to the rod, and over the plate, hold no wall


def nearest_wall_m(azimuth_rad):
    """Of the cone u = sin(azimuth): its nearest point of each plane n . p = d lies where n . direction is greatest, d over
    n_y u + sqrt(1 - u^2) hypot(n_x, n_z); and of the walls the nearer one."""
    u = np.sin(azimuth_rad)
    tip, ranges = np.radians(TIPPED_DEG), []
    for (x, y), turned_deg in WALLS:
        turned = np.radians(turned_deg)
        n = np.array([np.cos(tip) * np.cos(turned), np.cos(tip) * np.sin(turned), -np.sin(tip)])
        towards = n[1] * u + np.sqrt(1 - u * u) * np.hypot(n[0], n[2])
        ranges.append((n[0] * x + n[1] * y) / np.maximum(towards, 1e-6))
    return np.minimum(*ranges)


def peak_m(ping, beam, range_m):
    inside = np.abs(ping.range - range_m) < WINDOW_M
    return float(ping.range[np.argmax(np.where(inside, ping.power[:, beam], 0))])


def off_walls_m(ping):
    """Peak less nearest point, of every beam that sees a wall past plate and rod."""
    degrees = np.degrees(ping.azimuth)
    plate, rod = (np.degrees(np.arctan2(y, x)) for x, y in (PLATE_M, ROD_M))
    free = (np.abs(degrees) < 40) & (np.abs(degrees - plate) > 10) & (np.abs(degrees - rod) > SHADOWS_DEG)
    return [peak_m(ping, b, near) - near for b, near in zip(np.nonzero(free)[0], nearest_wall_m(ping.azimuth[free]))]


def chapter(sonard, folder):
    plate, rod = float(np.hypot(*PLATE_M)) - PLATE_HALF_M, float(np.hypot(*ROD_M)) - ROD_RADIUS_M
    rows = []
    for name, arguments in KINDS:
        ping = sonard.expected("tilted-tank", *arguments)[0]
        at = [peak_m(ping, ping.beam_at(np.arctan2(y, x)), near) for (x, y), near in ((PLATE_M, plate), (ROD_M, rod))]
        off = off_walls_m(ping)
        rows.append([name, f"{at[0]:.3f} m", f"{at[1]:.3f} m", f"{np.median(off):+.3f} m", f"{max(off, key=abs):+.3f} m"])
    text = table(["", f"plate, at {plate:.3f} m", f"rod, at {rod:.3f} m", "walls, median", "walls, farthest off"], rows)
    figure, axes = page.plt.subplots(1, 3, figsize=(12, 3.6))
    for axis, (title, arguments) in zip(axes, [KINDS[0], KINDS[2], ("default", [])]):
        ping = next(sonard.pings_of("tilted-tank", *arguments))
        level = db(ping.power) + 30 * np.log10(ping.range)[:, None]
        top = np.percentile(level, 99.8)
        page.draw_fan(axis, ping, level, top - 50, top, title)
    page.save(figure, folder / "tilted-tank.png")
    return INTRODUCTION + text + "\n![Plate and rod in a tilted tank, 50 dB below the brightest, 30 log r](tilted-tank.png)\n"


INTRODUCTION = """## Plate and rod in a tilted tank

After the paper's Figure 3: a plate and a rod before the corner of a tank whose walls stand at an angle to the sonar, under a P900.
The paper gives no sizes; these are ours. Expected are both targets at their ranges, their shadows on the walls, and walls as
straight lines.

Measured in expected power: the peaks of plate and rod in their beams, and in every beam that sees a wall the peak less the wall's
nearest point of that beam. A wall that leans in the beam's height echoes a little behind its nearest point, too.

"""
