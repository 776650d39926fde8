#!/usr/bin/env python3
"""Makes the table of reliability from the figures that tests recorded (tests/reliability/record.hpp and record.py).

usage: reliability_table.py FOLDER [--strict] > PAGE
  FOLDER     the folder of SONARD_RELIABILITY: build/reliability after tests/tools/long_checks.sh
  --strict   exit status 1 also if an item was not run; without it only if a figure missed its bound
Figures that are measured by hand, with programs that are built elsewhere, are in by_hand/ beside this file. record.py writes
them there if SONARD_RELIABILITY names that folder.
"""
import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BY_HAND = pathlib.Path(__file__).resolve().parent / "by_hand"
FUZZ_BOUNDS = {  # as in tests/tools/fuzz.sh
    "mesh_file": "5,000: the importer takes a hundred times as long",
    "conversations": "50,000: each is minutes of a sonar's time",
}

# Section -> items: key, what is measured, the bound.
ITEMS = {
    "Load": [
        ("load-accounted", "8 sonars x 4 clients x 40 Hz x 128 KiB, 45 s: pings simulated = sent + dropped", "exactly equal"),
        ("load-garbled", "the same: pings with wrong content", "0"),
        ("load-dropped", "the same: pings dropped", "at most 0.5 %"),
        ("load-memory", "the same: growth of resident memory", "at most 1 MiB"),
        ("stall-neighbours", "one client never reads: pings lost by three others", "0"),
        ("stall-reset", "the same: time until its reset", "10 s without progress"),
        ("stall-accounted", "the same: its pings = sent + dropped", "exactly equal"),
        ("dead-peer", "a client's computer fails: time until its slot is free", "within 15 s"),
        ("cycles", "10,000 x connect, command, disconnect: descriptors, threads, memory", "back to baseline"),
        ("reconnects", "1,000 reconnects without orderly disconnects: served", "every one served"),
        ("real-pings", "40 Hz x 512 simulated beams, 60 s: ticks, pings, drops", "every one accounted for"),
        ("junk-rate", "junk at full speed into one sonar and the pose ports: pings lost by another sonar", "0"),
        ("junk-gap", "the same: its longest gap", "at most 250 ms at 40 Hz"),
        ("descriptors", "all file descriptors used up: pings lost by a running stream", "0"),
        ("strangers", "one client that sends without end, the worst of 14 kinds: pings of a driver that requests 40 Hz", "at least 38 Hz"),
        ("closed-floods", "32 floods of poses have closed: time until an honest sender steers", "within 1 s"),
        ("viewers", "8 viewers of every channel beside a driver at 10 Hz, 60 s: pings lost by the driver", "0"),
        ("faults-beside", "a fault every second at another client, 60 s: pings lost by the driver", "0"),
        ("faults-journal", "the same: entries of the journal in its file", "every one"),
        ("datagrams", "hosts of the Ping family, ARIS and Sonar 3D-15 by UDP, 10 s each: pings", "served + dropped, one in progress at the end"),
        ("farm-kill", "farm: a worker and the queue's server killed: shards", "all, byte for byte those of one process"),
        ("farm-strays", "the same: numbers in its queue that are not shards of the job", "refused by name, no file made"),
    ],
    "Life cycle": [
        ("stop-reading", "SIGTERM: reading clients get their message whole, then a FIN", "all"),
        ("stop-time", "SIGTERM with a client that does not read: exit 0", "within 2 s"),
        ("stop-119", "SIGTERM with 119 descriptors open: 9 drivers, 8 viewers, 20 event streams, 64 others, a recording", "within 2 s"),
        ("reload-untouched", "SIGHUP: pings lost by an unchanged sonar", "0"),
        ("reload-error", "SIGHUP with an invalid file", "the old configuration stays"),
        ("kill-restart", "kill -9 and restart: first ping", "within 2.5 s"),
        ("disk-full", "log on a full disk", "no ping lost"),
        ("closed-output", "standard output and error closed", "no ping lost"),
        ("stop-continue", "SIGSTOP, SIGCONT: pings in the first second", "at most 12, whole"),
        ("unit-exposure", "systemd-analyze security of the unit", "at most 1.5"),
        ("driver-restart", "restart after 4 s: ENSTA's oculus_driver publishes again", "within 15 s"),
    ],
    "Missions": [
        ("mission-digest", "10 min of a trajectory in stepped time: digests of two runs, one recorded", "equal"),
        ("mission-pace", "the same: speed", "faster than real time"),
        ("mission-replay", "its .oculus recording served by sonard replay", "byte for byte the same"),
        ("trajectory-load", "reading a trajectory of 360,000 lines (an hour at 100 Hz)", "less than 1 s"),
    ],
    "Page": [
        ("page-first-picture", "the demo: opening of the page to its first picture", "< 1000 ms"),
        ("page-first-picture-new-browser", "the same in a browser that has just been started", "< 1000 ms"),
        ("page-demo-clicks", "the demo: click to the next picture of the browser", "p95 < 150 ms"),
        ("page-demo-clicks-scripts", "the demo: click to the end of the page's scripts", "p95 < 50 ms"),
        ("page-size", "what the page loads until its first picture", "< 200 kB as sent"),
        ("page-memory", "growth of the page's memory in 20 min beside a driver", "+10 MB"),
        ("page-pose-to-pixel", "set_object is answered: time until the picture shows it", "p50 < 100, p95 < 150 ms"),
        ("page-socket-to-pixel", "a ping arrives: time until the picture shows it", "p95 < 40 ms"),
        ("page-computing", "the same: time to compute the ping, a part of the delay", "< 20 ms"),
        ("page-pictures", "a driver at 15 Hz: pictures drawn", ">= 14 of 15 Hz"),
        ("page-clicks", "the same: click to the next picture of the browser", "p95 < 100 ms"),
        ("page-clicks-scripts", "the same: click to the end of the page's scripts", "p95 < 50 ms"),
    ],
    "Input": [
        ("dissector", "a recorded run: fields of the Wireshark dissector = sonard's decoder", "equal, field by field"),
        ("asan", "functional tests, without long computations: address and undefined-behaviour sanitizers", "no report"),
        ("tsan", "protocol, control and daemon tests: thread sanitizer", "no report"),
    ],
}


