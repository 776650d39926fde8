"""Tests SIGHUP with the shipped daemon, its real engine and an edited configuration file.

A client of a sonar that the edit does not concern sees every ping id once. Only pings that the daemon counts as skipped or
dropped (on a busy computer) are missing. The scene changes while the client is connected. Figures for the table of reliability
are written to the folder SONARD_RELIABILITY.
"""
import json
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.error
import urllib.request

from oculus_reader import Client, Ping, fire_message
from running_sonard import ROOT, SONARD, Sonard

sys.path.insert(0, str(ROOT / "tests/reliability"))
from record import record  # noqa: E402  the folder above

COMMAND = "python3 tests/acceptance/reload_test.py"

SCENE = """\
materials:
  bright: {{lambert_db: -10, roughness_m: 0.003}}
objects:
  - {{name: ball, type: sphere, material: bright, radius_m: 0.3, pose: {{xyz_m: [{x}, 0, -3]}}}}
"""
MESH = """\
materials:
  bright: {{lambert_db: -10}}
objects:
  - {{name: mesh, type: mesh, material: bright, file: {mesh}}}
"""
SECOND = """\
  - {{name: second, profile: oculus-m750d, bind_ip: {address}, status_to: [{address}], device_id: {device_id}}}
"""


class Watcher(threading.Thread):
    """Reads without a pause, so that no ping is dropped because of this client. Keeps all ids and the newest ping."""

    def __init__(self, client):
        super().__init__(daemon=True)
        self.client, self.ids, self.newest, self.ending = client, [], None, None
        self.start()

    def run(self):
        try:
            while True:
                kind, message = self.client.message()
                if kind == 0x23:
                    self.newest = message
                    self.ids.append(int.from_bytes(message[53:57], "little"))
        except (AssertionError, OSError, EOFError) as error:
            self.ending = error

    def ping_after(self, more, patience_s=200):
        """Returns the newest ping, after waiting for a number of new ones."""
        wanted, deadline = len(self.ids) + more, time.monotonic() + patience_s
        while len(self.ids) < wanted:
            assert self.ending is None and time.monotonic() < deadline, f"{len(self.ids)} of {wanted} pings; {self.ending!r}"
            time.sleep(0.01)
        return Ping(self.newest)

    def wrong(self, daemon, begin=0):
        """Counts ids from `begin` on that are repeated, out of order, or missing without being counted by the daemon."""
        steps = [b - a for a, b in zip(self.ids[begin:], self.ids[begin + 1:])]
        figures = daemon.status()["sonars"][0]["figures"]
        counted = int(figures["skipped_ticks"]) + int(figures["dropped"])
        return sum(step < 1 for step in steps) + max(0, sum(step - 1 for step in steps if step > 1) - counted)


