"""Runs every tutorial as a reader would: writes its files, runs its commands in one shell, and checks the promised results."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from running_sonard import BUILD, ROOT

PYTHON = ROOT / "clients/python"
ENDING = "trap 'kill $(jobs -p) 2>&- || true; wait || true' EXIT\n"  # ends a daemon in the background when the shell ends
sys.path.insert(0, str(PYTHON / "tests"))
import made_logs  # noqa: E402  pylint: disable=wrong-import-position


def follow(name, folder):
    """Runs the commands of a tutorial in `folder`; returns (exit code, output)."""
    text = (ROOT / "docs/tutorials" / name).with_suffix(".md").read_text(encoding="utf-8")
    for file, content in re.findall(r"`(\w+\.yaml)`:\n\n```yaml\n(.*?)^```", text, re.M | re.S):
        (folder / file).write_text(content, encoding="utf-8")
    commands = "".join(re.findall(r"^```sh\n(.*?)^```", text, re.M | re.S))
    programs = os.pathsep.join(str((BUILD / part).resolve()) for part in ("daemon", "clients"))
    environment = {**os.environ, "PATH": programs + os.pathsep + os.environ["PATH"], "PYTHON": str(PYTHON), "HOME": str(folder),
                   "PYTHONDONTWRITEBYTECODE": "1", "DOCS": str(ROOT / "docs"), "SCENES": str(ROOT / "scenes")}
    environment.pop("PYTHONPATH", None)
    # Output goes to a file: a daemon in the background would keep a pipe open.
    with open(folder / "output.txt", "w+", encoding="utf-8") as output:
        done = subprocess.run(["bash", "-eu", "-o", "pipefail", "-c", ENDING + commands], cwd=folder, env=environment,
                              stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, timeout=600, check=False)
        output.seek(0)
        return done.returncode, output.read()


class Tutorials(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def follow(self, name):
        code, output = follow(name, self.folder)
        self.assertEqual(code, 0, output)
        return output

    def test_first_driver_test(self):
        self.assertIn("OK", self.follow("first-driver-test").splitlines())

    def test_first_data_set(self):
        self.assertIn("0000000001.labels.png", self.follow("first-data-set"))
        for file in ("contact.png", "README.md", "manifest.json", "shard-000001.tar"):
            self.assertTrue((self.folder / "mines" / file).is_file(), file)

    def test_with_your_autopilot(self):
        (self.folder / "flight.tlog").write_bytes(made_logs.telemetry_log(("ODOMETRY", "SIM_STATE"), 4))
        self.follow("with-your-autopilot")
        self.assertIn("front", (self.folder / "status.txt").read_text(encoding="utf-8"))
        self.assertTrue((self.folder / "ping.png").read_bytes().startswith(b"\x89PNG"))
        self.assertEqual(len(list((self.folder / "pings").glob("*.png"))), 2)


if __name__ == "__main__":
    unittest.main()
