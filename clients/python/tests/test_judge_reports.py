"""Reports of the judge: results, pages, JUnit, merging."""
import contextlib
import io
import json
import pathlib
import re
import tempfile
import unittest
import xml.etree.ElementTree
from html.parser import HTMLParser

from sonard_client.judge import __main__ as judge_main
from sonard_client.judge import report


class Page(HTMLParser):
    """Fails on tags that are not closed in order."""
    OPEN = {"meta", "input", "br"}

    def __init__(self, text):
        super().__init__()
        self.tags, self.scopes = [], []
        self.feed(text)
        self.close()
        assert not self.tags, self.tags

    def handle_starttag(self, tag, attrs):
        if tag == "th":
            self.scopes.append(dict(attrs).get("scope"))
        if tag not in self.OPEN:
            self.tags.append(tag)

    def handle_endtag(self, tag):
        assert self.tags.pop() == tag, tag


def run_of(data="CLEAN", recovery="NONE NEEDED", must=True, should=True, shade="good"):
    checks = {"must": [{"what": "survives <all>", "holds": must, "value": "alive"}],
              "should": [{"what": "is quick", "holds": should, "value": 4.5}]}
    process = {"ending": "alive", "peak_mib": 1, "cpu_s": 0, "log_lines_s": 0, "descriptors": [3, 3]}
    clock = dict(checks, data=data, recovery=recovery, watched_s=2.5, timeline=[[0.5, "begins"]],
                 journal=[{"kind": "L05", "ping": n, "with": {"fill": "zero", "bytes": "1"}} for n in (3, 4, 8)],
                 hex=["> 00"], connections=[], process=process, pings_on_wire=3, pings_acknowledged=3, pings_published=3,
                 capture="", packets_missed=0)
    return {"ran": True, "data": data, "recovery": recovery, "must_holds": must, "should_holds": should, "colour": shade,
            "tapped": True, "wall_clock": clock}


GOOD, SLOW = run_of(), run_of("LOST", "BACK", should=False, shade="fair")
DEAD = run_of("FALSE", "CRASH", must=False, should=False, shade="worst")
NOT_RUN = {"ran": False, "why": "needs namespaces"}


def row_of(number, *runs, strict=False, expectation="MUST; SHOULD"):
    case = {"number": number, "kind": number[:3], "name": "silent-open", "sentence": f"Sentence & {number}.", "with": {"a": "1"},
            "at": "ping 10", "duration": "2 s", "limit": 15.0, "expectation": expectation, "measured": False,
            "folder": f"cases/{number}", "repeat": "sonarctl judge ...", "good_driver": "notices & goes on"}
    return report.combine(case, runs, strict, tapped=True)


def column_of(rows, name="mine"):
    return {"name": name, "command": "mine {ip}", "version": "", "tap": "json", "profile": "oculus-m1200d", "sonard": "sonard 1",
            "seed": 1, "repeat": 1, "machine": "Linux", "counts": report.counts(rows), "cases": rows,
            "wall_clock": {"date": "2026-01-01", "seconds": 9.0}}


