"""Checks with statistics of the samples (`sonarctl stats`) that the demo's picture resembles that of a real sonar.

The picture is that of the demo's first pose, with 256 beams as in the captured pings of a real M1200d. In these pings adjacent
beams have a correlation of 0.80, and adjacent rows 0.58. The near field is quiet, with a mean of 8, and noise rises towards
the far end. In the 512 format, which the demo uses, beams are equally wide but half as far apart (0.117 degrees; a beam
is 0.4 degrees wide), so neighbours are more similar.
"""
import json
import pathlib
import tempfile
import unittest

from running_sonard import SONARCTL, Sonard, run

# Rows and beams of 256; rows are 22 mm.
SAND = (250, 350, 75, 125)            # 5.5 to 7.8 m, 12 degrees to port: rippled sand without objects
SHADOWS = {                           # a shadow, and sand at the same range
    "the second cobble": ((200, 208, 68, 74), (200, 208, 80, 110)),  # 4.5 m, 13 degrees to port
    "the wreck": ((236, 252, 222, 246), (236, 252, 66, 110)),        # 5.4 m, 25 degrees to starboard, behind its near side
}


def window(place, beams):
    first_row, last_row, first_beam, last_beam = place
    return f"{first_row}:{last_row},{first_beam * beams // 256}:{last_beam * beams // 256}"


class Picture(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.raw = {beams: pathlib.Path(cls.folder.name) / f"raw {beams}" for beams in (256, 512)}
        png = pathlib.Path(cls.folder.name) / "demo.png"
        with Sonard(mount="{frame: FRD, xyz_m: [0.3, 0, 0.1], rpy_deg: [0, -15, 0]}") as daemon:
            for beams, raw in cls.raw.items():
                result = daemon.ctl("listen", "--pings", 3, "--quiet", "--beams", beams, "--record", raw, "--png", png)
                assert result.returncode == 0, result.stdout + result.stderr
        cls.png = png.read_bytes()
        cls.figures = cls.stats(256)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def stats(cls, beams, *arguments):
        result = run(SONARCTL, "stats", "--from-raw", cls.raw[beams], "--ping", 1, "--rows", window(SAND, beams), *arguments, "--json")
        assert result.returncode == 0, result.stderr
        return json.loads(result.stdout)

    def test_speckle_is_wider_across_beams_than_along_range(self):
        beams = self.figures["window"]["correlation_of_adjacent_beams"][0]
        rows = self.figures["window"]["correlation_of_adjacent_rows"][0]
        self.assertTrue(0.6 <= beams <= 0.9, beams)
        self.assertTrue(0.4 <= rows <= 0.7, rows)
        self.assertGreater(beams, rows)

    def test_with_512_beams_neighbours_are_more_alike(self):
        half_as_far, as_far = self.stats(512)["window"]["correlation_of_adjacent_beams"][:2]
        self.assertTrue(0.85 <= half_as_far <= 0.95, half_as_far)
        of_256 = self.figures["window"]["correlation_of_adjacent_beams"][0]
        self.assertAlmostEqual(as_far, of_256, delta=0.06, msg="every other beam of 512 is a beam of 256")

    def test_the_near_field_is_quiet_and_noise_rises_with_range(self):
        figures = self.figures["range"]
        # The sonar is 1.9 m above the bed, which has relief. The main lobe reaches it at 3.9 m, row 174, and a side lobe straight
        # below.
        self.assertGreater(figures["first_echo_row"], 80, "nothing is nearer than the bed below")
        self.assertLess(figures["first_echo_row"], 100, "a side lobe receives echoes of the bed below")
        self.assertLess(figures["near_field_mean"], 15)
        self.assertGreater(figures["last_50_rows_mean"], figures["near_field_mean"])

    def test_shadows_are_dark(self):
        for name, (shadow, beside) in SHADOWS.items():
            for beams in self.raw:
                with self.subTest(behind=name, beams=beams):
                    figures = self.stats(beams, "--shadow", window(shadow, beams), "--surroundings", window(beside, beams))
                    # With gamma 127, 0.4 is 16 dB: noise of the level of the captured pings is visible in a shadow at 5 m.
                    self.assertLess(figures["shadow"]["ratio"], 0.4, figures["shadow"])

    def test_samples_use_their_range_without_saturation(self):
        self.assertLess(self.figures["window"]["saturated_share"], 0.01)
        self.assertGreater(self.figures["window"]["mean"], 10, "sand must be visible")

    def test_the_picture_is_a_png(self):
        self.assertTrue(self.png.startswith(b"\x89PNG\r\n\x1a\n"))
        self.assertGreater(len(self.png), 50_000)


if __name__ == "__main__":
    unittest.main()
