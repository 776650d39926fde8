"""The judge's verdicts are right: a correct driver passes, and each planted fault fails its case and no unexpected MUST.

SONARD_JUDGE_CASES=some runs the proof, which takes minutes; =all runs every case with the correct driver."""
import contextlib
import io
import json
import os
import pathlib
import sys
import tempfile
import unittest

from common import ROOT, SONARD

from sonard_client import lab
from sonard_client.judge import __main__ as judge_main
from sonard_client.judge import report

# The planted fault, the case that finds it, its level (MUST or SHOULD), and further cases whose MUST it violates.
PLANTS = (("ignores-fin", "L02.1", "must", {"L01.1", "L02.2", "L03.1"}),
          ("trusts-lengths", "F10.1", "must", {"F05.1"}),
          ("never-sends-settings-again", "L04.1", "must", {"L01.1", "L02.1", "L02.2", "L03.1", "L05.1", "L06.1"}),
          ("leaks-descriptor", "L02.2", "must", set()),
          ("glues-pings", "L03.1", "must", set()),
          ("exits-when-refused", "L01.1", "must", set()),
          ("floods-log", "F01.5", "should", set()),
          ("publishes-duplicates", "F15.1", "must", set()),
          ("allocates-by-length", "F05.1", "must", set()),
          ("never-times-out", "L06.1", "must", set()),
          ("repeats-last-ping", "L05.1", "must", {"L06.1"}))
CASES = ["N00.1", *sorted({case for _, case, _, _ in PLANTS})]


def has_faults():
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(io.StringIO()):
        options = judge_main._parser().parse_args(["--driver", "x {ip}", "--sonard", str(SONARD)])
        return judge_main.Judge(options, pathlib.Path(folder)).fault_engine


class Judging(unittest.TestCase):
    maxDiff = None

    def judged(self, driver, *more, code=None):
        """Returns the index of a run."""
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "report"
            command = f"{sys.executable} -B {ROOT / 'tests/judge'}/{driver}"
            with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(said):
                result = judge_main.main(["--sonard", str(SONARD), "--driver", command, "--tap", "json", "--jobs", "4",
                                          "--out", str(out), *more])
            if code is not None:
                self.assertEqual(result, code, said.getvalue())
            return json.loads((out / "index.json").read_text())

    def failures(self, index, kind):
        rows = index["drivers"][0]["cases"]
        not_run = {r["number"]: r["why"] for r in rows if r["result"] == "NOT RUN"}
        self.assertLessEqual(set(not_run), {"L06.1"} if lab.missing() else set(), not_run)
        return {r["number"]: report.reasons(r) for r in rows if r["result"] != "NOT RUN" and not r[f"{kind}_holds"]}


FEW = ("--case", "N00.1", "--case", "L02.1", "--case", "F01.1")


class Few(Judging):
    """This runs at every change: the judge runs, and distinguishes a correct driver from one that never recovers."""

    def test_a_right_driver_passes_what_it_must(self):
        index = self.judged("right_driver.py {ip}", *FEW)
        self.assertEqual(self.failures(index, "must"), {})

    @unittest.skipIf(lab.missing(), lab.missing())
    def test_the_data_of_a_ping1d_are_judged(self):
        index = self.judged("right_ping_driver.py {ip} {port}", "--profile", "ping1d", "--case", "N00.1", "--case", "L05.1", code=0)
        found = {r["data"] for r in index["drivers"][0]["cases"]}
        self.assertLessEqual(found, {"CLEAN", "LOST"}, "LOST: a busy computer may drop datagrams")

    def test_a_driver_that_ignores_the_end_of_the_stream_fails(self):
        index = self.judged("planted_driver.py {ip} --plant ignores-fin", *FEW, code=1)
        self.assertIn("L02.1", self.failures(index, "must"))


LONG = "set SONARD_JUDGE_CASES=some, or =all: minutes of real time, and figures that other programs on the computer disturb"


@unittest.skipUnless(os.environ.get("SONARD_JUDGE_CASES"), LONG)
@unittest.skipUnless(has_faults(), "this sonard has no faults")
class Proof(Judging):
    def test_the_right_driver_passes(self):
        everything = os.environ.get("SONARD_JUDGE_CASES") == "all"
        chosen = [] if everything else [word for case in CASES for word in ("--case", case)]
        index = self.judged("right_driver.py {ip}", "--strict", *chosen, code=0)
        column = index["drivers"][0]
        self.assertEqual([r["number"] for r in column["cases"] if r["result"] == "FAIL"], [])
        self.assertGreaterEqual(column["counts"]["of"], 100 if everything else len(CASES) - 1)

    def test_each_planted_fault_is_found_by_its_case_and_by_no_other_must(self):
        for plant, case, kind, others in PLANTS:
            if case == "L06.1" and lab.missing():
                continue
            with self.subTest(plant):
                index = self.judged(f"planted_driver.py {{ip}} --plant {plant}", *(word for c in CASES for word in ("--case", c)))
                self.assertIn(case, self.failures(index, kind))
                must = self.failures(index, "must")
                self.assertLessEqual(set(must), {case, *others} if kind == "must" else others, must)

    def test_the_same_seed_gives_the_same_index(self):
        chosen = ["--case", "F01", "--case", "L03"]
        first, second = (report.without_wall_clock(self.judged("right_driver.py {ip}", *chosen)) for _ in range(2))
        self.assertEqual(first, second)


@unittest.skipUnless(os.environ.get("SONARD_JUDGE_CASES"), LONG)
@unittest.skipIf(lab.missing(), lab.missing())
class InTheLaboratory(Judging):
    """Faults of the network do not need sonard's fault engine."""
    CHOSEN = ("--case", "N00.1", "--case", "L06.1", "--case", "L17.2")

    def test_right_drivers_pass_and_wrong_drivers_fail(self):
        index = self.judged("right_driver.py {ip}", "--strict", *self.CHOSEN, code=0)
        self.assertEqual({r["result"] for r in index["drivers"][0]["cases"]}, {"PASS"})
        for plant, recovery, data in (("never-times-out", "OPERATOR", "CLEAN"), ("repeats-last-ping", "BACK", "STALE")):
            with self.subTest(plant):
                index = self.judged(f"planted_driver.py {{ip}} --plant {plant}", *self.CHOSEN, code=1)
                row = next(r for r in index["drivers"][0]["cases"] if r["number"] == "L06.1")
                self.assertEqual((row["result"], row["recovery"], row["data"]), ("FAIL", recovery, data), report.reasons(row))


if __name__ == "__main__":
    unittest.main()