class Reports(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def written(self, rows, name="mine", place="report"):
        out = self.folder / place
        for row in rows:
            if row["result"] != "NOT RUN":
                (out / row["folder"]).mkdir(parents=True)
                (out / row["folder"] / "case.json").write_text(json.dumps(GOOD))
                (out / row["folder"] / "driver.log").write_text("1.0 <b>last words</b>\n")
        out.mkdir(exist_ok=True)
        report.write(out, [column_of(rows, name)], False)
        return out

    def test_results_follow_from_verdicts(self):
        self.assertEqual(row_of("L05.1", GOOD)["result"], "PASS")
        self.assertEqual(row_of("L05.1", SLOW)["result"], "PASS")
        self.assertEqual(row_of("L05.1", SLOW, strict=True)["result"], "FAIL")
        self.assertEqual(row_of("L05.1", DEAD)["result"], "FAIL")
        self.assertEqual(row_of("L05.1", DEAD, expectation="INFO")["result"], "INFO")
        self.assertEqual(row_of("L05.1", NOT_RUN)["result"], "NOT RUN")
        self.assertEqual(row_of("L05.1", dict(GOOD, tapped=False))["result"], "PASS (wire)")

    def test_disagreeing_runs_are_flaky_and_show_the_worst(self):
        row = row_of("L05.1", GOOD, DEAD, GOOD)
        self.assertEqual((row["result"], row["shown"]), ("FLAKY", 1))
        self.assertEqual(row_of("L05.1", GOOD, GOOD)["result"], "PASS")
        self.assertFalse(report.passed(column_of([row])))

    def test_the_summary_groups_results(self):
        rows = [row_of("L05.1", GOOD), row_of("L05.2", SLOW), row_of("L05.3", DEAD), row_of("L05.4", GOOD, DEAD),
                row_of("L06.1", NOT_RUN), row_of("M02.1", DEAD, expectation="INFO")]
        self.assertEqual(report.summary(column_of(rows)), "mine: 2 of 4 MUST, 1 of 4 SHOULD, 1 flaky, 1 not run")
        self.assertFalse(report.passed(column_of(rows)))
        self.assertTrue(report.passed(column_of(rows[:2] + rows[4:])))

    def test_cases_that_fail_alike_are_one_cause(self):
        def dead(ending, *more):
            run = run_of("FALSE", "CRASH", must=False, should=False, shade="worst")
            run["wall_clock"]["must"][0]["value"] = ending
            run["wall_clock"]["must"].extend(more)
            return run
        false = {"what": "publishes nothing false", "holds": False, "value": "5 false"}
        rows = [row_of("L05.1", GOOD), row_of("L05.2", SLOW), row_of("L05.3", dead("exit code 7")),
                row_of("L05.4", dead("exit code 7", false)), row_of("L06.1", NOT_RUN), row_of("L07.1", dead("exit code 12")),
                row_of("M02.1", DEAD, expectation="INFO")]
        self.assertEqual([(c["must"], c["cases"]) for c in report.causes(rows)],
                         [(True, ["L05.3", "L07.1"]), (True, ["L05.4"]), (False, ["L05.2"])])
        text = report.causes_text(column_of(rows))
        self.assertIn("2  MUST: survives", text)
        self.assertIn("L05.3 L07.1", text)
        self.assertEqual(report.causes_text(column_of(rows[:1])), "")
        page = (self.written(rows) / "index.html").read_text()
        Page(page)
        for number in re.findall(r'href="#([^"]+)"', page):
            self.assertIn(f'id="{number}"', page)
        self.assertIn('href="#L07.1"', page)

    def test_junit_has_all_cases(self):
        rows = [row_of("L05.1", GOOD), row_of("L05.2", SLOW), row_of("L05.3", DEAD), row_of("L06.1", NOT_RUN)]
        suite = xml.etree.ElementTree.fromstring(report.junit([column_of(rows)], False)).find("testsuite")
        self.assertEqual((suite.get("tests"), suite.get("failures"), suite.get("skipped")), ("4", "1", "1"))
        self.assertIn("survives", suite.findall("testcase")[2].find("failure").get("message"))

    def test_pages_are_well_formed_escaped_and_self_contained(self):
        rows = [row_of("L05.1", GOOD), row_of("L05.3", DEAD), row_of("L06.1", NOT_RUN), row_of("S01.1", GOOD, DEAD)]
        out = self.written(rows)
        for path in (out / "index.html", out / "cases/L05.3/index.html"):
            text = path.read_text()
            page = Page(text)
            self.assertNotIn(None, page.scopes)
            self.assertNotRegex(text, r'(src|href)="(https?:)?//')
        self.assertIn("Sentence &amp; L05.1.", (out / "index.html").read_text())
        text = (out / "cases/L05.3/index.html").read_text()
        self.assertIn("notices &amp; goes on", text)
        self.assertIn("<strong>NONE NEEDED</strong><small>pings never stopped</small>", text)
        self.assertIn("kind=L05 ping=3 with=bytes=1 fill=zero, and 2 more, the last of ping 8", text)
        self.assertIn("&lt;b&gt;last words", (out / "cases/L05.3/index.html").read_text())
        links = re.findall(r'href="(cases/[^"]+)"', (out / "index.html").read_text())
        self.assertEqual(len(links), 3)
        self.assertTrue(all((out / link).is_file() for link in links))

    def test_reports_are_merged(self):
        a = self.written([row_of("L05.1", GOOD), row_of("L05.3", GOOD)], place="a")
        b = self.written([row_of("L05.1", DEAD), row_of("F01.1", GOOD)], place="b")
        with contextlib.redirect_stdout(io.StringIO()) as said:
            self.assertEqual(judge_main.main(["merge", str(a), str(b), "--out", str(self.folder / "m"), "--page",
                                              str(self.folder / "page")]), 0)
        self.assertEqual(said.getvalue(),
                         "mine: 2 of 2 MUST, 2 of 2 SHOULD, 0 flaky\nmine #2: 1 of 2 MUST, 1 of 2 SHOULD, 0 flaky\n")
        text = (self.folder / "m/index.html").read_text()
        Page(text)
        for link in re.findall(r'href="(driver-[^"]+)"', text):
            self.assertTrue((self.folder / "m" / link).is_file(), link)
        self.assertEqual(text.count("not in this report"), 2)
        page = (self.folder / "page").read_text()
        self.assertRegex(page, r"\n\| mine #2 \| .* \| json \| 1 of 2 \| 1 of 2 \| ")
        self.assertRegex(page, r"\n\| L Link and connection \| 2 of 2 \| 0 of 1 \|\n")
        self.assertRegex(page, r"\n\| L05.1 Sentence & L05.1. \| CLEAN, .* \| \*\*.*\*\*")
        self.assertNotIn("L05.3 ", page, "it holds")

    def test_wall_clock_keys_can_be_removed(self):
        index = json.loads((self.written([row_of("L05.1", GOOD)]) / "index.json").read_text())
        self.assertEqual((index["schema"], index["version"]), ("sonard-judge", 1))
        self.assertNotIn("watched_s", json.dumps(report.without_wall_clock(index)))
        self.assertIn('"data": "CLEAN"', json.dumps(report.without_wall_clock(index)))

    def test_other_folders_are_refused(self):
        (self.folder / "index.json").write_text('{"schema": "other"}')
        for place in (self.folder, self.folder / "none"):
            with self.assertRaisesRegex(ValueError, "judge"):
                report.read(place)


if __name__ == "__main__":
    unittest.main()
