"""The example of docs/writing-a-driver-test.md as it is, with its own little driver, on an address of its own."""
import os
import subprocess
import sys
import unittest

from running_sonard import ROOT, SONARD, free_address

EXAMPLE = ROOT / "docs/driver-test"


class DriverExample(unittest.TestCase):
    def test_the_page_is_true(self):
        environment = {**os.environ, "SONARD": str(SONARD.resolve()), "ADDRESS": free_address()}
        environment.pop("DRIVER", None)
        run = subprocess.run([sys.executable, "-B", "-m", "unittest", "-v", "test_driver.py"], cwd=EXAMPLE, env=environment,
                             stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=240,
                             check=False)
        self.assertEqual(run.returncode, 0, run.stdout)
        self.assertIn("Ran 4 tests", run.stdout)


if __name__ == "__main__":
    unittest.main()
