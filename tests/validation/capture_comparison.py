#!/usr/bin/env python3
"""Comparison with a real device: three captured pings of an M1200d beside the same scene rendered, in one table and one picture.

Statistics are made with the standard library alone, matplotlib draws. Writes capture.png into --out-dir and prints the chapter.
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
MESSAGE, IMAGE = 182_016, 2048  # bytes of a captured ping, offset of its image
FULL = 254
ROW_M = 0.0028421889710794315
TOLERANCE = 0.15
NEEDS_NO_REASON = 0.12  # a figure at the edge of the tolerance keeps its reason

# Why a statistic lies farther off than 15 %, and how far it may: today's figure and what another processor or seed could add. A
# statistic without its reason, beyond its bound, or within 12 % in spite of a reason here, fails the test beside this.
REASONS = {
    "percentile 1": ("one code of 254", 0.26),
    "rows 200-249, mean": ("the near edge of the bed: its true relief is not known", 0.40),
    "near-field floor (rows 20-60), sd": ("the real floor is 11 at the edges of the fan and 7 in the middle; ours is even", 0.35),
    "difference of pings, rows 20-119, sd": ("as the floor: louder at the edges of the fan", 0.20),
    "difference of pings, rows 400-599, sd": ("the real far field is steadier: echoes where ours is noise", 0.40),
}


def images_of_capture(folder):
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


def statistics(pings):
    """Name -> value, in the order of the table."""
    one, two = pings[0], pings[1]
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
    return out


def off_by(real, ours):
    """Name -> relative deviation of ours."""
    return {name: ours[name] / value - 1 if value else float(ours[name] != 0) for name, value in real.items()}


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
    """What is not as the reasons say: too far off, or not explained, or explained and not off."""
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
        pass  # larger, but the same picture


INTRODUCTION = """## Beside a real device

Three pings of a real Oculus M1200d (high mode, 2 m, 256 beams), recorded by the University of Washington's Applied Physics
Laboratory ([liboculus](https://github.com/apl-ocean-engineering/liboculus), BSD 3-clause, notice in
`docs/validation/LICENSE.liboculus`), and the same statistics of `tests/validation/scenes/like-the-capture.yaml`: patchy, very
soft mud (-40 dB) 0.6 m below a sonar that looks down by 42 degrees. The real bed is unknown: its place, slope and patches are
chosen for a similar picture. TVG curve, noise figure and leak of our profile are fitted to this recording; beam patterns, pulse
and speckle are not. The bed's strength and the noise figure cannot be separated (only their distance is visible), nor can gain
and full scale. The gain here is {gain} dB; the requested 50 % would be 48: our full scale is set by the demo's brightness, and
the recording has flag bit 4 set, possibly gain assist.

"""


def chapter(program, captures, folder):
    real, ours = images_of_capture(captures), images_of_render(program, SCENE)
    figures = statistics(real), statistics(ours)
    text, within = table(*figures)
    draw(real[0], ours[0], folder / "capture.png")
    gain = next(line.split()[1] for line in SCENE.read_text(encoding="utf-8").splitlines() if line.strip().startswith("gain_db:"))
    return (INTRODUCTION.format(gain=gain) + text + f"\n{within} of {len(figures[0])} within {100 * TOLERANCE:.0f} %.\n"
            "\n![A captured ping and ours](capture.png)\n")


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
