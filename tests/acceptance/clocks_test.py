"""Tests clocks that programs advance. lockstep: a program sends a pose, requests a step, and receives every ping due in it.
follow: a simulator stamps its poses and waits for each answer. Both give the same bytes in every run, independent of the wall
clock."""
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest

from foxglove_viewer import Viewer
from oculus_reader import Client, fire_message, reading
from running_sonard import ROOT, SONARCTL, Sonard, eventually, run

sys.path.insert(0, str(ROOT / "clients/python"))
from sonard_client import Control  # noqa: E402

PINGS, RATE_HZ = 20, 10


def pose_at(t):
    return {"position": (-7 + 0.5 * t, 0, -3 - t), "rpy": (0, 0, 0.3 * t)}


class Clocks(unittest.TestCase):
    def driven(self, clock, drive, pause_s=0.0):
        """Returns PINGS pings, and the digest of the stream; drive(control, n) causes ping n."""
        with Sonard(arguments=["--clock", clock, "--digest", "--exit-after-pings", PINGS]) as daemon:
            with Client(daemon.address) as client:
                client.send(fire_message(version=2, rate_hz=RATE_HZ, range_=5))
                control = self.when_pinging(daemon)
                pings = []
                for n in range(PINGS):
                    drive(control, n)
                    time.sleep(pause_s)
                    pings.append(client.ping())
            code, log = daemon.wait(), daemon.log()
        self.assertEqual(code, 0, log)
        digests = re.findall(r"sha256 ([0-9a-f]{64})", log)
        self.assertEqual(len(digests), 1, log)
        return pings, digests[0]

    def when_pinging(self, daemon):
        """Waits until the sonar has received its client's request."""
        control, deadline = Control(daemon.address), time.monotonic() + 60
        while not control.status()["sonars"][0]["pinging"]:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)
        return control

    def expect_dive(self, pings):
        per_m = (pings[-1].pressure - pings[0].pressure) / ((PINGS - 1) / RATE_HZ)
        self.assertAlmostEqual(per_m, 0.1, delta=0.005, msg="ten metres of water are a bar")
        for n, ping in enumerate(pings):
            self.assertAlmostEqual(ping.pressure - pings[0].pressure, per_m * n / RATE_HZ, delta=1e-4, msg=f"ping {n}")

    def test_lockstep_over_http(self):
        def drive(control, n):
            control.send_pose(**pose_at(n / RATE_HZ))
            try:
                answer = control.step(1 / RATE_HZ)
            except OSError:  # the daemon ends with its last ping
                self.assertEqual(n, PINGS - 1)
            else:
                self.assertEqual(answer, {"now_ns": (n + 1) * 100_000_000, "pings": 1})

        pings, digest = self.driven("lockstep", drive)
        self.expect_dive(pings)
        self.assertEqual(self.driven("lockstep", drive, pause_s=0.02)[1], digest)

    def test_follow_over_http(self):
        def drive(control, n):
            try:
                control.send_pose(**pose_at(n / RATE_HZ), timestamp=1763 + n / RATE_HZ)
            except OSError:
                self.assertEqual(n, PINGS - 1)

        pings, digest = self.driven("follow", drive)
        self.expect_dive(pings)
        self.assertEqual(self.driven("follow", drive, pause_s=0.02)[1], digest)

    def test_step_command(self):
        with Sonard(arguments=["--clock", "lockstep"]) as daemon, Client(daemon.address) as client:
            control = f"{daemon.address}:14770"
            client.send(fire_message(version=2, rate_hz=RATE_HZ, range_=5))
            self.when_pinging(daemon)
            reader = threading.Thread(target=lambda: [client.ping() for _ in range(3)])  # time waits for clients
            reader.start()
            result = run(SONARCTL, "step", "0.05", "--count", "3", "--control", control)
            self.assertEqual(result.returncode, 0, result.stderr)
            lines = result.stdout.splitlines()
            self.assertEqual(lines, ["0.050000000 s  1 ping", "0.100000000 s  0 pings", "0.150000000 s  1 ping"])
            result = run(SONARCTL, "step", "0.1", "--control", control)
            self.assertEqual(result.stdout, "0.250000000 s  1 ping\n")
            reader.join(20)
            self.assertIn("clock lockstep at 0.250 s", run(SONARCTL, "status", "--control", control).stdout)
            # No client receives the pings of this step, so it does not end. Ctrl-C ends the command.
            with subprocess.Popen([str(SONARCTL), "step", "3000", "--control", control], stderr=subprocess.PIPE) as waiting:
                eventually(lambda: "clock lockstep at 0.250 s" not in run(SONARCTL, "status", "--control", control).stdout)
                waiting.send_signal(signal.SIGINT)
                self.assertEqual(waiting.wait(60), 69)
                self.assertIn(b"interrupted before", waiting.stderr.read())
        with Sonard(arguments=["--clock", "stepped"]) as daemon:
            result = run(SONARCTL, "step", "0.1", "--control", f"{daemon.address}:14770")
            self.assertNotEqual(result.returncode, 0)
            self.assertIn("only with clock: lockstep", result.stderr)

    def test_a_step_ends_with_its_connection(self):
        """The client of a long step disconnects; then time stops again. This is tested for every way to request a step."""
        def by_http(daemon, _where):
            asking = socket.create_connection((daemon.address, 8088))
            body = b'{"dt_s": 3000}'
            asking.sendall(b"POST /api/v1/step HTTP/1.1\r\nHost: %s\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n%s"
                           % (daemon.address.encode(), len(body), body))
            return asking.close

        def by_stream(_daemon, where):
            asking = subprocess.Popen([str(SONARCTL), "step", "3000", "--control", where], stderr=subprocess.DEVNULL)

            def leave():
                asking.kill()
                asking.wait(60)
            return leave

        def by_live_view(daemon, _where):
            viewer = Viewer(daemon.address).greeted()
            viewer.wait_for(lambda kind, word: kind == "word" and word["op"] == "advertiseServices")
            viewer.request("/sonard/step", b'{"dt_s": 3000}')
            return viewer.socket.close

        for ask in by_http, by_stream, by_live_view:
            with Sonard(arguments=["--clock", "lockstep"]) as daemon, Client(daemon.address) as client:
                where = f"{daemon.address}:14770"
                client.send(fire_message(version=2, rate_hz=RATE_HZ, range_=5))
                control = self.when_pinging(daemon)
                with reading(client):  # time waits for clients
                    leave = ask(daemon, where)
                    eventually(lambda: int(control.status()["now_ns"]) > 500_000_000)
                    leave()

                    def stands():
                        before = control.status()["now_ns"]
                        time.sleep(0.5)
                        return control.status()["now_ns"] == before
                    eventually(stands)
                    now_ns = int(control.status()["now_ns"])
                    self.assertLess(now_ns, 2000e9, ask.__name__)
                    self.assertEqual(control.step(0.25)["now_ns"], now_ns + 250_000_000, "the next step has its whole length")


if __name__ == "__main__":
    unittest.main(verbosity=2)
