"""Tests that the generated page shows every item as measured, missed or not run; unknown and malformed records are faults."""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import reliability_table
from record import record

HERE = pathlib.Path(__file__).resolve().parent


def table(folder, *options):
    done = subprocess.run([sys.executable, str(HERE / "reliability_table.py"), folder, *options], capture_output=True, text=True,
                          timeout=60, check=False)
    return done.returncode, done.stdout, done.stderr


class Table(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        os.environ["SONARD_RELIABILITY"] = self.folder.name
        self.addCleanup(os.environ.pop, "SONARD_RELIABILITY")

    def test_missing_items_are_listed_as_not_run(self):
        code, page, said = table(self.folder.name)
        self.assertEqual(code, 0)
        rows = [line for line in page.splitlines() if "| not run |" in line]
        by_hand = reliability_table.read_records(reliability_table.BY_HAND)
        self.assertEqual(len(rows), sum(len(r) for r in reliability_table.items().values()) - len(by_hand))
        self.assertIn(by_hand["driver-restart"]["figure"], page)
        self.assertNotIn("driver-restart", said)
        self.assertIn("load-dropped", said)
        self.assertEqual(table(self.folder.name, "--strict")[0], 1)

    def test_no_item_is_missing_when_all_are_recorded(self):
        for rows in reliability_table.items().values():
            for key, _, bound in rows:
                if key not in reliability_table.read_records(reliability_table.BY_HAND):
                    record(key, "1", bound, True, "x")
        code, page, said = table(self.folder.name, "--strict")
        self.assertEqual((code, said), (0, ""))
        self.assertIn("| 5,000: the importer", page)
        self.assertIn("| 50,000: each is", page)

    def test_each_item_is_recorded_by_a_program_that_the_long_checks_run(self):
        tests = HERE.parent
        steps = "".join((tests / script).read_text(encoding="utf-8") for script in ("tools/long_checks.sh", "load/load.sh"))
        listed = {key for rows in reliability_table.items().values() for key, _, _ in rows if not key.startswith("fuzz-")}
        listed -= set(reliability_table.read_records(reliability_table.BY_HAND))
        recorded = {"asan", "tsan"}  # by sanitized_tests.sh with that argument
        for source in [*tests.glob("*/*.py"), *tests.glob("load/*.cpp")]:
            text = source.read_text(encoding="utf-8")
            if source.parent == HERE or not re.search(r'"tests/reliability"|"reliability"|load_case.hpp', text):
                continue
            items = set(re.findall(r'"([a-z0-9-]+)"', text)) & listed
            items |= set(re.findall(r'\b(?:record|keep|kept)\(\s*"([a-z0-9-]+)"', text))
            program = "load_test" if source.suffix == ".cpp" else source.stem.removesuffix("_test")
            self.assertTrue(not items or re.search(rf"(?<![a-z_]){program}(?![a-z])", steps), f"no step of the long checks runs {source}")
            recorded |= items
        self.assertEqual(recorded, listed)

    def test_measured_values_are_shown_with_the_machine(self):
        self.assertTrue(record("load-dropped", "0.02 % of 57,600 | 3", "at most 0.5 %", True, "build/x --only load"))
        code, page, _ = table(self.folder.name)
        self.assertEqual(code, 0)
        row = next(line for line in page.splitlines() if "0.02 %" in line)
        self.assertIn("| yes |", row)
        self.assertIn("57,600 \\| 3", row)
        self.assertTrue(row.endswith("| 1 |"), row)
        self.assertIn("1. `build/x --only load`, machine ", page)
        self.assertIn("Machines: 1: ", page)

    def test_fuzz_targets_that_passed_share_a_row(self):
        for name, bound in (("mavlink", "500000"), ("mcap", "500,000"), ("mesh", "1,000")):
            record(f"fuzz-{name}", "500000", bound, True, f"tests/tools/fuzz.sh {name}")
        record("fuzz-pcap", "17", "500,000", False, "tests/tools/fuzz.sh pcap")
        code, page, said = table(self.folder.name)
        self.assertEqual(code, 1)
        self.assertIn("fuzz-pcap: 17", said)
        self.assertIn("| 2 fuzz targets: inputs without a fault each: `mavlink`, `mcap` | 500,000 | 500000 | yes |", page)
        self.assertIn("| fuzz target: inputs without a fault: `mesh` | 1,000 | 500000 | yes |", page)
        self.assertIn("| fuzz target pcap: inputs without a fault | 500,000 | 17 | **NO** |", page)
        self.assertIn("| fuzz target scene: inputs without a fault | 500,000 | not run |", page)

    def test_a_missed_bound_is_a_fault(self):
        record("load-dropped", "1.2 %", "at most 0.5 %", False, "x")
        code, page, said = table(self.folder.name)
        self.assertEqual(code, 1)
        self.assertIn("**NO**", page)
        self.assertIn("load-dropped: 1.2 %", said)

    def test_unknown_and_malformed_records_are_faults(self):
        record("load-droped", "0", "0", True, "x")
        code, _, said = table(self.folder.name)
        self.assertEqual(code, 1)
        self.assertIn("unknown item load-droped", said)
        pathlib.Path(self.folder.name, "cut.json").write_text(json.dumps({"item": "cycles"}), encoding="utf-8")
        code, _, said = table(self.folder.name)
        self.assertEqual(code, 2)
        self.assertIn("without bound, command", said)

    def test_the_page_has_a_row_for_every_item(self):
        _, page, _ = table(self.folder.name)
        rows = [line.split("|")[1].strip() for line in page.splitlines() if line.startswith("| ")]
        for items in reliability_table.items().values():
            for key, what, _ in items:
                self.assertIn(reliability_table.cell(what), rows, key)

    def test_without_a_folder_no_file_is_written(self):
        del os.environ["SONARD_RELIABILITY"]
        self.assertFalse(record("load-dropped", "1.2 %", "at most 0.5 %", False, "x"))
        self.assertEqual(list(pathlib.Path(self.folder.name).iterdir()), [])
        os.environ["SONARD_RELIABILITY"] = self.folder.name


if __name__ == "__main__":
    unittest.main()
