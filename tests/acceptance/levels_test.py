"""Tests that the captured request of an M1200d (gain 50 %, gamma 127, gain assist) over a similar scene gives a picture as bright as the
captured one."""
import pathlib
import tempfile
import textwrap
import unittest

from oculus_reader import Client, fire_message
from running_sonard import ROOT, Sonard

ASSISTED, UNASSISTED = 0x19, 0x09  # metres, simple result; bit 4: gain assist
MEDIAN, LOUD = 43, 246             # captured: median, and 99th percentile of 254


def scene_of_render_file(path, folder):
    """Writes the scene inside a render file to a separate file."""
    text = path.read_text(encoding="utf-8")
    inside = text[text.index("\nscene:\n") + len("\nscene:\n"):text.index("\nsonar:\n")]
    scene = pathlib.Path(folder) / "scene.yaml"
    scene.write_text(textwrap.dedent(inside) + "\n", encoding="utf-8")
    return scene


class Levels(unittest.TestCase):
    def percentiles(self, flags, pings, echoed):
        """Returns median and 99th percentile of the last of several pings; its echo must state `echoed` per cent."""
        request = fire_message(rate_hz=15, flags=flags, range_=2.0, gain=50.0, sound_speed=1490.658551265436)
        with tempfile.TemporaryDirectory() as folder:
            scene = scene_of_render_file(ROOT / "tests/validation/scenes/like-the-capture.yaml", folder)
            with Sonard(scene=scene, pose="{frame: ENU_FLU, xyz_m: [0, 0, -2], rpy_deg: [2, 42, 0]}") as daemon:
                with Client(daemon.address) as client:
                    ping = client.ping_made_with(request)
                    for _ in range(pings - 1):
                        ping = client.ping()
        self.assertEqual(ping.gain, echoed)
        ordered = sorted(code for row in ping.image for code in row)
        return ordered[len(ordered) // 2], ordered[len(ordered) * 99 // 100]

    def test_gain_assist_makes_the_captured_brightness(self):
        median, loud = self.percentiles(ASSISTED, 30, echoed=50)
        self.assertAlmostEqual(median, MEDIAN, delta=0.15 * MEDIAN)
        self.assertAlmostEqual(loud, LOUD, delta=5)

    def test_without_gain_assist_the_per_cent_counts(self):
        self.assertLess(self.percentiles(UNASSISTED, 1, echoed=70)[1], LOUD / 2)


if __name__ == "__main__":
    unittest.main()
