"""Differences between the comparison modes and the canonical model, in figures: law of scattering, side lobes, rays, beams."""

import numpy as np

from runs import db
from texts import table

GRAZING_DEG = [(60, 0), (45, 0), (30, 0), (20, 1), (10, 1), (5, 2)]  # grazing angle, and the fan of scenes/grazing.yaml that contains it
HEIGHT_M = 2.0
KINDS = [("canonical", []), ("paper", ["--mode", "paper"]), ("raster", ["--mode", "raster"])]


def grazing(sonard):
    """Returns the table of a flat bed's level, paper mode minus canonical, by grazing angle; both without elevation pattern."""
    canonical = sonard.expected("grazing", "--specular", "off")
    paper = sonard.expected("grazing", "--mode", "paper", "--fixed-fan", 20000)
    rows, first = [], None
    for degrees, fan in GRAZING_DEG:
        ours, theirs = canonical[fan], paper[fan]
        row = int(np.argmin(np.abs(ours.range - HEIGHT_M / np.sin(np.radians(degrees)))))
        around = slice(row - 1, row + 2)
        off = float(np.mean(db(theirs.power[around, theirs.beam_at()]) - db(ours.power[around, ours.beam_at()])))
        sine = HEIGHT_M / ours.range[row]  # sine of the row that was used
        first = first or (off, sine)
        rows.append([f"{degrees} deg", f"{off - first[0]:+.2f} dB", f"{10 * np.log10(sine / first[1]):+.2f} dB"])
    return table(["grazing angle", "paper minus canonical, re 60 deg", "10 log cos of incidence, re 60 deg"], rows)


def width_deg(azimuth, power):
    """Returns the -3 dB width about the loudest beam, interpolated linearly between beams."""
    at = int(np.argmax(power))
    half = power[at] / 2

    def crossing(step):
        k = at
        while 0 < k < len(power) - 1 and power[k] > half:
            k += step
        a, b = power[k - step], power[k]
        return azimuth[k - step] + (a - half) / (a - b) * (azimuth[k] - azimuth[k - step]) if a > b else azimuth[k]

    return float(np.degrees(abs(crossing(-1) - crossing(1))))


def response_to_a_point(ping):
    power = ping.power
    row, beam = np.unravel_index(np.argmax(power), power.shape)
    across, along = power[row], power[:, beam]
    away = np.abs(np.degrees(ping.azimuth - ping.azimuth[beam]))
    peak = across[beam]
    far_rows = np.abs(np.arange(len(along)) - row)
    return {
        "level": float(db(peak)),
        "width": width_deg(ping.azimuth, across),
        "beside": float(db(np.max(across[away > 3]) / peak)),
        "sum": float(db(np.sum(across) / peak)),
        "range": float(db(max(np.max(along[(far_rows > 5) & (far_rows < 60)]), peak * 1e-20) / peak)),
    }


def points(sonard):
    by_kind = {name: [response_to_a_point(p) for p in sonard.pings_of("point", "--noise", "off", *arguments)] for name, arguments in KINDS}
    names = [name for name, _ in KINDS]

    def row(title, of):
        return [title, *(of(by_kind[name]) for name in names)]

    def or_none(value):
        return "none" if value < -150 else f"{value:.1f} dB"

    rows = [
        row("-3 dB width of a point, 512 beams 0.18 deg apart", lambda r: f"{r[1]['width']:.2f} deg"),
        row("highest level more than 3 deg beside it", lambda r: or_none(r[1]["beside"])),
        row("highest level 6 to 60 rows before or behind it", lambda r: or_none(r[1]["range"])),
        row("level with 256, 512, 1024 beams in the sector, re 512",
            lambda r: ", ".join(f"{x['level'] - r[1]['level']:+.1f}" for x in r) + " dB"),
    ]
    return table(["", *names], rows)


def mean_db(ping, window_m):
    rows = (ping.range > window_m[0]) & (ping.range < window_m[1])
    beams = np.abs(np.degrees(ping.azimuth)) < 30
    return float(db(np.mean(ping.power[rows][:, beams])))


def rays(sonard):
    counts, window = [11, 30, 100, 300, 1000], (3.8, 9.8)
    rows = []
    for name, arguments in [("paper mode", ["--mode", "paper"]), ("raster mode", ["--mode", "raster"]), ("ours, one scatterer per ray", [])]:
        means = [mean_db(sonard.expected("flat-sand", *arguments, "--fixed-fan", n)[0], window) for n in [*counts, 6000]]
        rows.append([name, *(f"{m - means[-1]:+.2f} dB" for m in means[:-1])])
    text = table(["mean energy, re 6000 rays", *(f"{n} rays" for n in counts)], rows)
    cells = mean_db(sonard.expected("flat-sand")[0], window) - means[-1]
    return text + f"\nThe default's surface cells give {cells:+.2f} dB, re ours with 6000 rays.\n"


def walls(sonard):
    rows = []
    for name, arguments in KINDS:
        means = [mean_db(p, (3.5, 5.5)) for p in sonard.expected("wall", *arguments)]
        rows.append([name, *(f"{m - means[1]:+.2f} dB" for m in means)])
    return table(["mean energy of a wall, re 512 beams", "256 beams", "512 beams", "1024 beams"], rows)


def chapter(sonard, folder):
    return "\n".join([INTRODUCTION.replace("PAGE", PAGE) + LAW, grazing(sonard), BEAMS, points(sonard), "", walls(sonard), RAYS, rays(sonard)])


PAGE = "../acoustics" + ".md"
INTRODUCTION = """## Differences of the comparison modes

`mode: paper` is Choi 2025 as printed, with the beamforming of its code; `mode: raster` places its rays on an image plane.
Section 8 of [the model's page](PAGE) lists omissions and differences. Measured effects:

"""
LAW = """The printed footprint multiplies Lambert's law by another cosine of the incidence: on a bed, low grazing angles are too dark.
"""
BEAMS = """
The published beam pattern is |sinc| as wide as the beams' *spacing*, divided by the root of the sum of its squares over all
beams. Neighbours barely overlap and side lobes add up. With twice the beams, points lose 3 dB and surfaces 6. The
spectrum, cut to bandwidth b, has side lobes in range that fall slowly: a strong near bed covers the far one.
"""
RAYS = """
Mean energy of the local search's flat sand, by rays per column. The mean is correct with few rays; it does not show the holes
between them, which the previous chapter counts.
"""
