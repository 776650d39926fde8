"""The judge without a daemon: verdicts, cases, waiting, the command line."""
import array
import contextlib
import io
import json
import pathlib
import subprocess
import sys
import tempfile
import time
import types
import unittest
import unittest.mock as mock
import zlib

from common import ROOT

from sonard_client.judge import __main__ as judge_main
from sonard_client.judge import cases, driver, ros_tap, run_case
from sonard_client.judge.cases import CASES
from sonard_client.judge.scene import Scene
from sonard_client.judge.truth import TruePing
from sonard_client.judge.verdicts import Observation, back_at, colour, judge, sort_published
from sonard_client.judge.wire import Seen

CRC = 0x1000  # of made pings: CRC + number


def published(*items):
    """Makes published pings from items (time, number) or (time, number, crc)."""
    return [driver.Published(i[0], i[1], i[2] if len(i) > 2 else CRC + i[1], None, None) for i in items]


def true(*items):
    return [Seen(TruePing(n, frozenset({CRC + n}), 3, 4, 0, 100), t, 1) for t, n in items]


TICKS = [(n / 10, n) for n in range(1, 61)]  # six seconds, ten pings a second; the fault is from 2 to 4 s


def observed(shown=TICKS, wire_pings=TICKS, **more):
    given = dict(began=2.0, ended=4.0, watched_until=6.4, tapped=True, published=published(*shown), true_pings=true(*wire_pings),
                 delivered=true(*wire_pings))
    return Observation(**{**given, **more})


def verdict(seen, must=None, should=None, notice=False):
    return judge(seen, must or {}, should or {}, notice)


