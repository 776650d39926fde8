"""Tests `sonarctl fault` with a running daemon: a fault acts on a connection, is listed, written to the journal, recorded, and
ends."""
import json
import pathlib
import signal
import socket
import subprocess
import tempfile
import time
import unittest

import mcap_checker
from running_sonard import SONARCTL, Sonard, run


class Faults(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard(arguments=("--faults",)).__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def tearDown(self):
        self.does("reset")

    def fault(self, *words):
        return run(SONARCTL, "fault", *words, "--control", f"{self.daemon.address}:14770")

    def does(self, *words):
        result = self.fault(*words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def refuses(self, code, words, *expected):
        result = self.fault(*words)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        for word in expected:
            self.assertIn(word, result.stderr)

    def listed(self):
        return {f["name"]: f for f in json.loads(self.does("list", "--json"))["faults"] if f["state"] != "over"}

    def test_a_fault_acts_is_listed_and_is_removed(self):
        self.assertIn("port-closed is added", self.does("add", "port-closed", "--name", "cut", "--seconds", "60"))
        self.assertRegex(self.does("list"), r"(?m)^cut +L01 +port-closed +front +active .* ends in [3-6]\d\.\d s$")
        with self.assertRaises(ConnectionRefusedError):
            socket.create_connection((self.daemon.address, 52100), 10)
        self.assertIn("fault cut is ended", self.does("remove", "cut"))
        self.assertNotIn("cut", self.listed())
        socket.create_connection((self.daemon.address, 52100), 10).close()
        self.refuses(65, ("remove", "cut"), 'no fault "cut"')
        for name in ("silent-open", "L05"):  # a fault without a name is ended by the name or the code of its kind
            self.does("add", "silent-open")
            self.assertRegex(self.does("list"), r"(?m)^silent-open +L05 ")
            self.does("remove", name)

    def test_every_part_of_a_record_reaches_the_daemon(self):
        self.does("add", "F01", "--with", "bytes=1", "--with", "fill=zero", "--at", "ping=200", "--sonar", "front", "--client", "newest",
                  "--name", "cut", "--count", "3")
        for number, at in enumerate((("every=50", "phase=7"), ("on=connect",), ("time_s=4000",), ("probability=0.01",))):
            self.does("add", ("L05", "S02", "F19", "F15")[number], "--name", f"at-{number}", *(word for t in at for word in ("--at", t)))
        listed = self.listed()
        self.assertEqual(sorted(listed), ["at-0", "at-1", "at-2", "at-3", "cut"])
        self.assertEqual({f["state"] for f in listed.values()}, {"waiting"})
        self.does("reset")
        self.assertEqual(self.listed(), {})

    def test_a_trouble_is_removed_by_its_name(self):
        self.does("add", "electrical-noise", "--with", "severity=1")
        self.assertEqual(sorted(self.listed()), [f"electrical-noise.{n}" for n in (1, 2, 3)])
        self.does("remove", "electrical-noise")
        self.assertEqual(self.listed(), {})

    def test_wrong_requests_are_refused_with_the_mistake(self):
        self.refuses(65, ("add", "silent-opne"), 'did you mean "silent-open"?')
        self.refuses(65, ("add", "F01", "--with", "bytes=0"), "bytes must be a whole number from 1 to 4096")
        self.refuses(65, ("add", "L05", "--sonar", "stern"), 'no sonar is called "stern"')
        self.refuses(64, ("add", "F01", "--with", "bytes"), "NAME=VALUE")
        self.refuses(64, ("add", "F01", "--at", "pign=3"), 'did you mean "ping"?')
        self.refuses(64, ("add", "F01", "--at", "ping=x"), "is not a whole number")
        self.refuses(64, ("add",))
        refused = run(SONARCTL, "fault", "list", "--control", "127.0.0.9:14770")
        self.assertEqual(refused.returncode, 69, refused.stderr)

    def test_the_catalogue_and_the_table(self):
        kinds = self.does("kinds")
        self.assertRegex(kinds, r"(?m)^L05 +silent-open .* 6 s\.  keep-status=yes \(yes\|no\)$")
        self.assertIn("power-cycle", kinds)
        catalogue = json.loads(self.does("kinds", "--json"))
        self.assertEqual(len(catalogue["troubles"]), 12)
        own = run(SONARCTL, "fault", "kinds", "--json")  # no daemon listens at the default address of these tests
        self.assertEqual(own.returncode, 0, own.stderr)
        own = json.loads(own.stdout)
        self.assertEqual([{**kind, "without_effect": {}} for kind in catalogue["kinds"]], [{**kind, "without_effect": {}} for kind in own["kinds"]])
        self.assertEqual([t["codes"] for t in catalogue["troubles"]], [t["codes"] for t in own["troubles"]])
        rows = self.does("list", "--support").splitlines()
        self.assertIn("oculus", rows[0])
        self.assertTrue(any(row.startswith("| L05 | silent-open | 1 | takes effect | takes effect |") for row in rows))
        self.assertTrue(any("needs two network namespaces" in row for row in rows))

    def test_the_journal_lists_the_faults(self):
        follow = subprocess.Popen([str(SONARCTL), "fault", "journal", "--follow", "--json", "--control", f"{self.daemon.address}:14770"],
                                  stdout=subprocess.PIPE, text=True)
        self.does("add", "L05", "--name", "followed", "--seconds", "30")
        deadline = time.monotonic() + 60
        entry = {}
        while entry.get("fault") != "followed" and time.monotonic() < deadline:
            entry = json.loads(follow.stdout.readline())
        follow.send_signal(signal.SIGINT)
        follow.communicate(timeout=20)
        self.assertEqual((entry["event"], entry["kind"], entry["sonar"]), ("began", "L05", "front"))
        self.assertEqual(follow.returncode, 0)
        self.assertIn("fault followed (L05) began  front", self.does("journal"))


class Recorded(unittest.TestCase):
    def test_a_recording_has_the_journal_of_its_sonar(self):
        with tempfile.TemporaryDirectory() as folder, Sonard(more=f"recording: {{folder: {folder}}}", arguments=("--faults",)) as daemon:
            def ctl(*words):
                result = run(SONARCTL, *words, "--control", f"{daemon.address}:14770")
                self.assertEqual(result.returncode, 0, result.stderr)
                return result.stdout

            ctl("recording", "start", "run.mcap")
            ctl("fault", "add", "F01", "--with", "bytes=3", "--at", "ping=3", "--name", "junk")
            daemon.ctl("listen", "--pings", "5", "--quiet")
            ctl("recording", "stop")
            checked = mcap_checker.check(pathlib.Path(folder, "run.mcap").read_bytes())
            entries = [json.loads(data) for topic, _, data in checked.messages if topic == "/faults"]
            journal = [json.loads(line) for line in ctl("fault", "journal", "--json").splitlines()]
        self.assertEqual(entries, journal)
        self.assertEqual([(e["event"], e["fault"]) for e in entries if e["event"] == "injected"], [("injected", "junk")])


class NotArmed(unittest.TestCase):
    def test_faults_are_refused(self):
        with Sonard() as daemon:
            control = ("--control", f"{daemon.address}:14770")
            refused = run(SONARCTL, "fault", "add", "L05", *control)
            self.assertEqual(refused.returncode, 65)
            self.assertIn("faults are not armed: start the daemon with sonard run --faults", refused.stderr)
            self.assertIn("not armed", run(SONARCTL, "fault", "list", *control).stdout)


if __name__ == "__main__":
    unittest.main()
