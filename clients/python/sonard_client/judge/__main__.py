"""Runs a driver against sonard with one fault at a time and writes a report: docs/judge.md

examples:
    sonarctl judge --driver 'mydriver --ip {ip}' --tap json --out report
    sonarctl judge --list
    sonarctl judge merge report-a report-b --out matrix
python3 -m sonard_client.judge does the same.
"""
from __future__ import annotations

import argparse
import importlib.util
import json
import os
import pathlib
import platform
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Dict, List, Optional, Sequence

from .. import DEFAULT_PROFILE, lab
from . import markdown, report
from .cases import CASES, Case, listing, select, torture

USAGE, UNAVAILABLE, NOT_HELD = 64, 69, 1
_PACKAGE = str(pathlib.Path(__file__).resolve().parents[2])
ROS_MODULES = {"ros1": "rospy", "ros2": "rclpy"}  # modules that the taps import


class NotJudged(RuntimeError):
    """Ends the run, because the driver does not work without a fault or sonard cannot be started."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="sonarctl judge", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--driver", metavar="TEXT", help="starts the driver; {ip}, {port} and {id} are filled in")
    parser.add_argument("--tap", metavar="TEXT", default="none", type=lambda text: "none" if text == "wire" else text,
                        help="json: the driver prints a JSON line per ping; ros1:TOPIC or ros2:TOPIC; wire or none (the default): only "
                             "the packets are examined")
    parser.add_argument("--profile", metavar="TEXT", default=DEFAULT_PROFILE, help="product")
    parser.add_argument("--option", metavar="KEY=TEXT", action="append", default=[],
                        help="option of the sonar, as in its configuration; repeatable")
    parser.add_argument("--case", metavar="TEXT", action="append", default=[],
                        help="number (L05.2), code (L05), family (L) or name; repeatable")
    parser.add_argument("--strict", action="store_true", help="count failed SHOULDs too")
    parser.add_argument("--repeat", type=int, default=1, metavar="INT", help="runs of each case; disagreement is FLAKY")
    parser.add_argument("--jobs", type=int, default=1, metavar="INT", help="number of cases that run at the same time")
    parser.add_argument("--torture", action="store_true",
                        help="cut, reset and pause at every point of a ping, instead of the cases")
    parser.add_argument("--shallow", type=int, metavar="INT", help="with --torture: only this number of points, selected by the seed")
    parser.add_argument("--seed", type=int, default=1, metavar="INT", help="seed of the scene, the faults and --shallow")
    parser.add_argument("--out", metavar="TEXT", help="folder for the report; must be new or empty")
    parser.add_argument("--name", metavar="TEXT", help="name of the driver in the report; default: its program")
    parser.add_argument("--driver-version", default="", metavar="TEXT", help="version of the driver, for the report")
    parser.add_argument("--sonard", metavar="TEXT", default=os.environ.get("SONARD", "sonard"), help="the program")
    parser.add_argument("--no-namespaces", action="store_true",
                        help="run on loopback addresses, without the cases that need namespaces")
    parser.add_argument("--list", action="store_true", help="print the cases, run nothing")
    return parser


def _merge_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="sonarctl judge merge", description="Makes one matrix of several reports.")
    parser.add_argument("reports", nargs="+", metavar="REPORT", help="folders with index.json")
    parser.add_argument("--out", required=True, metavar="FOLDER")
    parser.add_argument("--page", type=pathlib.Path, metavar="FILE", help="also write a page of Markdown")
    return parser


def driver_name(words: Sequence[str]) -> str:
    """Returns the name of the program in a command line. For an interpreter or a launcher it is the name of the script."""
    launchers = {"env", "sh", "bash", "python", "python3", "roslaunch", "rosrun", "ros2", "nice", "timeout"}
    names = [pathlib.Path(word).name for word in words if not word.startswith("-") and "{" not in word]
    return next((name for name in names if name not in launchers), names[0] if names else "driver")


def _new_folder(name: str) -> pathlib.Path:
    out = pathlib.Path(name)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ValueError(f"--out {name}: the folder exists and is not empty")
    out.mkdir(parents=True, exist_ok=True)
    return out


def _check(options: argparse.Namespace) -> None:
    if not options.driver:
        raise ValueError("--driver is missing: the command that starts the driver, as 'mydriver --ip {ip}'")
    if not options.out:
        raise ValueError("--out is missing: the folder for the report")
    if options.no_namespaces and "{ip}" not in options.driver:
        raise ValueError("--driver has no {ip}: without namespaces the judge chooses a loopback address for the sonar")
    for name, low in (("repeat", 1), ("jobs", 1), ("seed", 0)):
        if getattr(options, name) < low:
            raise ValueError(f"--{name} is {getattr(options, name)}: it must be at least {low}")
    for option in options.option:
        if not option.partition("=")[2]:
            raise ValueError(f"--option {option}: it must be KEY=TEXT, as rip=1")
    if options.shallow is not None and not options.torture:
        raise ValueError("--shallow belongs to --torture")
    kind, _, topic = options.tap.partition(":")
    if kind not in ("json", "none", *ROS_MODULES):
        raise ValueError(f"--tap {options.tap}: it must be json, ros1:TOPIC, ros2:TOPIC or wire (none)")
    if kind in ROS_MODULES and not topic:
        raise ValueError(f"--tap {kind} needs the topic: --tap {kind}:/sonar/ping")
    if kind in ROS_MODULES and importlib.util.find_spec(ROS_MODULES[kind]) is None:
        raise NotJudged(f"--tap {kind} needs {ROS_MODULES[kind]}, which this Python does not have: source ROS's setup.bash first")


class TimeLeft:
    """Estimates the time for the remaining cases: their expected time, scaled by the real duration of the finished ones."""

    def __init__(self, cases: Sequence[Case], jobs: int) -> None:
        self._waiting = {case.number: case for case in cases}
        self._jobs = jobs
        self._expected_s = self._took_s = 0.0  # sums over the finished cases

    @staticmethod
    def expected_s(case: Case) -> float:
        """Returns the time for start, fault, recovery and end on an idle computer."""
        return 6 + case.until().get("seconds", 1) + case.tail_s

    def after(self, case: Case, took_s: float, repeat: int = 1) -> str:
        """Counts a finished case. Returns the remaining time as text: "", ", 40 s left", ", 5 min left"."""
        if self._waiting.pop(case.number, None) is not None:
            self._expected_s += self.expected_s(case) * repeat
            self._took_s += took_s
        if not self._waiting or self._expected_s == 0:
            return ""
        expected_s = sum(self.expected_s(one) for one in self._waiting.values()) * repeat
        left_s = expected_s * self._took_s / self._expected_s / min(self._jobs, len(self._waiting))
        return f", {max(10, round(left_s, -1)):.0f} s left" if left_s < 95 else f", {left_s / 60:.0f} min left"


class Judge:
    """Runs the chosen cases and makes their report."""

    def __init__(self, options: argparse.Namespace, out: pathlib.Path) -> None:
        self.options, self.out = options, out
        found = shutil.which(options.sonard)
        if found is None:
            raise NotJudged(f"{options.sonard}: not found; --sonard names the program")
        self.sonard = os.path.abspath(found)
        self.sonard_version = self._first_line("--version")
        self.fault_engine = "--faults" in self._text("--help")
        self.ping_bytes = 0
        self.lacking = "namespaces (--no-namespaces)" if options.no_namespaces else lab.missing()
        self.kinds: Dict[str, Dict[str, Any]] = {}
        self.command = options.driver
        kind, _, topic = options.tap.partition(":")
        if kind in ROS_MODULES:
            adapter = [sys.executable, "-m", "sonard_client.judge.ros_tap", kind, topic, "--"]
            self.command = shlex.join(adapter) + " " + options.driver
        self._running: "set[subprocess.Popen[str]]" = set()
        self._stopping = False
        self._left = TimeLeft([], options.jobs)
        self._print, self._done, self._slots = threading.Lock(), 0, list(range(options.jobs, 0, -1))
        # Judges that run at the same time on one computer need different loopback addresses and ports.
        self._first_offset = 1 + os.getpid() % 9 * 10

    def _text(self, *arguments: str) -> str:
        return subprocess.run([self.sonard, *arguments], capture_output=True, text=True, timeout=30, check=False).stdout

    def _first_line(self, *arguments: str) -> str:
        return (self._text(*arguments).strip().splitlines() or ["unknown"])[0]

    # ---- one run
    def spec(self, case: Optional[Case], slot: int) -> Dict[str, Any]:
        o = self.options
        described = None
        if case is not None:
            described = {**vars(case), "given": dict(case.given), "must": dict(case.must), "should": dict(case.should)}
        return {"case": described, "driver": self.command, "tap": "json" if o.tap != "none" else "none", "profile": o.profile,
                "options": dict(option.split("=", 1) for option in o.option), "sonard": self.sonard, "seed": o.seed,
                "space": "loopback" if self.lacking else "lab", "offset": self._first_offset + slot,
                "fault_engine": self.fault_engine, "ping_bytes": self.ping_bytes}

    def run_one(self, case: Optional[Case], folder: pathlib.Path) -> Dict[str, Any]:
        folder.mkdir(parents=True, exist_ok=True)
        with self._print:
            slot = self._slots.pop()
        try:
            (folder / "spec.json").write_text(json.dumps(self.spec(case, slot), indent=1) + "\n", encoding="utf-8")
            path = os.pathsep.join(filter(None, (_PACKAGE, os.environ.get("PYTHONPATH", ""))))
            command = [sys.executable, "-m", "sonard_client.judge.run_case", str(folder.resolve())]
            limit_s = 240 + (case.limit + case.until().get("seconds", 20) if case else 30)
            if not self.lacking:
                command = [*lab.unshare_prefix(), *command]
            with subprocess.Popen(command, env={**os.environ, "PYTHONPATH": path}, stdin=subprocess.DEVNULL,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as runner:
                self._running.add(runner)
                try:
                    _, said = runner.communicate(timeout=limit_s)
                except subprocess.TimeoutExpired:
                    runner.terminate()
                    _, said = runner.communicate(timeout=30)
                self._running.discard(runner)
            (folder / "spec.json").unlink()
            try:
                return dict(json.loads((folder / "case.json").read_text(encoding="utf-8")))
            except (OSError, ValueError):
                why = (said.strip().splitlines() or [f"exit code {runner.returncode}"])[-1]
                return {"ran": False, "why": f"the judge failed: {why}", "text": said[-4000:]}
        finally:
            with self._print:
                self._slots.append(slot)

    def stop(self) -> None:
        """Ends the running cases and starts no more."""
        self._stopping = True
        for runner in list(self._running):
            runner.terminate()

    # ---- all of them
    def nominal(self) -> None:
        with tempfile.TemporaryDirectory(prefix="judge-") as folder:
            result = self.run_one(None, pathlib.Path(folder))
            log = pathlib.Path(folder) / "driver.log"
            if not result.get("ran"):
                raise NotJudged(result.get("text") or result["why"])
            if not result["works"]:
                shutil.copyfile(log, self.out / "driver.log")
                raise NotJudged("The driver does not receive 20 consecutive pings from a sonar without any fault, "
                                f"so it is not judged.\n{result['why']}\nIts whole output: {self.out / 'driver.log'}")
        self.ping_bytes = int(result["ping_bytes"])
        self.kinds = {kind["code"]: kind for kind in result["kinds"].get("kinds", ())}

    def not_run(self, case: Case) -> str:
        """Returns the reason why a case cannot run here, or an empty text."""
        if case.kind == "N00":
            return ""
        if case.needs_lab:
            lacking = self.lacking or lab.fault_missing(case.kind)
            return f"needs {lacking}" if lacking else ""
        if "byte" in case.given and not self.ping_bytes:
            return "needs the right to read packets: namespaces or root"
        if not self.fault_engine:
            return "this sonard has no faults (sonard run --faults)"
        if not self.kinds:
            return ""
        kind = self.kinds.get(case.kind)
        if kind is None:
            return f"this sonard has no fault {case.kind}"
        product = self.options.profile.replace("-", "")  # the product begins with the name of its make
        why = next((why for make, why in kind.get("without_effect", {}).items() if product.startswith(make)), "")
        if why:
            return f"{case.kind} {why}"
        unknown = sorted(set(case.given) - {"byte"} - {p["name"] for p in kind.get("parameters", ())})
        return f"{case.kind} of this sonard has no parameter {', '.join(unknown)}" if unknown else ""

    def row(self, case: Case, total: int) -> Dict[str, Any]:
        folder, began = self.out / "cases" / case.number, time.monotonic()
        why = "stopped" if self._stopping else self.not_run(case)
        runs: List[Dict[str, Any]] = []
        if why:
            runs.append({"ran": False, "why": why})
        else:
            for number in range(self.options.repeat):
                runs.append(self.run_one(case, folder / f"run-{number + 1}" if number else folder))
        o = self.options
        repeat = f"sonarctl judge --driver {shlex.quote(o.driver)} --tap {o.tap} --profile {o.profile} --seed {o.seed}" + (
            "".join(f" --option {shlex.quote(option)}" for option in o.option)) + (
            " --torture" if ".T" in case.number else "") + f" --case {case.number} --out report-{case.number}"
        described = {"number": case.number, "kind": case.kind, "name": case.name, "sentence": case.sentence,
                     "with": dict(case.given), "at": case.at, "duration": case.duration, "limit": case.limit,
                     "good_driver": self.kinds.get(case.kind, {}).get("good_driver", ""), "expectation": case.expectation, "measured": case.measured, "repeat": repeat,
                     "folder": f"cases/{case.number}"}
        found = report.combine(described, runs, o.strict, o.tap != "none")
        with self._print:
            self._done += 1
            words = ", ".join(w for w in report.pages.verdict_words(found) if w)
            reasons = "" if found["result"].startswith("PASS") and found["should_holds"] else "; ".join(report.reasons(found))
            left = self._left.after(case, 0.0 if why else time.monotonic() - began, self.options.repeat)
            print(f"[{self._done:>3}/{total}{left}] {case.number:<8} {found['result']:<11} {words:<22} {reasons}".rstrip(), flush=True)
        return found

    def column(self, cases: Sequence[Case]) -> Dict[str, Any]:
        o, began = self.options, time.monotonic()
        date = time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())
        self._left = TimeLeft([case for case in cases if not self.not_run(case)], o.jobs)
        with ThreadPoolExecutor(o.jobs) as pool:
            try:
                rows = list(pool.map(lambda case: self.row(case, len(cases)), cases))
            except BaseException:
                self.stop()
                raise
        name = o.name or driver_name(shlex.split(o.driver))
        return {"name": name, "command": o.driver, "version": o.driver_version, "tap": o.tap, "profile": o.profile,
                "sonard": self.sonard_version, "seed": o.seed, "repeat": o.repeat,
                "machine": f"{platform.system()} {platform.release()}, {platform.machine()}, {os.cpu_count()} cores, "
                           f"{'namespaces' if not self.lacking else 'loopback'}",
                "counts": report.counts(rows), "cases": rows,
                "wall_clock": {"date": date, "seconds": round(time.monotonic() - began, 1)}}


def _judge(options: argparse.Namespace) -> int:
    cases = torture(options.seed, options.shallow) if options.torture else CASES
    cases = select(options.case, cases)
    if options.list:
        print(listing(cases))
        return 0
    _check(options)
    out = _new_folder(options.out)
    judge = Judge(options, out)
    if judge.lacking:
        print(f"judge: no {judge.lacking}: on loopback addresses, without {sum(c.needs_lab for c in cases)} cases",
              file=sys.stderr)
    judge.nominal()
    column = judge.column(cases)
    report.write(out, [column], options.strict)
    if text := report.causes_text(column):
        print(text)
    print(report.summary(column))
    print(f"report: {out / 'index.html'}")
    if all(row["result"] == "NOT RUN" for row in column["cases"]):
        return UNAVAILABLE
    return 0 if report.passed(column) else NOT_HELD


def main(arguments: Optional[List[str]] = None) -> int:
    given = sys.argv[1:] if arguments is None else arguments
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        if given[:1] == ["merge"]:
            options = _merge_parser().parse_args(given[1:])
            columns = report.merge([pathlib.Path(folder) for folder in options.reports], _new_folder(options.out))
            print("\n".join(report.summary(column) for column in columns))
            if options.page:
                options.page.write_text(markdown.page(columns), encoding="utf-8")
            return 0
        return _judge(_parser().parse_args(given))
    except SystemExit as end:  # raised by the parser, which has printed why
        return USAGE if end.code else 0
    except ValueError as why:
        print(f"judge: {why}", file=sys.stderr)
        return USAGE
    except (NotJudged, OSError) as why:
        print(f"judge: {why}", file=sys.stderr)
        return UNAVAILABLE
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
