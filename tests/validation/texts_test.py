#!/usr/bin/env python3
"""The texts behind docs/validation.md, and that its render files can be rendered. Needs neither matplotlib nor numpy."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import coverage
import oracles
import parts
from texts import chapters_of, mark, table, with_seeds, with_step

SONARD = pathlib.Path(os.environ.get("SONARD_BUILD", "build/release")) / "daemon" / "sonard"
SCENES = pathlib.Path(__file__).resolve().parent / "scenes"
SWEPT = "name: a\nsweep:   # two\n  mode: [2, 1]  # one, two\n  yaw: [0, 15]\n\nscene: x\n"


class Texts(unittest.TestCase):
    def test_a_sweep_with_seeds_does_every_step_with_every_seed(self):
        text = with_seeds(SWEPT, 3)
        self.assertIn("  mode: [2, 2, 2, 1, 1, 1]\n", text)
        self.assertIn("  yaw: [0, 0, 0, 15, 15, 15]\n", text)
        self.assertIn("  seed: [1, 2, 3, 1, 2, 3]\nseed: $seed\n", text)
        self.assertTrue(text.endswith("scene: x\n"))

    def test_one_step_of_a_sweep(self):
        self.assertIn("  mode: [1]\n  yaw: [15]\n", with_step(SWEPT, 1))
        self.assertEqual(with_step("name: b\nscene: x\n", 0), "name: b\nscene: x\n")

    def test_chapters_are_found_again(self):
        text = f"title\n{mark('tank')}\n## Tank\n\n{mark('cost')}\ncost\n"
        self.assertEqual(chapters_of(text), {"tank": "## Tank\n\n", "cost": "cost\n"})
        self.assertEqual(chapters_of(""), {})

    def test_tables(self):
        self.assertEqual(table(["a", "b"], [[1, "2 dB"]]), "| a | b |\n|---|---|\n| 1 | 2 dB |\n")


class Oracles(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def record(self, numbers, holds=True):
        lines = [json.dumps({"test": "a.b", "oracle": n, "what": "w", "kind": "equal", "expected": 1.0, "measured": 1.0 if holds else 2.0,
                             "tolerance": 0.1, "unit": "dB", "pass": holds}) for n in numbers]
        pathlib.Path(self.folder.name, "a.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")

    def test_no_run_no_chapter(self):
        self.assertIsNone(oracles.chapter(None))
        self.assertIsNone(oracles.chapter(self.folder.name))

    def test_part_of_a_run_is_refused_unless_asked_for(self):
        self.record([9, 46])
        with self.assertRaisesRegex(RuntimeError, "2 of 46"):
            oracles.chapter(self.folder.name)
        self.assertIn("2 of 46", oracles.chapter(self.folder.name, partial=True))

    def test_a_whole_run_is_taken_and_one_with_a_miss_is_not(self):
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
        self.assertEqual(rows[3], ["demo", "volume", "on, nothing of it here", "24.0", "25.0", "+3.0"])


class RenderFiles(unittest.TestCase):
    def test_every_scene_of_the_page_renders(self):
        for name in ("tank-rod", "two-cylinders", "flat-sand", "rough-sand", "grazing", "point", "wall"):
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
            done = subprocess.run([SONARD, "bench", "--case", "P1", "--scene", "local-search", "--pings", "1", "--mode", "paper",
                                   "--fixed-fan", "8", "--frequency-sum", "direct", "--json", file],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            result = json.loads(file.read_text(encoding="utf-8"))["results"][0]
            self.assertEqual(result["mode"], "paper")
            self.assertEqual(result["rays"], 8 * 512)
            self.assertGreater(result["thread_ms"]["synthesize"], 0)

    def test_the_benchmark_takes_the_switches_and_gives_what_is_missing(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "bench.json")
            done = subprocess.run([SONARD, "bench", "--case", "P3c", "--scene", "demo", "--pings", "1", "--specular", "off", "--give",
                                   "volume", "--give", "texture", "--give", "crosstalk", "--multipath", "on", "--json", file],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            result = json.loads(file.read_text(encoding="utf-8"))["results"][0]
            self.assertFalse(result["switches"]["specular"])
            self.assertTrue(result["switches"]["multipath"])
            self.assertTrue(result["switches"]["noise"])
            self.assertEqual(result["parts_had"], ["leak"])  # of their own


if __name__ == "__main__":
    unittest.main()
