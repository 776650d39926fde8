"""Tests that the picture is not mirrored. The independent reader reads the L scene from the socket, and sonarctl sets the poses.

Places are those of scenes/l-targets.yaml; the spheres' nearest points are 0.1 m in front of their centres.
"""
import math
import unittest

from oculus_reader import Client, fire_message
from running_sonard import Sonard, eventually

A, B, C, BELOW = (3.9, -20), (3.9, 10), (6.9, -8), (4.9, 0)  # range m, bearing deg: positive to starboard
VERBATIM_GAIN = 0x59  # metres, simple result, 512 beams, and bit 4: the gain is used unchanged, also in mode 2
UNASSISTED = "oculus-m1200d\n    options: {gain_assist: off}"
SALINITY = 30.0  # that of the water; otherwise the device assumes another sound speed, and its ranges are wrong by a few per cent
LEVEL, BOW_DOWN, BOW_UP = "0,0,0", "0,25,0", "0,-25,0"      # east-north-up, forward-left-up


def rows_between(ping, near_m, far_m):
    return int(near_m / ping.resolution), min(ping.rows, int(far_m / ping.resolution))


def brightest_of_half(ping, near_m, far_m, side):
    """Returns range and bearing of the centre of the bright echo in one half of the fan: side -1 is port, +1 starboard."""
    first, last = rows_between(ping, near_m, far_m)
    beams = [b for b in range(ping.beams) if ping.bearings[b] * side > 0]
    top = max(ping.image[r][b] for r in range(first, last) for b in beams)
    bright = [(ping.image[r][b] ** 2, r, b) for r in range(first, last) for b in beams if ping.image[r][b] > top / 2]
    weight = sum(w for w, _, _ in bright)
    return (sum(w * (r + 0.5) for w, r, _ in bright) / weight * ping.resolution,
            sum(w * ping.bearings[b] for w, _, b in bright) / weight / 100)


def mean_around(ping, place, half_range_m=0.3, half_bearing_deg=3):
    first, last = rows_between(ping, place[0] - half_range_m, place[0] + half_range_m)
    beams = [b for b in range(ping.beams) if abs(ping.bearings[b] / 100 - place[1]) < half_bearing_deg]
    values = [ping.image[r][b] for r in range(first, last) for b in beams]
    return sum(values) / len(values)


