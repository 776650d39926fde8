#!/usr/bin/env python3
"""Compares three captured pings of a real M1200d with renderings of a similar scene, in a table and a picture.

Statistics need only the standard library, the picture needs matplotlib. Writes capture.png into --out-dir and prints the chapter.
The captures stay where they are: tests and this script read them from the folder that SONARD_CAPTURES names.
"""
import argparse
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
SCENE = HERE / "scenes" / "like-the-capture.yaml"
CAPTURE = "three_pings_8bit.raw"
ROWS, BEAMS, PINGS = 703, 256, 3
MESSAGE, IMAGE = 182_016, 2048  # bytes of a captured ping, and offset of its image
FULL = 254
ROW_M = 0.0028421889710794315
TOLERANCE = 0.15
SMALLEST_CORRELATION = 0.2  # a smaller correlation counts as this value, and so does a skewness
LOCAL = 4  # half the side of the square of a local mean: 9 x 9 samples
BED, NOISE = (288, 448), (620, 703)  # rows
BANDS = (20, 96), (96, 224), (224, 288), (288, 448), (448, 620), (620, 703)  # near floor, water, edge and bed, its end, noise
NEEDS_NO_REASON = 0.12  # up to this deviation no reason is given; from here to the tolerance one may be given

# The reason why a statistic differs by more than 15 %, and its limit: today's figure plus the effect of another processor or
# seed. The test beside this file fails for a statistic without a reason, beyond its limit, or within 12 % although a reason is
# given here.
UNKNOWN_BED = "the bed's true place, relief and patches are not known"
THIRD = "the third ping differs from the two fitted ones, which ours resembles"
REASONS = {
    "rows 200-249, mean": (UNKNOWN_BED + "; ours is brighter in the side lobes", 1.4),
    "rows 250-299, mean": (UNKNOWN_BED, 0.5),
    "rows 350-399, mean": (UNKNOWN_BED, 0.35),
    "difference of pings, rows 400-599, sd": ("the real far field is steadier: echoes where ours is noise", 0.5),
    "bed, local mean removed, rows apart 2": ("likely a receive filter with steep edges, which rings; ours is Gaussian", 0.35),
    "near floor, local mean removed, beams apart 1": (THIRD, 0.4),
    "near floor, local mean removed, beams apart 2": (THIRD, 0.9),
    "near floor, local mean removed, beams apart 3": (THIRD, 0.65),
    "rows 20-95, over local mean, beams apart 4": (THIRD, 0.5),
    "rows 20-95, over local mean, rows apart 4": ("tones of the receiver in the middle beams, which beat", 0.55),
    "rows 20-95, over local mean, skewness": (THIRD, 1.3),
    "rows 96-223, over local mean, beams apart 4": ("the bright lines before the bed are longer than the real ones", 0.5),
    "rows 96-223, over local mean, skewness": ("as 4 beams apart", 1.1),
    "rows 224-287, over local mean, rows apart 4": (UNKNOWN_BED, 0.3),
    "rows 288-447, over local mean, skewness": (UNKNOWN_BED, 0.4),
    "rows 448-619, over local mean, skewness": ("echoes where ours is noise", 0.3),
    "changing share of the variance, rows 480-559": ("steady reverberation is not modelled", 0.9),
}


def images_of_capture(folder):
    if (folder / "oculus" / CAPTURE).exists():
        folder = folder / "oculus"
    data = (folder / CAPTURE).read_bytes()
    if len(data) != PINGS * MESSAGE:
        raise RuntimeError(f"{folder / CAPTURE} has {len(data)} bytes, not {PINGS * MESSAGE}")
    pings = []
    for i in range(PINGS):
        message = data[i * MESSAGE:(i + 1) * MESSAGE]
        rows, beams = struct.unpack_from("<HH", message, 106)
        if (rows, beams) != (ROWS, BEAMS):
            raise RuntimeError(f"ping {i} is {rows} x {beams}, not {ROWS} x {BEAMS}")
        pings.append(message[IMAGE:IMAGE + ROWS * BEAMS])
    return pings


