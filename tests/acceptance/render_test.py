"""Tests sonard render: another language reads the arrays, interrupted runs continue, and refusals are clear."""
import ast
import contextlib
import fcntl
import json
import math
import os
import pathlib
import re
import struct
import subprocess
import tempfile
import unittest

from running_sonard import ROOT, SONARD, run

CONFIG = f"""\
world: {{scene: {ROOT}/scenes/l-targets.yaml}}
vehicles: [{{name: rov}}]
sonars: [{{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}}]
"""


def read_npy(path):
    """Returns shape, type and numbers of an array, read as the format's description says."""
    data = path.read_bytes()
    assert data[:8] == b"\x93NUMPY\x01\x00", data[:8]
    (length,) = struct.unpack_from("<H", data, 8)
    header = ast.literal_eval(data[10:10 + length].decode("latin-1"))
    assert not header["fortran_order"]
    code = {"<f4": "f", "<c8": "ff", "|u1": "B", "<u2": "H", "<u4": "I"}[header["descr"]]
    count = math.prod(header["shape"])
    values = struct.unpack_from("<" + str(count * len(code)) + code[0], data, 10 + length)
    assert len(data) == 10 + length + struct.calcsize("<" + code) * count
    return header["shape"], header["descr"], values


@contextlib.contextmanager
def open_folder(path):
    path.mkdir()
    handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        yield handle
    finally:
        os.close(handle)


