"""A vehicle follows a trajectory file. In stepped time every ping shows its position, with the same bytes in every run. A running
daemon pauses, seeks and speeds it up on request, and a reload does not disturb it."""
import json
import math
import pathlib
import re
import signal
import tempfile
import time
import unittest
import urllib.error
import urllib.request

from oculus_reader import Client, fire_message
from running_sonard import ROOT, SONARCTL, SONARD, Sonard, run

PINGS, RATE_HZ = 40, 10


def yaw_deg(t):
    return 30 * t


def depth_m(t):
    return 3 + t


def dive():
    """Returns a trajectory of four seconds that begins eastwards, turns to port and descends, in uneven steps, with stamps of a
    real clock."""
    lines = ["# frame: ENU_FLU"]
    for t in (0, 0.3, 1, 1.1, 2.5, 4):
        half = math.radians(yaw_deg(t)) / 2
        lines.append(f"{1403636579.763555584 + t:.6f} {-7 + 0.5 * t} 0 {-depth_m(t)} 0 0 {math.sin(half)} {math.cos(half)}")
    return "\n".join(lines) + "\n"


def daemon_with(file, text, trajectory, **more):
    daemon = Sonard(trajectory=trajectory, **more)
    (pathlib.Path(daemon.folder.name) / file).write_text(text, encoding="utf-8")
    return daemon


def stepped_run(trajectory, *arguments):
    """Returns the pings that a client received, and the digest of its stream."""
    arguments = ["--clock", "stepped", "--digest", "--exit-after-pings", PINGS, *arguments]
    with daemon_with("dive.tum", dive(), trajectory, arguments=arguments) as daemon:
        pings = []
        with Client(daemon.address) as client:
            client.send(fire_message(version=2, rate_hz=RATE_HZ, range_=5))
            for _ in range(PINGS):
                pings.append(client.ping())
        code, log = daemon.wait(), daemon.log()
    assert code == 0, log
    return pings, re.findall(r"sha256 ([0-9a-f]{64})", log)


class Stepped(unittest.TestCase):
    def expect_at(self, ping, t):
        self.assertAlmostEqual((90 - yaw_deg(t) - ping.heading_deg + 180) % 360, 180, delta=0.05, msg=f"heading at {t} s")
        self.assertAlmostEqual(ping.pressure - self.surface_bar, depth_m(t) * self.bar_per_m, delta=1e-4, msg=f"depth at {t} s")

    def calibrate(self, first, last, seconds):
        self.bar_per_m = (last.pressure - first.pressure) / seconds
        self.surface_bar = first.pressure - depth_m(0) * self.bar_per_m
        self.assertAlmostEqual(self.bar_per_m, 0.1, delta=0.005, msg="ten metres of water are a bar")

    def test_every_ping_is_where_the_file_says_and_runs_are_equal(self):
        pings, digest = stepped_run("dive.tum")
        self.calibrate(pings[0], pings[-1], (PINGS - 1) / RATE_HZ)
        for n, ping in enumerate(pings):
            self.expect_at(ping, n / RATE_HZ)
        self.assertEqual(len(digest), 1)
        again, digest_again = stepped_run("dive.tum", "--threads", 1)
        self.assertEqual(digest_again, digest)

        twice, other = stepped_run("{file: dive.tum, speed: 2, loop: true, start_s: 3}")
        self.assertNotEqual(other, digest)
        for n, ping in enumerate(twice):  # the end of a loop and its start are the same moment
            self.expect_at(ping, (3 + 2 * n / RATE_HZ) % 4)


