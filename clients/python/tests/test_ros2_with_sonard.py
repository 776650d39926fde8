"""The ROS 2 bridge with a running sonard: frames by a target to port."""
import math
import unittest

import ros_stand_ins  # noqa: F401  finds the bridge
from common import SONARD, config

from sonard_bridge import conversions as c
from sonard_client import Daemon, OculusClient

PATIENCE_S = 60
A = (4.0, 20.0)  # m and degrees, positive to port: a sphere of 0.1 m in scenes/l-targets.yaml


class WithSonard(unittest.TestCase):
    def start(self, text, *arguments):
        daemon = Daemon(text, SONARD, arguments=arguments)
        self.addCleanup(daemon.__exit__, None, None, None)
        daemon.__enter__()
        return daemon


class ATargetToPort(WithSonard):
    def test_the_static_transform_of_the_image_frame(self):
        daemon = self.start(config())
        with OculusClient(daemon.address) as sonar:
            sonar.fire(range_m=5, rate_hz=10)
            ping = next(p for p in sonar.pings(timeout=PATIENCE_S) if p.settings.range == 5)
        found = []
        for beam, bearing in enumerate(ping.bearings_rad):  # as on the wire: negative to port
            echo = max(ping.row(row)[beam] for row in range(ping.rows) if 3.5 < ping.ranges_m[row] < 4.5)
            # As oculus_sonar_driver computes a beam's direction, and RViz its place in the sonar's frame.
            x, y, z = c.rotate(c.wxyz(c.IMAGE_IN_FLU_XYZW), (0.0, -math.sin(bearing), math.cos(bearing)))
            found.append((echo, math.degrees(math.atan2(y, x)), z))
        brightest = max(echo for echo, deg, _ in found if deg > 15)
        at_deg = [deg for echo, deg, _ in found if deg > 15 and echo == brightest]  # several: the echo saturates
        self.assertAlmostEqual(sum(at_deg) / len(at_deg), A[1], delta=1)
        self.assertAlmostEqual(max(abs(z) for _, _, z in found), 0, places=9)
        self.assertGreater(brightest, 2 * max(echo for echo, deg, _ in found if deg < -15))  # nothing is there


if __name__ == "__main__":
    unittest.main()