class Render(unittest.TestCase):
    def setUp(self):
        self.path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.out = self.path / "out"
        self.config = self.path / "sonard.yaml"
        self.config.write_text(CONFIG, encoding="utf-8")

    def render(self, *more, out=None, config=None):
        return run(SONARD, "render", config or self.config, "--out", out or self.out, *more)

    def expect(self, result, code, *words):
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        if code:
            self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)

    def test_arrays_and_the_sidecar_agree(self):
        self.expect(self.render("--format", "npy,png,raw", "--complex", "--noise", "off"), 0)
        side = json.loads((self.out / "000001.json").read_text(encoding="utf-8"))
        rows, beams = side["settings"]["rows"], side["settings"]["beams"]
        shape, kind, pressure = read_npy(self.out / "000001_pressure.npy")
        self.assertEqual((shape, kind), ((rows, beams), "<f4"))
        shape, kind, signal = read_npy(self.out / "000001_beams.npy")
        self.assertEqual((shape, kind), ((rows, beams), "<c8"))
        shape, kind, samples = read_npy(self.out / "000001_samples.npy")
        self.assertEqual((shape, kind), ((rows, beams), "|u1"))
        self.assertEqual(bytes(samples), (self.out / "000001_samples.raw").read_bytes())
        self.assertTrue((self.out / "000001.png").read_bytes().startswith(b"\x89PNG"))
        loudest = max(range(len(pressure)), key=pressure.__getitem__)
        self.assertAlmostEqual(math.hypot(signal[2 * loudest], signal[2 * loudest + 1]) / pressure[loudest], 1, places=4)

        # The loudest echo is one of the targets, where the sidecar's own axes put it; the first hit of that beam agrees.
        azimuth = side["beam_azimuth_rad"][loudest % beams]
        true_over_believed = side["water"]["true_sound_speed_mps"] / side["settings"]["device_sound_speed_mps"]
        distance = (side["row_0_m"] + loudest // beams * side["row_spacing_m"]) * true_over_believed
        targets = {"A": (4, 20), "B": (4, -10), "C": (7, 8)}
        near = [n for n, (r, deg) in targets.items()
                if abs(distance - r) < 0.15 and abs(math.degrees(azimuth) - deg) < 2]
        self.assertEqual(len(near), 1, (distance, math.degrees(azimuth)))
        self.assertEqual(side["truth"]["object_name"][loudest % beams], near[0])
        self.assertAlmostEqual(side["truth"]["first_hit_m"][loudest % beams], distance, delta=0.15)
        self.assertIn(None, side["truth"]["object"])
        self.assertEqual(len(side["truth"]["first_hit_m"]), beams)

    def test_the_sidecar_contains_every_parameter(self):
        self.expect(self.render("--format", "raw", "--seed", "5", "--volume", "off"), 0)
        side = json.loads((self.out / "000001.json").read_text(encoding="utf-8"))
        for key in ["sonard", "inputs", "ping", "time_s", "scene", "sonar", "sonar_name", "settings", "beam_azimuth_rad", "row_0_m",
                    "row_spacing_m", "water", "sonar_in_world", "vehicle_in_world", "twist", "seed", "switches", "engine", "counts",
                    "truth"]:
            self.assertIn(key, side)
        self.assertEqual(side["seed"], 5)
        self.assertFalse(side["switches"]["volume"])
        self.assertTrue(side["switches"]["noise"])
        self.assertEqual(side["sonar"]["model"], "Oculus M1200d")
        self.assertTrue(1400 < side["water"]["true_sound_speed_mps"] < 1550)
        self.assertTrue(0 < side["water"]["absorption_db_per_m"] < 3)
        self.assertGreater(side["counts"]["rays"], 10000)
        self.assertFalse((self.out / "000001_pressure.npy").exists())

    def test_switches_without_effect_are_refused_or_noted(self):
        self.expect(self.render("--mode", "paper", "--noise", "on"), 64, "--noise on has no effect", "mode paper")
        self.expect(self.render("--fixed-fan", "8", "--multipath", "on"), 64, "a fixed fan leaves out multipath")
        self.expect(run(SONARD, "render", "--report", "coverage", "--mode", "raster"), 65, "canonical")
        self.expect(self.render("--mode", "paper", "--fixed-fan", "8", "--format", "raw"), 0, "mode paper leaves out noise, specular")
        side = json.loads((self.out / "000001.json").read_text(encoding="utf-8"))
        self.assertEqual(side["switches"]["mode"], "paper")
        self.assertEqual([k for k, v in side["switches"].items() if v is True], [])
        self.config.write_text(CONFIG + "engine: {fixed_fan: 8, multipath: on}\n", encoding="utf-8")
        self.expect(self.render(), 78, "sonard.yaml:4", "multipath", "a fixed fan leaves out multipath")

    def test_continues_where_it_stopped(self):
        self.expect(self.render("--pings", "2", "--format", "npy"), 0)
        first = self.out / "000001_pressure.npy"
        before = first.stat().st_mtime_ns, first.read_bytes()
        (self.out / "000002.json").unlink()  # stopped before the second ping was complete
        result = self.render("--pings", "3", "--format", "npy")
        self.expect(result, 0, "3 of 3 pings", "1 were there already")
        self.assertEqual((first.stat().st_mtime_ns, first.read_bytes()), before)
        self.assertTrue((self.out / "000003.json").exists())
        self.assertEqual([p.name for p in self.out.iterdir() if p.suffix == ".tmp"], [])

    def test_batches_make_the_same_files_and_report_the_rate(self):
        self.expect(self.render("--pings", "5", "--format", "raw"), 0, "5 of 5 pings", "MB/s written")
        batched = self.out.parent / "batched"
        self.expect(self.render("--pings", "5", "--format", "raw", "--batch", "3", out=batched), 0, "5 of 5 pings")
        names = sorted(p.name for p in self.out.iterdir())
        self.assertEqual(names, sorted(p.name for p in batched.iterdir()))
        for name in names:
            self.assertEqual((self.out / name).read_bytes(), (batched / name).read_bytes(), name)

    def test_a_folder_belongs_to_one_set_of_inputs(self):
        self.expect(self.render("--pings", "2", "--format", "npy", "--quiet"), 0)
        self.expect(self.render("--seed", "9"), 64, "other inputs", "--overwrite")
        self.expect(self.render("--noise", "off"), 64, "other inputs")
        self.expect(self.render("--seed", "9", "--overwrite", "--quiet", "--format", "npy"), 0)
        self.assertFalse((self.out / "000002.json").exists())
        self.assertEqual(json.loads((self.out / "000001.json").read_text(encoding="utf-8"))["seed"], 9)

    def test_threads_change_no_byte(self):
        for threads in (1, 2):
            self.expect(self.render("--threads", str(threads), "--format", "npy,raw", out=self.path / str(threads)), 0)
        for name in ["000001_pressure.npy", "000001_samples.raw"]:
            self.assertEqual((self.path / "1" / name).read_bytes(), (self.path / "2" / name).read_bytes())

    def test_poses_from_a_file(self):
        poses = self.path / "poses.csv"
        poses.write_text("t_s,x_m,y_m,z_m,yaw_deg\n0,0,0,0,0\n1,0.5,0,0,10\n2,1,0,0,20\n", encoding="utf-8")
        self.expect(self.render("--poses", poses), 65, "poses.csv", "frame", "ENU_FLU")
        poses.write_text("# frame: ENU_FLU\n" + poses.read_text(encoding="utf-8"), encoding="utf-8")
        self.expect(self.render("--poses", poses, "--format", "raw"), 0, "3 of 3 pings")
        side = json.loads((self.out / "000002.json").read_text(encoding="utf-8"))
        self.assertEqual(side["time_s"], 1)
        self.assertAlmostEqual(side["sonar_in_world"]["xyz_m"][0], 0.5)
        self.assertAlmostEqual(side["twist"]["velocity_mps"][0], 0.5, places=6)
        self.assertAlmostEqual(side["twist"]["angular_rate_radps"][2], math.radians(10), places=6)
        other = self.path / "other"
        self.expect(self.render("--poses", poses, "--format", "raw", "--pings", "4", out=other), 64, "the poses cover only 3")
        self.expect(self.render("--poses", poses, "--format", "raw", "--rate", "2", out=other), 0, "5 of 5 pings")
        poses.write_text("t,x,y,z\n0,0,0\n", encoding="utf-8")
        self.expect(self.render("--poses", poses, out=self.path / "third"), 65, "poses.csv:2: 3 values")
        poses.write_text("t,x,y,z\n0,0,0,0\n", encoding="utf-8")
        self.expect(self.render("--poses", poses, "--pose-frame", "ENU_FLU", "--format", "raw", out=self.path / "third"), 0, "1 of 1")

    def test_poses_about_another_origin_are_reported(self):
        poses = self.path / "poses.csv"
        poses.write_text("# frame: ENU_FLU\n# origin: 47.61,-122.33,0\nt,x,y,z\n0,0,0,-1\n", encoding="utf-8")
        for lat, notes in ((47.61, 0), (47.6, 1)):
            origin = f", origin: {{lat: {lat}, lon: -122.33}}}}"
            self.config.write_text(CONFIG.replace("l-targets.yaml}", "l-targets.yaml" + origin), encoding="utf-8")
            result = self.render("--poses", poses, "--quiet", "--format", "raw", out=self.path / f"at{notes}")
            self.expect(result, 0)
            self.assertEqual(result.stderr.count("poses.csv states an origin that is 1112 m from world.origin"), notes, result.stderr)
        about = json.loads((self.path / "at1/render.json").read_text(encoding="utf-8"))
        self.assertEqual(["sonard: " + note for note in about["notes"]], result.stderr.splitlines())

    def test_equal_stamps_are_counted(self):
        poses = self.path / "poses.tum"
        poses.write_text("# frame: ENU_FLU\n" + "".join(f"{t} 0 0 -1 0 0 0 1\n" for t in (0, 0.1, 0.1, 0.2)), encoding="utf-8")
        result = self.render("--poses", poses, "--format", "raw", "--quiet")
        self.expect(result, 0, "poses.tum: 1 pose replaced by the next of the same stamp")
        about = json.loads((self.out / "render.json").read_text(encoding="utf-8"))
        self.assertEqual(["sonard: " + note for note in about["notes"]], result.stderr.splitlines())

    def test_doubtful_attitudes_are_reported(self):
        """As `sonard check` does for trajectories of a configuration."""
        poses = self.path / "poses.tum"
        for attitude, note in (("1 0 0 0", "turn rov over, but would not if w were at the other end"), ("0 0 0 1", None)):
            poses.write_text(f"# frame: ENU_FLU\n0 0 0 -1 {attitude}\n0.1 0 0 -1 {attitude}\n", encoding="utf-8")
            result = self.render("--poses", poses, "--quiet", "--format", "raw", out=self.path / f"turned-{note is None}")
            self.expect(result, 0, *[note] * (note is not None))
            notes = json.loads((self.path / f"turned-{note is None}/render.json").read_text(encoding="utf-8")).get("notes", [])
            self.assertEqual(["sonard: " + n for n in notes], result.stderr.splitlines())
            self.assertEqual(len(notes), note is not None, notes)

    def test_snapshots_do_not_smear(self):
        """Poses too far apart for a vehicle: the sonar is at rest in each ping, with one note, also in render.json."""
        snapshots = self.path / "snapshots.csv"
        snapshots.write_text("# frame: ENU_FLU\nt,x,y,z,yaw\n0,0,0,0,0\n0.5,0.3,0,0,-150\n1,8.3,0,0,0\n", encoding="utf-8")
        options = ["--format", "raw", "--noise", "off"]
        result = self.render("--poses", snapshots, "--quiet", *options)
        self.expect(result, 0, "snapshots", "2 of 2 steps", "16 m/s", "--motion on")
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        about = json.loads((self.out / "render.json").read_text(encoding="utf-8"))
        self.assertEqual(["sonard: " + note for note in about["notes"]], result.stderr.splitlines())
        side = json.loads((self.out / "000001.json").read_text(encoding="utf-8"))
        self.assertEqual(side["twist"], {"velocity_mps": [0, 0, 0], "angular_rate_radps": [0, 0, 0]})
        resting = self.path / "one.csv"
        resting.write_text("# frame: ENU_FLU\nt,x,y,z,yaw\n0,0,0,0,0\n", encoding="utf-8")
        self.expect(self.render("--poses", resting, *options, out=self.path / "resting"), 0)
        raw = "000001_samples.raw"
        self.assertEqual((self.out / raw).read_bytes(), (self.path / "resting" / raw).read_bytes())

        moved = self.render("--poses", snapshots, "--motion", "on", *options, out=self.path / "moved")
        self.expect(moved, 0)
        self.assertNotIn("snapshots", moved.stderr)
        self.assertNotEqual((self.out / raw).read_bytes(), (self.path / "moved" / raw).read_bytes())
        self.expect(self.render("--poses", snapshots, "--motion", "on"), 64, "other inputs")
        self.config.write_text(CONFIG + "engine: {motion: on}\n", encoding="utf-8")
        asked = self.render("--poses", snapshots, *options, out=self.path / "asked")
        self.assertNotIn("snapshots", asked.stderr)
        self.assertEqual((self.path / "asked" / raw).read_bytes(), (self.path / "moved" / raw).read_bytes())

    def test_a_sonar_above_the_sea_surface_is_reported(self):
        scene = self.path / "sea.yaml"
        scene.write_text((ROOT / "scenes/l-targets.yaml").read_text(encoding="utf-8") +
                         "sea_surface: {size_m: [20, 20], lambert_db: -30}\n", encoding="utf-8")
        self.config.write_text(CONFIG.replace(f"{ROOT}/scenes/l-targets.yaml", str(scene)), encoding="utf-8")
        poses = self.path / "poses.csv"
        poses.write_text("# frame: ENU_FLU\nt,x,y,z\n0,0,0,-2\n1,0,0,2\n", encoding="utf-8")
        options = ["--poses", poses, "--quiet", "--format", "raw"]
        for _ in range(2):  # the second run finds all pings
            result = self.render(*options)
            self.expect(result, 0, "1 of 2 pings", "above the sea surface", "noise only", "NED")
            self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        about = json.loads((self.out / "render.json").read_text(encoding="utf-8"))
        self.assertEqual(["sonard: " + note for note in about["notes"]], result.stderr.splitlines())
        for number, is_above in ((1, False), (2, True)):
            side = json.loads((self.out / f"{number:06}.json").read_text(encoding="utf-8"))
            self.assertIs(side["above_sea_surface"], is_above)
        self.assertEqual(self.render(*options, "--pings", "1", out=self.path / "below").stderr, "")

    def test_a_sonar_above_z_0_is_reported_without_a_sea_surface(self):
        poses = self.path / "poses.csv"
        poses.write_text("# frame: ENU_FLU\nt,x,y,z\n0,0,0,-2\n1,0,0,2\n", encoding="utf-8")
        options = ["--poses", poses, "--quiet", "--format", "raw"]
        result = self.render(*options)
        self.expect(result, 0, "1 of 2 pings", "above z = 0", "no sea_surface", "NED")
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        about = json.loads((self.out / "render.json").read_text(encoding="utf-8"))
        self.assertEqual(["sonard: " + note for note in about["notes"]], result.stderr.splitlines())
        side = json.loads((self.out / "000002.json").read_text(encoding="utf-8"))
        self.assertIs(side["above_sea_surface"], False)
        self.assertEqual(self.render(*options, "--pings", "1", out=self.path / "below").stderr, "")

    def test_a_range_that_the_product_does_not_have_is_in_the_notes(self):
        file = self.path / "far.yaml"
        file.write_text("scene: {objects: [{type: point, target_strength_db: 0, pose: {xyz_m: [4, 0, -2]}}]}\n"
                        "sonar: {profile: oculus-m1200d, ping: {mode: HF, range_m: 25}}\n"
                        "poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -2]}}\n", encoding="utf-8")
        self.config = file
        result = self.render("--quiet", "--format", "raw", "--pings", "1")
        self.expect(result, 0, "range 25 m", "accepts 0.1 to 10 m")
        about = json.loads((self.out / "render.json").read_text(encoding="utf-8"))
        self.assertEqual(["sonard: " + note for note in about["notes"]], result.stderr.splitlines())

    def test_a_part_of_a_run_has_the_same_pings(self):
        options = ["--format", "raw,png"]
        self.expect(self.render("--pings", "4", *options), 0)
        part = self.path / "part"
        self.expect(self.render("--first", "3", "--pings", "2", *options, out=part), 0, "2 of 2 pings")
        names = {f"00000{n}{end}" for n in (3, 4) for end in (".json", ".png", "_samples.raw")}
        self.assertEqual({p.name for p in part.iterdir()}, names | {"render.json"})
        for name in names:
            self.assertEqual((part / name).read_bytes(), (self.out / name).read_bytes(), name)
        self.expect(self.render("--first", "4", "--pings", "2", *options, out=part), 0, "1 were there already")

        poses = self.path / "poses.csv"
        poses.write_text("# frame: ENU_FLU\nt,x,y,z\n0,0,0,0\n1,0.5,0,0\n2,1,0,0\n", encoding="utf-8")
        third = self.path / "third"
        self.expect(self.render("--poses", poses, "--first", "2", "--format", "raw", out=third), 0, "2 of 2 pings")
        self.assertEqual(json.loads((third / "000002.json").read_text(encoding="utf-8"))["time_s"], 1)
        self.expect(self.render("--poses", poses, "--first", "4", out=third), 64, "--first 4", "the poses cover only 3")
        self.expect(self.render("--poses", poses, "--first", "3", "--pings", "2", out=third), 64, "--first 3 --pings 2", "the poses cover only 3")
        self.expect(self.render("--first", "999999", "--pings", "2", out=third), 64, "999999")
        sweep = self.path / "sweep.yaml"
        sweep.write_text("scene: l-targets.yaml\nsweep: {r: [5, 6]}\nsonar: {ping: {range_m: $r}}\n", encoding="utf-8")
        self.expect(self.render("--first", "2", config=sweep, out=self.path / "sweep"), 64, "--first", "has a sweep")

    def test_pictures_without_rings(self):
        self.expect(self.render("--format", "png"), 0)
        plain = self.path / "plain"
        self.expect(self.render("--format", "png", "--image-rings", "off", out=plain), 0)
        self.assertNotEqual((plain / "000001.png").read_bytes(), (self.out / "000001.png").read_bytes())
        self.expect(self.render("--format", "png", "--image-rings", "off"), 64, "other inputs")
        self.expect(self.render("--format", "png", "--image-rings", "no", out=plain), 64, "--image-rings")

    def test_two_runs_at_once_do_not_share_a_folder(self):
        with open_folder(self.out) as held:
            fcntl.flock(held, fcntl.LOCK_EX)  # like another run that holds the lock
            self.expect(self.render(), 64, "another sonard render is writing into", "--out")
            self.assertEqual(list(self.out.iterdir()), [])
        self.expect(self.render("--format", "raw"), 0)

    def test_a_scene_is_distinguished_from_a_render_file(self):
        """The suggested command works too."""
        scene = self.path / "my scene.yaml"
        scene.write_text((ROOT / "scenes/l-targets.yaml").read_text(encoding="utf-8"), encoding="utf-8")
        result = self.render(config=scene)
        self.expect(result, 78, "my scene.yaml is a scene", "render.yaml")
        command = re.search(r"echo .* --out pings", result.stderr).group().replace("sonard render", f"'{SONARD.resolve()}' render")
        done = subprocess.run(["sh", "-c", command], cwd=self.path, capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((self.path / "pings/000001.png").exists())
        empty = self.path / "empty.yaml"
        empty.write_text("sonar: {}\n", encoding="utf-8")
        self.expect(self.render(config=empty), 78, "empty.yaml", "scene")
        self.assertNotIn('""', self.render(config=empty).stderr)

    def test_of_several_bodies_the_vehicles_own_poses_are_used(self):
        poses = self.path / "both.csv"
        poses.write_text("# frame: ENU_FLU\nbody,t,x,y,z\nboat,0,9,0,0\nrov,0,0.25,0,0\n", encoding="utf-8")
        self.expect(self.render("--poses", poses, "--format", "raw"), 0, "1 of 1")
        side = json.loads((self.out / "000001.json").read_text(encoding="utf-8"))
        self.assertAlmostEqual(side["sonar_in_world"]["xyz_m"][0], 0.25)
        poses.write_text(poses.read_text(encoding="utf-8").replace("rov", "auv"), encoding="utf-8")
        self.expect(self.render("--poses", poses, out=self.path / "other"), 65, "both.csv", "auv", "boat")

    def test_mistakes_are_one_sentence(self):
        self.expect(self.render(config=self.path / "none.yaml"), 66, "none.yaml")
        self.expect(self.render("--sonar", "back"), 64, "front")
        self.expect(self.render("--complex", "--expected-power"), 64, "--complex")
        self.expect(run(SONARD, "render", self.config), 64, "--out")
        (self.path / "file").write_text("", encoding="utf-8")
        self.expect(self.render(out=self.path / "file" / "out"), 74, "cannot make the folder")
        if pathlib.Path("/dev/full").exists():
            folder = self.path / "full"
            folder.mkdir()
            os.symlink("/dev/full", folder / "render.json.tmp")
            self.expect(self.render(out=folder), 74, "render.json: No space left")
            for kind, name in (("npy", "000001_samples.npy"), ("png", "000001.png")):
                folder = self.path / kind
                folder.mkdir()
                os.symlink("/dev/full", folder / (name + ".tmp"))
                self.expect(self.render("--quiet", "--format", kind, out=folder), 74, name + ": No space left", "make room")
                self.assertFalse([p.name for p in folder.iterdir() if p.name in (name, name + ".tmp", "000001.json")])

    def test_coverage_of_a_bed(self):
        bed = self.path / "bed.yaml"
        bed.write_text("scene: {objects: [{type: plane, material: sand, size_m: [40, 40], pose: {xyz_m: [0, 0, -12]}}]}\n"
                       "sonar: {profile: oculus-m1200d}\n"
                       "poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10], rpy_deg: [0, 14, 0]}}\n", encoding="utf-8")
        result = run(SONARD, "render", bed, "--report", "coverage")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertGreaterEqual(float(re.search(r"([\d.]+) %", result.stdout).group(1)), 99)
        self.expect(run(SONARD, "render", self.config, "--report", "coverage"), 65, "plane")

    def test_every_sonar_fills_a_bed_completely(self):
        result = run(SONARD, "render", "--report", "coverage", patience_s=600)
        self.assertEqual(result.returncode, 0, result.stderr)
        shares = re.findall(r"^(\S+ .*\S) +\d+ +[\d.]+ +\d+ +\d+ +([\d.]+) %", result.stdout, re.M)
        self.assertGreater(len(shares), 15, result.stdout)
        for sonar, share in shares:
            self.assertEqual(float(share), 100, sonar)


if __name__ == "__main__":
    unittest.main()
