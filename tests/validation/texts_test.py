#!/usr/bin/env python3
"""Tests the texts of docs/validation.md and its tables, and that their render files are valid. Needs no matplotlib or numpy."""

import contextlib
import functools
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest
from unittest import mock

import coverage
import oracles
import parts
import summary
import validate
from texts import chapters_of, mark, table, tables_of, with_seeds, with_step

sys.path.insert(0, str(oracles.SCRIPT.parent))
import oracle_table  # noqa: E402

BUILD = pathlib.Path(os.environ.get("SONARD_BUILD", "build/release"))
SONARD, SONARD_BENCH = BUILD / "daemon/sonard", BUILD / "tests/bench/sonard_bench"
SCENES = pathlib.Path(__file__).resolve().parent / "scenes"
SWEPT = "name: a\nsweep:   # two\n  mode: [2, 1]  # one, two\n  yaw: [0, 15]\n\nscene: x\n"


class Texts(unittest.TestCase):
    def test_a_sweep_with_seeds_repeats_every_step_with_every_seed(self):
        text = with_seeds(SWEPT, 3)
        self.assertIn("  mode: [2, 2, 2, 1, 1, 1]\n", text)
        self.assertIn("  yaw: [0, 0, 0, 15, 15, 15]\n", text)
        self.assertIn("  seed: [1, 2, 3, 1, 2, 3]\nseed: $seed\n", text)
        self.assertTrue(text.endswith("scene: x\n"))

    def test_a_sweep_is_read_step_by_step(self):
        self.assertIn("  mode: [1]\n  yaw: [15]\n", with_step(SWEPT, 1))
        self.assertEqual(with_step("name: b\nscene: x\n", 0), "name: b\nscene: x\n")

    def test_chapters_are_found_again(self):
        text = f"title\n{mark('tank')}\n## Tank\n\n{mark('cost')}\ncost\n"
        self.assertEqual(chapters_of(text), {"tank": "## Tank\n\n", "cost": "cost\n"})
        self.assertEqual(chapters_of(""), {})

    def test_tables_are_written_and_read(self):
        text = table(["a", "b"], [[1, "2 dB"]])
        self.assertEqual(text, "| a | b |\n|---|---|\n| 1 | 2 dB |\n")
        self.assertEqual(tables_of(f"x\n\n{text}\nbetween\n\n| c | |\n|---|---|\n| \\|d\\| |  |\n"),
                         [(["a", "b"], [["1", "2 dB"]]), (["c", ""], [["|d|", ""]])])


