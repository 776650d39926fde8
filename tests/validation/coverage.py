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
            raise RuntimeError(f"a line of the coverage report that cannot be read: {line}")
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

Every mode of every sonar, at its first range, over a level bed: how many bins of the bed lie within 1 dB of the closed form of
their level. By `sonard render --report coverage` (method: docs/render.md). This is expected power, the mean over speckle, with
surface cells 0.4 of a picture's each way. It shows that rays, patterns, pulse and gain leave no holes and no error; the effect of
a picture's larger cells is in docs/acoustics.md, section 3.

"""
