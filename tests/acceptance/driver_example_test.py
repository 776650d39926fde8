"""Runs the example of docs/writing-a-driver-test.md unchanged, with its small driver."""
import os
import re
import subprocess
import sys
import time
import unittest

from running_sonard import ROOT, SONARCTL, SONARD

EXAMPLE = ROOT / "docs/driver-test"


def run_example(test, **more):
    """Runs the example's tests, or one of them, as its page describes."""
    environment = {**os.environ, "SONARD": str(SONARD.resolve()), "ADDRESS": "127.0.0.9", **more}
    if "DRIVER" not in more:
        environment.pop("DRIVER", None)
    return subprocess.run([sys.executable, "-B", "-m", "unittest", "-v", test], cwd=EXAMPLE, env=environment,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=600, check=False)


class DriverExample(unittest.TestCase):
    def test_a_driver_that_ends_is_reported_at_once_with_its_output(self):
        begin = time.monotonic()
        run = run_example("test_driver.DriverTest.test_numbers_go_up",
                          DRIVER="sh -c 'echo starting; echo no such device >&2; exit 3'")
        self.assertEqual(run.returncode, 1, run.stdout)
        self.assertIn("the driver ended with code 3 after 0 of 20 pings", run.stdout)
        self.assertIn("starting\nno such device\n", run.stdout)
        self.assertLess(time.monotonic() - begin, 60)  # well before the 100 s that a driver may take for its pings

    def test_the_example_passes_its_five_tests(self):
        run = run_example("test_driver.py")
        self.assertEqual(run.returncode, 0, run.stdout)
        self.assertIn("Ran 5 tests", run.stdout)

    def test_ci_jobs_call_the_judge_as_it_is(self):
        usage = subprocess.run([SONARCTL, "judge", "--help"], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, check=True)
        for name in ("judge-github.yml", "judge-gitlab.yml"):
            with self.subTest(name):
                text = (ROOT / "docs/examples" / name).read_text(encoding="utf-8")
                (command,) = re.findall(r"sonard/(build/release/clients/sonarctl) judge((?:.|\n +(?=--))+)\n", text)
                options = re.findall(r"--[a-z-]+", command[1])
                self.assertIn("--driver", options)
                self.assertEqual(set(options) - set(re.findall(r"--[a-z-]+", usage.stdout)), set())


if __name__ == "__main__":
    unittest.main()