def items():
    """Returns the list above, with one item for each fuzz target in the tree."""
    listed = {section: list(rows) for section, rows in ITEMS.items()}
    for source in sorted((ROOT / "tests/fuzz").glob("*_fuzz.cpp")):
        name = source.stem.removesuffix("_fuzz")
        listed["Input"].append((f"fuzz-{name}", f"fuzz target {name}: inputs without a fault", FUZZ_BOUNDS.get(name, "500,000")))
    return listed


def read_records(folder):
    records = {}
    for path in sorted(pathlib.Path(folder).glob("*.json")):
        record = json.loads(path.read_text(encoding="utf-8"))
        missing = {"item", "figure", "bound", "passed", "command", "machine"} - set(record)
        if missing:
            raise ValueError(f"{path}: without {', '.join(sorted(missing))}")
        records[record["item"]] = record
    return records


def cell(text):
    return str(text).replace("|", "\\|").replace("\n", " ")


def range_of(values):
    """Returns the common value of several records, or the first and the last value."""
    values = sorted(set(values))
    return values[0] if len(values) == 1 else f"{values[0]} to {values[-1]}"


class Page:
    """Makes the rows of the tables. Lists commands, machines and dates once, and cites them by number."""

    def __init__(self):
        self.machines, self.commands, self.faults = {}, {}, []

    def number(self, command, records):
        at = sorted({self.machines.setdefault(r["machine"], len(self.machines) + 1) for r in records})
        where = f"machine{'s' if len(at) > 1 else ''} {' and '.join(map(str, at))}"
        text = f"`{command}`, {where}, {range_of(r.get('date', '') for r in records)}"
        return self.commands.setdefault(text, len(self.commands) + 1)

    def row(self, key, what, bound, record):
        if record is None:
            return what, bound, "not run", "", ""
        if not record["passed"]:
            self.faults.append(f"{key}: {record['figure']}, bound {record['bound']}")
        holds = "yes" if record["passed"] else "**NO**"
        return what, record["bound"], record["figure"], holds, self.number(record["command"], [record])

    def fuzz_row(self, bound, records):
        """Returns one row for all targets that passed with the same bound."""
        names = ", ".join(f"`{name}`" for name in sorted(records))
        count = f"{len(records)} fuzz targets: inputs without a fault each"
        what = count if len(records) > 1 else "fuzz target: inputs without a fault"
        figures = range_of(r["figure"] for r in records.values())
        return f"{what}: {names}", bound, figures, "yes", self.number("tests/tools/fuzz.sh TARGET", list(records.values()))

    def section(self, title, rows, records):
        lines = [f"## {title}", "", "| measured | bound | result | holds | command |", "|" + "---|" * 5]
        passed = {}  # bound -> fuzz target -> record
        for key, what, bound in rows:
            record = records.get(key)
            if key.startswith("fuzz-") and record is not None and record["passed"]:
                same = record["bound"].replace(",", "") == bound.replace(",", "")
                passed.setdefault(bound if same else record["bound"], {})[key.removeprefix("fuzz-")] = record
                continue
            lines.append("| " + " | ".join(cell(c) for c in self.row(key, what, bound, record)) + " |")
        for bound, targets in passed.items():
            lines.append("| " + " | ".join(cell(c) for c in self.fuzz_row(bound, targets)) + " |")
        return lines + [""]


def page_of(records):
    """Returns the page and its list of faults."""
    page = Page()
    lines = ["# Reliability", "",
             "Measured bounds of a daemon in long runs. Generated by `tests/reliability/reliability_table.py` from the",
             "records of `tests/tools/long_checks.sh`; `tests/reliability/by_hand` has results that need programs built elsewhere.", "",
             "\"Holds\" compares with the bound given here; a **NO** fails `long_checks.sh`. The tests themselves fail only at",
             "five times a time bound, so that a busy machine does not fail them.", ""]
    sections = items()
    for title, rows in sections.items():
        lines += page.section(title, rows, records)
    known = {key for rows in sections.values() for key, _, _ in rows}
    faults = page.faults + [f"unknown item {key}: add it to ITEMS" for key in sorted(set(records) - known)]
    if page.commands:
        lines += ["## Commands", ""] + [f"{at}. {text}" for text, at in page.commands.items()] + [""]
        lines += ["Machines: " + "; ".join(f"{at}: {name}" for name, at in page.machines.items()) + ".", ""]
    return "\n".join(lines), faults, sorted(known - set(records))


def main():
    arguments = [a for a in sys.argv[1:] if a != "--strict"]
    if len(arguments) != 1 or arguments[0].startswith("-"):
        sys.exit(__doc__)
    try:
        page, faults, missing = page_of({**read_records(BY_HAND), **read_records(arguments[0])})
    except (OSError, ValueError) as error:
        print(f"reliability_table.py: {error}", file=sys.stderr)
        return 2
    print(page, end="")
    for fault in faults:
        print(fault, file=sys.stderr)
    if missing:
        print("not run: " + ", ".join(missing), file=sys.stderr)
    return 1 if faults or ("--strict" in sys.argv and missing) else 0


if __name__ == "__main__":
    sys.exit(main())