class Mirror(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard(scene="l-targets.yaml", profile=UNASSISTED,
                            pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}").__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def ping(self, **settings):
        with Client(self.daemon.address) as client:
            return client.ping_made_with(fire_message(flags=VERBATIM_GAIN, gain=20.0, salinity=SALINITY, **settings))

    def pose(self, *arguments, json=False):
        port = 14771 if json else 14770
        before = self.accepted()
        result = self.daemon.ctl_to(f"{self.daemon.address}:{port}", "pose", "once", *arguments, *(["--json"] if json else []))
        self.assertEqual(result.returncode, 0, result.stderr)
        eventually(lambda: self.accepted() > before)

    def accepted(self):
        return int(self.daemon.status()["poses"].get("accepted", 0))

    def expect_at(self, found, place):
        self.assertAlmostEqual(found[0], place[0], delta=0.12)
        self.assertAlmostEqual(found[1], place[1], delta=1.5)

    def expect_level_l(self, ping):
        self.expect_at(brightest_of_half(ping, 3.4, 4.4, -1), A)
        self.expect_at(brightest_of_half(ping, 3.4, 4.4, +1), B)
        self.expect_at(brightest_of_half(ping, 6.4, 7.4, -1), C)
        for place in (A, C):
            mirrored = (place[0], -place[1])
            self.assertGreater(mean_around(ping, place, 0.15, 1), 3 * mean_around(ping, mirrored, 0.15, 1))

    def test_level_sonars_are_not_mirrored_in_both_modes_and_widths(self):
        self.pose("--xyz", "0,0,0", "--rpy", LEVEL)
        for settings in ({"mode": 2}, {"mode": 1}, {"mode": 2, "version": 2}):
            with self.subTest(**settings):
                self.expect_level_l(self.ping(**settings))

    def test_down_is_down_for_every_sender(self):
        self.pose("--xyz", "0,0,0", "--rpy", LEVEL)
        level = mean_around(self.ping(), BELOW)
        self.pose("--xyz", "0,0,0", "--rpy", BOW_DOWN)
        down = self.ping()
        self.expect_at(brightest_of_half(down, 4.5, 5.3, -1), BELOW)
        self.expect_at(brightest_of_half(down, 4.5, 5.3, +1), BELOW)
        self.pose("--xyz", "0,0,0", "--rpy", BOW_UP)
        up = mean_around(self.ping(), BELOW)
        self.assertGreater(mean_around(down, BELOW), 2 * max(level, up))
        # The same attitude in the other frame: north-east-down, pitch positive with the bow up, yaw from north.
        self.pose("--frame", "ned", "--xyz", "0,0,0", "--rpy", "0,-25,90", json=True)
        self.assertGreater(mean_around(self.ping(), BELOW), 2 * max(level, up))

    def test_turning_to_port_moves_everything_to_starboard(self):
        self.pose("--xyz", "0,0,0", "--rpy", "0,0,10")
        ping = self.ping()
        self.expect_at(brightest_of_half(ping, 3.4, 4.4, -1), (A[0], A[1] + 10))
        self.expect_at(brightest_of_half(ping, 3.4, 4.4, +1), (B[0], B[1] + 10))
        self.pose("--xyz", "1,0,0", "--rpy", LEVEL)
        ahead = self.ping()
        found = brightest_of_half(ahead, 5.4, 6.4, -1)
        self.assertAlmostEqual(found[0], 5.92, delta=0.12, msg="a metre ahead, C is a metre nearer")

    def test_the_control_stream_answers(self):
        to = f"{self.daemon.address}:14770"
        result = self.daemon.ctl_to(to, "pose", "line", "--from", "0,0,0", "--to-point", "0.1,0,0", "--confirm")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("poses sent to tcp", result.stdout)
        for wrong in (("--vehicle", "rob"), ("--object", "diver")):
            result = self.daemon.ctl_to(to, "pose", "once", "--confirm", *wrong)
            self.assertEqual(result.returncode, 65, result.stdout)
            self.assertIn(wrong[1], result.stderr)


class Rolled(unittest.TestCase):
    def ping(self, attitude, **settings):
        pose = f"{{frame: ENU_FLU, xyz_m: [0, 0, 0], rpy_deg: {list(attitude)}}}"
        with Sonard(scene="l-targets.yaml", profile=UNASSISTED, pose=pose) as daemon:
            with Client(daemon.address) as client:
                return client.ping_made_with(fire_message(version=2, flags=VERBATIM_GAIN, gain=20.0, salinity=SALINITY, **settings))

    def test_a_roll_moves_targets_below_to_the_low_side(self):
        """With the bow 13 degrees down, `below` is 12 degrees under the axis. If starboard is down, it moves to starboard; if
        port is down, to port."""
        bearing_deg = math.degrees(math.asin(math.sin(math.radians(12)) * math.sin(math.radians(20))))
        for roll_deg in (20, -20):
            with self.subTest(roll_deg=roll_deg):
                ping = self.ping((roll_deg, 13, 0), mode=1)
                self.assertAlmostEqual(ping.roll_deg, roll_deg, delta=0.5)
                found = ping.brightest(*rows_between(ping, 4.5, 5.3))
                self.assertAlmostEqual(found[0], BELOW[0], delta=0.12)
                self.assertAlmostEqual(found[1], math.copysign(bearing_deg, roll_deg), delta=1)

    def test_a_roll_to_starboard_moves_port_targets_out_of_the_fan(self):
        """With a roll of 90 degrees, left and right become up and down. A and C leave the fan of 12 degrees, so the picture loses
        its L."""
        ping = self.ping((90, 0, 0))
        self.assertAlmostEqual(ping.roll_deg, 90, delta=0.5)
        self.assertLess(mean_around(ping, A, 0.15, 1), 40)
        self.assertLess(mean_around(ping, C, 0.15, 1), 40)


if __name__ == "__main__":
    unittest.main()
