"""Local search of Choi 2025: the fraction of the bottom's bins that are right, and the picture."""

import numpy as np

import page
from runs import db
from texts import table

DENSE_ROWS = 20000  # rays per column; more rays do not change the result
FAN_DEG, TILT_DEG, HEIGHT_M = 20.0, 14.3239, 2.0


def elevation_of_bed(ping):
    """Returns the elevation of the level bed in each bin of flat beams [rad]; NaN in bins without bed."""
    tilt = np.radians(TILT_DEG)
    r, azimuth = np.meshgrid(ping.range, ping.azimuth, indexing="ij")
    # In the sonar's axes the bed is at x sin(tilt) - z cos(tilt) = h. Therefore a cos(phi) - b sin(phi) = h / r.
    a, b = np.cos(azimuth) * np.sin(tilt), np.cos(tilt)
    along = np.hypot(a, b)
    with np.errstate(invalid="ignore"):
        return np.arccos(HEIGHT_M / (r * along)) - np.arctan2(b, a)


def share_of_limit(sonard, *arguments):
    """Compares a mode with itself at many rays. Returns the number of bins, the share within 1 dB, and the worst difference."""
    some, = sonard.expected("flat-sand", *arguments)
    mode = arguments[arguments.index("--mode") + 1]
    limit, = sonard.expected("flat-sand", "--mode", mode, "--fixed-fan", DENSE_ROWS)
    elevation = elevation_of_bed(limit)
    bins = np.abs(elevation) < np.radians(FAN_DEG - 0.5)
    bins[-3:, :] = False  # the end of the record, where pulses from beyond it appear
    bins[:3, :] = False
    off = db(some.power[bins]) - db(limit.power[bins])
    return {"bins": int(bins.sum()), "within_1_db": 100.0 * float(np.mean(np.abs(off) < 1)), "worst_db": float(off[np.argmax(np.abs(off))])}


def chapter(sonard, folder):
    runs = [
        ("11 raster rows", "its own limit of many rows", share_of_limit(sonard, "--mode", "raster", "--fixed-fan", 11)),
        ("300 fixed rays, paper mode", "its own limit of many rays", share_of_limit(sonard, "--mode", "paper", "--fixed-fan", 300)),
        ("300 fixed rays, our pulse, beams and law", "closed form", sonard.coverage("flat-sand", "--fixed-fan", 300)),
        ("default", "closed form", sonard.coverage("flat-sand")),
    ]
    rows = [[name, against, f"{c['bins']:,}", f"{c['within_1_db']:.2f} %", f"{c['worst_db']:+.1f} dB"] for name, against, c in runs]
    text = table(["scatterers", "compared with", "bins of the bottom", "within 1 dB", "largest deviation"], rows)

    figure, axes = page.plt.subplots(1, 3, figsize=(12, 3.6))
    pictures = [("11 raster rows", ["--mode", "raster"]), ("300 rays, paper mode", ["--mode", "paper"]), ("default", [])]
    for axis, (title, arguments) in zip(axes, pictures):
        ping = next(sonard.pings_of("rough-sand", *arguments))
        level = db(ping.power) + 30 * np.log10(ping.range)[:, None]
        top = np.percentile(level, 99.8)
        page.draw_fan(axis, ping, level, top - 40, top, title)
    page.save(figure, folder / "local-search.png")
    return INTRODUCTION + text + "\n![Local search, 40 dB below the brightest, 30 log r](local-search.png)\n"


INTRODUCTION = """## Local search

In the paper, the older raster method (11 effective rows) drew arcs over a bottom with objects at 5 to 7 m, and 300 rays filled
them. The paper has pictures, but no values.

We measure the share of bottom bins with the correct level in expected power, for the same sonar (P900, 10 m, 512 beams, rows of
one inch, b = 29.5 kHz) 2 m above level sand, 0.25 rad nose down. Our scatterers are compared with the closed form (oracle 8,
where the two-way pattern is above -20 dB). The comparison modes have another law and other beams, so they are compared with
themselves at 20 000 rays per column.

"""
