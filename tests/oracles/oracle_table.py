#!/usr/bin/env python3
"""Makes the summary table of the oracles from the figures that a test run recorded (tests/oracles/record.hpp).

usage: oracle_table.py FOLDER [--markdown] [--partial]
  FOLDER      the folder that SONARD_ORACLES named; build/<preset>/oracles after ctest
  --markdown  a table for the validation tables instead of one for the terminal
  --partial   only some tests were run, so an oracle without figures is no fault
Exit status 1: an oracle is out of tolerance, or has no figures and no reason for that. 2: the folder cannot be read.
"""

import argparse
import json
import math
import pathlib
import sys

ORACLES = {
    1: "range of a point target's peak",
    2: "range against a sound speed mismatch",
    3: "level of a point target",
    4: "slope of a point's level over range",
    5: "slope of a flat wall's energy over range",
    6: "slope of a flat wall's first cell over range",
    7: "slope of a seabed cell over range",
    8: "absolute level of a seabed",
    9: "Lambert sphere",
    10: "specular echo of a sphere",
    11: "specular echo of a cylinder",
    12: "specular echo of a plate",
    13: "trihedral corner",
    14: "receive width of a point target",
    15: "highest side lobe",
    16: "two-way elevation product",
    17: "pulse width in range",
    18: "column synthesis against the direct sum",
    19: "beamforming against the dense sum",
    20: "CPU against GPU",
    21: "energy against the number of rays",
    22: "energy against the number of beams",
    23: "Rayleigh statistics of speckle",
    24: "scintillation index of speckle",
    25: "scintillation index of a Rician field",
    26: "coherence of beams on a seabed",
    27: "absorption table",
    28: "absorption's branches meet",
    29: "sound speed",
    30: "noise level",
    31: "noise correlation of beams",
    32: "a flat bottom is filled",
    33: "shadow behind a box",
    34: "still scene, identical pings",
    35: "decorrelation by a lateral shift",
    36: "speckle rides with the bottom ahead",
    37: "speckle stays with the bottom in a turn",
    38: "surface ghosts, ranges",
    39: "surface ghosts, amplitudes",
    40: "yaw during the ping",
    41: "quantisation round trip",
    42: "TVG flattens a point target",
    43: "no wrap of echoes beyond the record",
    44: "awkward inputs give finite output",
    45: "frequency modes against each other",
    46: "conical shift",
}
NO_NUMBER = 0  # number of the checks beyond the table

NOT_BUILT = {
    13: "no corner reflector is built: corners echo by multipath or not at all",
    20: "needs a CUDA device; by loops on the host: docs/cuda.md",
}


def read_records(folder):
    """Returns all records of a run, in the order of their oracles, then of the tests that made them."""
    records = []
    for path in sorted(pathlib.Path(folder).glob("*.jsonl")):
        for at, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            try:
                records.append(json.loads(line))
            except ValueError as error:
                raise ValueError(f"{path}:{at}: not a record: {error}") from error
    return records


def badness(record):
    """Returns how bad a record is: for `equal` the used share of the tolerance, for a bound the distance beyond it."""
    expected, measured = record["expected"], record["measured"]
    if math.isnan(measured):
        return math.inf
    if record["kind"] == "equal":
        off = abs(measured - expected)
        if record["tolerance"] > 0:
            return off / record["tolerance"]
        return 0 if off == 0 else math.inf
    return expected - measured if record["kind"] == "at_least" else measured - expected


def rows_of(records):
    """Returns a row for each oracle and `what`: the worst of its records, and their number."""
    rows = {}
    for record in records:
        row = rows.setdefault((record["oracle"], record["what"]), {"worst": record, "count": 0, "pass": True})
        row["count"] += 1
        row["pass"] &= record["pass"]
        if badness(record) > badness(row["worst"]):
            row["worst"] = record
    # The 46 numbered oracles come first, the other checks last. Within one oracle, the order is that of the records.
    return sorted(rows.items(), key=lambda item: item[0][0] or math.inf)


def figure(value):
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    return f"{value:.3e}" if abs(value) < 1e-3 or abs(value) >= 1e6 else f"{value:.4g}"


def cells_of(number, what, row):
    worst = row["worst"]
    if worst["kind"] == "equal":
        expected = figure(worst["expected"])
        tolerance = "exact" if worst["tolerance"] == 0 else f"±{figure(worst['tolerance'])}"
    else:
        expected = ("at least " if worst["kind"] == "at_least" else "below ") + figure(worst["expected"])
        tolerance = ""
    unit = f" {worst['unit']}" if worst["unit"] else ""
    times = f"{what} (worst of {row['count']})" if row["count"] > 1 else what
    title = ORACLES.get(number, "")
    return [
        str(number) if number else "+",
        f"{title}: {times}" if title else times,
        expected + unit,
        figure(worst["measured"]),
        tolerance,
        "yes" if row["pass"] else "NO",
    ]


HEAD = ["#", "oracle", "expected", "measured", "tolerance", "holds"]


def table_of(records):
    rows = rows_of(records)
    recorded = {number for (number, _), _ in rows}
    table = [(number or math.inf, cells_of(number, what, row)) for (number, what), row in rows]
    for number, reason in NOT_BUILT.items():
        if number not in recorded:
            table.append((number, [str(number), f"{ORACLES[number]}: {reason}", "", "", "", "not built"]))
    return [cells for _, cells in sorted(table, key=lambda item: item[0])]


def as_markdown(table):
    lines = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    return lines + ["| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |" for cells in table]


def as_text(table):
    widths = [max(len(row[i]) for row in [HEAD] + table) for i in range(len(HEAD))]
    return ["  ".join(c.ljust(w) for c, w in zip(row, widths)).rstrip() for row in [HEAD] + table]


def faults_of(records, partial):
    faults = [
        f"oracle {r['oracle'] or '+'} ({r['what']}) is out of tolerance in {r['test']}: expected {figure(r['expected'])}, "
        f"measured {figure(r['measured'])} {r['unit']}".rstrip()
        for r in records
        if not r["pass"]
    ]
    recorded = {r["oracle"] for r in records}
    faults += [f"unknown oracle number {n}" for n in sorted(recorded - set(ORACLES) - {NO_NUMBER})]
    if not partial:
        missing = [n for n in ORACLES if n not in recorded and n not in NOT_BUILT]
        faults += [f"oracle {n} ({ORACLES[n]}) has no figures: no test recorded it" for n in missing]
    return faults


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, usage=argparse.SUPPRESS)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--partial", action="store_true")
    args = parser.parse_args()
    try:
        records = read_records(args.folder)
    except (OSError, ValueError) as error:
        print(f"oracle_table.py: {error}", file=sys.stderr)
        return 2
    table = table_of(records)
    print("\n".join(as_markdown(table) if args.markdown else as_text(table)))
    faults = faults_of(records, args.partial)
    for fault in faults:
        print(fault, file=sys.stderr)
    built = len({r["oracle"] for r in records} & set(ORACLES))
    print(f"{built} of {len(ORACLES)} oracles have figures, {len(records)} in all; {len(faults)} faults", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
