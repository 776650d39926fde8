"""Tests docs/bvtsdk.md, "BlueView in five minutes": the banner's text, the first picture, and the program as printed there."""
import pathlib
import re
import signal
import subprocess
import tempfile
import time
import unittest

from prefixes import BUILD, ROOT, Sonard, prefix, run
from running_sonard import SONARCTL


class FiveMinutes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.at = pathlib.Path(cls.folder.name)
        cls.daemon = Sonard(profile="blueview-p900-90", trajectory="orbit",
                            mount="{frame: FRD, xyz_m: [0.3, 0, 0.1], rpy_deg: [0, -15, 0]}\n"
                                  "    options: {before_first_fire: pings}").__enter__()  # left from an Oculus
        cls.address = cls.daemon.address

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()
        cls.folder.cleanup()

    def test_the_banner_says_how_a_host_connects(self):
        text = self.daemon.log()
        self.assertIn(f'BVTSonar_Open(sonar, "NET", "{self.address}")', text)
        self.assertIn(f"LD_LIBRARY_PATH={BUILD}/bvt4/lib", text)
        self.assertIn(f"sonarctl view {self.address} --png ping.png", text)

    def test_an_oculus_option_without_effect_is_reported(self):
        note = "sonar front: options.before_first_fire is for Oculus sonars: without effect on BlueView P900-90"
        self.assertIn(f"info  {note}", self.daemon.log())
        self.daemon.process.send_signal(signal.SIGHUP)
        deadline = time.monotonic() + 60
        while "reloaded: " not in self.daemon.log() and time.monotonic() < deadline:
            time.sleep(0.05)
        self.assertIn(f"info  reload: {note}", self.daemon.log())

    def test_the_first_commands_of_the_page_work(self):
        result = run(SONARCTL, "view", self.address, "--wait", "100", "--png", self.at / "ping.png", "--width", "600")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, r"ping.png: 600 x \d+ pixels, 315 rows x 512 beams, 10.00 m")
        result = run(SONARCTL, "listen", self.address, "--wait", "100", "--pings", "3", "--range", "5")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(f"connected to {self.address}:14750, BlueView P900-90, serial 7001", result.stdout)
        self.assertRegex(result.stdout, r"ping \d+  118 x 512  16 bit  5.00 m  0.9000 MHz")
        result = run(SONARCTL, "stats", self.address, "--wait", "100")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("window.correlation_of_adjacent_beams", result.stdout)

    def test_doctor_finds_no_error(self):
        for control in (14770, 1):  # also without a control stream
            result = run(SONARCTL, "doctor", self.address, "--control", f"{self.address}:{control}", "--http",
                         f"{self.address}:8088", "--within", "60", "--status-on", self.address)
            self.assertIn(f"tcp {self.address}:14750 accepts, first ping decoded after", result.stdout)
            self.assertIn("BlueView head BlueView P900-90 (7001) answers discovery", result.stdout)
            self.assertNotIn("start it", result.stdout)
            if control == 14770:
                self.assertEqual(result.returncode, 0, result.stdout)
                self.assertNotRegex(result.stdout, r"(?m)^fail")
            self.assertNotIn("52102", result.stdout, "heads send no status")

    def test_the_program_of_the_page_works(self):
        page = (ROOT / "docs/bvtsdk.md").read_text(encoding="utf-8")
        program = re.search(r"```c\n(.*?)```.*?```\n(.*?)```", page, re.S)
        (self.at / "first.c").write_text(program[1].replace("127.0.0.2", self.address), encoding="utf-8")
        commands = program[2].replace("/usr/lib/sonard/bvt4", str(prefix(4)))
        self.assertIn("gcc first.c", commands)
        result = subprocess.run(["bash", "-ec", commands], cwd=self.at, capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual((result.returncode, result.stdout), (0, "first.ppm\n"), result.stderr)
        picture = (self.at / "first.ppm").read_bytes()
        self.assertTrue(picture.startswith(b"P6\n"))
        self.assertGreater(len(set(picture[100:])), 50, "the image has many shades")


if __name__ == "__main__":
    unittest.main()
