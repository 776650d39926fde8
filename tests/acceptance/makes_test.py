"""Checks that a change does not alter the output of any make of sonar. In stepped time it compares with makes_expected.json: the
bytes and samples of a recording, the lines of `sonarctl listen`, the picture of `sonarctl view` and the findings of `sonarctl
doctor`. The table of fault support is pinned by fault_docs_test.

`makes_test.py --write` writes the file anew, with SONARD_BUILD set.
"""
import hashlib
import json
import os
import pathlib
import re
import sys
import unittest

os.environ.update(SONARD_SIMD="portable", SONARD_EMBREE_ISA="sse2")  # the same on every processor: samples differ in their last digits

import mcap_checker  # noqa: E402
from recording_test import Replay  # noqa: E402
from running_sonard import SONARCTL, Sonard, run  # noqa: E402

EXPECTED = pathlib.Path(__file__).with_name("makes_expected.json")
# The port, and settings for `sonarctl listen`.
MAKES = {"oculus-m1200d": (52100, "--range", 3, "--gain", 60, "--rate", 5, "--mode", 1),
         "blueview-p900-90": (14750, "--range", 3, "--gain", 60, "--rate", 5, "--mode", 1),
         "aris-3000": (56888, "--range", 3, "--gain", 60, "--rate", 5),
         "waterlinked-3d15": (80, "--range", 3, "--mode", 2),
         "ping360": (12345, "--range", 3, "--gain", 60),
         "surveyor-240": (62312, "--range", 3, "--gain", 60, "--rate", 5),
         "omniscan-450": (51200, "--range", 3, "--gain", 60, "--rate", 5),
         "ping1d": (9090, "--range", 3, "--gain", 60, "--rate", 5),
         "s500": (51200, "--make", "s500", "--range", 3, "--gain", 60, "--rate", 5),
         "dvl-a50": (16171, "--as-it-is"),  # it pings before it receives settings
         "m3": (20001, "--as-it-is"),  # it receives no settings
         "micron": (4001, "--range", 3, "--gain", 60),
         "norbit-wbms": (2210, "--range", 3, "--gain", 60, "--rate", 5)}
WATERFALLS = ("omniscan-450", "ping1d", "s500", "dvl-a50")
PINGS = 4
LONGEST_BEACON = 142  # bytes; beacons hold the address, which differs from run to run
PATIENCE = ("--wait", 120)
# Settings that need little computing time.
CHEAP = ["--clock", "stepped", "--threads", 1, "--fixed-fan", 2]
for part in ("volume", "conical", "crosstalk", "shared-noise", "defocus", "uneven"):
    CHEAP += [f"--{part}", "off"]
VOLATILE = {"at_s", "rate_hz", "interval_max_ms", "interval_p50_ms", "interval_p99_ms"}


def pixels_of(png):
    """Returns the SHA-256 of the decoded pixels, so that filters and zlib have no influence."""
    import PIL.Image  # python3-pil

    with PIL.Image.open(png) as picture:
        return hashlib.sha256(picture.convert("RGB").tobytes()).hexdigest()


def steady(value):
    """Removes fields that depend on the time of day."""
    if isinstance(value, dict):
        return {name: steady(inner) for name, inner in value.items() if name not in VOLATILE}
    return [steady(inner) for inner in value] if isinstance(value, list) else value


