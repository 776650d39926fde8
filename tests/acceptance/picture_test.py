"""The demo looks like a sonar image, in figures on its quantised samples, computed by `sonarctl stats`.

From the demo's first pose, with 256 beams as in the captured pings of a real M1200d, whose figures are: adjacent-beam correlation
0.80, adjacent-row 0.58, quiet near field with a mean of 8, noise rising towards the far end.
"""
import json
import pathlib
import tempfile
import unittest

from running_sonard import SONARCTL, Sonard, run

SAND = "250:350,75:125"              # 5.5 to 7.8 m, 12 degrees to port: rippled sand, nothing on it
BOULDER_SHADOW = "200:208,68:74"     # 4.5 m, 13 degrees to port, behind the second small boulder
BESIDE_IT = "200:208,80:110"


class Picture(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        raw, png = (pathlib.Path(cls.folder.name) / name for name in ("raw", "demo.png"))
        with Sonard(mount="{frame: FRD, xyz_m: [0.3, 0, 0.1], rpy_deg: [0, -15, 0]}") as daemon:
            result = daemon.ctl("listen", "--pings", 3, "--quiet", "--beams", 256, "--record", raw, "--png", png)
        assert result.returncode == 0, result.stdout + result.stderr
        cls.png = png.read_bytes()
        result = run(SONARCTL, "stats", "--from-raw", raw, "--ping", 1, "--rows", SAND, "--shadow", BOULDER_SHADOW,
                     "--surroundings", BESIDE_IT, "--json")
        assert result.returncode == 0, result.stderr
        cls.figures = json.loads(result.stdout)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_speckle_is_wider_across_beams_than_along_range(self):
        beams = self.figures["window"]["correlation_of_adjacent_beams"][0]
        rows = self.figures["window"]["correlation_of_adjacent_rows"][0]
        self.assertTrue(0.6 <= beams <= 0.9, beams)
        self.assertTrue(0.4 <= rows <= 0.7, rows)
        self.assertGreater(beams, rows)

    def test_the_near_field_is_quiet_and_noise_rises_with_range(self):
        figures = self.figures["range"]
        self.assertGreater(figures["first_echo_row"], 100, "the bed is first met beyond 2 m")
        self.assertLess(figures["near_field_mean"], 15)
        self.assertGreater(figures["last_50_rows_mean"], figures["near_field_mean"])

    def test_shadows_are_dark(self):
        self.assertLess(self.figures["shadow"]["ratio"], 1 / 3, self.figures["shadow"])

    def test_samples_use_their_range_without_burning_out(self):
        self.assertLess(self.figures["window"]["saturated_share"], 0.01)
        self.assertGreater(self.figures["window"]["mean"], 10, "sand must be visible")

    def test_the_picture_is_a_png(self):
        self.assertTrue(self.png.startswith(b"\x89PNG\r\n\x1a\n"))
        self.assertGreater(len(self.png), 50_000)


if __name__ == "__main__":
    unittest.main()
