"""Tests the comparison with captured pings: its statistics with made-up pictures, and the fit of our profile with recordings."""
import os
import pathlib
import random
import unittest

import capture_comparison as comparison

SONARD = pathlib.Path(os.environ.get("SONARD_BUILD", "build/release")) / "daemon" / "sonard"


def picture(seed, amid=60):
    draw = random.Random(seed)
    return bytes(min(254, max(0, int(draw.gauss(amid, 15)))) for _ in range(comparison.ROWS * comparison.BEAMS))


class Statistics(unittest.TestCase):
    def test_white_noise_has_the_expected_statistics(self):
        figures = comparison.statistics([picture(1), picture(2)])
        self.assertAlmostEqual(figures["percentile 50"], 60, delta=1)
        self.assertAlmostEqual(figures["mean"], 59.5, delta=0.3)
        self.assertEqual(figures["saturated share, %"], 0)
        for name in ("beams apart 1, correlation", "rows apart 1, correlation", "ping to ping, correlation"):
            self.assertAlmostEqual(figures[name], 0, delta=0.02, msg=name)
        self.assertAlmostEqual(figures["difference of pings, rows 20-119, sd"], 15 * 2 ** 0.5, delta=0.5)

    def test_a_still_picture_correlates_with_itself(self):
        one = picture(1)
        figures = comparison.statistics([one, one])
        self.assertAlmostEqual(figures["ping to ping, correlation"], 1)
        self.assertEqual(figures["difference of pings, rows 20-119, sd"], 0)

    def test_larger_differences_have_a_reason_or_are_reported(self):
        real = {"mean": 10.0, "rows 350-399, mean": 4.0, "other": 1.0}
        ours = {"mean": 11.0, "rows 350-399, mean": 5.0, "other": 2.0}
        text, within = comparison.table(real, ours)
        self.assertEqual(within, 1)
        self.assertIn(comparison.REASONS["rows 350-399, mean"][0], text)
        self.assertIn("not explained", text)

    def test_reasons_are_bounded_and_used(self):
        self.assertTrue(all(comparison.TOLERANCE < most < 1.5 for _, most in comparison.REASONS.values()))
        real = {name: 1.0 for name in comparison.REASONS} | {"mean": 1.0}
        as_explained = {name: 1 + most - 0.001 for name, (_, most) in comparison.REASONS.items()} | {"mean": 1.1}
        self.assertEqual(comparison.faults(real, as_explained), [])
        for changed in ({"mean": 1.2}, {"rows 350-399, mean": 1.5}, {"rows 350-399, mean": 1.0}):
            self.assertEqual(len(comparison.faults(real, as_explained | changed)), 1, changed)
        del real["rows 350-399, mean"]
        self.assertEqual(len(comparison.faults(real, as_explained)), 1)


@unittest.skipUnless(os.environ.get("SONARD_CAPTURES"), "no recordings: SONARD_CAPTURES is not set")
class BesideTheDevice(unittest.TestCase):
    def test_every_statistic_is_near_or_as_far_off_as_explained(self):
        real = comparison.statistics(comparison.images_of_capture(pathlib.Path(os.environ["SONARD_CAPTURES"])))
        ours = comparison.statistics(comparison.images_of_render(SONARD.resolve(), comparison.SCENE))
        text, within = comparison.table(real, ours)
        self.assertEqual(comparison.faults(real, ours), [], text)
        self.assertGreaterEqual(within, 93, text)


if __name__ == "__main__":
    unittest.main()
