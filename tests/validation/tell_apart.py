#!/usr/bin/env python3
"""Distinguishes captured pings of an M1200d from renderings of like-the-capture.yaml by the texture of small patches.
The closer the accuracy is to one half, the more alike are the pictures.

usage: tell_apart.py --program SONARD [--captures FOLDER]
A random forest classifies patches of 32 rows x 32 beams, half of them captured. The tested patches are from a ping (training uses
the other two) or a sector of the fan (training uses the other seven). Texture features do not depend on the brightness;
"all features" do. The control is the same test between two seeds of sonard. "Another bed" is the scene with another seed of
relief, without drifting objects, and with the product's own pulse and noise. Needs python3-sklearn.
"""
import argparse
import os
import pathlib
import sys
import tempfile

import capture_comparison as comparison

PATCH = 32
TREES = 200
RESAMPLES = 1000
SEEDS = 101, 202  # seeds of the speckle; the second is for the control
BANDS = (0, 32), (32, 160), (160, 288), (288, 448), (448, 672)  # rows: leak, near floor, before the bed, bed, beyond it
NEAR_FLOOR = BANDS[1]
FITTED = "type: point", "pulse_width_m:", "noise_width:"  # drifting objects, settings that replace the product's


def missing():
    """Returns why there is nothing to compare, or None."""
    if not os.environ.get("SONARD_CAPTURES"):
        return "no recordings: SONARD_CAPTURES is not set"
    try:
        import numpy  # noqa: F401
        import sklearn  # noqa: F401
    except ImportError as error:
        return f"no python3-sklearn: {error}"
    return None


