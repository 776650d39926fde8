#!/usr/bin/env python3
"""The texts behind docs/validation.md, and that its render files can be rendered. Needs neither matplotlib nor numpy."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

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


if __name__ == "__main__":
    unittest.main()
