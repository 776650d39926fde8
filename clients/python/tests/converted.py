"""Base class of the tests of converters. It has a folder for the log, a list of warnings, and a comparison of tracks."""
import math
import pathlib
import tempfile
import unittest

import common  # noqa: F401  adds the package to the path
import made_logs as made

from sonard_client.convert import convert


class WithFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.warned = []

    def file(self, data, name="log"):
        path = self.folder / name
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        return path

    def convert(self, data, **how):
        self.warned = []
        return convert(self.file(data), warn=self.warned.append, **how)

    def assert_track(self, track, steps, t0=0.0, metres=0.01, radians=2e-4, origin_down=0.0):
        """Compares track with made_logs.moment(), in the frame of the track. By default, angles may differ by 2e-4 rad."""
        self.assertEqual(len(track.rows), len(steps), track.rows[:2])
        for row, step in zip(track.rows, steps):
            t, north, east, down, roll, pitch, yaw = made.moment(step)
            position, turn = (north, east, down - origin_down), made.quaternion(roll, pitch, yaw)
            if track.frame == "ENU_FLU":
                _, position, xyzw = made.enu_moment(step)
                turn = xyzw[3], xyzw[0], xyzw[1], xyzw[2]
            self.assertAlmostEqual(row.t_s, t0 + t, delta=0.0051)
            for got, wanted in zip(row.position_m, position):
                self.assertAlmostEqual(got, wanted, delta=metres)
            cosine = abs(sum(a * b for a, b in zip(row.orientation, turn)))
            self.assertLess(2 * math.acos(min(1.0, cosine)), radians)
