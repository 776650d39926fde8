"""`sonarctl judge merge --page FILE`: a page of Markdown that compares drivers, for a manual or a merge request."""
from __future__ import annotations

from typing import Any, Dict, List, Sequence

from .cases import FAMILIES

Json = Dict[str, Any]
_HEAD = """# Drivers under faults

`sonarctl judge` measured these results. A failed case shows how this version of a driver reacts to one injected fault; it does not say
how good the driver is at sea, and another version may differ. docs/judge.md, "Verdicts", explains the words.
"""


def _table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |\n" for line in lines)


def _holds(column: Json, family: str) -> str:
    rows = [r for r in column["cases"] if r["number"][0] == family and r["result"] not in ("NOT RUN", "INFO")]
    return f"{sum(bool(r['must_holds']) and r['result'] != 'FLAKY' for r in rows)} of {len(rows)}" if rows else "not run"


def _cell(row: "Json | None") -> str:
    if row is None or row["result"] == "NOT RUN":
        return "not run"
    run = row["runs"][row.get("shown", 0)]["wall_clock"]
    broken = [c for c in run["must"] if not c["holds"]]
    words = ", ".join(word for word in (run["data"], run["recovery"]) if word)
    crash = next((str(c["value"]) for c in broken if c["what"] == "survives"), "")
    return ("**" + words + "**" if broken else words) + (f" ({crash})" if crash else "")


def page(columns: Sequence[Json]) -> str:
    """Returns the page: the drivers, their counts by family, and the cases in which at least one driver fails."""
    names = [column["name"] for column in columns]
    drivers = _table(["driver", "version", "tap", "MUST", "SHOULD", "date"], [
        [c["name"], c["version"] or "not given", c["tap"], f"{c['counts']['must']} of {c['counts']['of']}",
         f"{c['counts']['should']} of {c['counts']['of']}", c["wall_clock"]["date"][:10]] for c in columns])
    families = _table(["MUST by family", *names], [
        [f"{letter} {title}", *cells] for letter, title in FAMILIES.items()
        for cells in [[_holds(c, letter) for c in columns]] if set(cells) != {"not run"}])
    of = [{row["number"]: row for row in column["cases"]} for column in columns]
    rows: List[List[str]] = []
    for number, case in {number: row for one in of for number, row in one.items()}.items():
        cells = [one.get(number) for one in of]
        if any(row and row["result"] in ("FAIL", "FLAKY") for row in cells):
            rows.append([f"{number} {case['sentence']}", *map(_cell, cells)])
    first = columns[0]
    return (f"{_HEAD}\n{drivers}\nProfile {first['profile']}, {first['sonard']}, seed {first['seed']}; {first['machine']}.\n\n{families}"
            "\n## Cases that a driver fails\n\nA failed MUST is **bold**.\n\n"
            + _table(["case", *names], rows))