class Verdicts(unittest.TestCase):
    def words(self, *arguments, **more):
        return verdict(observed(*arguments, **more)).words()

    def test_an_undisturbed_run_is_clean(self):
        found = verdict(observed())
        self.assertEqual(found.words(), ("CLEAN", "NONE NEEDED"))
        self.assertTrue(found.must_holds and found.should_holds)
        self.assertEqual(colour(found), "good")

    def test_pings_sent_before_the_end_show_no_recovery(self):
        before = [(t, n) for t, n in TICKS if t < 4]
        self.assertEqual(self.words([(t + 1, n) for t, n in before], before)[1], "NEVER")
        # The connection that the sonar closed still carries pings: a slow driver receives them after the fault's end.
        closed = [(0.0, 4.0, "device FIN")]
        self.assertEqual([self.words(connections=given)[1] for given in (closed, [(0.0, None, "")])], ["NEVER", "NONE NEEDED"])

    def test_an_outage_has_its_length(self):
        kept = [(t, n) for t, n in TICKS if not 2 <= t < 4.5]
        wire_pings = [one._replace(connection=1 if one.mono < 4 else 2) for one in true(*kept)]
        connections = [(0.0, 4.0, "device FIN"), (4.4, None, "")]
        found = verdict(observed(kept, true_pings=wire_pings, delivered=wire_pings, connections=connections))
        self.assertEqual(found.words(), ("CLEAN", "0.5 s"))
        kept = [(t, n) for t, n in TICKS if t < 2] + [(t + 5, n + 50) for t, n in TICKS]
        found = verdict(observed(kept, kept, watched_until=12.0))
        self.assertEqual(found.words()[1], "1.1 s")

    def test_lost_pings_are_those_the_driver_received_but_did_not_publish(self):
        kept = [(t, n) for t, n in TICKS if n not in (25, 26)]
        self.assertEqual(self.words(kept)[0], "LOST 2")
        self.assertEqual(self.words(kept, touched=[25])[0], "LOST 1")
        self.assertEqual(self.words(kept, touched=[25, 26])[0], "CLEAN")
        before_and_not_yet = [(t, n) for t, n in TICKS if n not in (3, 60)]
        self.assertEqual(self.words(before_and_not_yet)[0], "CLEAN")
        self.assertFalse(verdict(observed(kept)).should_holds)
        self.assertTrue(verdict(observed(kept)).must_holds)

    def test_pings_that_a_driver_may_leave_out_are_not_lost(self):
        optional = [seen._replace(ping=seen.ping._replace(needed=seen.ping.number != 25)) for seen in true(*TICKS)]
        kept = [(t, n) for t, n in TICKS if n not in (25, 26)]
        self.assertEqual(self.words(kept, true_pings=optional, delivered=optional)[0], "LOST 1")
        self.assertEqual(self.words(true_pings=optional, delivered=optional)[0], "CLEAN")

    def test_pings_that_the_fault_changed_are_known(self):
        journal = [{"event": "began", "mono_ns": 1}, {"event": "injected", "ping": 90, "mono_ns": 2_410_000_000}]
        self.assertEqual(run_case.touched_pings(journal, true(*TICKS), True), [90])
        self.assertEqual(run_case.touched_pings(journal, true(*TICKS), False), [24])
        self.assertEqual(run_case.touched_pings(journal, true(*TICKS[:20]), False), [])

    def test_false_beats_stale_beats_lost(self):
        lost = [(t, n) for t, n in TICKS if n != 25]
        stale = lost + [(5.0, 30)]
        false = stale + [(5.1, 31, 99)]
        self.assertEqual([self.words(shown)[0] for shown in (lost, stale, false)], ["LOST 1", "STALE 1", "FALSE 1"])
        found = verdict(observed(false))
        self.assertEqual(found.first_false, {"mono": 5.1, "id": 31, "crc32": "00000063"})
        self.assertFalse(found.must_holds)
        self.assertEqual((colour(found), colour(verdict(observed(stale)))), ("worst", "bad"))

    def test_other_sizes_than_sent_are_false(self):
        shown = [*published(*TICKS[:-1]), driver.Published(6.0, 60, CRC + 60, 65535, 4)]
        self.assertEqual(len(sort_published(shown, true(*TICKS))[2]), 1)

    def test_equal_images_with_other_numbers_are_not_repeated(self):
        stuck = [Seen(TruePing(n, frozenset({5}), 3, 4, 0, 9), n / 10, 1) for n in range(1, 9)]
        with_number = [driver.Published(n / 10, n, 5, None, None) for n in range(1, 9)]
        without = [driver.Published(n / 10, None, 5, None, None) for n in range(1, 9)]
        for shown in (with_number, without):
            self.assertEqual([len(part) for part in sort_published(shown, stuck)], [8, 0, 0])
        self.assertEqual([len(part) for part in sort_published([*without, without[0]], stuck)], [8, 1, 0])

    def test_a_numbers_restart_is_no_repetition(self):
        again = [Seen(TruePing(n, frozenset({0x2000 + n}), 3, 4, 0, 9), 3 + n / 10, 1) for n in range(1, 9)]
        shown = published(*TICKS[:20], *((3 + n / 10, n, 0x2000 + n) for n in range(1, 9)))
        self.assertEqual([len(part) for part in sort_published(shown, true(*TICKS) + again)], [28, 0, 0])

    def test_the_same_pings_after_a_reboot_are_new_once(self):
        again = [Seen(one.ping, one.mono + 3, 2) for one in true(*TICKS[:8])]
        shown = published(*TICKS[:20], *((3 + n / 10, n) for n in range(1, 9)))
        self.assertEqual([len(part) for part in sort_published(shown, true(*TICKS) + again)], [28, 0, 0])
        self.assertEqual([len(part) for part in sort_published([*shown, shown[3]], true(*TICKS) + again)], [28, 1, 0])

    def test_ends_of_the_driver_are_judged(self):
        before = [(t, n) for t, n in TICKS if t < 2]
        self.assertEqual(self.words(before, exit_code=-6, exit_time=2.1)[1], "CRASH")
        self.assertEqual(self.words(before, exit_code=1, exit_time=2.1)[1], "CRASH")
        self.assertEqual(self.words(before, before)[1], "NEVER")
        self.assertEqual(self.words(before, before, restarted_well=True)[1], "OPERATOR")
        self.assertEqual(self.words(before, before, exit_code=0, exit_time=2.1, restarted_well=True)[1], "OPERATOR")
        self.assertFalse(verdict(observed(before, before)).must_holds)

    def test_back_needs_three_pings_together(self):
        self.assertIsNone(back_at([4.1, 4.2], 4))
        self.assertIsNone(back_at([4.1, 6.0, 9.0, 14.0], 4))
        self.assertEqual(back_at([3.9, 4.1, 8.0, 8.1, 8.2], 4), 8.0)

    def test_limits_of_should_and_must(self):
        samples = [driver.Sample(1.0, 20.0, 5, 0.1), driver.Sample(3.0, 120.0, 5, 0.2), driver.Sample(6.0, 30.0, 9, 0.3)]
        found = verdict(observed(samples=samples, log_lines_s=40.0))
        self.assertEqual([c["what"] for c in found.should if not c["holds"]],
                         ["takes at most 32 MiB more memory", "writes at most 10 log lines a second"])
        found = verdict(observed(samples=samples), must={"descriptors": 2, "rss_mib": 256})
        self.assertEqual([c["what"] for c in found.must if not c["holds"]], ["leaves at most 2 more descriptors open"])
        self.assertNotIn("rss_mib", str(found.should))
        found = verdict(observed(samples=samples), should={"rss_mib": None})
        self.assertNotIn("memory", str(found.should))

    def test_noticing_is_judged(self):
        kept = [(t, n) for t, n in TICKS if not 2 <= t < 4]
        for more, holds in (({}, False), ({"log_times": [3.5]}, True), ({"state_times": [1.0, 4.5]}, False),
                            ({"connections": [(0.0, 3.9, "driver FIN")]}, True),
                            ({"connections": [(0.0, 3.9, "device FIN")]}, False)):
            found = verdict(observed(kept, kept, **more), notice=True)
            self.assertEqual([c["holds"] for c in found.should if "notices" in c["what"]], [holds], more)

    def test_without_a_tap_data_are_unseen(self):
        found = verdict(observed([], tapped=False))
        self.assertEqual(found.words(), ("UNSEEN", "NONE NEEDED"))
        self.assertTrue(found.must_holds)
        found = verdict(observed(truth_known=False, true_pings=[], delivered=[]))  # a tap, but no permission to read packets
        self.assertEqual(found.words(), ("UNSEEN", "NONE NEEDED"))