def images_of_render(program, scene):
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([program, "render", scene, "--pings", str(PINGS), "--out", folder, "--format", "raw"],
                              capture_output=True, text=True, check=False)
        files = sorted(pathlib.Path(folder).rglob("*_samples.raw"))
        if done.returncode != 0 or len(files) != PINGS:
            raise RuntimeError(f"sonard render: {done.stderr.strip()} ({len(files)} pings)")
        return [f.read_bytes() for f in files]


def rows(image, first, last):
    return image[first * BEAMS:last * BEAMS]


def mean(values):
    return sum(values) / len(values)


def deviation(values):
    m = mean(values)
    return math.sqrt(sum((v - m) ** 2 for v in values) / len(values))


def correlation(a, b):
    ma, mb = mean(a), mean(b)
    top = sum((x - ma) * (y - mb) for x, y in zip(a, b))
    return top / math.sqrt(sum((x - ma) ** 2 for x in a) * sum((y - mb) ** 2 for y in b))


def percentile(ordered, percent):
    return ordered[min(len(ordered) - 1, int(percent / 100 * len(ordered)))]


def beams_apart(image, lag, first=400, last=650):
    a, b = [], []
    for row in range(first, last):
        line = rows(image, row, row + 1)
        a.extend(line[:-lag])
        b.extend(line[lag:])
    return correlation(a, b)


def rows_apart(image, lag, first=400, last=650):
    return correlation(rows(image, first, last - lag), rows(image, first + lag, last))


def difference(a, b, first, last):
    return deviation([x - y for x, y in zip(rows(a, first, last), rows(b, first, last))])


def local_sums(values):
    """Returns, for each sample, the sum over the 9 x 9 samples around it that exist, and their number."""
    sums = [[0.0] * (BEAMS + 1)]
    for row in range(ROWS):
        line, along = sums[-1], 0.0
        sums.append([0.0] * (BEAMS + 1))
        for beam, value in enumerate(rows(values, row, row + 1)):
            along += value
            sums[-1][beam + 1] = line[beam + 1] + along
    out, counts = [], []
    for row in range(ROWS):
        low, high = sums[max(0, row - LOCAL)], sums[min(ROWS, row + LOCAL + 1)]
        height = min(ROWS, row + LOCAL + 1) - max(0, row - LOCAL)
        for beam in range(BEAMS):
            left, right = max(0, beam - LOCAL), min(BEAMS, beam + LOCAL + 1)
            out.append(high[right] - high[left] - low[right] + low[left])
            counts.append(height * (right - left))
    return out, counts


def texture_statistics(image):
    """Returns name -> value: statistics of the picture divided by its local mean."""
    sums, counts = local_sums(image)
    ratio = [value / max(total / count, 1e-9) for value, total, count in zip(image, sums, counts)]
    squares, _ = local_sums([v * v for v in image])
    spread = sorted(math.sqrt(max(0.0, q / n - (t / n) ** 2)) / max(t / n, 1e-9)
                    for q, t, n in list(zip(squares, sums, counts))[100 * BEAMS:])
    out = {}
    for name, (first, last) in (("bed", BED), ("far noise", NOISE)):
        for lag in (1, 2, 3):
            out[f"{name}, local mean removed, beams apart {lag}"] = beams_apart(ratio, lag, first, last)
        for lag in (1, 2, 3):
            out[f"{name}, local mean removed, rows apart {lag}"] = rows_apart(ratio, lag, first, last)
    for percent in (10, 50, 90):
        out[f"local sd over mean, percentile {percent}"] = percentile(spread, percent)
    amplitude = [v * v for v in image]  # gamma is a half
    means, _ = local_sums(amplitude)
    glints = [v > 2.5 * t / n for v, t, n in list(zip(amplitude, means, counts))[BED[0] * BEAMS:BED[1] * BEAMS]]
    out["bed, share above 2.5 local means, %"] = 100 * sum(glints) / len(glints)
    bed = [rows(ratio, row, row + 1) for row in range(*BED)]
    along = mean([abs(a - b) for one, two in zip(bed, bed[1:]) for a, b in zip(one, two)])
    out["bed, range over azimuth gradient"] = along / mean([abs(a - b) for line in bed for a, b in zip(line, line[1:])])
    for lag in (1, 2, 3):
        out[f"near floor, local mean removed, beams apart {lag}"] = beams_apart(ratio, lag, 20, 61)
    for first, last in BANDS:
        name = f"rows {first}-{last - 1}, over local mean"
        band = sorted(rows(ratio, first, last))
        sd, middle = deviation(band), mean(band)
        out[f"{name}, beams apart 4"] = beams_apart(ratio, 4, first, last)
        out[f"{name}, rows apart 4"] = rows_apart(ratio, 4, first, last)
        out[f"{name}, sd"] = sd
        out[f"{name}, skewness"] = mean([((v - middle) / sd) ** 3 for v in band])
        for percent in (5, 95):
            out[f"{name}, percentile {percent}"] = percentile(band, percent)
        blocks = [mean(rows(ratio, row, row + 1)[beam:beam + 32]) for row in range(first, last) for beam in range(0, BEAMS, 32)]
        out[f"{name}, sd of means of 32 beams"] = deviation(blocks)
    return out


