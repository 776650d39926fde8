"""Faults of a running sonard as a driver's test uses them: a block, the reaction of the driver, and the fixture of pytest."""
import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from common import PACKAGE, SONARD, config

from sonard_client import Control, ControlError, Daemon, OculusClient


class Faults(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(config(), SONARD, ["--faults"]).__enter__()
        cls.control = Control(cls.daemon.address)

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def tearDown(self):
        self.control.reset_faults()

    def driver(self):
        sonar = OculusClient(self.daemon.address)
        self.addCleanup(sonar.close)
        sonar.fire(range_m=2, rate_hz=40)
        sonar.ping(timeout=60)
        return sonar

    def acting(self):
        return [fault["code"] for fault in self.control.faults() if fault["state"] != "over"]

    def test_a_fault_lasts_as_long_as_its_block(self):
        self.driver()
        with self.control.fault("silent-open", seconds=60) as fault:
            self.assertEqual(self.acting(), ["L05"])
            deadline = time.monotonic() + 60
            while fault.injections() == 0:
                self.assertLess(time.monotonic(), deadline)
            first = next(entry for entry in fault.journal() if entry["event"] == "injected")
            self.assertEqual((first["kind"], first["sonar"], first["client_number"] > 0), ("L05", "front", True))
            self.assertLess(abs(first["utc_ns"] * 1e-9 - time.time()), 30)
        self.assertEqual(self.acting(), [])

    def test_a_trouble_ends_with_its_block(self):
        with self.control.fault("electrical-noise", name="noise", parameters={"severity": 1}) as fault:
            self.assertEqual(sorted(f["name"] for f in fault.status()), ["noise.1", "noise.2", "noise.3"])
        self.assertEqual(self.acting(), [])

    def test_a_fault_that_is_over_before_its_block_is_no_error(self):
        with self.control.fault("L01", seconds=0.1) as fault:
            deadline = time.monotonic() + 60
            while self.acting():
                self.assertLess(time.monotonic(), deadline)
            self.assertEqual(fault.journal()[-1]["event"], "ended")

    def test_a_driver_that_only_waits_has_not_noticed(self):
        self.driver()
        with self.control.fault("L05", seconds=60) as fault:
            begin = time.monotonic()
            self.assertFalse(fault.noticed_within(0.5))
            self.assertLess(time.monotonic() - begin, 50)

    def test_a_driver_that_closes_or_reconnects_has_noticed(self):
        sonar = self.driver()
        with self.control.fault("L05", seconds=60) as fault:
            closing = threading.Timer(0.3, sonar.close)
            closing.start()
            self.assertTrue(fault.noticed_within(60))
            closing.join()
            self.assertFalse(fault.noticed_within(0.01), "it took longer")

    def test_a_connection_that_the_fault_ends_is_not_the_drivers_doing(self):
        sonar = self.driver()
        with self.control.fault("L01", parameters={"close-existing": "yes"}, seconds=1) as fault:
            self.assertFalse(fault.noticed_within(0.5))
            sonar.close()
            while self.acting():
                time.sleep(0.02)
            self.driver()
            self.assertTrue(fault.noticed_within(60), "it has connected again")

    def test_a_refused_fault_is_an_error_and_leaves_nothing(self):
        with self.assertRaisesRegex(ControlError, 'did you mean "silent-open"'), self.control.fault("silent-opne"):
            self.fail("not a fault")
        with self.assertRaisesRegex(ControlError, "no fault"):
            self.control.end_fault("nothing")
        self.assertEqual(self.acting(), [])

    def test_the_catalogue_has_every_kind(self):
        catalogue = self.control.fault_kinds()
        self.assertEqual(len(catalogue["troubles"]), 12)
        self.assertIn("L05", [kind["code"] for kind in catalogue["kinds"]])


PYTEST = '''
import pytest

def test_the_demo_has_armed_faults(sonard):
    assert sonard.address.startswith("127.0.") and list(sonard.addresses) == ["front"]
    with sonard.control.fault("L05", seconds=6) as fault:
        assert fault.status()[0]["state"] == "active"

@pytest.mark.sonard("CONFIG")
def test_a_configuration_can_be_given(sonard):
    assert list(sonard.addresses) == ["bow"]
'''


@unittest.skipUnless(importlib.util.find_spec("pytest"), "pytest is not installed")
class Fixture(unittest.TestCase):
    def test_each_test_has_its_daemon(self):
        with tempfile.TemporaryDirectory() as folder:
            mine = pathlib.Path(folder) / "mine.yaml"
            mine.write_text(config().replace("name: front", "name: bow").replace("ADDRESS", "127.0.0.2").replace(
                '"127.0.0.2:', '"127.0.0.1:'), encoding="utf-8")
            (pathlib.Path(folder) / "test_mine.py").write_text(PYTEST.replace("CONFIG", str(mine)), encoding="utf-8")
            path = os.pathsep.join([str(PACKAGE), *filter(None, [os.environ.get("PYTHONPATH")])])
            environment = dict(os.environ, PYTHONPATH=path, SONARD=str(SONARD.resolve()))
            done = subprocess.run([sys.executable, "-B", "-m", "pytest", "-q", "-p", "sonard_client.pytest_plugin", "-p", "no:cacheprovider",
                                   folder], env=environment, capture_output=True, text=True, timeout=120, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertIn("2 passed", done.stdout)


if __name__ == "__main__":
    unittest.main()
