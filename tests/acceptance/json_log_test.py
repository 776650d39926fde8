"""Tests `sonard run --log-format json`. Every line of the log stream is an object, from the banner to the last line. The text
format is unchanged."""
import json
import pathlib
import subprocess
import tempfile
import time
import unittest

from running_sonard import BUILD, ROOT, SONARCTL, SONARD, Sonard, run


def objects(test, text):
    lines = [json.loads(line) for line in text.splitlines()]
    for line in lines:
        test.assertLessEqual({"time", "level", "message"}, line.keys())
    return lines


class JsonLog(unittest.TestCase):
    def test_a_run_from_banner_to_summary(self):
        with Sonard(arguments=["--log-format", "json", "--log-level", "warning"]) as daemon:
            self.assertEqual(daemon.stop()[0], 0)
            messages = [line["message"] for line in objects(self, daemon.log())]
        self.assertRegex(messages[0], r"^sonard \d+\.\d+")
        for start in ["config ", "scene ", "sonar ", "tcp ", "status ", "pose ", "control ", "seed ", "ready in ", "resident memory "]:
            self.assertTrue(any(m.startswith(start) for m in messages), f"{start}: {messages}")

    def test_standard_output_is_the_same_with_both_formats(self):
        for arguments in [["--log-format", "json"], []]:
            with self.subTest(arguments=arguments), tempfile.TemporaryDirectory() as folder:
                config, log, address = pathlib.Path(folder) / "sonard.yaml", pathlib.Path(folder) / "log", "127.0.0.9"
                config.write_text(f"""\
world: {{scene: {ROOT}/scenes/demo.yaml}}
vehicles: [{{name: rov}}]
sonars: [{{name: front, profile: oculus-m1200d, bind_ip: {address}, status_to: [{address}]}}]
poses: {{protobuf: "{address}:14770", json: "{address}:14771"}}
control: {{stream: off, http: off}}
""", encoding="utf-8")
                with open(log, "wb") as errors, subprocess.Popen(
                        [str(SONARD), "run", str(config), "--digest", "--exit-after-pings", "1", *arguments], stdin=subprocess.DEVNULL,
                        stdout=subprocess.PIPE, stderr=errors) as process:
                    deadline = time.monotonic() + 60
                    while process.poll() is None and b"ready in" not in log.read_bytes() and time.monotonic() < deadline:
                        time.sleep(0.02)
                    driver = run(SONARCTL, "listen", address, "--wait", "100", "--seconds", "100", "--quiet")
                    output = process.communicate(timeout=60)[0].decode()
                self.assertRegex(output, r"^sha256 [0-9a-f]{64}  front client 1  \d+ bytes\n$", driver.stderr)
                text = log.read_text(encoding="utf-8")
                if arguments:
                    objects(self, text)
                else:
                    self.assertRegex(text, r"(?m)^  tcp +127")
                    self.assertRegex(text, r"(?m)^resident memory ")

    def test_errors_of_the_start_are_objects_too(self):
        missing = BUILD / "none.yaml"
        result = run(SONARD, "run", missing, "--log-format", "json")
        self.assertEqual(result.returncode, 66)
        (line,) = objects(self, result.stderr)
        self.assertEqual(line["level"], "error")
        self.assertIn("none.yaml", line["message"])
        result = run(SONARD, "run", "--demo", "--bind", "192.0.2.7", "--log-format", "json")
        self.assertEqual(result.returncode, 69)
        self.assertIn("192.0.2.7", objects(self, result.stderr)[-1]["message"])
        self.assertEqual(run(SONARD, "run", missing).stderr[:8], "sonard: ")

    def test_names_that_are_not_utf8_are_repaired(self):
        result = subprocess.run([str(SONARD), "run", b"no\xff.yaml", "--log-format", "json"], stdin=subprocess.DEVNULL,
                                capture_output=True, timeout=60, check=False)
        self.assertEqual(result.returncode, 66)
        self.assertIn("no\ufffd.yaml", json.loads(result.stderr.decode("utf-8"))["message"])


if __name__ == "__main__":
    unittest.main()
