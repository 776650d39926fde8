#!/usr/bin/env python3
"""Tests the summary table: a row has its worst figure, failed and missing oracles are faults, those not built are named."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE))
import oracle_table  # noqa: E402
from record import record as record_figure  # noqa: E402


def record(oracle, what="level", expected=0.0, measured=0.1, tolerance=0.3, kind="equal", passed=True):
    return {"oracle": oracle, "what": what, "kind": kind, "expected": expected, "measured": measured,
            "tolerance": tolerance, "unit": "dB", "pass": passed, "test": "A.Test"}


class OracleTableTest(unittest.TestCase):
    def test_the_worst_value_of_an_oracle_is_shown(self):
        records = [record(8, measured=m) for m in (0.1, -0.25, 0.2)]
        records += [record(32, "share", 0.99, m, 0, "at_least") for m in (0.999, 0.992, 1.0)]
        records += [record(18, "error", 1e-4, m, 0, "below") for m in (2e-6, 5e-5)]
        rows = dict(oracle_table.rows_of(records))
        self.assertEqual(rows[8, "level"]["worst"]["measured"], -0.25)
        self.assertEqual(rows[8, "level"]["count"], 3)
        self.assertEqual(rows[32, "share"]["worst"]["measured"], 0.992)
        self.assertEqual(rows[18, "error"]["worst"]["measured"], 5e-5)

    def test_not_a_number_is_the_worst_value(self):
        rows = dict(oracle_table.rows_of([record(8, measured=9), record(8, measured=float("nan"), passed=False)]))
        self.assertNotEqual(rows[8, "level"]["worst"]["measured"], 9)
        self.assertFalse(rows[8, "level"]["pass"])

    def test_missing_and_failed_oracles_are_faults_but_not_those_that_are_not_built(self):
        whole = [record(n) for n in oracle_table.ORACLES if n not in oracle_table.NOT_BUILT]
        self.assertEqual(oracle_table.faults_of(whole, partial=False), [])
        self.assertEqual(len(oracle_table.faults_of(whole[1:], partial=False)), 1)
        self.assertEqual(oracle_table.faults_of(whole[1:], partial=True), [])
        self.assertEqual(len(oracle_table.faults_of(whole + [record(3, measured=1, passed=False)], partial=False)), 1)
        self.assertEqual(len(oracle_table.faults_of(whole + [record(47)], partial=True)), 1)

    def test_rows_are_in_order_with_the_checks_beyond_the_table_last(self):
        table = oracle_table.table_of([record(0, "thin pole"), record(21), record(3)])
        self.assertEqual([row[0] for row in table], ["3", "13", "20", "21", "+"])

    def test_the_command_prints_the_table(self):
        with tempfile.TemporaryDirectory() as folder:
            def run(*more):
                return subprocess.run([sys.executable, str(HERE / "oracle_table.py"), folder, *more],
                                      capture_output=True, text=True, check=False)

            pathlib.Path(folder, "03-A.Test.jsonl").write_text(json.dumps(record(3, "a|b")) + "\n", encoding="utf-8")
            self.assertEqual(run().returncode, 1)
            partial = run("--partial", "--markdown")
            self.assertEqual(partial.returncode, 0)
            self.assertIn("| 3 | level of a point target: a\\|b | 0 dB | 0.1 | ±0.3 | yes |", partial.stdout)
            self.assertIn("1 of 46 oracles have figures", partial.stderr)
            pathlib.Path(folder, "04-A.Test.jsonl").write_text("half a li", encoding="utf-8")
            broken = run()
            self.assertEqual(broken.returncode, 2)
            self.assertIn("04-A.Test.jsonl:1", broken.stderr)

    def test_records_made_in_python_are_read_back(self):
        with tempfile.TemporaryDirectory() as folder, unittest.mock.patch.dict(os.environ, SONARD_ORACLES=folder):
            self.assertTrue(record_figure(3, "level", "equal", 1.0, 1.05, 0.1, "dB", "render/point"))
            self.assertFalse(record_figure(3, "level", "equal", 1.0, float("nan"), 0.1, "dB", "render/point"))
            self.assertFalse(record_figure(3, "error", "below", 1e-4, 1e-3, 0, "", "render/point"))
            self.assertEqual([r["pass"] for r in oracle_table.read_records(folder)], [True, False, False])


if __name__ == "__main__":
    unittest.main()
