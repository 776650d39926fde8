"""Repeats the paper's Figure 3: a sonar pitched down before a plate and a rod, and the floor that a model's rows leave dark."""

import numpy as np

import page
from runs import db
from texts import table
from two_cylinders import KINDS

# The same values as in scenes/pitched-sonar.yaml.
PLATES_M, HEIGHT_M, PITCH_DEG = (5.0, 2.5), 1.2, 20.0
FIRST_M = 1.95                # at shorter ranges the fan of the comparison modes ends
BEFORE_M = 0.1                # distance from the plate's foot
BEAMS_DEG = (-20.0, 5.0)      # beams that miss the rod and its shadow
TOO_DARK_DB = -6.0
HALF_FAN_DEG = 20.0           # half fan of both comparison modes: the quoted elevation width
PULSE_M = 0.0299


def floor_of(ping, plate_m):
    """Returns the rows and beams that contain floor in front of the plate."""
    degrees = np.degrees(ping.azimuth)
    foot_m = np.hypot(plate_m, HEIGHT_M)
    return ((ping.range > FIRST_M) & (ping.range < foot_m - BEFORE_M), (degrees > BEAMS_DEG[0]) & (degrees < BEAMS_DEG[1]))


def too_dark(level_db, reference_db):
    return 100.0 * float(np.mean(level_db - reference_db < TOO_DARK_DB))


def dark_floor(ping, reference, plate_m):
    """Returns the share of the floor's bins that lie more than 6 dB below the default's level, each relative to its own mean."""
    rows, beams = floor_of(ping, plate_m)
    nearest = [reference.beam_at(a) for a in ping.azimuth[beams]]
    ours, theirs = ping.power[rows][:, beams], reference.power[rows][:, nearest]
    return too_dark(db(ours / np.mean(ours)), db(theirs / np.mean(theirs)))


def predicted(rows, is_raster, range_m):
    """Predicts the share of dark floor straight ahead. Each row meets the flat floor at height / sin(depression) and makes one
    pulse there, with the power of its patch. The reference has enough rows for a whole floor."""
    def level_db(count):
        half = np.radians(HALF_FAN_DEG)
        top = np.tan(half) if is_raster else half
        place = (np.arange(count) + 0.5) / count * 2 * top - top
        up = np.arctan(place) if is_raster else place
        down = np.radians(PITCH_DEG) - up
        up, down = up[down > 0.01], down[down > 0.01]
        at_m = HEIGHT_M / np.sin(down)
        solid_angle = np.cos(up) ** (2 if is_raster else 1)
        strength = solid_angle * np.sin(down) ** 2 / at_m**2 * np.sinc(0.884 * np.sin(up) / np.radians(HALF_FAN_DEG)) ** 4
        steepness = np.log(2) / 2 / (PULSE_M / 2) ** 2  # steepness of the amplitude: -3 dB at half the width
        power = np.exp(-2 * steepness * (range_m[:, None] - at_m) ** 2) @ strength
        return db(power / np.mean(power))
    return too_dark(level_db(rows), level_db(40 * 228))


def rows_of(name):
    return int(name.split()[1])


def chapter(sonard, folder):
    expected = [sonard.expected("pitched-sonar", *arguments) for _, arguments in KINDS]
    lines = []
    for (name, arguments), pings in zip(KINDS, expected):
        cells = [name]
        for i, plate_m in enumerate(PLATES_M):
            cells.append(f"{dark_floor(pings[i], expected[-1][i], plate_m):.1f} %")
            range_m = pings[i].range[floor_of(pings[i], plate_m)[0]]
            cells.append(f"{predicted(rows_of(name), 'raster' in arguments, range_m):.1f} %" if "--mode" in arguments else "0 %")
        lines.append(cells)
    head = [f"plate at {m:g} m{what}" for m in PLATES_M for what in ("", ", rows alone")]
    text = table(["floor bins more than 6 dB too dark", *head], lines)
    figure, axes = page.plt.subplots(2, 4, figsize=(14, 7))
    for i, (title, arguments) in enumerate([KINDS[0], KINDS[1], KINDS[3], ("default", [])]):
        for axis, ping in zip(axes[:, i], sonard.pings_of("pitched-sonar", *arguments)):
            level = db(ping.power) + 30 * np.log10(ping.range)[:, None]
            top = np.percentile(level, 99.8)
            page.draw_fan(axis, ping, level, top - 50, top, title)
    page.save(figure, folder / "pitched-sonar.png")
    return INTRODUCTION + text + "\n![Plate far and near under a pitched sonar, 50 dB below the brightest, 30 log r](pitched-sonar.png)\n"


INTRODUCTION = """## A sonar pitched down

In the paper's Figure 3 a sonar looks down into a tank with a plate and a rod. With raster sampling the floor has gaps, because
the pixels have too few rows. If the plate is near, less of the floor is far away, where rows are far apart. The paper gives no
sizes; these are ours.

We measure the share of the floor's bins before the plate that are more than 6 dB too dark in expected power, compared with the
default without mirrors, both relative to their own means. "Rows alone" predicts it: each row of the model is one pulse where it
meets the floor straight ahead.

"""
