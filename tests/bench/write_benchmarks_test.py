"""Tests that the pages of benchmarks agree with the results: verdicts, missing parts, and pictures that are valid XML."""

import re
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from tempfile import TemporaryDirectory

import write_benchmarks


def result(case, threads, rate):
    return {"case": case, "scene": "local-search", "threads": threads, "description": case + " described", "engine": "cpu, avx512, 2 threads, Embree",
            "triangles": 202692, "pings_per_second": rate, "median_ms": 1e3 / rate, "min_ms": 900 / rate, "processor_ms": 5.0,
            "thread_ms": {"trace": 3.34, "scatter": 3.8, "frame": 0.0}, "switches": {"side_lobes": True}}


TIMES = {"min_ms": 1.0, "median_ms": 2.0, "p90_ms": 3.0, "p95_ms": 3.5, "p99_ms": 4.0, "max_ms": 5.0}


class Stages(unittest.TestCase):
    def test_stages_are_named_as_in_the_program(self):
        header = (Path(__file__).resolve().parents[2] / "core/pipeline/ping_engine.hpp").read_text(encoding="utf-8")
        enumerators = re.search(r"enum class Stage \{([^}]*), stages \};", header)[1].split(", ")
        names = re.findall(r'"([^"]*)"', re.search(r"stage_names\{([^}]*)\};", header)[1])
        self.assertEqual(names, [name.strip().replace("_", " ") for name in enumerators])
        self.assertLessEqual(set(write_benchmarks.FLOOR), set(names))


