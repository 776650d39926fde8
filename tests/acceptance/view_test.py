"""Tests sonarctl view in the terminal and live: letters for pipes, and colours for terminals, which are restored at the end."""
import os
import pathlib
import pty
import re
import select
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

from oculus_reader import Client, fire_message
from running_sonard import SONARCTL, Sonard, eventually, run


def in_a_terminal(command, until, end, **environment):
    """Returns the output of a command on a separate terminal; `end(process)` is called after the text `until`."""
    master, slave = pty.openpty()
    variables = {**os.environ, "TERM": "xterm-256color", "LC_ALL": "C.UTF-8", "COLUMNS": "60", "LINES": "24", **environment}
    variables.pop("NO_COLOR", None)
    process = subprocess.Popen([str(c) for c in command], stdin=slave, stdout=slave, stderr=slave, env=variables)
    os.close(slave)
    output, ended, deadline = b"", False, time.monotonic() + 200
    while time.monotonic() < deadline:
        if not select.select([master], [], [], 0.2)[0]:
            continue
        try:
            data = os.read(master, 65536)
        except OSError:  # the other end is closed
            break
        output += data
        if not data:
            break
        if not ended and until in output:
            end(process)
            ended = True
    os.close(master)
    return process.wait(20), output.decode(errors="replace")