def sector_mean(image, first, last, beams):
    """Returns the mean amplitude of some beams."""
    return mean([v * v for row in range(first, last) for i, v in enumerate(rows(image, row, row + 1)) if i in beams])


def beam_statistics(pings):
    """Returns name -> value: differences between beams, shares that change from ping to ping, and the leak by rows."""
    one, two = pings[-1], pings[-2]  # the profile is fitted to all pings but the last
    edges, middle = {*range(24), *range(232, 256)}, range(100, 156)
    out = {f"{name}, edges over middle": sector_mean(one, *at, edges) / sector_mean(one, *at, middle)
           for name, at in (("near floor", (20, 61)), ("far noise", NOISE))}
    out["centre stripe, rows 420-559"] = (sector_mean(one, 420, 560, range(120, 136)) /
                                          sector_mean(one, 420, 560, {*range(90, 110), *range(146, 166)}))
    floor = rows(one, 20, 61)
    out["near floor, sd over mean"] = deviation(floor) / mean(floor)
    for name, at in (("rows 480-559", (480, 560)), ("rows 620-702", NOISE)):
        out[f"changing share of the variance, {name}"] = (difference(one, two, *at) / deviation(rows(one, *at))) ** 2 / 2
    for row in range(8):
        out[f"leak, row {row}, median"] = percentile(sorted(rows(one, row, row + 1)), 50)
    return out


def statistics(pings):
    """Returns name -> value, in the order of the table."""
    one, two = pings[-1], pings[-2]  # the profile is fitted to all pings but the last
    ordered = sorted(one)
    out = {f"percentile {p}": percentile(ordered, p) for p in (1, 5, 25, 50, 75, 95, 99)}
    out["mean"] = mean(one)
    out["saturated share, %"] = 100 * sum(v >= FULL for v in one) / len(one)
    for first in range(0, ROWS - 50, 50):
        last = ROWS if first + 100 > ROWS else first + 50
        out[f"rows {first}-{last - 1}, mean"] = mean(rows(one, first, last))
    out["leak, rows 0-1, median"] = percentile(sorted(rows(one, 0, 2)), 50)
    out["leak, rows 2-5, median"] = percentile(sorted(rows(one, 2, 6)), 50)
    out["near-field floor (rows 20-60), mean"] = mean(rows(one, 20, 61))
    out["near-field floor (rows 20-60), sd"] = deviation(rows(one, 20, 61))
    out["far noise (rows 650-702), mean"] = mean(rows(one, 650, ROWS))
    out["far noise (rows 650-702), sd"] = deviation(rows(one, 650, ROWS))
    for lag in (1, 2, 3):
        out[f"beams apart {lag}, correlation"] = beams_apart(one, lag)
    for lag in (1, 2, 3):
        out[f"rows apart {lag}, correlation"] = rows_apart(one, lag)
    out["ping to ping, correlation"] = correlation(one, two)
    out["difference of pings, rows 20-119, sd"] = difference(one, two, 20, 120)
    out["difference of pings, rows 400-599, sd"] = difference(one, two, 400, 600)
    return out | texture_statistics(one) | beam_statistics(pings)


