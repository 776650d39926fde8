"""Tests the classifier of captured and simulated pings with made-up pictures: it distinguishes only different ones."""
import os
import random
import unittest
from unittest import mock

import capture_comparison as comparison
import tell_apart

try:
    import numpy
    import sklearn  # noqa: F401
except ImportError:
    numpy = None


def pings(seed, smooth=False, rows=slice(None)):
    """Returns three pictures of noise. If `smooth`, each sample in `rows` is the mean of two rows."""
    draw = numpy.random.default_rng(seed)
    out = []
    for _ in range(comparison.PINGS):
        image = draw.rayleigh(30, (comparison.ROWS + 1, comparison.BEAMS))
        means = (image[1:] + image[:-1]) / 2
        image = image[1:]
        if smooth:
            image[rows] = means[rows]
        out.append(image.clip(0, comparison.FULL).astype(numpy.uint8).tobytes())
    return out


class Skipping(unittest.TestCase):
    def test_the_missing_captures_are_named(self):
        with mock.patch.dict(os.environ):
            os.environ.pop("SONARD_CAPTURES", None)
            self.assertIn("SONARD_CAPTURES", tell_apart.missing())


class Scenes(unittest.TestCase):
    def test_another_bed_has_no_fitted_lines(self):
        fitted, another = tell_apart.scene_like_the_recording(), tell_apart.scene_of_another_bed()
        for mark in tell_apart.FITTED:
            self.assertIn(mark, fitted)
            self.assertNotIn(mark, another)
        self.assertIn("      seed: 4\n", fitted)
        self.assertIn("      seed: 9\n", another)
        self.assertIn("name: bed", another)
        self.assertIn("profile: oculus-m1200d", another)


@unittest.skipIf(numpy is None, "no python3-sklearn")
class Classifier(unittest.TestCase):
    def test_local_means_are_computed(self):
        image = numpy.array([[random.Random(i * 9 + j).random() for j in range(9)] for i in range(9)])
        self.assertAlmostEqual(tell_apart.box_mean(image, 4)[4, 4], image.mean())
        self.assertAlmostEqual(tell_apart.box_mean(image, 1)[0, 0], (4 * image[0, 0] + 2 * image[0, 1] + 2 * image[1, 0] +
                                                                    image[1, 1]) / 9)

    def test_shifts_are_computed(self):
        patch = numpy.arange(16).reshape(4, 4)
        for down, right, step in ((0, 1, 1), (1, 0, 4), (1, 1, 5), (1, -1, 3)):
            a, b = tell_apart.shifted(patch, down, right)
            self.assertTrue((b - a == step).all(), (down, right))

    def test_texture_features_do_not_depend_on_brightness(self):
        patch = numpy.random.default_rng(1).rayleigh(1, (32, 32))
        at, twice = (tell_apart.texture_features(scale * patch / (scale * patch).mean()) for scale in (1, 2))
        for name, value in at.items():
            self.assertAlmostEqual(value, twice[name], places=9, msg=name)
            self.assertNotRegex(name, r"\b1 (beams|rows)")

    def test_only_different_patches_are_distinguished(self):
        with mock.patch.object(tell_apart, "TREES", 20):
            rows, best, bands = tell_apart.results(pings(1, smooth=True), pings(2), pings(3), pings(4, smooth=True))
        shares = {name: (low, high) for name, _, low, high in rows}
        self.assertGreater(shares["unseen sector, texture"][0], 0.95)
        low, high = shares["control: sonard against sonard, unseen sector, texture"]
        self.assertTrue(low - 0.05 < 0.5 < high + 0.05, (low, high))
        self.assertGreater(best["picture"][0][0], 0.95)
        low, high = shares["another bed, unseen sector, texture"]
        self.assertTrue(low - 0.05 < 0.5 < high + 0.05, (low, high))
        told, alike = bands.values()
        for band in told, alike:
            self.assertEqual([rows[:2] for rows in band], [(0, 31), (32, 159), (160, 287), (288, 447), (448, 671)])
        self.assertTrue(all(share > 0.9 for *_, share in told), told)
        self.assertTrue(all(share < 0.8 for *_, share in alike), alike)

    def test_features_of_the_near_floor_use_only_its_rows(self):
        near = slice(*tell_apart.NEAR_FLOOR)
        ours, theirs = (tell_apart.patches(p) for p in (pings(1, smooth=True, rows=near), pings(2)))
        rows = [tell_apart.of_rows(one, *tell_apart.NEAR_FLOOR) for one in (ours, theirs)]
        self.assertEqual({*rows[0][1][:, 1]}, {1, 2, 3, 4})
        self.assertGreater(tell_apart.best_features(*rows, ours[2])[0][0], 0.95)
        self.assertLess(tell_apart.best_features(ours, theirs, ours[2])[0][0], 0.8)


if __name__ == "__main__":
    unittest.main()