class Observed:
    """Observes one make, with a run of the daemon for each command."""

    def __init__(self, profile):
        self.profile, self.seen = profile, {}
        self.port, *self.settings = MAKES[profile]
        for observe in (self.record_and_listen, self.view, self.examine):
            with Sonard(scene="l-targets.yaml", profile=profile, trajectory="orbit", more="recording: {folder: .}",
                        mount="{frame: FRD, xyz_m: [0.3, 0, 0.1], rpy_deg: [0, -15, 0]}", arguments=CHEAP) as daemon:
                observe(daemon, f"{daemon.address}:{self.port}", ("--control", f"{daemon.address}:14770"))

    def ctl(self, *arguments, fails=False):
        result = run(SONARCTL, *arguments, patience_s=300)
        assert fails or result.returncode == 0, f"{self.profile} {arguments}: {result.stdout}{result.stderr}"
        return result

    def record_and_listen(self, daemon, device, control):
        self.ctl("recording", "start", "run.mcap", *control)
        lines = self.ctl("listen", device, "--json", "--pings", PINGS, *self.settings, *PATIENCE).stdout
        self.ctl("recording", "stop", *control)
        self.seen["listen"] = [steady(json.loads(line)) for line in lines.splitlines()]
        recorded = {}
        for topic, _, data in mcap_checker.check((pathlib.Path(daemon.folder.name) / "run.mcap").read_bytes()).messages:
            recorded.setdefault(topic, []).append(data)
        served = recorded.get("/front/device", []) + recorded.get("/front/status", [])
        for what, messages in (("served", [m for m in served if len(m) > LONGEST_BEACON]), ("image", recorded["/front/image"])):
            self.seen[what] = [hashlib.sha256(message).hexdigest() for message in messages[:PINGS]]

    def view(self, daemon, device, _):
        png = pathlib.Path(daemon.folder.name) / "view.png"
        marks = ("--no-rings",) if self.profile in WATERFALLS else ()  # the times beside a waterfall differ from run to run
        settings = self.settings if self.settings == ["--as-it-is"] else ("--range", 8)
        result = self.ctl("view", device, *settings, *marks, "--png", png, *PATIENCE, fails=True)
        self.seen["view"] = pixels_of(png) if png.exists() else result.stderr

    def examine(self, daemon, device, control):
        result = self.ctl("doctor", device, "--json", "--status-on", daemon.address, *control, "--http", f"{daemon.address}:8088",
                          "--within", 120)
        masked = json.loads(re.sub(r"\d+(\.\d+)+|\d+", "0", result.stdout))
        self.seen["doctor"] = [[f[key] for key in ("level", "check", "text", "cure")] for f in masked["findings"]
                               if f["check"] not in ("ports", "rate")]


class Makes(unittest.TestCase):
    maxDiff = None

    def test_every_make_behaves_as_recorded(self):
        expected = json.loads(EXPECTED.read_text(encoding="utf-8"))
        for profile in MAKES:
            seen = Observed(profile).seen
            for what, value in seen.items():
                with self.subTest(profile=profile, what=what):
                    self.assertEqual(value, expected[profile][what])


OWN_KINDS = {"oculus-m1200d": "oculus", "aris-3000": "aris", "waterlinked-3d15": "sonar-file", "surveyor-240": "svlog", "omniscan-450": "svlog", "s500": "svlog", "m3": "imb"}


class Recordings(unittest.TestCase):
    """Runs `sonarctl record` for a running sonar, and `view` for its files."""

    def ctl(self, *arguments):
        return run(SONARCTL, *arguments, patience_s=300)

    def test_every_make_is_recorded_viewed_and_replayed(self):
        for profile, (port, *settings) in MAKES.items():
            with self.subTest(profile=profile), Sonard(scene="l-targets.yaml", profile=profile, arguments=CHEAP) as daemon:
                folder = pathlib.Path(daemon.folder.name)
                kinds = ["mcap", "pcap"] + ([OWN_KINDS[profile]] if profile in OWN_KINDS else [])
                pings = 210 if profile in ("ping360", "micron") else PINGS  # a picture needs a whole scan
                outputs = [word for kind in kinds for word in (f"--{kind}", folder / f"run.{kind}")]
                done = self.ctl("record", f"{daemon.address}:{port}", "--pings", pings, *settings, *PATIENCE, *outputs)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertIn(f"recorded {pings} pings", done.stdout)
                shown = set()
                for kind in kinds:
                    done = self.ctl("view", "--from", folder / f"run.{kind}", "--ping", pings - 1, "--png", folder / "view.png")
                    self.assertEqual(done.returncode, 0, kind + done.stderr)
                    shown.add(pixels_of(folder / "view.png"))
                self.assertEqual(len(shown), 1, "every file shows the same picture")
                for kind in kinds:
                    with self.subTest(profile=profile, kind=kind):
                        self.replay(folder / f"run.{kind}", port)

    def replay(self, path, port):
        """Runs `sonarctl listen` with `sonard replay`."""
        with Replay(path, "--loop") as replay:
            done = self.ctl("listen", f"{replay.address}:{port}", "--as-it-is" if port == 52100 else "--quiet", "--pings", 2, *PATIENCE)
            self.assertIn("pings 2", done.stdout, done.stderr + replay.text())


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        EXPECTED.write_text(json.dumps({profile: Observed(profile).seen for profile in MAKES}, indent=1) + "\n", encoding="utf-8")
    else:
        unittest.main()