def off_by(real, ours):
    """Returns name -> relative deviation of ours; for a correlation or skewness relative to at least SMALLEST_CORRELATION."""
    out = {}
    for name, value in real.items():
        scale = max(abs(value), SMALLEST_CORRELATION) if "apart" in name or "skewness" in name else abs(value)
        out[name] = (ours[name] - value) / scale if scale else float(ours[name] != 0)
    return out


def table(real, ours):
    lines = ["| statistic | captured | sonard | off | |", "|---|---|---|---|---|"]
    within = 0
    for name, off in off_by(real, ours).items():
        good = abs(off) <= TOLERANCE
        within += good
        reason, most = REASONS.get(name, ("not explained", math.inf))
        if abs(off) > most:
            reason = f"{reason}; more than that explains ({100 * most:.0f} %)"
        lines.append(f"| {name} | {real[name]:.3g} | {ours[name]:.3g} | {100 * off:+.0f} % | {'' if good else reason} |")
    return "\n".join(lines) + "\n", within


def faults(real, ours):
    """Returns what contradicts the list of reasons: too far off, or not explained, or explained but not off."""
    found = []
    deviations = off_by(real, ours)
    for name, off in deviations.items():
        reason, most = REASONS.get(name, (None, TOLERANCE))
        if abs(off) > most:
            found.append(f"{name} is {100 * off:+.1f} % off, more than {100 * most:.0f} %")
        elif reason and abs(off) <= NEEDS_NO_REASON:
            found.append(f"{name} is only {100 * off:+.1f} % off: it needs no reason any more")
    return found + [f"there is no statistic {name}" for name in REASONS if name not in deviations]


def draw(real, ours, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 4.2), facecolor="black")
    half = math.sin(math.radians(30))
    sines = [half * (2 * j / BEAMS - 1) for j in range(BEAMS + 1)]
    azimuths = [math.asin(s) for s in sines]
    step = 2  # rows: the picture has fewer pixels than the ping
    ranges = [row * ROW_M for row in range(0, ROWS + 1, step)]
    x = [[r * math.sin(a) for a in azimuths] for r in ranges]
    y = [[r * math.cos(a) for a in azimuths] for r in ranges]
    for axis, image, title in ((axes[0], real, "captured: M1200d, University of Washington"), (axes[1], ours, "sonard")):
        values = [list(rows(image, row, row + 1)) for row in range(0, (len(ranges) - 1) * step, step)]
        axis.pcolormesh(x, y, values, cmap="gray", vmin=0, vmax=FULL, shading="flat", rasterized=True)
        axis.set_aspect("equal")
        axis.set_title(title, fontsize=9, color="white")
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(path, dpi=90, facecolor="black", metadata={"Software": None})
    plt.close(figure)
    try:
        from PIL import Image

        Image.open(path).convert("L").quantize(32).save(path, optimize=True)
    except ImportError:
        pass  # larger, but with the same picture


