"""Runs the program for the validation page: pings with `sonard render`, times with `sonard_bench`. It contains no acoustics."""

import json
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np

SCENES = pathlib.Path(__file__).parent / "scenes"


def text_of(scene):
    return (SCENES / f"{scene}.yaml").read_text(encoding="utf-8")


class Ping:
    """A rendered ping: pressure [rows, beams] in uPa, and the whole sidecar."""

    def __init__(self, stem):
        self.about = json.loads(stem.with_suffix(".json").read_text(encoding="utf-8"))
        self.pressure = np.load(stem.with_name(stem.name + "_pressure.npy"))
        self.azimuth = np.array(self.about["beam_azimuth_rad"])
        rows = self.pressure.shape[0]
        self.range = self.about["row_0_m"] + self.about["row_spacing_m"] * np.arange(rows)

    @property
    def power(self):
        return self.pressure.astype(float) ** 2

    def beam_at(self, azimuth_rad=0.0):
        return int(np.argmin(np.abs(self.azimuth - azimuth_rad)))

    @property
    def absorption_db_per_m(self):
        return self.about["water"]["absorption_db_per_m"]

    @property
    def sound_speed_mps(self):
        return self.about["water"]["true_sound_speed_mps"]


class Sonard:
    def __init__(self, program, threads=0):
        self.program = str(program)
        self.bench_program = pathlib.Path(program).parents[1] / "tests/bench/sonard_bench"
        self.threads = threads
        self.pings = 0

    def call(self, *arguments, program=None):
        words = [str(program or self.program), *map(str, arguments)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(words)}\nfailed with {done.returncode}: {done.stderr.strip()}")
        return done.stdout

    def pings_of(self, scene, *arguments, text=None):
        """Yields the pings of a render file one by one, and deletes their files at the end. `text` replaces the file's text."""
        folder = pathlib.Path(tempfile.mkdtemp(prefix="validation-"))
        try:
            file = SCENES / f"{scene}.yaml"
            if text is not None:
                file = folder / f"{scene}.yaml"
                file.write_text(text, encoding="utf-8")
            out = folder / "out"
            self.call("render", file, "--out", out, "--format", "npy", "--quiet", *arguments)
            for sidecar in sorted(out.glob("[0-9]*.json")):
                self.pings += 1
                yield Ping(sidecar.with_suffix(""))
        finally:
            shutil.rmtree(folder)

    def expected(self, scene, *arguments, text=None):
        """Returns the pings with mean power instead of one draw of speckle, and without noise."""
        return list(self.pings_of(scene, "--expected-power", "--noise", "off", *arguments, text=text))

    def coverage(self, scene, *arguments):
        """Returns the result of --report coverage for the first ping, a dict."""
        lines = self.call("render", SCENES / f"{scene}.yaml", "--report", "coverage", *arguments).splitlines()
        words = lines[1].split()
        return {"bins": int(words[-5]), "within_1_db": float(words[-4]), "worst_db": float(words[-2]), "mean_db": float(words[-1])}

    def bench(self, *arguments):
        with tempfile.TemporaryDirectory(prefix="validation-") as folder:
            file = pathlib.Path(folder) / "bench.json"
            self.call("--json", file, *arguments, program=self.bench_program)
            return json.loads(file.read_text(encoding="utf-8"))


def db(power):
    return 10 * np.log10(np.maximum(power, 1e-30))
