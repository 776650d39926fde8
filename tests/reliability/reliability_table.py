#!/usr/bin/env python3
"""Makes docs/reliability.md from the figures that tests recorded (tests/reliability/record.hpp and record.py).

usage: reliability_table.py FOLDER [--strict] > docs/reliability.md
  FOLDER     what SONARD_RELIABILITY named: build/reliability after ./test.sh --long; what is measured by hand, with programs that
             are built elsewhere, is in by_hand/ beside this file (record.py writes it with SONARD_RELIABILITY=that folder)
  --strict   exit status 1 also when an item was not run; without it only when one missed its bound
"""
import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BY_HAND = pathlib.Path(__file__).resolve().parent / "by_hand"
FUZZ_BOUNDS = {"mesh_file": "5,000: the importer takes a hundred times as long"}  # as tests/tools/fuzz.sh

# Section -> items: key, what it is, what is promised.
ITEMS = {
    "Load and neighbours": [
        ("load-accounted", "8 sonars x 4 clients x 40 Hz x 128 KiB for 45 s: pings made, and sent or dropped", "exactly equal"),
        ("load-garbled", "the same: pings whose content is not what was made", "0"),
        ("load-dropped", "the same: pings dropped", "at most 0.5 %"),
        ("load-memory", "the same: growth of resident memory", "at most 1 MiB"),
        ("stall-neighbours", "a client that never reads beside three that do: pings the three lose", "0"),
        ("stall-reset", "the same: when the fourth is reset", "10 s without progress"),
        ("stall-accounted", "the same: pings made for the fourth, and sent or dropped", "exactly equal"),
        ("dead-peer", "a client whose computer died: when its place is free", "within 15 s"),
        ("cycles", "10,000 times connect, command, disconnect: descriptors, threads, memory", "back to baseline"),
        ("reconnects", "1,000 reconnects of a driver-shaped client that leaves in rude ways", "every one served"),
        ("real-pings", "60 s of 40 Hz x 512 simulated beams: ticks, pings and drops", "every one accounted for"),
        ("junk-rate", "junk at full speed into one sonar and the pose ports: pings the neighbour loses", "0"),
        ("junk-gap", "the same: longest gap of the neighbour's stream", "at most 250 ms at 40 Hz"),
        ("descriptors", "every file descriptor used up by visitors: pings a running stream loses", "0"),
    ],
    "Life cycle": [
        ("stop-reading", "SIGTERM: clients that read get their message whole and a FIN", "all"),
        ("stop-time", "SIGTERM with a client that does not read: exit 0", "within 2 s"),
        ("reload-untouched", "SIGHUP: pings that an untouched sonar loses", "0"),
        ("reload-error", "SIGHUP with a wrong file", "the old configuration stays"),
        ("kill-restart", "kill -9 and restart: first ping", "within 2.5 s"),
        ("disk-full", "log on a full disk", "no ping lost"),
        ("closed-output", "closed standard output and error", "no ping lost"),
        ("stop-continue", "SIGSTOP, SIGCONT: burst and corruption", "none"),
        ("unit-exposure", "exposure of the systemd unit, systemd-analyze security", "at most 1.5"),
        ("driver-restart", "restart after 4 s under oculus_driver of ENSTA: it publishes again", "within 15 s"),
    ],
    "Whole missions": [
        ("mission-digest", "10 minutes of a trajectory in stepped time: digests of two runs, one of them recorded", "equal"),
        ("mission-pace", "the same: pace", "faster than real time"),
        ("mission-replay", "its .oculus recording, served by sonard replay, received by our client", "byte for byte the same"),
        ("trajectory-load", "a trajectory of an hour at 100 Hz, 360,000 lines: read", "less than 1 s"),
    ],
    "Bytes from outside": [
        ("dissector", "a recorded run read by tshark with our dissector and by our decoder", "equal, field by field"),
        ("asan", "functional suite but for what computes for long, under the address and undefined-behaviour sanitizers",
         "no report"),
        ("tsan", "protocol, control and daemon under the thread sanitizer", "no report"),
    ],
}


def items():
    """The list above, and one item for each fuzz target that the tree has."""
    listed = {section: list(rows) for section, rows in ITEMS.items()}
    for source in sorted((ROOT / "tests/fuzz").glob("*_fuzz.cpp")):
        name = source.stem.removesuffix("_fuzz")
        listed["Bytes from outside"].append((f"fuzz-{name}", f"fuzz target {name}: inputs tried without a fault",
                                            FUZZ_BOUNDS.get(name, "500,000")))
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


def row_of(key, what, bound, record, machines):
    if record is None:
        return [what, bound, "not run", "", "", "", ""]
    at = machines.setdefault(record["machine"], len(machines) + 1)
    return [what, record["bound"], record["figure"], "yes" if record["passed"] else "**NO**", f"`{record['command']}`", str(at),
            record.get("date", "")]


def page_of(records):
    """The page, and the faults it shows."""
    machines, faults = {}, []
    lines = ["# Reliability", "",
             "What is promised of a daemon that is left running, and what was measured. Generated by "
             "`tests/reliability/reliability_table.py` from what the tests record; `./test.sh --long` measures everything again, "
             "but for what `tests/reliability/by_hand` keeps: that needs programs which are built elsewhere.", "",
             "\"Holds\" judges the bound that is written here. The tests themselves fail only at five times a promised time, so "
             "that a busy machine does not fail them; a row with **NO** fails `./test.sh --long` all the same.", ""]
    known = set()
    for section, rows in items().items():
        lines += [f"## {section}", "", "| what | bound | measured | holds | command | machine | date |", "|" + "---|" * 7]
        for key, what, bound in rows:
            known.add(key)
            record = records.get(key)
            lines.append("| " + " | ".join(cell(c) for c in row_of(key, what, bound, record, machines)) + " |")
            if record is not None and not record["passed"]:
                faults.append(f"{key}: {record['figure']}, bound {record['bound']}")
        lines.append("")
    faults += [f"unknown item {key}: add it to ITEMS" for key in sorted(set(records) - known)]
    if machines:
        lines += ["Machines: " + "; ".join(f"{at}: {name}" for name, at in machines.items()) + ".", ""]
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
