"""The bytes of a stepped run depend only on the configuration and on the requests of clients: not on threads, observers,
recordings, or earlier runs. A run that starts later in the trajectory shows the same pictures."""
import hashlib
import signal
import subprocess
import time
import unittest

import mcap_checker
from mission import RATE_HZ, Mission, Onlooker
from recording_test import oculus_log_messages
from running_sonard import SONARCTL, run

SECONDS, PINGS = 20, 24


class Reproducibility(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with Mission(SECONDS, PINGS) as mission:
            cls.plain = mission.fly()
        assert mission.code == 0

    def expect_the_same(self, mission, client=1):
        self.assertEqual(mission.code, 0)
        self.assertEqual(mission.taken, PINGS)
        self.assertEqual(mission.digests[client], self.plain.digests[1])
        self.assertEqual(mission.sha256, self.plain.sha256, "the digest is that of the received bytes")

    def test_every_run_with_any_number_of_threads_is_the_same(self):
        self.assertEqual(self.plain.digests, {1: self.plain.sha256})
        self.assertEqual(len({hashlib.sha256(str(p.image).encode()).digest() for p in self.plain.pictures()}), PINGS, "the pictures differ")
        for threads in (1, 2, 4):
            with self.subTest(threads=threads), Mission(SECONDS, PINGS, "--threads", threads) as mission:
                self.expect_the_same(mission.fly(keep=False))

    def test_onlookers_change_nothing(self):
        for comes_at in (0, 5):
            with self.subTest(comes_at=comes_at), Mission(SECONDS, PINGS) as mission:
                onlookers = []
                come = lambda m=mission, o=onlookers: o.append(Onlooker(m.daemon.address))
                if comes_at == 0:
                    come()
                    mission.fly(keep=False)
                else:
                    mission.fly(keep=False, after=(comes_at, come))
                onlookers[0].end()
                self.assertGreater(onlookers[0].pings, 0)
                self.expect_the_same(mission, client=2 if comes_at == 0 else 1)
        with Mission(SECONDS, PINGS) as mission:
            events = subprocess.Popen([str(SONARCTL), "events", "--pings", "--clients", "--json", "--control", mission.control],
                                      stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            mission.fly(keep=False, after=(3, lambda: mission.steer("status")))
            events.terminate()
            told = events.communicate(timeout=60)[0]
            self.assertIn('"ping"', told)
            self.expect_the_same(mission)

    def test_recording_changes_nothing_and_has_every_byte(self):
        with Mission(SECONDS, PINGS, record=("run.mcap", "run.oculus", "run.pcap")) as mission:
            mission.fly()
            self.expect_the_same(mission)
            kept = oculus_log_messages(mission.recorded("run.oculus").read_bytes())
            self.assertEqual(b"".join(kept), self.plain.stream)
            by_topic, checked = {}, mcap_checker.check(mission.recorded("run.mcap").read_bytes())
            for topic, _, data in checked.messages:
                by_topic.setdefault(topic, []).append(data)
            self.assertEqual(b"".join(by_topic["/front/device"]), self.plain.stream)
            for topic in ("image", "pose", "truth"):
                self.assertEqual(len(by_topic[f"/front/{topic}"]), PINGS, topic)
            self.expect_true_places(checked)
        with Mission(SECONDS, PINGS, record=("run.mcap",)) as mission:
            mission.fly(keep=False, after=(10, lambda: mission.steer("recording", "start", "rest.mcap")))
            self.expect_the_same(mission)
            again = {}
            for topic, _, data in mcap_checker.check(mission.recorded("run.mcap").read_bytes()).messages:
                again.setdefault(topic, []).append(data)
            self.assertEqual(again.pop("/front/status")[0][:16], by_topic.pop("/front/status")[0][:16])  # each run has its address
            self.assertEqual(again, by_topic, "the files are the same")
            mcap_checker.check(mission.recorded("rest.mcap").read_bytes())

    def expect_true_places(self, recording):
        """Checks that pose and frames in protobuf agree with the ground truth in JSON."""
        frames = [frame for message in recording.read("/tf") for frame in message["transforms"]]
        self.assertEqual([frame["child_frame_id"] for frame in frames], ["front", "object/rod"] * PINGS)
        for number, (pose, truth) in enumerate(zip(recording.read("/front/pose"), recording.read("/front/truth"))):
            for found, place in ((frames[2 * number], truth["sonar_in_world"]), (frames[2 * number + 1], truth["bodies"][0]["pose"])):
                stamp = found["timestamp"]
                self.assertEqual({"sec": stamp.get("seconds", 0), "nsec": stamp.get("nanos", 0)}, truth["timestamp"])
                self.assertEqual({axis: found["translation"].get(axis, 0) for axis in "xyz"}, place["position"])
                self.assertEqual({axis: found["rotation"].get(axis, 0) for axis in "xyzw"}, place["orientation"])
            self.assertEqual(pose["pose"], {"position": frames[2 * number]["translation"], "orientation": frames[2 * number]["rotation"]})

    def test_a_killed_run_can_be_started_again(self):
        def kill():
            deadline = time.monotonic() + 60
            while killed.recorded("run.oculus").stat().st_size < 100_000 and time.monotonic() < deadline:
                time.sleep(0.01)  # the recording contains one or two pings then
            killed.daemon.process.send_signal(signal.SIGKILL)

        with Mission(SECONDS, PINGS, record=("run.oculus",)) as killed:
            killed.fly(after=(9, kill))
            self.assertEqual(killed.code, -signal.SIGKILL)
            self.assertGreaterEqual(killed.taken, 9)
            self.assertTrue(self.plain.stream.startswith(killed.stream), "the bytes received until then are the beginning")
            rest = killed.folder / "rest.raw"
            done = run(SONARCTL, "record", "--from", killed.recorded("run.oculus"), "--raw", rest)
            self.assertIn(done.returncode, (0, 65), done.stderr)  # 65: the last message is cut short
            self.assertTrue(self.plain.stream.startswith(rest.read_bytes()), "its recording can be read as far as it goes")
            self.assertGreater(rest.stat().st_size, 0)
        with Mission(SECONDS, PINGS) as again:
            self.expect_the_same(again.fly(keep=False))

    def test_a_later_start_gives_the_same_pictures(self):
        """Ping numbers and stamps count from the start of a run, and so does the receiver's noise, which is off here."""
        quiet = ("--noise", "off", "--leak", "off")
        later = 10
        with Mission(SECONDS, PINGS, *quiet) as whole:
            expected = whole.fly().pictures()[later:]
        with Mission(SECONDS, PINGS - later, *quiet, start_s=later / RATE_HZ) as rest:
            found = rest.fly().pictures()
        self.assertEqual(len(found), PINGS - later)
        for number, (a, b) in enumerate(zip(expected, found)):
            self.assertTrue(b.image == a.image, f"ping {later + number}")
            self.assertEqual((b.heading_deg, b.pitch_deg, b.roll_deg, b.pressure), (a.heading_deg, a.pitch_deg, a.roll_deg, a.pressure))
            self.assertEqual(a.id, b.id + later)


if __name__ == "__main__":
    unittest.main()
