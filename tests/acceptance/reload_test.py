"""SIGHUP as an operator sends it: the shipped daemon, its real engine, a configuration file that is edited.

A client of a sonar that the edit does not touch sees every ping id once; the scene it looks at changes under it.
"""
import pathlib
import signal
import subprocess
import tempfile
import time
import unittest

from oculus_reader import Client, fire_message
from running_sonard import SONARD, Sonard, free_address

SCENE = """\
materials:
  bright: {{lambert_db: -10, roughness_m: 0.003}}
objects:
  - {{name: ball, type: sphere, material: bright, radius_m: 0.3, pose: {{xyz_m: [{x}, 0, -3]}}}}
"""
SECOND = """\
  - {{name: second, profile: oculus-m750d, bind_ip: {address}, status_to: [{address}], device_id: {device_id}}}
"""


class Reload(unittest.TestCase):
    def config(self, daemon):
        return pathlib.Path(daemon.folder.name) / "sonard.yaml"

    def hang_up(self, daemon, words, times=1, patience_s=60):
        daemon.process.send_signal(signal.SIGHUP)
        deadline = time.monotonic() + patience_s
        while daemon.log().count(words) < times:
            self.assertLess(time.monotonic(), deadline, daemon.log())
            time.sleep(0.02)

    def test_untouched_sonar_streams_on_over_a_changed_scene(self):
        daemon = Sonard(pose="{frame: ENU_FLU, xyz_m: [0, 0, -3]}")
        daemon.scene = pathlib.Path(daemon.folder.name) / "reload.yaml"
        daemon.scene.write_text(SCENE.format(x=3), encoding="utf-8")
        with daemon, Client(daemon.address) as client:
            text = self.config(daemon).read_text(encoding="utf-8")
            client.send(fire_message(range_=8.0, rate_hz=10))
            near, ids = self.look(client)

            daemon.scene.write_text(SCENE.format(x=6), encoding="utf-8")
            second = free_address()
            self.config(daemon).write_text(text.replace("poses:", SECOND.format(address=second, device_id=7002) + "poses:"),
                                           encoding="utf-8")
            self.hang_up(daemon, "reloaded: front untouched, second added")
            far, more_ids = self.look(client)
            self.assertAlmostEqual(near, 2.7, delta=0.2)
            self.assertAlmostEqual(far, 5.7, delta=0.2)
            with Client(second) as other:
                other.send(fire_message(rate_hz=10))
                self.assertEqual(other.ping().source, 7002)

            self.config(daemon).write_text(text.replace("vehicles:", "vehicals:"), encoding="utf-8")
            self.hang_up(daemon, "the configuration stays as it was")
            self.assertIn('did you mean "vehicles"?', daemon.log())
            still, last_ids = self.look(client)
            self.assertAlmostEqual(still, 5.7, delta=0.2)
            ids = ids + more_ids + last_ids
            self.assertEqual(sorted(set(ids)), ids, "no ping twice, none out of order")
            code, _ = daemon.stop()
            self.assertEqual(code, 0, daemon.log())

    def look(self, client):
        """Range of the strongest echo in the newest of a few pings, and the ids of them all."""
        pings = [client.ping() for _ in range(12)]  # those from before the reload go first
        rows_per_m = 1 / pings[-1].resolution
        ball, _, _ = pings[-1].brightest(int(1.0 * rows_per_m), int(7.0 * rows_per_m))
        return ball, [p.id for p in pings]

    def test_the_demo_has_nothing_to_read(self):
        with tempfile.TemporaryFile() as log:
            demo = subprocess.Popen([str(SONARD), "run", "--demo", "--bind", free_address()], stdin=subprocess.DEVNULL, stdout=log,
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