class Oracles(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def record(self, numbers, holds=True):
        lines = [json.dumps({"test": "a.b", "oracle": n, "what": "w", "kind": "equal", "expected": 1.0, "measured": 1.0 if holds else 2.0,
                             "tolerance": 0.1, "unit": "dB", "pass": holds}) for n in numbers]
        pathlib.Path(self.folder.name, "a.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")

    def test_without_a_run_there_is_no_chapter(self):
        self.assertIsNone(oracles.chapter(None))
        self.assertIsNone(oracles.chapter(self.folder.name))

    def test_an_incomplete_run_is_refused_unless_partial_is_given(self):
        self.record([9, 46])
        with self.assertRaisesRegex(RuntimeError, "2 of 46"):
            oracles.chapter(self.folder.name)
        self.assertIn("2 of 46", oracles.chapter(self.folder.name, partial=True))

    def test_a_whole_run_is_accepted_unless_an_oracle_failed(self):
        self.record(range(1, 47))
        text = oracles.chapter(self.folder.name)
        self.assertNotIn("Not a whole run", text)
        self.assertIn("| 46 |", text)
        self.record(range(1, 47), holds=False)
        with self.assertRaisesRegex(RuntimeError, "out of tolerance"):
            oracles.chapter(self.folder.name)


class Chapters(unittest.TestCase):
    def test_the_coverage_report_is_read(self):
        report = ("sonar beams range m rows bins within 1dB worst dB mean dB\n"
                  "Oculus M1200d high mode            512    10.00    437    159374  100.000 %     +0.49    -0.012\n")
        self.assertEqual(coverage.rows_of(report), [["Oculus M1200d high mode", "512", "10.00 m", "437", "159,374", "100.000 %",
                                                     "+0.49 dB", "-0.012 dB"]])
        for wrong in ("head\n", "head\nsomething else\n"):
            with self.assertRaises(RuntimeError):
                coverage.rows_of(wrong)

    def test_costs_of_parts_are_differences_of_thread_times(self):
        def result(rate, trace, scatter, had=()):
            return {"pings_per_second": rate, "thread_ms": {"trace": trace, "scatter": scatter}, "parts_had": had}

        rows = parts.rows_of("demo", result(25, 10, 20, ["leak"]), {
            "multipath": (result(25, 10, 20), result(12.5, 40, 25)), "leak": (result(26, 10, 19), result(25, 10, 20)),
            "volume": (result(25, 10, 20), result(24, 10, 23))})
        self.assertEqual(rows[0], ["demo", "default", "", "25.0", "", "30.0"])
        self.assertEqual(rows[1], ["demo", "multipath", "off", "12.5", "25.0", "+35.0"])
        self.assertEqual(rows[2], ["demo", "leak", "on", "25.0", "26.0", "+1.0"])
        self.assertEqual(rows[3], ["demo", "volume", "on, but no data for it", "24.0", "25.0", "+3.0"])


class Summary(unittest.TestCase):
    def chapters(self):
        """Returns the minimum of every chapter that the summary reads."""
        return {
            "tank": table(["", "measured", "predicted"], [["HF", "-24.44", "-24.06"], ["LF", "-22.47", "-22.11"]])
                    + "\n" + table(["validation", "calibration", "total", "predicted"], [["LF", "HF", "+2.63 dB", "+2.60 dB"]]),
            "two-cylinders": table(["", "lying, nearest point at 2.000 m", "upright, nearest point at 3.000 m"],
                                   [["default", "2.060 m", "3.010 m"]])
                             + "\n" + table(["", "beside", "within", ""], [["raster, 228 rows", "ray, 228 rays", "43 %", "3.5 dB"]]),
            "pitched-sonar": table(["", "far", "", "near", ""], [["raster, 11 rows", "84.0 %", "85.2 %", "56.4 %", "67.9 %"],
                                                                 ["ray, 228 rays", "1.3 %", "0.8 %", "0.0 %", "0.0 %"]]),
            "local-search": table(["", "mean", "", "within", "worst"],
                                  [["default", "closed form", "", "100.00 %", "+0.1 dB"],
                                   ["300 fixed rays, our pulse, beams and law", "closed form", "", "77.92 %", "-26.2 dB"]]),
            "differences": table(["angle", "measured", "expected"], [["5", "-10.61 dB", "-10.60 dB"]]),
            "coverage": table(["sonar", "", "", "", "", "", ""], [["M1200d", "", "", "", "", "100.000 %", "+0.49 dB"]]),
            "capture": table(["statistic", "captured", "sonard", "off", ""], [["mean", "50", "97", "+94 %", "its place"]])
                       + "\n0 of 1 within 15 %.\n",
            "tell-apart": table(["", "right", ""], [["unseen sector, texture", "59.7", "55.8 to 63.7"],
                                                           ["another bed, unseen sector, texture", "62.6", "58 to 67"],
                                                           ["control", "46.8", ""]])
                          + "\n- unseen sector, texture: 0 to 31 70.1 %; 32 to 159 72.4 %\n\n"
                          + table(["feature"], [["kurtosis"]]) + "\n" + table(["feature"], [["samples of neighbouring beams"]]),
            "oracles": table(oracle_table.HEAD, [["3", "level: far", "0 dB", "0.1", "±0.3", "yes"]]),
            "cost": "Ours, no GPU: test. By `x`\n\n" + table(["", "", "", "", "", "rate"], [
                [name, "", "", "", "", "1 Hz"] for name in ("default: surface cells", "paper mode, 300 rays", "P25, ray, 300 rays")]),
        }

    def oracles_of(self, *rows):
        return {"oracles": table(oracle_table.HEAD, rows)}

    def test_the_page_of_the_tree_has_every_chapter(self):
        """Compares headings and title; the page's values come from the run that wrote it."""
        def names(page):
            return [line for line in page.splitlines() if line.startswith("#")]

        page = validate.PAGE.read_text(encoding="utf-8")
        self.assertEqual(names(page), names(summary.page_of(self.chapters())))
        self.assertTrue(page.startswith(summary.TITLE))
        self.assertNotIn("Out of tolerance", page)
        self.assertLess(len(page.split()), 840, "longer than one page")

    def test_tables_and_summary_are_written_and_read_again(self):
        with tempfile.TemporaryDirectory() as folder:
            page, tables = pathlib.Path(folder, validate.PAGE.name), pathlib.Path(folder, "tables")
            tables.mkdir()
            (tables / summary.PICTURE_FILE).write_bytes(b"picture")
            validate.write_tables(tables, self.chapters())
            read = chapters_of(validate.tables_in(tables).read_text(encoding="utf-8"))
            self.assertEqual({name: text.strip() for name, text in read.items()},
                             {name: text.strip() for name, text in self.chapters().items()})
            self.assertTrue(validate.write_summary(page, tables, read))
            self.assertEqual(page.read_text(encoding="utf-8"), summary.page_of(read))
            self.assertEqual((page.with_suffix("") / summary.PICTURE_FILE).read_bytes(), b"picture")

    def test_the_summary_has_the_aim_for_the_near_floor(self):
        self.assertIn("| the same, near floor only | guessing | 72.4 % (most by: samples of neighbouring beams) | "
                      "aim: at most 65 % |", summary.page_of(self.chapters()))

    def test_without_a_chapter_the_summary_is_kept(self):
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder, validate.PAGE.name)
            page.write_text("before", encoding="utf-8")
            without = {name: text for name, text in self.chapters().items() if name != "capture"}
            with contextlib.redirect_stdout(io.StringIO()) as printed:
                self.assertFalse(validate.write_summary(page, pathlib.Path(folder), without))
            self.assertIn("the tables lack capture", printed.getvalue())
            self.assertEqual(page.read_text(encoding="utf-8"), "before")

    def test_a_summary_that_is_not_written_is_an_error(self):
        with tempfile.TemporaryDirectory() as folder:
            tables, page = pathlib.Path(folder), pathlib.Path(folder, "page")
            command = [sys.executable, "-B", validate.__file__, "--summary", "--tables", tables, "--page", page]
            without = subprocess.run(command, capture_output=True, text=True, check=False)
            self.assertEqual((without.returncode, without.stderr),
                             (1, f"validate.py: no {validate.tables_in(tables)}: run validate.sh without --summary first\n"))
            validate.write_tables(tables, {"tank": "text\n"})
            self.assertEqual(subprocess.run(command, capture_output=True, check=False).returncode, 1)
            validate.write_tables(tables, self.chapters())
            self.assertEqual(subprocess.run(command, capture_output=True, check=False).returncode, 0)

    def test_tables_made_without_a_summary_are_an_error(self):
        runs = types.SimpleNamespace(Sonard=lambda program: types.SimpleNamespace(pings=0))
        for chapters, code in (({"tank": "text\n"}, 1), (self.chapters(), None)):
            makers = {name: functools.partial(str, text) for name, text in chapters.items()}
            with self.subTest(code=code), tempfile.TemporaryDirectory() as folder, mock.patch.dict(sys.modules, runs=runs), \
                    mock.patch.object(validate, "makers_of", lambda *_: makers), contextlib.redirect_stdout(io.StringIO()), \
                    mock.patch.object(sys, "argv", ["validate.py", "--program", "sonard", "--tables", folder,
                                                    "--page", f"{folder}/{validate.PAGE.name}", "--only",
                                                    *(name for name in makers if name != "oracles")]):
                # The table of oracles is copied, because it is not made here.
                validate.write_tables(pathlib.Path(folder), {name: chapters[name] for name in chapters if name == "oracles"})
                end = self.assertRaises(SystemExit) if code else contextlib.nullcontext()
                with end:
                    validate.main()
                if code:
                    self.assertEqual(end.exception.code, code)

    def test_every_oracle_that_is_built_is_in_one_group(self):
        grouped = [n for _, numbers in summary.GROUPS if numbers != "+" for n in numbers]
        self.assertEqual(len(grouped), len(set(grouped)))
        self.assertEqual(set(grouped) | set(oracle_table.NOT_BUILT), set(oracle_table.ORACLES))

    def test_shares_of_tolerances_are_computed(self):
        for expected, measured, tolerance, share in (
                ("141.6 dB", "141.9", "±0.3", 1), ("-50 dB/decade", "-50.15", "±0.3", 0.5), ("0", "0", "exact", 0), ("0", "1", "exact", 1e9),
                ("below 1.000e-04", "5.000e-05", "", 0.5), ("below -30 dB", "-60", "", 0.5), ("below -100 dB", "-inf", "", 0),
                ("at least 0.9", "0.95", "", 0.5), ("at least 100 %", "100", "", 0), ("at least 100 %", "99", "", 1e9),
                ("0 dB", "nan", "±0.2", 1e9)):
            with self.subTest(expected, measured=measured):
                found = summary.share_of_tolerance(expected, measured, tolerance)
                self.assertAlmostEqual(min(found, 1e9), share)

    def test_the_worst_of_a_group_is_shown_and_a_miss_is_stated(self):
        near = ["3", "level: far (worst of 9)", "0 dB", "0.1", "±0.3", "yes"]
        far = ["4", "slope: near", "-40 dB/decade", "-40.3", "±0.2", "NO"]
        page = summary.page_of(self.oracles_of(near))
        self.assertIn("9 measurements. All are within tolerance.", page)
        self.assertIn("| 3-9 | levels and their slopes | far | 0.1 | 0 dB ±0.3 |", page)
        page = summary.page_of(self.oracles_of(near, far, ["13", "corner", "", "", "", "not built"]))
        self.assertIn("10 measurements. **Out of tolerance: 1 rows.**", page)
        self.assertIn("| near | -40.3 | -40 dB/decade ±0.2 |", page)

    def test_chapters_that_are_missing_are_left_out(self):
        page = summary.page_of({name: text for name, text in self.chapters().items() if name == "coverage"})
        self.assertIn("| flat bed, ", page)
        for words in ("tank", "## Oracles", "## Cost", "capture.png"):
            self.assertNotIn(words, page)


