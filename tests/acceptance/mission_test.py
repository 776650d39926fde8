"""A whole mission, faster than real time: a trajectory in stepped time, recorded by sonard as .oculus, replayed by sonard replay,
and received by our client byte for byte. It runs twice, and both runs have the same digest. Also measures the time for reading a
long trajectory.

usage: mission_test.py [--long]     --long: ten minutes, 1,200 pings; figures are written to the folder SONARD_RELIABILITY
"""
import hashlib
import pathlib
import resource
import sys
import tempfile
import time
import unittest

from mission import RATE_HZ, Mission
from recording_test import Replay
from running_sonard import ROOT, SONARCTL, SONARD, run

sys.path.insert(0, str(ROOT / "tests/reliability"))
from record import record  # noqa: E402

LONG = "--long" in sys.argv
SECONDS = 600 if LONG else 8
PINGS = SECONDS * RATE_HZ
COMMAND = "python3 tests/acceptance/mission_test.py" + (" --long" if LONG else "")
CONFIG = """\
world: {scene: SCENE}
vehicles: [{name: rov, trajectory: {file: hour.csv}}]
sonars: [{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}]
"""


def kept(item, figure, bound, passed):
    if LONG:  # the short run shows only that it works, so its figures are not recorded
        record(item, figure, bound, passed, COMMAND)
    return passed


class WholeMission(unittest.TestCase):
    def test_flown_twice_recorded_and_replayed(self):
        with Mission(SECONDS, PINGS, record=("mission.oculus",)) as first:
            begin = time.monotonic()
            first.fly(keep=False)
            took_s = time.monotonic() - begin
            self.assertEqual((first.code, first.taken), (0, PINGS))
            log = first.recorded("mission.oculus")
            same = self.received_again(log, first)
            self.assertTrue(kept("mission-replay", f"{PINGS} pings, {log.stat().st_size / 1e6:.0f} MB: {'the same' if same else 'different'}",
                                 "byte for byte the same", same))
        with Mission(SECONDS, PINGS) as second:
            second.fly(keep=False)
        self.assertEqual((second.code, second.taken), (0, PINGS))
        equal = first.digests == second.digests == {1: first.sha256} == {1: second.sha256}
        self.assertTrue(kept("mission-digest", f"{PINGS} pings twice, recorded once: {'equal' if equal else 'not equal'}", "equal", equal))
        kept("mission-pace", f"{SECONDS / took_s:.1f} x: {SECONDS} s in {took_s:.0f} s", "faster than real time", took_s < SECONDS)

    def received_again(self, log, flown):
        """Returns whether our client receives the same bytes from the replay as the client of the mission did."""
        with tempfile.TemporaryDirectory() as folder, Replay(log, "--stepped") as replay:
            again = pathlib.Path(folder) / "again.raw"
            done = run(SONARCTL, "listen", replay.address, "--as-it-is", "--wait", 100, "--pings", PINGS, "--quiet", "--record", again, patience_s=600)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr + replay.text())
            with open(again, "rb") as received:
                digest = hashlib.sha256()
                while block := received.read(1 << 20):
                    digest.update(block)
            return digest.hexdigest() == flown.sha256


def spent_by_children_s():
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


class LongTrajectory(unittest.TestCase):
    def test_an_hour_at_100_hz_is_read_within_a_second(self):
        """The limit is processor time of the whole `sonard check`. The record states whether it was met; the test allows 5 s."""
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            with open(folder / "hour.csv", "w", encoding="utf-8") as out:
                out.write("# frame: ENU_FLU\nt,x,y,z,qw,qx,qy,qz\n")
                out.writelines(f"{1700000000 + n / 100:.2f},{n * 1e-4:.6f},{-n * 2e-4:.6f},-3.25,1,0,0,0\n" for n in range(360_000))
            (folder / "sonard.yaml").write_text(CONFIG.replace("SCENE", str(ROOT / "scenes/tank-rod.yaml")), encoding="utf-8")
            least_s = 60.0
            for _ in range(3):
                begin = spent_by_children_s()
                done = run(SONARD, "check", folder / "sonard.yaml")
                least_s = min(least_s, spent_by_children_s() - begin)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("360000 poses", done.stdout)
        kept("trajectory-load", f"{least_s:.2f} s, the whole of sonard check", "less than 1 s", least_s < 1)
        self.assertLess(least_s, 5)


if __name__ == "__main__":
    unittest.main(argv=[a for a in sys.argv if a != "--long"])
