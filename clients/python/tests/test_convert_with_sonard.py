"""`sonard render` with a converted log: the vehicle follows the log."""
import json
import pathlib
import subprocess
import tempfile
import unittest

import made_logs as made
from common import SONARD, config

from sonard_client.convert.__main__ import main

ORIGIN = ",".join(map(str, made.ORIGIN))


class Rendered(unittest.TestCase):
    def test_vehicle_follows_the_log(self):
        odometry = [(i, made.odometry(i)) for i in range(3)]
        logs = {"flight.bin": (made.dataflash_log(("SIM",), 3), ["--origin", ORIGIN]),
                "flight.tlog": (made.telemetry_log(("ODOMETRY",), 3), []),
                "dive.mcap": (made.mcap([("/odom", "cdr", "nav_msgs/msg/Odometry", odometry)]), [])}
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "dive.yaml").write_text(config().replace("ADDRESS", "127.0.0.1"), encoding="utf-8")
            for log, (data, options) in logs.items():
                with self.subTest(log):
                    (folder / log).write_bytes(data)
                    self.assertEqual(main([str(folder / log), "-o", str(folder / "way.csv"), *options]), 0)
                    out = folder / f"{log}-pings"
                    done = subprocess.run([str(SONARD), "render", str(folder / "dive.yaml"), "--poses", str(folder / "way.csv"),
                                           "--out", str(out), "--format", "raw", "--quiet"], stdin=subprocess.DEVNULL,
                                          capture_output=True, text=True, timeout=120, check=False)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    for step in range(3):
                        vehicle = json.loads((out / f"{step + 1:06d}.json").read_text(encoding="utf-8"))["vehicle_in_world"]
                        _, position, (x, y, z, w) = made.enu_moment(step)
                        for got, wanted in zip(vehicle["xyz_m"], position):
                            self.assertAlmostEqual(got, wanted, delta=0.01)
                        turned = sum(a * b for a, b in zip(vehicle["wxyz"], (w, x, y, z)))
                        self.assertAlmostEqual(abs(turned), 1, places=6)


if __name__ == "__main__":
    unittest.main()