class Steered(unittest.TestCase):
    def ask(self, path, body=None):
        request = urllib.request.Request(f"http://{self.daemon.address}:8088{path}", headers={"Content-Type": "application/json"},
                                         data=None if body is None else json.dumps(body).encode())
        try:
            with urllib.request.urlopen(request, timeout=20) as answer:
                return json.load(answer)
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()

    def plays(self):
        return self.ask("/api/v1/status")["vehicles"][0]

    def reload(self, lines):
        self.daemon.process.send_signal(signal.SIGHUP)
        deadline = time.monotonic() + 60
        while self.daemon.log().count("reloaded:") < lines:
            self.assertLess(time.monotonic(), deadline, self.daemon.log())
            time.sleep(0.02)

    def test_trajectories_are_steered_by_requests_and_kept_by_a_reload(self):
        with daemon_with("dive.tum", dive(), "{file: dive.tum, loop: true, speed: 0.001}") as self.daemon:
            vehicle = self.plays()
            self.assertEqual(vehicle["source"], "trajectory dive.tum")
            self.assertEqual(vehicle["trajectory"]["file"], "dive.tum")
            self.assertEqual((vehicle["trajectory"]["duration_s"], vehicle["trajectory"]["loop"]), (4, True))

            self.ask("/api/v1/set_trajectory", {"position_s": 2.5, "paused": True, "speed": 1000})
            vehicle = self.plays()
            self.assertTrue(vehicle["trajectory"]["paused"])
            self.assertEqual(vehicle["trajectory"]["position_s"], 2.5)
            self.assertAlmostEqual(vehicle["position"]["z"], -depth_m(2.5), places=5)
            self.reload(1)
            self.assertEqual(self.plays()["trajectory"], vehicle["trajectory"], "an untouched trajectory continues unchanged")

            code, text = self.ask("/api/v1/set_trajectory", {"position_s": 5})
            self.assertEqual(code, 400, text)
            self.assertIn("from 0 to 4", text)
            control = f"{self.daemon.address}:14770"
            result = run(SONARCTL, "set", "trajectory", "rov", "--seek", "1", "--control", control)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertAlmostEqual(self.plays()["position"]["z"], -depth_m(1), places=5)
            result = run(SONARCTL, "status", "--control", control)
            self.assertIn("from trajectory dive.tum  at 1.0 of 4.0 s x1000 looped paused", result.stdout)

            file = pathlib.Path(self.daemon.folder.name) / "dive.tum"
            file.write_text("# frame: ENU_FLU\n0 5 5 -5 0 0 0 1\n", encoding="utf-8")
            self.reload(2)
            self.assertEqual(self.plays()["position"], {"x": 5, "y": 5, "z": -5}, "another file is another trajectory")
            self.assertEqual(self.daemon.stop()[0], 0)


class Files(unittest.TestCase):
    def with_files(self, trajectory, object_name, *command):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "dive.tum").write_text(dive(), encoding="utf-8")
            (folder / "way.kitti").write_text("".join(f"1 0 0 {x} 0 1 0 0 0 0 1 -0.6\n" for x in (-0.5, -0.4, -0.2)), encoding="utf-8")
            (folder / "boat.csv").write_text("# frame: ENU_FLU\nt,x,y,z\n0,1,2,-3\n9,1,3,-3\n", encoding="utf-8")
            (folder / "sonard.yaml").write_text(f"""\
world: {{scene: {ROOT / 'scenes/tank-rod.yaml'}}}
vehicles: [{{name: rov, trajectory: {trajectory}}}]
objects:
  - {{name: {object_name}, trajectory: boat.csv}}
sonars: [{{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}}]
""", encoding="utf-8")
            done = run(SONARD, command[0], folder / "sonard.yaml", *[a.replace("FOLDER", name) for a in command[1:]])
            done.sidecars = [json.loads(f.read_text(encoding="utf-8")) for f in sorted(folder.glob("out/0*.json"))]
            return done

    def check(self, trajectory, object_name="rod"):
        return self.with_files(trajectory, object_name, "check")

    def test_render_has_a_ping_at_every_line(self):
        done = self.with_files("{file: dive.tum, speed: 2}", "rod", "render", "--out", "FOLDER/out", "--format", "raw", "--noise", "off")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([round(s["time_s"], 4) for s in done.sidecars], [0, 0.3, 1, 1.1, 2.5, 4])
        for s in done.sidecars:
            self.assertAlmostEqual(s["vehicle_in_world"]["xyz_m"][2], -depth_m(s["time_s"]), places=5)

    def test_render_needs_a_rate_for_a_file_without_times(self):
        words = ["render", "--poses", "FOLDER/way.kitti", "--pose-frame", "ENU_FLU", "--out", "FOLDER/out", "--format", "raw"]
        done = self.with_files("none", "rod", *words, "--pose-rate", "4")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([(s["time_s"], s["vehicle_in_world"]["xyz_m"][0]) for s in done.sidecars], [(0, -0.5), (0.25, -0.4), (0.5, -0.2)])
        without = self.with_files("none", "rod", *words)
        self.assertEqual((without.returncode, without.stderr.count("\n")), (65, 1), without.stderr)
        self.assertIn("rate", without.stderr)

    def test_check_lists_followed_files_and_mistakes(self):
        good = self.check("{file: dive.tum, speed: 2}")
        self.assertEqual(good.returncode, 0, good.stderr)
        self.assertIn("vehicle rov follows dive.tum: tum, ENU_FLU, 6 poses, 4.000 s, from 0 s at 2 x\n", good.stdout)
        self.assertIn("object rod follows boat.csv: csv, ENU_FLU, 2 poses, 9.000 s\n", good.stdout)
        missing = self.check("none.tum")
        self.assertEqual(missing.returncode, 78)
        self.assertRegex(missing.stderr, r"sonard.yaml:2:36: vehicles\[0\].trajectory: no such file: \"none.tum\"; looked in /")
        unknown = self.check("dive.tum", "boat")
        self.assertEqual(unknown.returncode, 78)
        self.assertRegex(unknown.stderr, r"sonard.yaml:4:12: objects\[0\].name: no moving object of the scene is called \"boat\"")


if __name__ == "__main__":
    unittest.main()
