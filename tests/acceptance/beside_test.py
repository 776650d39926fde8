"""Tests --offset (two demos on one computer, which sonarctl can both reach) and --clients."""
import json
import signal
import socket
import subprocess
import tempfile
import time
import unittest

from running_sonard import SONARCTL, SONARD, run

class Demo:
    """with Demo(3, "--clients", "2") as demo: ..."""

    def __init__(self, offset, *arguments):
        self.offset, self.arguments = offset, arguments
        self.address, self.control = f"127.0.{offset}.2", f"127.0.0.1:{14770 + 10 * offset}"

    def __enter__(self):
        self.log = tempfile.TemporaryFile("w+b")
        self.process = subprocess.Popen([str(SONARD), "run", "--demo", "--offset", str(self.offset), *self.arguments],
                                        stdin=subprocess.DEVNULL, stdout=self.log, stderr=subprocess.STDOUT)
        deadline = time.monotonic() + 60
        while "ready in" not in self.text():
            if self.process.poll() is not None or time.monotonic() > deadline:
                text = self.text()
                self.__exit__()
                raise AssertionError(text)
            time.sleep(0.02)
        return self

    def text(self):
        self.log.seek(0)
        return self.log.read().decode()

    def status(self):
        return json.loads(run(SONARCTL, "status", "--json", "--control", self.control).stdout)

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.log.close()


class Beside(unittest.TestCase):
    def test_two_demos_run_beside_each_other(self):
        with Demo(0) as first, Demo(1) as second:
            for demo in (first, second):
                self.assertIn(f"Connect your driver to {demo.address}.", demo.text())
                self.assertNotIn("continuing without", demo.text())
                status = demo.status()
                self.assertEqual(status["sonars"][0]["listens"], f"{demo.address}:52100")
                self.assertEqual(status["http"], f"127.0.0.1:{8088 + 10 * demo.offset}")
                heard = run(SONARCTL, "listen", demo.address, "--wait", "100", "--pings", "2", "--quiet")
                self.assertEqual(heard.returncode, 0, heard.stdout + heard.stderr)
                found = json.loads(run(SONARCTL, "doctor", "--control", demo.control, "--json", "--within", "40").stdout)
                self.assertEqual(found["errors"], 0, found)
                texts = " ".join(f["text"] for f in found["findings"])
                self.assertIn(f"tcp {demo.address}:52100 accepts", texts)
                self.assertIn(f"http://127.0.0.1:{8088 + 10 * demo.offset}/healthz returns ok", texts)
                # doctor receives the other demo's broadcast too, and must not report a duplicate device id.
                alike = [f["text"] for f in found["findings"] if "same device id" in f["text"] and demo.address in f["text"]]
                self.assertEqual(alike, [])
            moved = run(SONARCTL, "pose", "once", "--xyz", "1,2,-3", "--to", f"127.0.0.1:{14770 + 10 * second.offset}")
            self.assertEqual(moved.returncode, 0, moved.stderr)
            deadline = time.monotonic() + 20
            while second.status()["poses"].get("accepted") != "1" and time.monotonic() < deadline:
                time.sleep(0.05)
            self.assertEqual(second.status()["vehicles"][0]["position"], {"x": 1, "y": 2, "z": -3})
            self.assertEqual(first.status()["vehicles"][0]["source"], "demo orbit")

            third = run(SONARD, "run", "--demo", "--offset", "0")
            self.assertEqual(third.returncode, 69)
            self.assertIn("port in use by another program (another sonard? --offset 1, 2, ...", third.stderr)

    def test_more_clients_are_served_at_a_time(self):
        with Demo(2, "--clients", "3") as demo:
            with socket.create_connection((demo.address, 52100)), socket.create_connection((demo.address, 52100)):
                heard = run(SONARCTL, "listen", demo.address, "--wait", "100", "--pings", "2", "--quiet")
                self.assertEqual(heard.returncode, 0, heard.stdout + heard.stderr)
                self.assertEqual(len(demo.status()["sonars"][0]["clients"]), 2)


if __name__ == "__main__":
    unittest.main()
