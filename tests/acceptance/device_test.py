"""Tests sonard with a CUDA device, which is replaced by loops on the CPU behind the same module (tests/cuda/host_module.cpp)."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

from running_sonard import BUILD, ROOT, SONARD

MODULE = BUILD / "tests/cuda/libhost_module.so"
CONFIG = f"""\
world: {{scene: {ROOT}/scenes/l-targets.yaml}}
vehicles: [{{name: rov}}]
sonars: [{{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}}]
"""
LOST = "the CUDA engine stopped: host loops: the device is lost"


class Device(unittest.TestCase):
    def setUp(self):
        self.assertTrue(MODULE.exists(), MODULE)
        self.path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.config = self.path / "sonard.yaml"
        self.config.write_text(CONFIG, encoding="utf-8")

    def sonard(self, *words, lasts=None):
        environment = dict(os.environ, SONARD_CUDA_MODULE=str(MODULE))
        if lasts is not None:
            environment["SONARD_TEST_DEVICE_LASTS"] = str(lasts)
        return subprocess.run([str(SONARD), *map(str, words)], env=environment, capture_output=True, text=True, timeout=300, check=False)

    def render(self, out, engine, lasts=None, batch=1):
        return self.sonard("render", self.config, "--out", self.path / out, "--format", "npy", "--pings", "3", "--quiet",
                           "--engine", engine, "--batch", batch, lasts=lasts)

    def samples(self, out):
        files = sorted((self.path / out).glob("*_samples.npy"))
        self.assertEqual(len(files), 3)
        return [f.read_bytes() for f in files]

    def test_renders_on_the_device(self):
        result = self.render("sound", "cuda")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        side = json.loads((self.path / "sound/000001.json").read_text(encoding="utf-8"))
        self.assertIn("cuda, host loops", json.dumps(side))
        self.samples("sound")

    def test_after_a_failed_device_the_cpu_continues_with_one_line(self):
        self.assertEqual(self.render("cpu", "cpu").returncode, 0)
        result = self.render("lost", "auto", lasts=30)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stderr, f"sonard: {LOST}; from here on the CPU computes\n")
        self.assertEqual(self.samples("lost"), self.samples("cpu"))

    def test_files_name_the_engine(self):
        for out, engine in (("cpu", "cpu"), ("device", "cuda")):
            self.assertEqual(self.render(out, engine, batch=3).returncode, 0)
        made = {"cpu, after a failure": self.samples("cpu"), "cuda, host loops": self.samples("device")}
        self.assertNotEqual(*made.values(), "otherwise this test shows nothing")
        found = set()
        for batch in (1, 2):
            for lasts in (30, 45, 60, 75):
                out = f"lost-{batch}-{lasts}"
                self.assertEqual(self.render(out, "auto", lasts, batch).returncode, 0)
                for i, samples in enumerate(self.samples(out)):
                    side = (self.path / out / f"{i + 1:06}.json").read_text(encoding="utf-8")
                    by = [words for words in made if words in side]
                    self.assertEqual(len(by), 1, side)
                    self.assertEqual(samples, made[by[0]][i], f"{out}, ping {i + 1}")
                    found.add(by[0])
        self.assertEqual(len(found), 2, "the device was never lost between two pings")

    def test_a_failed_device_without_a_fallback_is_exit_code_69(self):
        result = self.render("lost", "cuda", lasts=30)
        self.assertEqual(result.returncode, 69, result.stderr)
        self.assertEqual(result.stderr, f"sonard: {LOST}; use --engine cpu or auto\n")


if __name__ == "__main__":
    unittest.main()