class Reload(unittest.TestCase):
    def config(self, daemon):
        return pathlib.Path(daemon.folder.name) / "sonard.yaml"

    def hang_up(self, daemon, words, times=1, patience_s=200):
        daemon.process.send_signal(signal.SIGHUP)
        deadline = time.monotonic() + patience_s
        while daemon.log().count(words) < times:
            self.assertLess(time.monotonic(), deadline, daemon.log())
            time.sleep(0.02)

    def test_an_unchanged_sonar_continues_in_a_changed_scene(self):
        daemon = Sonard(pose="{frame: ENU_FLU, xyz_m: [0, 0, -3]}")
        daemon.scene = pathlib.Path(daemon.folder.name) / "reload.yaml"
        daemon.scene.write_text(SCENE.format(x=3), encoding="utf-8")
        with daemon, Client(daemon.address) as client:
            text = self.config(daemon).read_text(encoding="utf-8")
            client.send(fire_message(range_=8.0, rate_hz=10))
            watcher = Watcher(client)
            near = self.look(watcher)

            daemon.scene.write_text(SCENE.format(x=6), encoding="utf-8")
            second = "127.0.0.9"
            self.config(daemon).write_text(text.replace("poses:", SECOND.format(address=second, device_id=7002) + "poses:"),
                                           encoding="utf-8")
            self.hang_up(daemon, "reloaded: front untouched, second added")
            far = self.look(watcher)
            across = len(watcher.ids)
            lost = watcher.wrong(daemon)
            record("reload-untouched", f"{lost} of {across}", "0 lost, 0 repeated", lost == 0, COMMAND)
            self.assertEqual(lost, 0, watcher.ids)
            self.assertAlmostEqual(near, 2.7, delta=0.2)
            self.assertAlmostEqual(far, 5.7, delta=0.2)
            with Client(second) as other:
                other.send(fire_message(rate_hz=10))
                self.assertEqual(other.ping().source, 7002)

            self.config(daemon).write_text(text.replace("vehicles:", "vehicals:"), encoding="utf-8")
            self.hang_up(daemon, "the configuration stays as it was")
            explained = 'did you mean "vehicles"?' in daemon.log()
            still = self.look(watcher)
            kept = abs(still - 5.7) <= 0.2 and watcher.wrong(daemon) == 0
            record("reload-error", f"{'explained' if explained else 'NOT explained'}; same scene, {watcher.wrong(daemon, across - 1)} of "
                   f"{len(watcher.ids) - across} pings lost", "the old configuration stays, 0 lost", explained and kept, COMMAND)
            self.assertTrue(explained, daemon.log())
            self.assertAlmostEqual(still, 5.7, delta=0.2)
            self.assertEqual(watcher.wrong(daemon), 0, watcher.ids)
            code, _ = daemon.stop()
            self.assertEqual(code, 0, daemon.log())

    def test_pings_continue_when_a_mesh_cannot_be_imported(self):
        """Each of these files once ended the daemon, when it imported meshes itself."""
        daemon = Sonard(pose="{frame: ENU_FLU, xyz_m: [0, 0, -3]}")
        folder = pathlib.Path(daemon.folder.name)
        daemon.scene = folder / "reload.yaml"
        daemon.scene.write_text(SCENE.format(x=3), encoding="utf-8")
        scenes = {}
        for mesh, words in (("loop.dae", "contains itself"), ("fan.gltf", "repeats its nodes"), ("list.ply", "ends within face 1 of 1")):
            shutil.copy(ROOT / "tests/fuzz/corpus/mesh_file" / mesh, folder)
            scenes[folder / f"{mesh}.yaml"] = f"{mesh}: ", words
            (folder / f"{mesh}.yaml").write_text(MESH.format(mesh=mesh), encoding="utf-8")
        with daemon, Client(daemon.address) as client:
            client.send(fire_message(range_=8.0, rate_hz=10))
            watcher = Watcher(client)
            near = self.look(watcher)
            for scene, (name, words) in scenes.items():
                request = urllib.request.Request(f"http://{daemon.address}:8088/api/v1/load", method="POST",
                                                 data=json.dumps({"path": str(scene)}).encode(),
                                                 headers={"Content-Type": "application/json"})
                with self.assertRaises(urllib.error.HTTPError) as refused:
                    urllib.request.urlopen(request, timeout=300)
                answer = refused.exception.read().decode()
                refused.exception.close()
                self.assertIn(name, answer)
                self.assertIn(words, answer)
                watcher.ping_after(3)
            for times, (scene, (name, words)) in enumerate(scenes.items(), 1):
                daemon.scene.write_text(scene.read_text(encoding="utf-8"), encoding="utf-8")
                self.hang_up(daemon, "the configuration stays as it was", times)
                self.assertIn(name, daemon.log())
                self.assertIn(words, daemon.log())
                watcher.ping_after(3)
            self.assertAlmostEqual(self.look(watcher), near, delta=0.1)
            code, _ = daemon.stop()
            self.assertEqual(code, 0, daemon.log())

    def look(self, watcher):
        """Returns the range of the strongest echo after a few pings, because pings from before the reload come first."""
        ping = watcher.ping_after(12)
        rows_per_m = 1 / ping.resolution
        ball, _, _ = ping.brightest(int(1.0 * rows_per_m), int(7.0 * rows_per_m))
        return ball

    def test_a_reload_of_the_demo_changes_nothing(self):
        with tempfile.TemporaryFile() as log:
            demo = subprocess.Popen([str(SONARD), "run", "--demo", "--bind", "127.0.0.9"], stdin=subprocess.DEVNULL, stdout=log,
                                    stderr=subprocess.STDOUT)
            try:
                self.wait_for(log, demo, "ready in")
                demo.send_signal(signal.SIGHUP)
                self.wait_for(log, demo, "there is no configuration file; nothing changed")
                demo.send_signal(signal.SIGTERM)
                self.assertEqual(demo.wait(20), 0)
            finally:
                demo.kill()
                demo.wait()

    def wait_for(self, log, process, words, patience_s=60):
        deadline = time.monotonic() + patience_s
        while True:
            log.seek(0)
            text = log.read().decode(errors="replace")
            if words in text:
                return
            self.assertIsNone(process.poll(), text)
            self.assertLess(time.monotonic(), deadline, text)
            time.sleep(0.02)


if __name__ == "__main__":
    unittest.main()
