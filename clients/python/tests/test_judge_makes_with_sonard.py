"""The judge reads each make: a small driver passes, and a planted fault is found. SONARD_JUDGE_CASES=some runs all tests."""
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

from common import PACKAGE, ROOT, SONARD

from sonard_client import lab

PROFILES = {"m3": "m3", "dvl": "dvl-a50", "micron": "micron", "norbit": "norbit-wbms", "s500": "s500", "ping1d": "ping1d",
            "ping360": "ping360", "omniscan": "omniscan-450", "surveyor": "surveyor-240", "blueview": "blueview-p900-90",
            "aris": "aris-3000", "waterlinked": "waterlinked-3d15"}
DATAGRAMS = {"aris", "ping1d", "ping360", "waterlinked"}  # a busy computer may drop some
MOST_RUNS = 5


def judged(make, plant="", tap="json"):
    """Returns (exit code, the only case) of a run without a fault. A run whose capture missed packets is repeated, and so is one in
    which a driver without a plant was too slow: beside other programs its last pings may come after the end."""
    busy = {"UNSEEN"} if plant else {"UNSEEN", "LOST"}
    for _ in range(MOST_RUNS):
        with tempfile.TemporaryDirectory() as folder:
            driver = f"{sys.executable} -B {ROOT / 'tests/judge/make_drivers.py'} {make} {{ip}} {{port}} {plant}"
            done = subprocess.run([sys.executable, "-B", "-m", "sonard_client.judge", "--sonard", str(SONARD), "--profile", PROFILES[make],
                                   "--driver", driver, "--tap", tap, "--case", "N00.1", "--out", f"{folder}/report"],
                                  env={**os.environ, "PYTHONPATH": str(PACKAGE)}, capture_output=True, text=True, check=False)
            index = pathlib.Path(folder, "report/index.json")
            if not index.is_file():
                return done.returncode, {"data": done.stdout + done.stderr}
            case = json.loads(index.read_text())["drivers"][0]["cases"][0]
        if tap != "json" or case["data"] not in busy:
            break
    return done.returncode, case


@unittest.skipIf(lab.missing(), lab.missing())
class Makes(unittest.TestCase):
    maxDiff = None

    def all_judged(self, *arguments):
        with concurrent.futures.ThreadPoolExecutor(3) as pool:
            found = {make: pool.submit(judged, make, *arguments) for make in PROFILES}
        return {make: future.result() for make, future in found.items()}

    def test_right_drivers_pass(self):
        for make, (code, case) in self.all_judged().items():
            with self.subTest(make):
                self.assertIn(case["data"], {"CLEAN", "LOST"} if make in DATAGRAMS else {"CLEAN"})
                self.assertEqual(code, 0)

    def test_mirrored_pings_are_false(self):
        for make, (code, case) in self.all_judged("mirrors").items():
            with self.subTest(make):
                self.assertEqual((case["data"], code), ("FALSE", 1))

    @unittest.skipUnless(os.environ.get("SONARD_JUDGE_CASES"), "set SONARD_JUDGE_CASES")
    def test_omitted_pings_are_lost(self):
        for make, (_, case) in self.all_judged("drops").items():
            with self.subTest(make):
                self.assertEqual(case["data"], "LOST")

    @unittest.skipUnless(os.environ.get("SONARD_JUDGE_CASES"), "set SONARD_JUDGE_CASES")
    def test_without_a_tap_the_wire_is_judged(self):
        for make, (code, case) in self.all_judged("", "wire").items():
            with self.subTest(make):
                self.assertEqual((case["data"], case["result"], code), ("UNSEEN", "PASS (wire)", 0))


if __name__ == "__main__":
    unittest.main()