class Tap(unittest.TestCase):
    def test_lines_of_the_tap_are_read(self):
        self.assertEqual(driver.tap_line(b'{"id": 8, "crc32": "0a1b2c3d"}', 1.0),
                         driver.Published(1.0, 8, 0x0A1B2C3D, None, None))
        self.assertEqual(driver.tap_line(b'{"crc32": 5, "rows": 3, "beams": 4, "x": []}', 1.0),
                         driver.Published(1.0, None, 5, 3, 4))
        self.assertEqual(driver.tap_line(b'{"state": "lost"}', 1.0), driver.State(1.0, "lost"))
        for line in (b"", b"hello", b"{", b'{"id": 8}', b'{"id": 8, "crc32": "xyz"}', b'{"id": 8, "crc32": null}', b"{\xff}"):
            self.assertIsNone(driver.tap_line(line, 1.0))

    def test_the_command_line_is_expanded(self):
        self.assertEqual(driver.expand("a --x='{ip}:{port}' {id} {other}", "127.0.0.2", 52100, 7),
                         ["a", "--x=127.0.0.2:52100", "7", "{other}"])

    def test_the_port_is_that_of_the_sonars_make(self):
        one = [{"protocol": "status", "address": "127.0.0.2:52102", "sonar_speaks_first": True},
               {"protocol": "udp", "address": "127.0.0.2:12345"}, {"protocol": "udp", "address": "127.0.0.2:30303"}]
        self.assertEqual(run_case.port_of({"listens": "127.0.0.2:1", "addresses": one}), 12345)
        self.assertEqual(run_case.port_of({"listens": "127.0.0.2:14750"}), 14750)

    def test_why_a_driver_takes_no_pings(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = mock.Mock(folder=pathlib.Path(folder), address="10.77.0.2", make=mock.Mock(needs_request=True))
            (scene.folder / "driver.log").write_text("last words\n")
            scene.driver.exited = None
            scene.capture.configure_mock(connections=[], port=16171)
            scene.capture.delivered.return_value = []
            self.assertRegex(run_case.explanation(scene), "no connection to 10.77.0.2:16171(.|\n)*last words")
            scene.capture.connections = [mock.Mock(fires=[])]
            self.assertIn("sent neither settings nor a request", run_case.explanation(scene))
            scene.make.needs_request = False
            self.assertIn("received no complete ping", run_case.explanation(scene))

    def test_why_a_fault_has_no_effect_on_a_make(self):
        judge = mock.Mock(options=mock.Mock(profile="omniscan-450"), lacking="", fault_engine=True, ping_bytes=1)
        judge.kinds = {"G01": {"parameters": [], "without_effect": {"oculus": "sends none", "omniscan450": "has none"}}}
        case = next(case for case in CASES if case.kind == "G01")
        self.assertEqual(judge_main.Judge.not_run(judge, case), "G01 has none")
        judge.options.profile = "blueview-p900-90"
        self.assertNotIn("has none", judge_main.Judge.not_run(judge, case))

    def test_output_and_end_of_the_driver_are_read(self):
        program = ("import os, sys, time\nprint('{\"id\": 1, \"crc32\": 2}')\nprint('words')\n"
                   "for i in range(50): print(i, file=sys.stderr)\nwhile not os.path.exists(sys.argv[1]): time.sleep(0.01)\n"
                   "sys.exit(3)")
        with tempfile.TemporaryDirectory() as folder:
            log, may_end = pathlib.Path(folder) / "log", pathlib.Path(folder) / "may_end"
            one = driver.Driver([sys.executable, "-c", program, str(may_end)], [], log, tap=True)
            one.start()
            deadline = time.monotonic() + 20
            while one.poll() is None and time.monotonic() < deadline:
                if one.peak_mib > 1:  # it was seen
                    may_end.touch()
                time.sleep(0.01)
            one.stop()
            self.assertEqual(one.exited[1], 3)
            self.assertEqual([p.number for p in one.published], [1])
            self.assertEqual(one.lines_per_s(0), 51 / 5)
            self.assertEqual(len(log.read_text().splitlines()), 51)
            self.assertGreater(one.peak_mib, 1)


class Table(unittest.TestCase):
    def test_numbers_names_and_records_agree(self):
        found = [c.number for c in cases.CASES]
        self.assertEqual(len(found), len(set(found)))
        for case in cases.CASES:
            self.assertRegex(case.number, r"^[A-Z]\d\d\.\d+$")
            self.assertTrue(case.sentence.endswith("."), case.number)
            record = case.record()
            self.assertLessEqual(set(record), {"name", "do", "with", "at", "for"})
            self.assertEqual(len(record["for"]), 1)

    def test_tier_1_is_complete(self):
        """All kinds of the first release, without those that were later moved to tier 3."""
        tiers = {"L": "1-7 10 13 14 17 18", "S": "1-4 6 7", "F": "1-8 10-16 19 20 22 24", "D": "1-8 11-19 21 22 26-28",
                 "U": "1-8 12 13", "T": "1-6 8 10-12", "M": "1-6 8-10", "P": "1-6 9 11-13", "B": "1 2 4-6 8-10 12 13 15",
                 "G": "1-7"}
        have = {c.kind for c in cases.CASES}
        for family, text in tiers.items():
            for part in text.split():
                first, _, last = part.partition("-")
                for number in range(int(first), int(last or first) + 1):
                    self.assertIn(f"{family}{number:02}", have)

    def test_every_measured_row_is_a_case(self):
        measured = {c.number for c in cases.CASES if c.measured}
        self.assertEqual({n.partition(".")[0] for n in measured}, set(
            "N00 S01 L01 L02 L04 L05 L10 F01 F06 F05 F20 F10 F14 U03 U04 U02 D19 D08".split()))

    def test_cases_are_selected(self):
        def chosen(*words):
            return [c.number for c in cases.select(words)]
        self.assertEqual(chosen("L05.2"), ["L05.2"])
        self.assertEqual(chosen("l05"), chosen("silent-open"))
        self.assertEqual(chosen("T01", "T02", "T08"), chosen("clock-step"))
        self.assertEqual({n[0] for n in chosen("L", "F")}, {"L", "F"})
        self.assertEqual(len(cases.select([])), len(cases.CASES))
        with self.assertRaisesRegex(ValueError, "L99"):
            chosen("L99")

    def test_torture_has_its_cases(self):
        whole = cases.torture(1)
        self.assertEqual(len(whole), len({c.number for c in whole}))
        self.assertEqual({c.kind for c in whole}, {"L03", "L04", "S06"})
        self.assertEqual(cases.torture(1, 25), cases.torture(1, 25))
        self.assertNotEqual(cases.torture(1, 25), cases.torture(2, 25))
        self.assertEqual(len(cases.torture(1, 25)), 25)


class TimeLeft(unittest.TestCase):
    def test_the_time_left_follows_from_the_speed_so_far(self):
        three = [case for case in CASES if case.family == "L" and case.until() == {"count": 1} and not case.tail_s][:3]
        usual = judge_main.TimeLeft.expected_s(three[0])
        left = judge_main.TimeLeft(three, 1)
        self.assertEqual(left.after(three[0], 10 * usual), f", {round(20 * usual / 60):.0f} min left")
        self.assertEqual(left.after(three[1], 0), f", {round(5 * usual, -1):.0f} s left")
        self.assertEqual(left.after(three[2], 10), "")
        fast = judge_main.TimeLeft(three, 2)
        self.assertEqual(fast.after(three[0], usual), ", 10 s left")

    def test_cases_that_do_not_run_take_none(self):
        self.assertEqual(judge_main.TimeLeft([], 4).after(CASES[0], 0.0), "")


class Clock:
    """Replaces the clock. Time advances only during a sleep, and a stall of the computer makes the sleep longer."""

    def __init__(self, stalls=()):
        self.now, self.stalls, self.sleeps = 1000.0, dict(stalls), 0

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.sleeps += 1
        self.now += seconds + self.stalls.get(self.sleeps, 0)


class Waiting(unittest.TestCase):
    """A busy computer makes a driver slow; a driver without any activity is stuck."""

    def waited(self, happens_s, timeout_s, stalls=(), most=8):
        """happens_s: times after the start at which something happens."""
        scene, clock = mock.Mock(), Clock(stalls)
        scene.driver.poll.return_value = None
        scene.sonard.ended.return_value = ""
        scene.driver.samples = []
        began = clock.now

        def moves():
            return sum(clock.now >= began + at for at in happens_s)
        with mock.patch("sonard_client.judge.scene.time", clock):
            done = Scene.wait(scene, lambda: moves() >= most, timeout_s, moves)
        return done, clock.now - began

    def test_waiting_continues_while_something_happens(self):
        done, seconds = self.waited([0.1 * n for n in range(1, 9)], 0.3)
        self.assertTrue(done)
        self.assertGreaterEqual(seconds, 0.8)

    def test_waiting_continues_after_a_stall_with_an_event(self):
        done, seconds = self.waited([0.1, 0.2, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4], 0.3, stalls={4: 0.6})
        self.assertTrue(done)
        self.assertGreaterEqual(seconds, 1.4)

    def test_looks_at_the_condition_after_a_stall(self):
        self.assertTrue(self.waited([0.1 * n for n in range(1, 9)], 0.3, stalls={1: 100})[0])

    def test_waiting_ends_when_nothing_happens(self):
        done, seconds = self.waited([0.1, 0.2, 0.25], 0.3)
        self.assertFalse(done)
        self.assertGreaterEqual(seconds, 0.55 - 1e-9)
        self.assertLess(seconds, 0.75)

    def test_waiting_has_a_limit(self):
        done, seconds = self.waited([0.1 * n for n in range(1, 100)], 0.3, most=50)
        self.assertFalse(done)
        self.assertGreaterEqual(seconds, 1.8 - 1e-9)
        self.assertLess(seconds, 2.1)


class Options(unittest.TestCase):
    def test_options_of_the_sonar_are_passed(self):
        words = ["--driver", "x {ip}", "--profile", "waterlinked-3d15", "--option", "rip=1", "--option", "a=b=c", "--sonard", "true"]
        spec = judge_main.Judge(judge_main._parser().parse_args(words), pathlib.Path("out")).spec(None, 1)
        config = json.loads(run_case.config_of(spec, None, "127.0.0.2", pathlib.Path("journal")))
        self.assertEqual(config["sonars"][0]["options"], {"rip": "1", "a": "b=c"})


class CommandLine(unittest.TestCase):
    def said(self, *arguments):
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
            code = judge_main.main(list(arguments))
        return code, out.getvalue() + err.getvalue()

    def test_the_cases_are_listed(self):
        code, text = self.said("--list", "--case", "silent-open", "--case", "N")
        self.assertEqual(code, 0)
        self.assertIn("5 cases of 2 kinds", text)
        self.assertIn("L05.2", text)

    def test_wrong_use_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            right = ["--driver", "x {ip}", "--out", folder + "/new"]
            for arguments, word in ((["--out", folder], "--driver"), (["--driver", "x {ip}"], "--out"),
                                    (["--driver", "x", "--no-namespaces", "--out", folder + "/new"], "{ip}"), (right + ["--case", "Q77"], "Q77"),
                                    (right + ["--tap", "yaml"], "--tap"), (right + ["--repeat", "0"], "--repeat"),
                                    (right + ["--shallow", "5"], "--torture"), (right + ["--tap", "ros1"], "topic"),
                                    (right + ["--tap", "ros2:"], "ros2:/sonar/ping"), (right + ["--option", "rip"], "KEY=TEXT"),
                                    (["merge", folder, "--out", folder + "/new"], "no report")):
                code, text = self.said(*arguments)
                self.assertEqual((code, word in text), (64, True), text)
            self.assertEqual(self.said(*right, "--sonard", "/nowhere/sonard"),
                             (69, "judge: /nowhere/sonard: not found; --sonard names the program\n"))

    def test_lines_of_ros_messages_are_read(self):
        rows = [b"abcd", b"efgh"]
        plain = {"id": 7, "crc32": f"{zlib.crc32(b''.join(rows)):08x}"}
        ping = types.SimpleNamespace(ping_id=7, step=4, has_gains=False, ping_data=array.array("B", b"".join(rows)))
        self.assertEqual(json.loads(ros_tap.line_of(ping)), plain)
        with_gains = b"".join(b"\1\0\0\0" + row for row in rows)
        ping = types.SimpleNamespace(ping_id=7, step=8, has_gains=True, ping_data=array.array("B", with_gains))
        self.assertEqual(json.loads(ros_tap.line_of(ping)), plain)
        ping.ping_data, ping.n_ranges = array.array("B", b"head" + with_gains), 2
        self.assertEqual(json.loads(ros_tap.line_of(ping)), plain)
        image = types.SimpleNamespace(header=types.SimpleNamespace(), image=types.SimpleNamespace(data=b"abcdefgh"))
        self.assertEqual(json.loads(ros_tap.line_of(image)), {**plain, "id": None})
        echo = types.SimpleNamespace(intensities=array.array("B", b"abcdefgh"), number_of_samples=8)  # ping360_sonar_msgs/SonarEcho
        self.assertEqual(json.loads(ros_tap.line_of(echo)), {**plain, "id": None})

    def test_the_driver_has_a_name(self):
        for words, name in ((["/usr/bin/mydriver", "{ip}"], "mydriver"), (["python3", "-u", "a/drv.py", "{ip}"], "drv.py"),
                            (["ros2", "launch"], "launch"), (["sh"], "sh"), (["{ip}"], "driver")):
            self.assertEqual(judge_main.driver_name(words), name)

    def test_the_drivers_of_the_proof_say_how_they_are_used(self):
        done = subprocess.run([sys.executable, ROOT / "tests/judge/planted_driver.py", "127.0.0.2"],
                              capture_output=True, text=True, check=False)
        self.assertIn("ignores-fin", done.stderr)


if __name__ == "__main__":
    unittest.main()