INTRODUCTION = """## Beside a real device

This table compares statistics of a recorded ping with those of ours. The recording has three pings of a real Oculus M1200d (high
mode, 2 m, 256 beams), from the University of Washington's Applied Physics Laboratory
([liboculus](https://github.com/apl-ocean-engineering/liboculus), BSD 3-clause, notice in `docs/validation/LICENSE.liboculus`).
Our scene is `tests/validation/scenes/like-the-capture.yaml`: patchy soft mud 0.54 m below a sonar that looks down by 40 degrees,
with vertical side lobes. The real bed is unknown. Its place, relief and patches, and the small things that drift in the water,
are chosen for a similar picture. TVG curve, leak, noise (level, bandwidth, by beam, shared by the channels), truncation, blend
and defocus of our profile are fitted to the first two pings, with the scene. The table compares the third ping, which is not
wholly independent: of several fits and models we kept the one that this table and the classifier below judged best, and the
classifier sees all three pings. The pulse is fitted (0.66 rows; other scenes have the default 0.71), the array is not. The
recording does not separate the bed's strength from the noise figure (only their distance is visible), nor gain from full scale.
The gain here is {gain} dB; the requested 50 % would be 48. Our full scale is set by the demo's brightness, and the recording has
gain assist (flag bit 4). Local means are over 9 x 9 samples. The bed is rows 288 to 447, far noise rows 620 to 702, and edges are
24 beams on either side. Deviations of correlations and skewness are relative to 0.2 or more: smaller values are as good as none.

"""
# Equations: docs/acoustics.md.
EVIDENCE = """

With other seeds the classifier labels 55 to 60 % of the patches correctly, with brightness 67 %, on unseen pings instead of
sectors 77 %. Percentage points that the removal of one part adds (mean of three seeds): `uneven` 11, relief below 15 cm 11, the
shorter pulse 9, `truncation` 6, `shared_noise` 4, GSAB in place of Lambert 4, `side_lobes` 3, the leak by channels 2, steady noise
2, `defocus` 1, `group` 128 in place of 32 none.

Evidence for the less usual parts:
- *Leak by channels.* In rows 0 and 1 the leak is a comb of notches along the beams. (47) with 128 channels, steady and focused at
  8.5 mm, correlates with it by 0.96, as does (47) with a sine of 0.56 and 126 to 132 channels. In rows 8 to 16 the noise has
  fringes. (47), focused one row beyond the row's near edge, correlates with them by 0.5 to 0.75.
- *Shared noise.* Before the bed there is a dome of quiet noise between louder sides. Samples 5 to 10 beams apart share 4 to 12 %
  of their power in rows 16 to 47, and at most 3 % from there to row 175. With our groups they share 5 to 20 % and at most 10 %,
  with one draw for all channels 100 %. Of groups of 2 to 128 channels without a window, 16 (as wide as windowed ones of 32) fit
  the level by beam and row best: 1.9 dB rms, against 2.5 for one group and 2.6 for levels by beam alone.
- *Truncation.* In rows 20 to 60 the numbers of samples with codes from 0 to n are as 1 : 5.1 : 15.7 : 36.6 for n = 1 to 4.
  Truncated codes would give 1 : 5.1 : 16 : 39, rounded ones 1 : 7.7 : 30 : 81. There is no code 255.
- *Side lobes.* The thin bright lines before the bed are its first echoes from straight below, as `side_lobes` places them.
- *GSAB and relief.* Samples of the bed 3 and 4 beams apart correlate (0.045) if its relief goes down to centimetres and its law
  has a peak at normal incidence.

The classifier labels 72 % of the near floor correctly (three seeds: 74 %), 56 % of the rows beyond it. In the near floor features
of beams alone give 66 %, those of rows 59 %, those of the distribution 55 %. Trained on the near floor only (three seeds), they
give 79, 63 and 64 %, all features 82 %; over another bed 83, 66, 72 and 84 %. These differ there:
- Neighbouring beams between edge and middle: in rows 64 to 127 recorded ones correlate by 0.25 to 0.38, ours by 0.41 to 0.5, and
  without `blend` like the recorded ones. In rows 620 to 702 both correlate by 0.5. In rows 64 to 159, but not in the
  middle, a tenth of the variance of the recorded power is white across the beams, as noise of the channels cannot be.
- The middle: all recorded channels share noise with equal signs, to N d / 2 r on either side (0.2 at 0.2 m, 0.02 at 1.9 m). It is
  up to 6 dB above the noise beside it. It has tones, with other phases in every ping, at 0.051, 0.166 and 0.380 cycles per row
  (13, 44 and 100 kHz). Its amplitudes are like those of a constant with noise (rows 64 to 159: skewness -0.2 to -0.3, ours -0.1
  to 0). Samples 4 to 24 beams apart correlate by 0.1, ours by 0. Means of rows spread by 0.10 of the mean, ours by 0.07.
- The outermost 16 beams: beams 2 apart correlate by 0.35, 0.18 and 0.07 in the 32 rows from 64, 96 and 128 on, ours by 0.83, 0.65
  and 0.48. A quarter of the recorded variance is the same in all pings, of ours a twentieth. In rows 72 to 103 the changing part
  appears one row earlier in a beam that is 7 beams nearer to the middle. The array delays a signal that all channels share by `s
  r / (1 - s^2)` per unit of sine; (47) has only the phases of this delay.
- Dark samples: code 0 occurs 22 times among the 33,600 samples of rows 30 to 129, beams 72 to 183, in ours 4 times. Subtracting
  1.3 / 65,025 of full scale from each amplitude would give the recorded number.

We tried these in copies of the program and did not keep them, because what helps here does harm over another bed. The figures are
for the near floor and the whole picture (means of three seeds); without a change, 74 and 58 %, over another bed 73 and 60 %:

- Four tones in all channels (0 and the lines above from the carrier, together -7 dB re a channel's own noise, falling as e^{-r /
  0.8 m}; they also make the stripe at 1.9 m), shared noise that ends at 0.28 m, and in its place noise of each channel in the
  outermost beams: 68 and 58 %. With a `blend` that falls to 0 below 0.3 m too: 64 and 59 %, over another bed 75 and 63 %.
- Only louder noise of each channel in the outermost beams: 67 and 58 %, over another bed 76 and 61 %.
- Off the middle no `blend` near the sonar, white noise (-13 dB), four tones (-5 dB): 66 and 58 %, over another bed 74 and 60 %.
- Groups of 8 and 16 channels, the array's delays at one to four times the bandwidth, that subtraction: 73 to 80 %.

Recorded small echoes of the water have a skirt on one side of the beams, and fall with the range, so that no strength of `volume`
fits. Our bed begins with one long bright line and a dark gap beyond it, and has round dark patches. The recorded lines are short
and broken, and one lies beyond the bed; the recorded bed brightens gradually, with layers along the sector. The recorded stripe
in the middle runs through echoes, ours through noise only. The demo differs from a recording by the sharp arc where the bed
begins, by evenly bright objects with straight edges, and by strong echoes without a streak along the range.

Not modelled, because single patches do not show them: the jitter of the gain (0.07 to 0.2 dB between the pings), the drift of the
sonar (the bed's correlation is 0.99 after one ping, 0.96 after two), and steady reverberation of the water. In rows 480 to 559,
30 % of the recorded variance changes from ping to ping, 37 % of ours.
"""


