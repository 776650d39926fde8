"""A driver's tests against sonard: copy this file into your driver's repository and change DRIVER and read_ping.

    DRIVER    the command that starts your driver on ADDRESS and prints one line per ping; here tiny_driver.py
    SONARD    the daemon's program (default: the one in the PATH)
    ADDRESS   of the emulated sonar (default 127.0.0.2); poses and control use it too, so that parallel runs are separate

Run it with: python3 -m unittest test_driver.py
"""
import json
import os
import pathlib
import shlex
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.request

HERE = pathlib.Path(__file__).resolve().parent
SONARD = os.environ.get("SONARD", "sonard")
ADDRESS = os.environ.get("ADDRESS", "127.0.0.2")
DRIVER = os.environ.get("DRIVER", f"{sys.executable} {HERE / 'tiny_driver.py'} {ADDRESS}")

# Three spheres in an arrangement without symmetry: a mirrored or rotated image fails.
CONFIG = f"""
world: {{scene: l-targets.yaml, seed: 1}}
vehicles: [{{name: rov, initial_pose: {{frame: ENU_FLU, xyz_m: [0, 0, 0]}}}}]
sonars: [{{name: front, profile: oculus-m1200d, bind_ip: {ADDRESS}}}]
poses: {{protobuf: "{ADDRESS}:14770", json: "{ADDRESS}:14771"}}
control: {{stream: "{ADDRESS}:14770", http: "{ADDRESS}:8088"}}
"""
NEAR_TO_PORT, NEAR_TO_STARBOARD, FAR_TO_PORT = (3.9, -20), (3.9, 10), (6.9, -8)  # range m, bearing deg, starboard positive


def read_ping(line):
    """Parses a line of your driver: number of the ping, and range and bearing of its bright spots."""
    return json.loads(line)


class Sonar:
    """The emulated device: power on, power off."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.config = pathlib.Path(self.folder.name) / "sonard.yaml"
        self.config.write_text(CONFIG, encoding="utf-8")
        self.process = None

    def power_on(self):
        self.process = subprocess.Popen([SONARD, "run", "--faults", str(self.config)], stdin=subprocess.DEVNULL)
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:  # /healthz answers as soon as drivers can connect
            try:
                with urllib.request.urlopen(f"http://{ADDRESS}:8088/healthz", timeout=1):
                    return
            except OSError:
                if self.process.poll() is not None:
                    raise AssertionError(f"sonard ended with code {self.process.returncode}") from None
                time.sleep(0.05)
        raise AssertionError("sonard is not ready after 60 s")

    def power_off(self):
        """Like a power cut: connections are not closed in order."""
        self.process.kill()
        self.process.wait()

    def request(self, operation, **message):
        """A request of docs/control.md: request("sonar", transmit=False); without a message, it reads: request("faults")."""
        body = json.dumps(message).encode() if message else None
        post = urllib.request.Request(f"http://{ADDRESS}:8088/api/v1/{operation}", body, {"Content-Type": "application/json"})
        with urllib.request.urlopen(post, timeout=60) as reply:
            return json.load(reply)

    def withheld_pings(self):
        """How many pings the fault has withheld until now."""
        return int(self.request("faults")["faults"][0]["injections"])


class Driver:
    """The program under test, and the pings it has published so far."""

    def __init__(self):
        self.pings = []  # (time of arrival, ping)
        self.other_lines = []
        self.errors = tempfile.NamedTemporaryFile("w")  # stderr, shown when a test fails
        self.process = subprocess.Popen(shlex.split(DRIVER), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self.errors,
                                        text=True)
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            try:
                self.pings.append((time.monotonic(), read_ping(line)))
            except (ValueError, KeyError, TypeError):  # not a line of a ping
                self.other_lines.append(line)

    def output(self):
        """The last lines other than pings."""
        errors = pathlib.Path(self.errors.name).read_text(encoding="utf-8", errors="replace")
        return "".join((self.other_lines + errors.splitlines(keepends=True))[-20:]) or "(none)"

    def wait_for_pings(self, count, timeout_s):
        """Returns the next `count` pings."""
        begin, deadline = len(self.pings), time.monotonic() + timeout_s
        while len(self.pings) < begin + count:
            if self.process.poll() is not None:
                self.reader.join(10)  # pings printed just before the end
                if len(self.pings) >= begin + count:
                    break
                raise AssertionError(f"the driver ended with code {self.process.returncode} after {len(self.pings) - begin} of "
                                     f"{count} pings; its output:\n{self.output()}")
            if time.monotonic() > deadline:
                raise AssertionError(f"{len(self.pings) - begin} of {count} pings within {timeout_s} s; "
                                     f"output of the driver:\n{self.output()}")
            time.sleep(0.02)
        return [ping for _, ping in self.pings[begin:begin + count]]

    def stop(self):
        self.process.terminate()
        self.process.wait(10)
        self.reader.join(10)
        self.process.stdout.close()
        self.errors.close()


class DriverTest(unittest.TestCase):
    def setUp(self):
        self.sonar = Sonar()
        self.addCleanup(self.sonar.folder.cleanup)
        self.sonar.power_on()
        self.addCleanup(self.sonar.power_off)
        self.driver = Driver()
        self.addCleanup(self.driver.stop)

    def expect_echo(self, ping, place):
        near = [e for e in ping["bright"] if abs(e[0] - place[0]) < 0.2 and abs(e[1] - place[1]) < 2]
        self.assertTrue(near, f"no echo at {place[0]} m, {place[1]} deg; bright spots: {ping['bright']}")

    def test_targets_are_at_their_ranges_and_bearings(self):
        ping = self.driver.wait_for_pings(3, 100)[-1]
        for place in (NEAR_TO_PORT, NEAR_TO_STARBOARD, FAR_TO_PORT):
            self.expect_echo(ping, place)

    def test_numbers_go_up(self):
        numbers = [ping["number"] for ping in self.driver.wait_for_pings(20, 100)]
        self.assertEqual(numbers, sorted(set(numbers)))  # a driver without time to read misses whole pings

    def test_driver_recovers_after_a_power_cut(self):
        self.driver.wait_for_pings(3, 100)
        self.sonar.power_off()
        time.sleep(4)
        self.sonar.power_on()
        self.driver.wait_for_pings(3, 15)

    def test_driver_recovers_when_the_sonar_hangs(self):
        """A fault on purpose (docs/faults.md): the connection stays open, and no ping comes for 6 s."""
        self.driver.wait_for_pings(3, 100)
        self.sonar.request("faults", **{"name": "hang", "do": "silent-open", "for": {"seconds": 6}})
        time.sleep(6)
        self.driver.wait_for_pings(3, 100)
        # Not by the times of the lines: a busy computer delays them.
        numbers = [ping["number"] for _, ping in self.driver.pings]
        self.assertGreater(self.sonar.withheld_pings(), 0, "the fault had no effect")
        self.assertGreater(max(b - a for a, b in zip(numbers, numbers[1:])), 1, "the driver received every ping")

    def test_no_echo_when_the_transmitter_fails(self):
        def echoes(ping):
            return [e for e in ping["bright"] if abs(e[0] - 3.9) < 0.2 and abs(e[1] + 20) < 2]

        self.driver.wait_for_pings(3, 100)
        self.sonar.request("sonar", sonar="front", transmit=False)
        for _ in range(100):  # the first pings may be of the time before
            if not echoes(self.driver.wait_for_pings(1, 100)[0]):
                break
        self.assertFalse(echoes(self.driver.wait_for_pings(3, 100)[-1]))


if __name__ == "__main__":
    unittest.main()