class Page(unittest.TestCase):
    def test_verdicts_are_those_of_the_figures(self):
        report = {"processor": "test", "results": [result("P1", 1, 100), result("P1", 2, 460), result("P3a", 2, 39)]}
        page = write_benchmarks.page(report)
        row = {line.split(" | ")[0]: line for line in page.splitlines() if line.startswith("| P") and "described" in line}
        self.assertIn("| 460 |", row["| P1"])
        self.assertTrue(row["| P1"].endswith("goal |"))
        self.assertTrue(row["| P3a"].endswith("**missed** |"))
        self.assertIn("in multiples of the paper's 0.3 Hz: P1, 1 thread: 333; P1, 2 threads: 1533.", page)
        tables = write_benchmarks.tables(report)
        self.assertIn("50 %", tables, "1.9 ms of the prototype against 3.8")
        self.assertIn("| P1, 1 thread: P1 described | 100.0 | 333 times the paper's |", tables)

    def test_rates_without_side_lobes_are_marked(self):
        report = {"processor": "test", "results": [result("P1", 2, 80)]}
        self.assertNotIn("side lobes off", write_benchmarks.page(report))
        report["results"][0]["switches"] = {"side_lobes": False}
        self.assertRegex(write_benchmarks.page(report), r"### avx512: test, .*; side lobes off\n")

    def test_first_pings_hold_by_time_and_by_ratio(self):
        for late, holds, verdict in ((-20.0, True, "| holds |"), (60.0, True, "**missed**"), (10.0, False, "**missed**")):
            report = {"processor": "test", "results": [result("P1", 2, 80)],
                      "first_pings": {"settings": 144, "threads": 2, "first": TIMES, "beyond_two_periods_ms": late, "slowest": "30 m",
                                      "median_ratio": 1.5, "holds": holds}}
            row = next(line for line in write_benchmarks.page(report).splitlines() if line.startswith("| P14"))
            self.assertIn(f"at most {max(late, 0):.0f} ms beyond two periods (30 m)", row)
            self.assertIn(verdict, row)

    def test_the_page_has_the_demos_and_the_tables_all_products(self):
        fields = {"make": "an ARIS", "threads": 2, "on_request": False, "rate_hz": 12.0, "beams": 128, "rows": 800, "range_m": 3.4, "pings": 36,
                  "processor_ms": 9.25, "latency": TIMES, "skipped_ticks": 0, "demo": True, "profile": "aris-3000"}
        report = {"processor": "test", "results": [result("P1", 2, 80)],
                  "demos": [fields, fields | {"rate_hz": 15.0, "skipped_ticks": 4}, fields | {"profile": "aris-1200", "demo": False}]}
        page = [line for line in write_benchmarks.page(report).splitlines() if line.startswith("| P0")]
        self.assertEqual(len(page), 2)
        self.assertIn("an ARIS (aris-3000, 12 Hz)", page[0])
        self.assertIn("median 2.0 ms, p95 3.5 ms; 9.2 processor ms; 0 of 36 ticks skipped | none skipped |  | holds |", page[0])
        self.assertIn("4 of 40 ticks skipped | none skipped |  | **missed** |", page[1])
        self.assertIn("| aris-1200 | 12 Hz | 128 | 800 | 3.4 | 2.0 | 3.5 | 9.2 | 0 of 36 ticks skipped |", write_benchmarks.tables(report))

    def test_all_results_are_written(self):
        report = {"processor": "test", "load_average": 5.5, "results": [result("P1", 2, 80)],
                  "latency": {"rows": 437, "threads": 2, "triggers": 200, "latency": TIMES},
                  "clients": [{"clients": 10, "pings_per_second": 40.0, "dropped": 1, "sender_share": 0.1}],
                  "cold": [{"case": "P1", "threads": 2, "cold": TIMES, "warm": TIMES, "new_tiles": 0.9}],
                  "objects": {"objects": 100, "place": TIMES, "added": TIMES},
                  "side_lobes": [{"case": "P3a", "with": TIMES, "without": TIMES, "ratio": 1.23}],
                  "hashes": [{"case": "P1", "same": False, "sha256": "0123456789abcdef0"}],
                  "empty_bins": [{"case": "P1", "rays": 300, "rows": 394, "bins": 1000, "empty_share": 0.31}],
                  "ratios": [{"name": "slow / fast", "slow_ms": 100.0, "fast_ms": 1.0, "ratio": 100.0, "least": 500.0,
                              "difference": 0.0, "holds": False}],
                  "curves": [{"name": "rows", "case": "P3a", "points": [{"x": 200, "median_ms": 3.0}, {"x": 400, "median_ms": 5.0}]}]}
        with TemporaryDirectory() as folder:
            (Path(folder) / "tables").mkdir()
            write_benchmarks.write(report, Path(folder), Path(folder) / "tables")
            page, tables = (write_benchmarks.file_of(where, write_benchmarks.NAME).read_text(encoding="utf-8")
                            for where in (Path(folder), Path(folder) / "tables"))
            for svg in ("benchmarks-rates.svg", "benchmarks-curves.svg"):
                self.assertTrue(ElementTree.parse(Path(folder) / svg).getroot().tag.endswith("svg"))
        for words in ("p99 4.00 ms", "median ratio +23 % |  | +10 % | **missed** |", "1 dropped | 40 %, no drop | 15 % | **missed** |", "**different bytes**",
                      "the next ping 2.0 ms | 500 ms | 60 ms | goal |", "before the run 5.5"):
            self.assertIn(words, page)
        for words in ("31.000 %", "| 500 |", "400: 5.00 ms"):
            self.assertIn(words, tables)

    def test_a_knee_is_found_where_the_slope_changes(self):
        of = lambda costs: [{"x": 2 ** i, "median_ms": ms, "thread_ms": {"trace": 1.0, "scatter": ms}} for i, ms in enumerate(costs)]
        before, knee, after = write_benchmarks.exponents(of([4, 4, 4, 8, 16, 32]))
        self.assertEqual([round(before, 6), knee, round(after, 6)], [0, 2, 1])
        steady = write_benchmarks.exponents(of([1, 2.1, 3.9, 8, 16]))
        self.assertIsNone(steady[1])
        self.assertAlmostEqual(steady[0], 1, places=1)
        chapter = "\n".join(write_benchmarks.growth(
            {"processor": "test", "results": [result("P1", 1, 80)],
             "curves": [{"name": "rows", "case": "P3a", "points": of([4, 4, 4, 8, 16, 32])}]}))
        self.assertIn("| rows: P3a | 1 to 32 | 250 to 31 | 0.00, from 4 on 1.00 | none; then scatter 4.0 to 32.0 |", chapter)

    def test_curves_alone_replace_their_chapter(self):
        report = {"processor": "test", "results": [result("P1", 1, 80)],
                  "curves": [{"name": "rows", "case": "P3a", "points": [{"x": 200, "median_ms": 3.0}, {"x": 400, "median_ms": 5.0}]}]}
        with TemporaryDirectory() as name:
            file = write_benchmarks.file_of(Path(name), write_benchmarks.NAME)
            file.write_text(f"# Benchmarks\n\n## How times grow\n\nold\n\n{write_benchmarks.PEER}\n\nby hand\n", encoding="utf-8")
            write_benchmarks.write_curves(report, Path(name))
            page = file.read_text(encoding="utf-8")
            self.assertIn("| rows: P3a | 200 to 400 | 333 to 200 | 0.74 |", page)
            self.assertTrue(page.endswith(f"\n\n{write_benchmarks.PEER}\n\nby hand\n"))
            self.assertNotIn("\nold\n", page)
            (Path(name) / "tables").mkdir()
            write_benchmarks.write(report, Path(name), Path(name) / "tables")
            whole = file.read_text(encoding="utf-8")
        self.assertIn("by hand", whole, "a whole run keeps the chapter that is written by hand")
        self.assertEqual(whole.count("## How times grow"), 1)

    def test_threads_and_sonars_have_a_table_each(self):
        report = {"processor": "test", "results": [result("P1", 2, 80)],
                  "threads": [{"case": "P1", "description": "P1 described", "threads": n, "pings_per_second": 50.0 * n} for n in (1, 2)],
                  "sonars": [{"sonars": 8, "threads": 2, "total": 160.0, "lowest": 18.0, "highest": 24.0}]}
        tables = write_benchmarks.tables(report)
        for words in ("| case | what | 1 thread | 2 threads |", "| P1 | P1 described | 50 | 100 (2.00) |",
                      "| 8 | 2 | 160 | 18.0 | 24.0 | 0.75 |"):
            self.assertIn(words, tables)

    def test_instruction_sets_are_columns_of_one_table(self):
        sets = [{"processor": "test", "results": [dict(result("P1", 2, rate), engine=f"cpu, {name}, 2 threads, Embree")]}
                for name, rate in (("avx2", 100), ("portable", 40))]
        chapter = write_benchmarks.instruction_sets(sets)
        self.assertIn("| case | what | avx2 | portable |", chapter)
        self.assertIn("| P1 | P1 described | 100 | 40 (2.50) |", chapter)
        self.assertIn("| P1 | portable | 3.80 | 3.34 |", chapter)
        page = write_benchmarks.tables({"processor": "test", "results": [result("P1", 2, 260)]})
        once = write_benchmarks.with_sets(page, chapter, page)
        self.assertIn(chapter, once)
        again = write_benchmarks.with_sets(once, chapter.replace("| 100 |", "| 120 |"), once)
        self.assertEqual(again, once.replace("| 100 |", "| 120 |"), "the machine's chapter is replaced, and all else is kept")
        other = write_benchmarks.with_sets(page, chapter.replace("### avx2:", "### avx512:"), once)
        self.assertIn(chapter, other, "the chapter of a machine with another instruction set is kept")
        self.assertLess(other.index("### avx2:"), other.index("### avx512:"))
        self.assertEqual(other.count("## Instruction sets\n"), 1)

    def test_rates_of_another_instruction_set_are_kept(self):
        older = {"processor": "old", "date": "2026-01-02", "results": [result("P1", 2, 242)]}
        newer = {"processor": "new", "results": [dict(result("P1", 2, 140), engine="cpu, avx2, 2 threads, Embree")]}
        with TemporaryDirectory() as name:
            folder, tables = Path(name), Path(name) / "tables"
            tables.mkdir()
            for report in (older, newer, newer):
                write_benchmarks.write(report, folder, tables)
            page = write_benchmarks.file_of(folder, write_benchmarks.NAME).read_text(encoding="utf-8")
        self.assertEqual(page.count("### avx512: old, 2026-01-02\n"), 1)
        self.assertEqual(page.count("### avx2: new, "), 1)
        self.assertIn("| P1 | P1 described |  | 242 | 269 | 5.00 | 75 | 400 | holds |", page)
        self.assertIn("| P1 | P1 described |  | 140 | 156 | 5.00 | 75 | 160 | holds |", page)

    def test_a_report_with_one_result_makes_a_page(self):
        self.assertIn("# Benchmarks", write_benchmarks.page({"processor": "test", "results": [result("P2", 1, 10)]}))


if __name__ == "__main__":
    unittest.main()
