"""If sonard ends during a case, there is no verdict on the driver: the case is NOT RUN, with the reason."""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import unittest
import unittest.mock as mock

import common

from sonard_client.daemon import Daemon
from sonard_client.judge import run_case
from sonard_client.judge.scene import Scene

SAYS_READY = "#!/bin/sh\necho ready in 0 s\necho the last words >&2\nexec sleep 1000\n"
NEVER = {"ran": True, "data": "CLEAN", "recovery": "NEVER"}


class SonardEnds(unittest.TestCase):
    def result_of(self, happens):
        """happens(sonard): called during the case."""
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            program = folder / "sonard"
            program.write_text(SAYS_READY)
            program.chmod(0o755)
            spec = {"sonard": str(program), "offset": 1, "profile": "oculus-m1200d", "seed": 1, "fault_engine": False, "ping_bytes": 0}
            with mock.patch.object(run_case, "_with_driver", lambda *arguments: happens(arguments[4])):
                return run_case._with_sonard(spec, folder, None)

    @staticmethod
    def ends(sonard, number=signal.SIGKILL):
        sonard.process.send_signal(number)
        sonard.process.wait()

    def test_never_becomes_not_run_with_the_reason(self):
        def dies(sonard):
            self.ends(sonard)
            return dict(NEVER)
        result = self.result_of(dies)
        self.assertFalse(result["ran"])
        self.assertEqual(result["why"], "sonard ended during the case, killed by SIGKILL: the last words")

    def test_an_error_of_the_judges_own_requests_then_has_the_same_reason(self):
        def dies(sonard):
            self.ends(sonard)
            raise ConnectionRefusedError("no one listens")
        self.assertIn("sonard ended during the case", self.result_of(dies)["why"])

    def test_a_verdict_stays_while_sonard_runs(self):
        self.assertEqual(self.result_of(lambda sonard: dict(NEVER)), NEVER)
        with self.assertRaises(ConnectionRefusedError):
            self.result_of(mock.Mock(side_effect=ConnectionRefusedError))

    def test_how_it_ended(self):
        for script, how in (("#!/bin/sh\necho ready in 0 s\nexit 70\n", "with exit code 70"), (SAYS_READY, "")):
            with tempfile.TemporaryDirectory() as name:
                program = pathlib.Path(name) / "sonard"
                program.write_text(script)
                program.chmod(0o755)
                with Daemon(None, str(program)) as sonard:
                    if how:
                        sonard.process.wait()
                    self.assertEqual(sonard.ended(), how)

    def test_a_wait_ends_with_sonard(self):
        scene = mock.Mock()
        scene.driver.poll.return_value = None
        scene.driver.samples = []
        scene.sonard.ended.return_value = "killed by SIGSEGV"
        with mock.patch("sonard_client.judge.scene.time") as time:
            time.monotonic.return_value = 1.0
            time.sleep.side_effect = AssertionError("it waits for a sonar that does not come back")
            self.assertFalse(Scene.wait(scene, lambda: False, 1000.0))


class TapEnds(unittest.TestCase):
    def test_the_tap_ends_as_the_driver_did(self):
        for script, code in (("kill -ABRT $$", -signal.SIGABRT), ("kill -KILL $$", -signal.SIGKILL), ("exit 3", 3), ("exit 0", 0)):
            # The subscription never becomes ready: only the driver ends.
            tap = ("import sys, time; from sonard_client.judge import ros_tap; ros_tap._subscribe_ros2 = lambda topic: time.sleep(1000); "
                   f"sys.argv[1:] = ['ros2', '/t', '--', 'sh', '-c', {script!r}]; sys.exit(ros_tap.main())")
            path = {**os.environ, "PYTHONPATH": str(common.ROOT / "clients/python")}
            self.assertEqual(subprocess.run([sys.executable, "-B", "-c", tap], env=path, timeout=60, check=False).returncode, code)


if __name__ == "__main__":
    unittest.main()
