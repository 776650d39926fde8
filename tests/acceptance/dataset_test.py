"""Tests `sonard dataset`: the run is killed and repeated, the disk is full, the loader of docs/datasets.md reads the set, and a
model learns from it."""
import hashlib
import json
import pathlib
import re
import resource
import signal
import subprocess
import tempfile
import time
import unittest

from running_sonard import ROOT, SONARD, run

try:
    import numpy as np
    import PIL.Image  # noqa: F401
except ImportError:
    np = None

MINES = (ROOT / "scenes/datasets/mines.yaml").read_text(encoding="utf-8")


def small_job(pings, shard):
    text = re.sub(r"pings: \d+, shard: \d+", f"pings: {pings}, shard: {shard}", MINES)
    return text.replace("beams: 256, rows: 400", "beams: 128, rows: 200")


def shipped_loader():
    """Returns the generator that docs/datasets.md shows first."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs/datasets.md").read_text(encoding="utf-8"), re.S)
    names = {}
    exec(blocks[0], names)  # pylint: disable=exec-used
    return names["pings"]


def features(samples):
    """Returns features of each sample: its level, the level around it, and its difference from the level of its row."""
    level = np.log1p(samples.astype(float))
    around = sum(np.roll(np.roll(level, dy, 0), dx, 1) for dy in range(-2, 3) for dx in range(-2, 3)) / 25
    row = level.mean(1, keepdims=True) + 0 * level
    return np.stack([level, around, around - row, row], -1).reshape(-1, 4)


def learned(x, y):
    """Fits a logistic regression by Newton's method; labelled and other samples have equal total weights. Returns the weight of
    each feature."""
    x = np.column_stack([x, np.ones(len(x))])
    counts = np.where(y, 0.5 / y.mean(), 0.5 / (1 - y.mean()))
    weights = np.zeros(x.shape[1])
    for _ in range(20):
        p = 1 / (1 + np.exp(-x @ weights))
        curvature = (x * (counts * p * (1 - p))[:, None]).T @ x + 1e-6 * np.eye(x.shape[1])
        weights += np.linalg.solve(curvature, x.T @ (counts * (y - p)))
    return weights[:-1]


class Dataset(unittest.TestCase):
    def setUp(self):
        self.path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.job = self.path / "mines.yaml"

    def make(self, out, *more):
        result = run(SONARD, "dataset", self.job, "--out", self.path / out, "--threads", "2", *more, patience_s=300)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stderr

    def test_a_killed_run_loses_nothing_and_repeats_nothing(self):
        self.job.write_text(small_job(12, 2), encoding="utf-8")
        self.make("whole")
        out = self.path / "killed"
        process = subprocess.Popen([str(SONARD), "dataset", str(self.job), "--out", str(out), "--quiet"], stderr=subprocess.PIPE)
        deadline = time.monotonic() + 120
        while not (out / "shard-000000.tar.sha256").exists() and time.monotonic() < deadline and process.poll() is None:
            time.sleep(0.01)
        process.kill()
        process.communicate()
        before = (out / "shard-000000.tar").stat().st_mtime_ns
        self.assertRegex(self.make("killed"), r"\b[1-5] shards were there already")
        self.assertEqual((out / "shard-000000.tar").stat().st_mtime_ns, before)
        for name in ("manifest.json", "coco.json"):
            self.assertEqual((out / name).read_bytes(), (self.path / "whole" / name).read_bytes())
        self.assertEqual([p.name for p in out.glob("*.tmp*")], [])
        for shard in json.loads((out / "manifest.json").read_text())["shards"]:
            self.assertEqual(hashlib.sha256((out / shard["name"]).read_bytes()).hexdigest(), shard["sha256"])
        unreadable = out / "shard-000000.tar.sha256"
        unreadable.unlink()
        unreadable.mkdir()
        refused = run(SONARD, "dataset", self.job, "--out", out)
        self.assertIn(f"{unreadable}: is a folder, not a regular file", refused.stderr)
        self.assertEqual(refused.returncode, 66)

    def test_an_interrupted_run_reports_it_and_continues_with_the_same_pings(self):
        self.job.write_text(small_job(24, 24), encoding="utf-8")
        out = self.path / "interrupted"
        process = subprocess.Popen([str(SONARD), "dataset", str(self.job), "--out", str(out), "--threads", "1"],
                                   stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 120
        while not any(p.stat().st_size for p in out.glob("shard-*.tar.tmp*")) and time.monotonic() < deadline:
            time.sleep(0.002)  # until the first pings are written
        process.send_signal(signal.SIGINT)
        words = process.communicate(timeout=300)[1]
        self.assertRegex(words, r"stopped: \d+ of 24 pings are made and kept.*run the command again")
        self.assertEqual(process.returncode, 130)
        self.assertEqual([p.name for p in out.glob("shard-*.tar*")], [])
        made = int(re.search(r"stopped: (\d+) of", words).group(1))
        self.assertRegex(self.make("interrupted"), rf"\n{24 - made} pings in ")
        self.make("whole")
        self.assertEqual((out / "shard-000000.tar").read_bytes(), (self.path / "whole/shard-000000.tar").read_bytes())
        self.assertEqual(sorted(p.name for p in out.iterdir()), sorted(p.name for p in (self.path / "whole").iterdir()))

    def test_exports_are_written_beside_the_shards(self):
        self.job.write_text(small_job(6, 3), encoding="utf-8")
        result = run(SONARD, "dataset", self.job, "--out", self.path / "set", "--export", "coco", "--split-by", "bed_sed")
        self.assertEqual((result.returncode, 'did you mean "bed_seed"' in result.stderr), (64, True), result.stderr)
        self.assertFalse((self.path / "set").exists(), "a mistake is found before the set is made")
        words = self.make("set", "--export", "coco", "--split", "60,20,20", "--split-by", "bed_seed")
        self.assertRegex(words, r"set/coco: train \d, val \d, test \d pings of \d scenes")
        ids = []
        for split in sorted(p.name for p in (self.path / "set/coco").iterdir() if p.is_dir() and p.name != "annotations"):
            coco = json.loads((self.path / "set/coco/annotations" / f"instances_{split}.json").read_text())
            self.assertEqual({p.name for p in (self.path / "set/coco" / split).iterdir()}, {i["file_name"] for i in coco["images"]})
            ids += [i["id"] for i in coco["images"]]
        self.assertEqual(sorted(ids), [1, 2, 3, 4, 5, 6])
        self.make("set", "--export", "folder")
        result = run(SONARD, "dataset", self.job, "--out", self.path / "set", "--export", "coco")
        self.assertEqual((result.returncode, "remove it" in result.stderr), (64, True), result.stderr)
        result = run(SONARD, "dataset", self.job, "--out", self.path / "part", "--shards", "0/2", "--export", "coco")
        self.assertEqual((result.returncode, "complete set" in result.stderr), (64, True), result.stderr)

    def test_two_processes_at_once_make_one_data_set(self):
        self.job.write_text(small_job(4, 2), encoding="utf-8")
        self.make("alone")
        out = self.path / "both"
        command = [str(SONARD), "dataset", str(self.job), "--out", str(out), "--quiet", "--threads", "1"]
        both = [subprocess.Popen(command, stderr=subprocess.PIPE, text=True) for _ in range(2)]
        for process in both:
            _, words = process.communicate(timeout=300)
            self.assertEqual(process.returncode, 0, words)
        files = sorted(p.name for p in out.iterdir())
        self.assertEqual(files, sorted(p.name for p in (self.path / "alone").iterdir()))
        for name in files:
            self.assertEqual((out / name).read_bytes(), (self.path / "alone" / name).read_bytes(), name)

    def test_a_full_disk_ends_with_a_sentence(self):
        def small_disk():
            resource.setrlimit(resource.RLIMIT_FSIZE, (30000, 30000))
        self.job.write_text(small_job(2, 2), encoding="utf-8")
        result = subprocess.run([str(SONARD), "dataset", str(self.job), "--out", str(self.path / "full"), "--quiet"],
                                stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False,
                                preexec_fn=small_disk)
        self.assertEqual(result.returncode, 74, result.stderr)
        self.assertIn("cannot write", result.stderr)
        self.assertEqual(list((self.path / "full").glob("*.tar*")), [])

    def test_render_keeps_the_objects_file_of_the_user(self):
        out = self.path / "render"
        out.mkdir()
        (out / "objects.json").write_text("mine", encoding="utf-8")
        result = run(SONARD, "render", ROOT / "scenes/sonard.yaml", "--out", out, "--labels", "--quiet")
        self.assertEqual((result.returncode, "objects.json" in result.stderr), (64, True), result.stderr)
        self.assertEqual([p.name for p in out.iterdir()], ["objects.json"])

    def test_a_changed_scene_file_is_another_input_of_render(self):
        scene, job = self.path / "scene.yaml", self.path / "render.yaml"
        scene.write_text("objects: [{name: ball, type: sphere, material: steel, radius_m: 0.3, pose: {xyz_m: [4, 0, -10]}}]\n")
        job.write_text("scene: scene.yaml\nsonar: {ping: {range_m: 6, beams: 16, rows: 32}}\n"
                       "poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10]}}\n")
        command = (SONARD, "render", job, "--out", self.path / "render", "--format", "npy", "--quiet")
        self.assertEqual(run(*command).returncode, 0)
        self.assertEqual(run(*command).returncode, 0)
        scene.write_text(scene.read_text() + "# changed\n")
        result = run(*command)
        self.assertEqual((result.returncode, "other inputs" in result.stderr), (64, True), result.stderr)

    def test_wrong_words_are_refused_with_a_sentence(self):
        self.job.write_text(small_job(2, 2).replace("negatives", "negatifs"), encoding="utf-8")
        result = run(SONARD, "dataset", self.job, "--out", self.path / "x")
        self.assertEqual((result.returncode, "negatifs" in result.stderr), (78, True), result.stderr)
        self.job.write_text(small_job(2, 2), encoding="utf-8")
        self.assertEqual(run(SONARD, "dataset", self.job, "--out", self.path / "x", "--shards", "2/2").returncode, 64)
        result = run(SONARD, "render", self.job, "--out", self.path / "x")
        self.assertEqual((result.returncode, "sonard dataset" in result.stderr), (78, True), result.stderr)

    def test_the_shipped_jobs_make_pings(self):
        for job in sorted((ROOT / "scenes/datasets").glob("*.yaml")):
            with self.subTest(job=job.name):
                self.job.write_text(re.sub(r"pings: \d+, shard: \d+", "pings: 2, shard: 2", job.read_text(encoding="utf-8")), encoding="utf-8")
                self.make(job.stem, "--quiet")

    @unittest.skipIf(np is None, "needs NumPy and Pillow")
    def test_render_writes_the_same_labels_as_arrays(self):
        out = self.path / "render"
        result = run(SONARD, "render", ROOT / "scenes/sonard.yaml", "--out", out, "--labels", "--format", "npy", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        samples, labels, share, caster = (np.load(out / f"000001_{name}.npy") for name in ("samples", "labels", "share", "caster"))
        self.assertEqual((labels.shape, labels.dtype, share.dtype, caster.dtype), (samples.shape, np.uint16, np.uint8, np.uint16))
        self.assertFalse(np.any((labels > 0) & (caster > 0)))
        instances = {i["instance"] for i in json.loads((out / "objects.json").read_text())}
        self.assertLessEqual(set(np.unique(labels)) | set(np.unique(caster)), {0, *instances})
        self.assertGreater(len(set(np.unique(labels))), 3)
        self.assertEqual(set(json.loads((out / "000001_labels.json").read_text())), {"layout", "annotations"})

    @unittest.skipIf(np is None, "needs NumPy and Pillow")
    def test_the_loader_of_the_manual_reads_labels_that_a_small_detector_learns(self):
        """Only a smoke test of the labels: they agree with the picture better than chance."""
        self.job.write_text(small_job(16, 8).replace("dataset: {", "dataset: {fan: true, "), encoding="utf-8")
        self.make("set", "--quiet")
        pings = shipped_loader()
        sets = []
        for shard in ("shard-000000.tar", "shard-000001.tar"):
            x, y = [], []
            for key, ping in pings(self.path / "set" / shard):
                self.assertEqual(ping["samples.png"].shape, (200, 128), key)
                self.assertEqual(ping["labels.png"].shape, (200, 128))
                self.assertFalse(np.any((ping["labels.png"] > 0) & (ping["caster.png"] > 0)))
                classes = {i["instance"]: i["class"] for i in ping["json"]["instances"]}
                self.assertLessEqual(set(np.unique(ping["labels.png"])), {0, *classes})
                self.assertEqual(ping["fan.png"].shape[2:], (3,), key)
                self.assertLessEqual(set(ping["json"]["truth"]["instance"]), {0, *classes})
                self.assertIsInstance(ping["json"]["draws"]["x"], float)
                self.assertGreater(ping["samples.png"].max(), 100, key)
                if ping["json"]["negative"]:
                    self.assertNotIn("mine", classes.values())
                for a in ping["json"]["annotations"]:
                    self.assertEqual(a["area"], int((ping["labels.png"] == a["instance"]).sum()))
                things = [i for i, name in classes.items() if name in ("mine", "stone")]
                x.append(features(ping["samples.png"]))
                y.append(np.isin(ping["labels.png"], things).reshape(-1))
            sets.append((np.concatenate(x), np.concatenate(y)))
        (x, y), (x_test, y_test) = sets
        score = x_test @ learned(x, y)
        share = y_test.mean()
        found = score > np.quantile(score, 1 - share)  # as many samples as belong to things
        iou = (found & y_test).sum() / (found | y_test).sum()
        chance = share / (2 - share)
        print(f"intersection over union {iou:.3f}, by chance {chance:.3f}")
        self.assertGreater(iou, 3 * chance)


if __name__ == "__main__":
    unittest.main()
