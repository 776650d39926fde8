"""Tests the programs with an additional make of sonar (tests/example_make): demo, listen, view, record, replay, doctor and faults work as
for other makes."""
import json
import pathlib
import socket
import unittest

from recording_test import Replay
from running_sonard import SONARCTL, SONARD, Sonard, eventually, run

PORT, PINGS = 23000, 4
PATIENCE = ("--wait", 120)
CHEAP = ["--clock", "stepped", "--threads", 1, "--fixed-fan", 2]


class ExampleMake(unittest.TestCase):
    def ctl(self, *arguments, code=0):
        result = run(SONARCTL, *arguments, patience_s=300)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result.stdout

    def test_sonarctl_listens_views_and_examines(self):
        with Sonard(scene="l-targets.yaml", profile="example-64", arguments=CHEAP[2:]) as daemon:
            device, control = f"{daemon.address}:{PORT}", ("--control", f"{daemon.address}:14770")
            lines = self.ctl("listen", device, "--json", "--pings", PINGS, "--range", 9, "--rate", 5, *PATIENCE).splitlines()
            pings = [json.loads(line) for line in lines]
            self.assertEqual([ping["beams"] for ping in pings if "beams" in ping][:PINGS], [64] * PINGS)
            png = pathlib.Path(daemon.folder.name) / "view.png"
            self.ctl("view", device, "--range", 9, "--png", png, *PATIENCE)
            self.assertTrue(png.read_bytes().startswith(b"\x89PNG"))
            examine = ("doctor", device, "--status-on", daemon.address, *control, "--http", f"{daemon.address}:8088")
            self.assertIn("first ping decoded", self.ctl(*examine, "--within", 120))
            with socket.create_connection((daemon.address, PORT), timeout=60) as driver:
                driver.sendall(b"seventeen bytes!!")
                text = eventually(lambda: "no valid message of settings among them" in (said := run(SONARCTL, *examine).stdout) and said)
            self.assertIn("send settings (type 1) with a rate above 0", text)

    def test_the_make_is_recorded_and_replayed(self):
        with Sonard(scene="l-targets.yaml", profile="example-64", arguments=CHEAP) as daemon:
            folder = pathlib.Path(daemon.folder.name)
            files = {kind: folder / f"run.{kind}" for kind in ("mcap", "pcap", "exs", "raw")}
            outputs = [word for kind, path in files.items() for word in (f"--{kind}", path)]
            self.ctl("record", f"{daemon.address}:{PORT}", "--pings", PINGS, *PATIENCE, *outputs)
            shown = set()
            for path in files.values():
                self.ctl("view", "--from", path, "--ping", PINGS - 1, "--png", folder / "view.png")
                shown.add((folder / "view.png").read_bytes())
            self.assertEqual(len(shown), 1, "every file shows the same picture")
            for path in files.values():
                with self.subTest(path=path.name), Replay(path, "--loop") as replay:
                    lines = self.ctl("listen", f"{replay.address}:{PORT}", "--pings", 2, *PATIENCE)
                    self.assertIn("pings 2", lines)

    def test_faults_change_the_pings_of_the_make(self):
        with Sonard(scene="l-targets.yaml", profile="example-64", arguments=[*CHEAP, "--faults"]) as daemon:
            control = ("--control", f"{daemon.address}:14770")
            self.ctl("fault", "add", "F01", "--with", "bytes=3", "--at", "ping=3", "--name", "junk", *control)
            heard = run(SONARCTL, "listen", f"{daemon.address}:{PORT}", "--pings", 5, *PATIENCE)
            self.assertIn("junk bytes 3", heard.stdout)
            kinds = {kind["code"]: kind.get("without_effect", {}).get("example", "")
                     for kind in json.loads(self.ctl("fault", "kinds", "--json", *control))["kinds"]}
            self.assertEqual(kinds["F01"], "")
            self.assertEqual(kinds["B01"], "only the BlueView link has it")
            self.assertEqual(kinds["G01"], "sends no datagrams of pings")

    def test_the_demo_emulates_the_make(self):
        self.assertIn("example", run(SONARD, "--help").stdout)
        refused = run(SONARD, "--demo", "none").stderr
        self.assertIn("ping1d, s500, dvl, m3, micron, norbit, example, and --profile NAME", refused)


if __name__ == "__main__":
    unittest.main()