def chapter(program, captures, folder):
    real, ours = images_of_capture(captures), images_of_render(program, SCENE)
    figures = statistics(real), statistics(ours)
    text, within = table(*figures)
    draw(real[0], ours[0], folder / "capture.png")
    gain = next(line.split()[1] for line in SCENE.read_text(encoding="utf-8").splitlines() if line.strip().startswith("gain_db:"))
    return (INTRODUCTION.format(gain=gain) + text + f"\n{within} of {len(figures[0])} within {100 * TOLERANCE:.0f} %.\n"
            "\n![A captured ping and ours](capture.png)\n" + EVIDENCE)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sonard", "--program", required=True, type=pathlib.Path, dest="program")
    parser.add_argument("--captures", type=pathlib.Path, default=os.environ.get("SONARD_CAPTURES"))
    parser.add_argument("--out-dir", "--pictures", type=pathlib.Path, required=True, dest="folder")
    options = parser.parse_args()
    if options.captures is None:
        raise RuntimeError("no recordings: give --captures, or set SONARD_CAPTURES")
    options.folder.mkdir(parents=True, exist_ok=True)
    text = chapter(options.program.resolve(), pathlib.Path(options.captures), options.folder)
    print(text, end="")


if __name__ == "__main__":
    try:
        main()
    except (OSError, RuntimeError) as error:
        sys.exit(f"capture_comparison.py: {error}")