class View(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard().__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def test_a_pipe_gets_letters(self):
        result = self.daemon.ctl("view", "--term")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("\x1b", result.stdout)
        self.assertTrue(result.stdout.isascii())
        self.assertIn(" 9 m\n", result.stdout)
        lines = result.stdout.splitlines()
        self.assertGreater(len(lines), 8)
        self.assertRegex(lines[-1], r"^ping \d+  \d+\.\d\d m  2\.\d+ MHz  512 beams x \d+ rows$")

    def test_a_terminal_shows_colours_and_is_restored_at_the_end(self):
        code, output = in_a_terminal([SONARCTL, "view", self.daemon.address, "--wait", "100", "--term", "--live"], b" Hz  ",
                                     lambda process: process.send_signal(signal.SIGINT))
        self.assertEqual(code, 0, output[-500:])
        self.assertTrue(output.startswith("\x1b[?1049h\x1b[?25l"))
        self.assertTrue(output.endswith("\x1b[?25h\x1b[?1049l"), repr(output[-100:]))
        self.assertIn("\u2580", output)
        self.assertIn("38;5;", output)

    def test_a_file_is_kept_up_to_date(self):
        with tempfile.TemporaryDirectory() as folder:
            png = pathlib.Path(folder) / "ping.png"
            result = self.daemon.ctl("view", "--png", png, "--live", "--pings", "3", "--width", "200")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(len(result.stdout.splitlines()), 3)
            self.assertEqual(png.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
            self.assertEqual([p.name for p in pathlib.Path(folder).iterdir()], ["ping.png"])  # no unfinished file remains

    def test_the_recording_that_is_read_is_not_replaced(self):
        with tempfile.TemporaryDirectory() as folder:
            recording = pathlib.Path(folder) / "run.mcap"
            result = self.daemon.ctl("record", "--mcap", recording, "--pings", "2")
            self.assertEqual(result.returncode, 0, result.stderr)
            before = recording.read_bytes()
            result = run(SONARCTL, "view", "--from", recording, "--png", recording)
            self.assertEqual(result.returncode, 64)
            self.assertIn("is the recording that is read", result.stderr)
            self.assertEqual(recording.read_bytes(), before)

    def test_listen_ends_when_its_reader_has_gone(self):
        with subprocess.Popen([str(SONARCTL), "listen", self.daemon.address, "--wait", "100"], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE) as listener:
            listener.stdout.readline()
            listener.stdout.close()
            self.assertEqual(listener.wait(200), 0, listener.stderr.read())

    def test_beside_a_driver_view_is_an_observer(self):
        control = ("--control", f"{self.daemon.address}:14770")
        with tempfile.TemporaryDirectory() as folder, Client(self.daemon.address) as driver:
            driver.send(fire_message(range_=3.0))
            reads = threading.Thread(target=self.read_until_closed, args=(driver,))
            reads.start()
            try:
                png = pathlib.Path(folder) / "ping.png"
                for command in (("view", "--png", png, "--live", "--pings", "2"), ("view", "--png", png), ("stats",),
                                ("listen", "--pings", "2"), ("listen", "--observe", "--pings", "2", "--range", "7")):
                    result = self.daemon.ctl(command[0], *command[1:], *control)
                    self.assertEqual(result.returncode, 0, (command, result.stdout, result.stderr))
                    self.assertIn(f"sonarctl: connected to {self.daemon.address}:", result.stderr)
                refused = self.daemon.ctl("view", "--png", png, "--control", f"{self.daemon.address}:1")
                self.assertEqual(refused.returncode, 74, refused.stderr)
                self.assertIn("connecting as an observer failed too: ", refused.stderr)
                status = run(SONARCTL, "status", *control).stdout
                self.assertRegex(status, r"clients +1 now, \d+ since")
                self.assertIn("  3 m  ", status)
                self.assertIn(f"observers at {self.daemon.address}:", status)
            finally:
                driver.socket.shutdown(socket.SHUT_RDWR)
                reads.join(20)

    def test_an_observer_connects_again_after_a_restart_of_sonard(self):
        for words in (("--observe",), ("--make", "oculus")):  # the second gets no slot initially, but one after the restart
            with self.subTest(words), Sonard() as daemon:
                control = ("--control", f"{daemon.address}:14770")
                said, pings = (pathlib.Path(daemon.folder.name) / name for name in ("said", "pings"))
                with said.open("w") as errors, pings.open("w") as output, Client(daemon.address) as driver:
                    driver.send(fire_message())
                    reads = threading.Thread(target=self.read_until_closed, args=(driver,))
                    reads.start()
                    with subprocess.Popen([SONARCTL, "listen", daemon.address, *words, *control], stdout=output, stderr=errors) as watches:
                        try:
                            eventually(lambda: len(pings.read_text().splitlines()) > 2)
                            self.assertIn(" as an observer: ", said.read_text())
                            daemon.stop()
                            daemon.restart()
                            eventually(lambda: "connected again" in said.read_text() or watches.poll() is not None)
                            before = len(pings.read_text().splitlines())
                            if "--observe" in words:
                                self.assertEqual(daemon.ctl("listen", "--pings", 4).returncode, 0)
                            eventually(lambda: len(pings.read_text().splitlines()) > before or watches.poll() is not None)
                            self.assertIsNone(watches.poll(), said.read_text())
                        finally:
                            watches.send_signal(signal.SIGINT)
                            driver.socket.shutdown(socket.SHUT_RDWR)
                            reads.join(20)
                    self.assertEqual(watches.returncode, 0, said.read_text())

    @staticmethod
    def read_until_closed(client):
        try:
            while True:
                client.message()
        except (OSError, EOFError, AssertionError):
            pass

    def test_a_wait_for_the_first_ping_is_reported(self):
        with Sonard(arguments=["--clock", "lockstep"]) as daemon, tempfile.TemporaryDirectory() as folder:
            for command in (("listen",), ("listen", "--json"), ("view", "--live", "--png", f"{folder}/a.png"), ("view", "--png", f"{folder}/b.png"),
                            ("record", "--raw", f"{folder}/c")):
                with self.subTest(command), subprocess.Popen([SONARCTL, command[0], daemon.address, *command[1:]], stdout=subprocess.DEVNULL,
                                                             stderr=subprocess.PIPE, text=True) as waits:
                    said = waits.stderr.readline()
                    waits.terminate()
                    waits.stderr.read()
                    self.assertRegex(said, rf"connected to {daemon.address}:52100, .*; requested pings; waiting for the first one, at most 10 s")

    def test_a_value_that_the_sonar_limits_is_reported_once(self):
        with tempfile.TemporaryDirectory() as folder:
            for command in (("view", "--png", f"{folder}/a.png"), ("view", "--live", "--pings", "3", "--png", f"{folder}/b.png"),
                            ("record", "--pings", "3", "--raw", f"{folder}/c"), ("listen", "--pings", "3"), ("stats",)):
                result = self.daemon.ctl(*command, "--range", "15")
                self.assertEqual(result.returncode, 0, result.stderr)
                told = re.findall(r"the sonar limits the request: range (?:9\.99|10\.00) m, not 15 m", result.stderr)
                self.assertEqual(len(told), 1, (command, result.stderr))

    def test_contradictions_are_named(self):
        for arguments, word in [((), "--term"), (("--term", "--live", "--from-raw", "x"), "--ping"),
                                (("--term", "--pings", "3"), "--live")]:
            result = self.daemon.ctl("view", *arguments)
            self.assertEqual(result.returncode, 64)
            self.assertIn(word, result.stderr)


if __name__ == "__main__":
    unittest.main()
