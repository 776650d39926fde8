"""Makes a table of the results of `sonard render --report coverage` for every sonar."""

import re

from texts import table

LINE = re.compile(r"^(?P<sonar>\S.*?) +(?P<beams>\d+) +(?P<range>[\d.]+) +(?P<rows>\d+) +(?P<bins>\d+) +(?P<share>[\d.]+) %"
                  r" +(?P<worst>[+-][\d.]+) +(?P<mean>[+-][\d.]+)$")


def rows_of(report):
    lines = report.splitlines()[1:]
    rows = []
    for line in lines:
        match = LINE.match(line)
        if match is None:
            raise RuntimeError(f"cannot read a line of the coverage report: {line}")
        rows.append([match["sonar"], match["beams"], f"{match['range']} m", match["rows"], f"{int(match['bins']):,}",
                     f"{match['share']} %", f"{match['worst']} dB", f"{match['mean']} dB"])
    if not rows:
        raise RuntimeError("the coverage report is empty")
    return rows


def chapter(sonard, folder):
    rows = rows_of(sonard.call("render", "--report", "coverage"))
    whole = sum(float(row[5].split()[0]) == 100 for row in rows)
    return (INTRODUCTION + table(["sonar", "beams", "range", "rows", "bins of the bed", "within 1 dB", "largest deviation", "mean"], rows) +
            f"\n{whole} of {len(rows)} wholly within 1 dB.\n")


INTRODUCTION = """## Coverage

For every mode of every sonar, at its first range over a level bed, the table has the share of the bed's bins within 1 dB of the
closed form of their level. `sonard render --report coverage` computes it (method: docs/render.md) in expected power, the mean
over speckle, with surface cells 0.4 times as long and wide as in a picture. It shows that rays, patterns, pulse and gain leave no
holes and no error. Section 3 of docs/acoustics.md has the effect of a picture's larger cells.

"""
