"""Tests the page of the CUDA engine's benchmarks: its verdicts, and all steps that make it, with host loops as the device."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import write_gpu_benchmarks

TIMES = {"median_ms": 2.0, "p99_ms": 4.0}
STAGES = {s: 0.1 for s in ("cull", "build cells", "specular", "multipath", "trace", "scatter", "synthesize", "noise", "form beams", "receive",
                           "frame")}


def result(case, engine, rate):
    return {"case": case, "scene": "local-search", "description": case + " described", "engine": engine, "pings_per_second": rate,
            "median_ms": 1e3 / rate, "p90_ms": 2e3 / rate, "cold_ms": 5.0, "thread_ms": STAGES}


def report(reference):
    rates = [{"case": "P1", "threads": 4, "batch": b, "pings_per_second": r, "processor_ms": 0.2, "device_ms": 0.15}
             for b, r in ((1, 900), (8, 4000), (32, 5001))]
    return {"processor": "test", "results": [result("P1", "cuda, H200", 2000), result("P3d", "cuda, H200", 39), result("P2", "cpu", 50)],
            "device": {"name": "H200", "rates": rates, "reference": reference}, "latency": {"latency": TIMES},
            "hashes": [{"case": "P1", "same": False}]}


class Page(unittest.TestCase):
    def test_verdicts_are_those_of_the_figures(self):
        page = write_gpu_benchmarks.page(report({"ms": 30.0, "on_this_device": True, "ratio": 150.0}),
                                         {"facts": {"driver": "580.1"}, "distances": "1: relative L2 1e-3"})
        lines = page.splitlines()
        self.assertIn("| P1 | 4 | 1 | 900 | **missed** | 1.111 | 0.200 | 0.150 |", lines)
        self.assertIn("| P1 | 4 | 8 | 4000 | holds | 0.250 | 0.200 | 0.150 |", lines)
        self.assertIn("| P1 | 4 | 32 | 5001 | goal | 0.200 | 0.200 | 0.150 |", lines)
        self.assertTrue(any(l.startswith("| P3d ") and "| **missed** |" in l for l in lines))
        self.assertFalse(any(l.startswith("| P2 ") for l in lines))
        for words in ("P2: not for the device", "| driver | 580.1 |", "150 times the public reference code on this device (30.0 ms per frame): holds",
                      "p99 4.00 ms", "**different bytes**", "1: relative L2 1e-3"):
            self.assertIn(words, page)

    def test_a_ratio_that_was_not_measured_gives_no_verdict(self):
        page = write_gpu_benchmarks.page(report({"ms": 36.0, "on_this_device": False, "ratio": 5000.0}), {"facts": {}})
        self.assertIn("P11 is not measured", page)
        self.assertNotIn("P11: ", page)

    @unittest.skipUnless("SONARD_BENCH" in os.environ, "SONARD_BENCH names the program")
    def test_all_steps_with_host_loops(self):
        with tempfile.TemporaryDirectory() as folder:
            found, page = pathlib.Path(folder), pathlib.Path(folder) / "page"
            bench = [os.environ["SONARD_BENCH"], "--engine", "cuda", "--scene", "demo", "--pings", "2", "--threads", "1"]
            for cases, name in ((["--case", "P3c"], "single"), (["--case", "P10", "--reference-ms", "30"], "batches")):
                subprocess.run([*bench, *cases, "--json", found / f"{name}.json"], check=True, timeout=600, stdout=subprocess.DEVNULL)
            (found / "facts.txt").write_text("driver=none\n", encoding="utf-8")
            (found / "memcheck.txt").write_text("x\n========= ERROR SUMMARY: 0 errors\n", encoding="utf-8")
            (found / "cuda_seam_test.txt").write_text("[  PASSED  ] 2 tests.\n", encoding="utf-8")
            subprocess.run([sys.executable, "-B", write_gpu_benchmarks.__file__, found, page], check=True)
            text = page.read_text(encoding="utf-8")
            self.assertIn("| device | host loops |", text)
            self.assertIn("30.0 ms per frame", text)
            self.assertEqual(text.count("| P3a |"), 2, "as many sizes of a batch as two pings fill")
            for row in ("| driver | none |", "| cuda_seam_test | [  PASSED  ] 2 tests. |", "| compute-sanitizer initcheck | not run |",
                        "| compute-sanitizer memcheck | ERROR SUMMARY: 0 errors |"):
                self.assertIn(row, text)
            device = json.loads((found / "batches.json").read_text(encoding="utf-8"))["device"]
            self.assertTrue(all(r["device_ms"] > 0 and r["processor_ms"] > 0 for r in device["rates"]))


if __name__ == "__main__":
    unittest.main()