def box_mean(image, half):
    """Returns the mean over (2 half + 1)^2 samples, with repeated edges."""
    import numpy as np

    wide = np.pad(image, half, mode="edge")
    sums = np.pad(wide.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    n = 2 * half + 1
    return (sums[n:, n:] - sums[:-n, n:] - sums[n:, :-n] + sums[:-n, :-n]) / (n * n)


def correlation(a, b):
    import numpy as np

    a, b = a - a.mean(), b - b.mean()
    power = np.sqrt((a * a).mean() * (b * b).mean())
    return float((a * b).mean() / power) if power > 0 else 0.0


def shifted(patch, down, right):
    """Returns the parts of the patch that overlap if it is shifted by this many rows and beams."""
    rows, beams = patch.shape
    left = max(0, -right)
    return patch[:rows - down, left:beams - max(0, right)], patch[down:, left + right:beams + min(0, right)]


def texture_features(ratio):
    """Returns name -> value for a patch of samples divided by their local mean."""
    import numpy as np

    deviation = ratio.std()
    shape = (ratio - ratio.mean()) / deviation if deviation > 0 else ratio * 0
    out = {"spread": deviation, "skewness": (shape ** 3).mean(), "kurtosis": (shape ** 4).mean()}
    for percent in (5, 50, 95, 99):
        out[f"percentile {percent}"] = np.percentile(ratio, percent)
    out["share above 1.5 local means"] = (ratio > 1.5).mean()
    for lag in (1, 2, 3, 4):
        out[f"samples {lag} beams apart" if lag > 1 else "samples of neighbouring beams"] = correlation(*shifted(ratio, 0, lag))
    for lag in (1, 2, 3, 4):
        out[f"samples {lag} rows apart" if lag > 1 else "samples of neighbouring rows"] = correlation(*shifted(ratio, lag, 0))
    for right in (-1, 1):
        out[f"samples 1 row and {right:+d} beam apart"] = correlation(*shifted(ratio, 1, right))
    along, across = np.abs(np.diff(ratio, axis=0)).mean(), np.abs(np.diff(ratio, axis=1)).mean()
    out["range over azimuth gradient"] = along / across if across > 0 else 0.0
    blocks = ratio.reshape(8, 4, 8, 4).mean((1, 3))
    out["spread of 4 x 4 means"] = blocks.std()
    out["spread of rows"], out["spread of beams"] = ratio.mean(1).std(), ratio.mean(0).std()
    return out


def level_features(patch):
    """Returns name -> value for a patch of codes."""
    import numpy as np

    mean = patch.mean() + 1
    trend = np.linspace(-1, 1, PATCH)
    return {"mean": mean, "trend over range": (patch.mean(1) * trend).mean() / mean,
            "trend over azimuth": (patch.mean(0) * trend).mean() / mean, "contrast": patch.std() / mean}


def patches(pings):
    """Returns the features of all patches [patches][features], the places of these (ping, row, sector), and the features' names,
    texture first."""
    import numpy as np

    table, places, names = [], [], []
    for number, ping in enumerate(pings):
        image = np.frombuffer(ping, np.uint8).reshape(comparison.ROWS, comparison.BEAMS).astype(float)
        ratio = (image + 0.5) / (box_mean(image, 4) + 0.5)
        for row in range(0, comparison.ROWS - PATCH + 1, PATCH):
            for beam in range(0, comparison.BEAMS, PATCH):
                cut = slice(row, row + PATCH), slice(beam, beam + PATCH)
                features = texture_features(ratio[cut]) | level_features(image[cut])
                names = list(features)
                table.append(list(features.values()))
                places.append((number, row // PATCH, beam // PATCH))
    return np.array(table), np.array(places), names


LEVELS = 4  # number of features from level_features, which are the last ones


def forest(seed=1):
    from sklearn.ensemble import RandomForestClassifier

    return RandomForestClassifier(TREES, min_samples_leaf=2, random_state=seed, n_jobs=1)


def told_apart(ours, theirs, unseen):
    """Returns whether each patch is classified correctly. Training leaves out a ping (`unseen` 0) or a sector (`unseen` 2)."""
    import numpy as np

    features = np.vstack([ours[0], theirs[0]])
    groups = np.concatenate([ours[1][:, unseen], theirs[1][:, unseen]])
    truth = np.concatenate([np.zeros(len(ours[0])), np.ones(len(theirs[0]))])
    right = np.zeros(len(truth), bool)
    for group in np.unique(groups):
        test = groups == group
        right[test] = forest().fit(features[~test], truth[~test]).predict(features[test]) == truth[test]
    return right


def interval(right, places):
    """Returns the mean and its 95 % interval, by bootstrap over the patches' places, because the pings of one place are alike."""
    import numpy as np

    keys = np.unique(places[:, 1:], axis=0, return_inverse=True)[1].ravel()
    sums, counts = np.bincount(keys, right), np.bincount(keys)
    draws = np.random.default_rng(1).integers(0, len(counts), (RESAMPLES, len(counts)))
    means = sums[draws].sum(1) / counts[draws].sum(1)
    return right.mean(), *np.percentile(means, (2.5, 97.5))


def by_rows(right, places):
    """Returns the first and last row of each band of patches, and the share of right answers there."""
    first_row = PATCH * places[:, 1]
    return [(first, last - 1, right[(first_row >= first) & (first_row < last)].mean()) for first, last in BANDS]


def only(patch_set, first, last):
    return patch_set[0][:, first:last], patch_set[1]


def of_rows(patch_set, first, last):
    inside = (PATCH * patch_set[1][:, 1] >= first) & (PATCH * patch_set[1][:, 1] < last)
    return patch_set[0][inside], patch_set[1][inside]


def best_features(ours, theirs, names, count=5):
    """Returns the features that separate best alone: (accuracy of the best threshold over all patches, name, two medians)."""
    import numpy as np

    truth = np.concatenate([np.zeros(len(ours[0])), np.ones(len(theirs[0]))])
    found = []
    for k, name in enumerate(names):
        order = np.argsort(np.concatenate([ours[0][:, k], theirs[0][:, k]]), kind="stable")
        balance = np.cumsum(2 * truth[order] - 1)
        found.append((0.5 + np.abs(balance).max() / len(truth), name, np.median(theirs[0][:, k]), np.median(ours[0][:, k])))
    return sorted(found, reverse=True)[:count]


def scene_like_the_recording():
    return comparison.SCENE.read_text(encoding="utf-8")


def scene_of_another_bed():
    """Returns the scene without the lines of FITTED, and with relief of another seed."""
    kept = [line for line in scene_like_the_recording().splitlines() if not any(mark in line for mark in FITTED)]
    return "\n".join(kept).replace("      seed: 4\n", "      seed: 9\n")


def render(program, seed, scene):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "scene.yaml"
        path.write_text(f"{scene}\nseed: {seed}\n", encoding="utf-8")
        return comparison.images_of_render(program, path)


def results(captured, ours, others, another):
    """Returns the rows of the table (name, accuracy, interval); the features that separate best, in the picture and near the
    floor; and shares by rows (name -> share of each band)."""
    import numpy as np

    sets = [patches(p) for p in (captured, ours, others, another)]
    names = sets[0][2]
    texture, everything = len(names) - LEVELS, len(names)
    rows, bands = [], {}
    for name, first, features, second, unseen in (
            ("unseen sector, texture", 1, texture, 0, 2), ("unseen sector, all features", 1, everything, 0, 2),
            ("unseen ping, texture", 1, texture, 0, 0), ("unseen ping, all features", 1, everything, 0, 0),
            ("another bed, unseen sector, texture", 3, texture, 0, 2),
            ("another bed, unseen sector, all features", 3, everything, 0, 2),
            ("control: sonard against sonard, unseen sector, texture", 1, texture, 2, 2)):
        a, b = (only(sets[i], 0, features) for i in (first, second))
        right, places = told_apart(a, b, unseen), np.vstack([a[1], b[1]])
        if unseen == 2 and features == texture and second == 0:
            bands[name] = by_rows(right, places)
        rows.append((name, *interval(right, places)))
    like = [only(sets[i], 0, texture) for i in (1, 0)]
    best = {"picture": best_features(*like, names[:texture]),
            "near floor": best_features(*(of_rows(one, *NEAR_FLOOR) for one in like), names[:texture])}
    return rows, best, bands


INTRODUCTION = f"""## Can a classifier tell?

A random forest of {TREES} trees over {PATCH} x {PATCH} patches of the three captured pings and of as many of
`like-the-capture.yaml`, judged on sectors or pings that it was not trained on. 50 % is a guess. Intervals: 95 %, by bootstrap over
the patches' places. "Another bed" has relief of another seed, nothing that drifts in the water, and the product's own pulse and
noise.

| judged on | right, % | 95 % |
|---|---|---|
"""


def chapter(program, captures):
    like, another = scene_like_the_recording(), scene_of_another_bed()
    rows, best, bands = results(comparison.images_of_capture(captures), render(program, SEEDS[0], like),
                                render(program, SEEDS[1], like), render(program, SEEDS[0], another))
    text = INTRODUCTION
    text += "".join(f"| {name} | {100 * mean:.1f} | {100 * low:.1f} to {100 * high:.1f} |\n" for name, mean, low, high in rows)
    text += "\nBy rows, of which 32 to 159 are the near floor:\n\n"
    for name, shares in bands.items():
        text += f"- {name}: " + "; ".join(f"{first} to {last} {100 * share:.1f} %" for first, last, share in shares) + "\n"
    for part, features in best.items():
        text += f"\nFeatures that separate the {part} best, each alone with its best threshold:\n\n"
        text += "| feature | right, % | captured, median | sonard, median |\n|---|---|---|---|\n"
        text += "".join(f"| {name} | {100 * share:.1f} | {real:.3g} | {ours:.3g} |\n" for share, name, real, ours in features)
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True, type=pathlib.Path)
    parser.add_argument("--captures", type=pathlib.Path, default=os.environ.get("SONARD_CAPTURES"))
    options = parser.parse_args()
    if options.captures:
        os.environ["SONARD_CAPTURES"] = str(options.captures)
    if reason := missing():
        sys.exit(f"tell_apart.py: skipped: {reason}")
    print(chapter(options.program.resolve(), pathlib.Path(options.captures)), end="")


if __name__ == "__main__":
    try:
        main()
    except (OSError, RuntimeError) as error:
        sys.exit(f"tell_apart.py: {error}")
