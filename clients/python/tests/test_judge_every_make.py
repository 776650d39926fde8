"""Every make of sonar has a reader of the judge, and a small driver with which the judge is tested. print_makes, which is built with the
tests, lists the makes."""
import subprocess
import unittest

from common import ROOT, SONARD
from sonard_client.judge import makes
from test_judge_makes_with_sonard import PROFILES

PRINT_MAKES = SONARD.parents[1] / "tests/docs/print_makes"
JUDGED = {*PROFILES.values(), "oculus-m1200d"}  # test_judge_with_sonard has the drivers of an Oculus
READERS, DRIVERS = "clients/python/sonard_client/judge/makes", "tests/judge/make_drivers.py"


def products():
    """Returns {title of a make: names of its products}."""
    lines = subprocess.run([PRINT_MAKES], capture_output=True, text=True, check=True).stdout.splitlines()
    return {title: names.split() for title, _, names in (line.partition(":") for line in lines)}


class EveryMake(unittest.TestCase):
    def test_every_make_has_a_reader(self):
        for title, names in products().items():
            with self.subTest(title):
                unread = [name for name in names if makes.make_of(name) is None]
                self.assertEqual(unread, [], f"the judge does not read the pings of {title}: add {READERS}/<make>.py, and its row to MAKES "
                                             "in __init__.py there")

    def test_every_make_is_judged_with_a_small_driver(self):
        for title, names in products().items():
            with self.subTest(title):
                self.assertTrue(JUDGED & set(names), f"no test judges a driver of {title}: add a function to {DRIVERS}, and a product to "
                                                     "PROFILES in clients/python/tests/test_judge_makes_with_sonard.py")

    def test_readers_are_of_products(self):
        every = [name for names in products().values() for name in names]
        for make in makes.MAKES:
            with self.subTest(make.profiles):
                self.assertEqual([prefix for prefix in make.profiles if not any(name.startswith(prefix) for name in every)], [],
                                 "no product has this prefix")

    def test_the_files_exist(self):
        for place in (READERS, DRIVERS):
            self.assertTrue((ROOT / place).exists(), place)


if __name__ == "__main__":
    unittest.main()