class RenderFiles(unittest.TestCase):
    def test_every_scene_of_the_page_renders(self):
        for name in ("tank-rod", "pitched-sonar", "two-cylinders", "flat-sand", "rough-sand", "grazing", "point", "wall"):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                text = with_step((SCENES / f"{name}.yaml").read_text(encoding="utf-8"), 0)
                file = pathlib.Path(folder, f"{name}.yaml")
                file.write_text(text, encoding="utf-8")
                for mode in ("canonical", "raster"):
                    out = pathlib.Path(folder, mode)
                    done = subprocess.run([SONARD, "render", file, "--out", out, "--format", "npy", "--quiet", "--mode", mode,
                                           "--fixed-fan", "4", "--expected-power"], capture_output=True, text=True, check=False)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    self.assertTrue(pathlib.Path(out, "000001_pressure.npy").is_file())

    def test_the_benchmark_times_the_comparison_modes(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "bench.json")
            done = subprocess.run([SONARD_BENCH, "--case", "P1", "--scene", "local-search", "--pings", "1", "--mode", "paper",
                                   "--fixed-fan", "8", "--frequency-sum", "direct", "--json", file],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            result = json.loads(file.read_text(encoding="utf-8"))["results"][0]
            self.assertEqual(result["mode"], "paper")
            self.assertEqual(result["rays"], 8 * 512)
            self.assertGreater(result["thread_ms"]["synthesize"], 0)

    def test_the_benchmark_uses_the_switches_and_adds_missing_parts(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "bench.json")
            done = subprocess.run([SONARD_BENCH, "--case", "P3c", "--scene", "demo", "--pings", "1", "--specular", "off", "--give",
                                   "volume", "--give", "texture", "--give", "crosstalk", "--multipath", "on", "--json", file],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            result = json.loads(file.read_text(encoding="utf-8"))["results"][0]
            self.assertFalse(result["switches"]["specular"])
            self.assertTrue(result["switches"]["multipath"])
            self.assertTrue(result["switches"]["noise"])
            self.assertEqual(result["parts_had"], ["texture", "leak"])  # those of scene and sonar


if __name__ == "__main__":
    unittest.main()
