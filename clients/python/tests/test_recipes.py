"""docs/poses.md: runs every recipe with synthetic logs and a running sonard, and checks the table of axes."""
import functools
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import made_logs as made
from common import PACKAGE, ROOT, SONARD, config

from sonard_client import Daemon
from sonard_client.rotations import quaternion_from_rpy

PAGE = (ROOT / "docs/poses.md").read_text(encoding="utf-8")
HALF = math.sqrt(0.5)


def logs():
    odometry = [(100 + i, made.odometry(i)) for i in range(4)]
    ros1 = [(100 + i, made.odometry(i, ros1=True)) for i in range(4)]
    return {"flight.bin": made.dataflash_log(("SIM", "ATT", "POS"), 4),
            "flight.tlog": made.telemetry_log(("ODOMETRY", "SIM_STATE"), 4),
            "second.tlog": made.telemetry_log(("ODOMETRY",), 5),
            "dive.mcap": made.mcap([("/odom", "cdr", "nav_msgs/msg/Odometry", odometry),
                                    ("/tf", "cdr", "tf2_msgs/msg/TFMessage", [(100 + i, made.transforms(i)) for i in range(4)])]),
            "dive.bag": made.bag([("/odom", "nav_msgs/Odometry", ros1)]), "nmea.log": made.nmea_log(4).encode(),
            "dive.yaml": config().replace("ADDRESS", "127.0.0.1").encode()}


class Recipes(unittest.TestCase):
    def test_every_recipe_runs(self):
        recipes = re.findall(r"^```sh\n(.*?)^```", PAGE, re.M | re.S)
        self.assertGreater(len(recipes), 4)
        environment = dict(os.environ, PYTHONPATH=str(PACKAGE), PATH=f"{SONARD.parent}{os.pathsep}{os.environ['PATH']}")
        with tempfile.TemporaryDirectory() as name, Daemon(config(), SONARD) as daemon:
            folder = pathlib.Path(name)
            for log, data in logs().items():
                (folder / log).write_bytes(data)
            (folder / "rosbag2_2026_05_04").mkdir()
            made.db3(folder / "rosbag2_2026_05_04/part_0.db3",
                     [("/odom", "nav_msgs/msg/Odometry", [(100 + i, made.odometry(i)) for i in range(4)])])
            for recipe in recipes:
                with self.subTest(recipe):
                    typed = recipe.replace("ADDRESS", daemon.address).replace("python3 -m", f"'{sys.executable}' -B -m")
                    done = subprocess.run(["bash", "-eu", "-o", "pipefail", "-c", typed], cwd=folder, env=environment,
                                          stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False)
                    self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            for csv in ("flight", "truth", "dive", "dive-tf", "dive-bag", "ship", "both"):
                self.assertIn("# frame: ", (folder / f"{csv}.csv").read_text(encoding="utf-8"))
            both = (folder / "both.csv").read_text(encoding="utf-8").splitlines()
            self.assertEqual([sum(line.endswith(b) for line in both) for b in (",rov", ",buoy")], [4, 5])
            self.assert_file_with_two_bodies(folder, environment)
            self.assertIn("json", daemon.log())

    def assert_file_with_two_bodies(self, folder, environment):
        """sonard reads `both.csv`: each body has its own lines; the error for another name lists them."""
        dive = (folder / "dive.yaml").read_text(encoding="utf-8")
        text, changed = re.subn(r"initial_pose: \{.*?\}", "trajectory: {file: both.csv, body: BODY}", dive)
        self.assertEqual(changed, 1)
        for body, code, answer in (("rov", 0, "vehicle rov follows both.csv: csv, NED_FRD, 4 poses"),
                                   ("buoy", 0, "vehicle rov follows both.csv: csv, NED_FRD, 5 poses"),
                                   ("kayak", 78, 'no body is called "kayak"; there are: rov, buoy')):
            with self.subTest(body):
                (folder / "two.yaml").write_text(text.replace("BODY", body), encoding="utf-8")
                done = subprocess.run([str(SONARD), "check", "two.yaml"], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                      capture_output=True, text=True, timeout=120, check=False)
                self.assertEqual(done.returncode, code, done.stdout + done.stderr)
                self.assertIn(answer, done.stdout + done.stderr)


class Axes(unittest.TestCase):
    """Forward, port and up axes of a body in other conventions, converted by the table."""

    @staticmethod
    def product(a, b):
        return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])

    def turned(self, q, v):
        return functools.reduce(self.product, (q, (0, *v), (q[0], -q[1], -q[2], -q[3])))[1:]

    def test_the_table_of_axes_is_right(self):
        quarter = (HALF, 0, 0, HALF)
        rows = {  # name: place, quaternion; ahead, port, up of a body in its own axes; words of the page
            "glTF": (lambda x, y, z: (x, -z, y), lambda w, x, y, z: self.product((w, x, -z, y), quarter),
                     ((0, 0, -1), (-1, 0, 0), (0, 1, 0)), "(w, x, -z, y) times (0.70711, 0, 0, 0.70711)"),
            "Unreal": (lambda x, y, z: (x, -y, z), lambda w, x, y, z: (w, -x, y, -z),
                       ((1, 0, 0), (0, -1, 0), (0, 0, 1)), "0.01 x, -0.01 y, 0.01 z; quaternion (w, -x, y, -z)"),
            "Unity": (lambda x, y, z: (x, z, y), lambda w, x, y, z: self.product((w, -x, -z, -y), quarter),
                      ((0, 0, 1), (-1, 0, 0), (0, 1, 0)), "x, z, y; quaternion (w, -x, -z, -y) times (0.70711, 0, 0, 0.70711)")}
        for name, (place, quaternion, theirs, words) in rows.items():
            self.assertIn(words, next(line for line in PAGE.splitlines() if line.startswith("| ") and name in line))
            for q in (quaternion_from_rpy(0, 0, 0), quaternion_from_rpy(0.3, -0.5, 1.2), quaternion_from_rpy(-1, 0.2, -2.5)):
                for axis, ours in zip(theirs, ((1, 0, 0), (0, 1, 0), (0, 0, 1))):
                    for got, wanted in zip(self.turned(quaternion(*q), ours), place(*self.turned(q, axis))):
                        self.assertAlmostEqual(got, wanted, msg=name)


if __name__ == "__main__":
    unittest.main()
