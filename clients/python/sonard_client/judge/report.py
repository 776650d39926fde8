"""Writes, reads and merges the judge's reports: index.json, junit.xml and the summary. pages.py makes the HTML pages."""
from __future__ import annotations

import json
import pathlib
import re
import shutil
import xml.etree.ElementTree as xml
from typing import Any, Dict, List, Sequence

from . import pages

SCHEMA, VERSION = "sonard-judge", 1
Json = Dict[str, Any]


_LONG = ("timeline", "journal", "hex", "connections", "text")  # only in case.json and on the case's page


def brief(run: Json) -> Json:
    """Returns a run without the long parts, for the index."""
    kept = {key: value for key, value in run.items() if key not in _LONG}
    if "wall_clock" in kept:
        kept["wall_clock"] = {key: value for key, value in kept["wall_clock"].items() if key not in _LONG}
    return kept


def combine(case: Json, runs: Sequence[Json], strict: bool, tapped: bool) -> Json:
    """Makes one row of a report from the runs of a case. If the runs disagree, the row is FLAKY."""
    row = dict(case, runs=[brief(run) for run in runs])
    ran = [run for run in runs if run.get("ran")]
    if not ran or len(ran) < len(runs):
        why = next(run.get("why", "") for run in runs if not run.get("ran"))
        return dict(row, result="NOT RUN", why=why, colour="none", must_holds=None, should_holds=None, data="", recovery="")
    classes = {(r["data"], r["recovery"], r["must_holds"], r["should_holds"]) for r in ran}
    worst = max(ran, key=lambda r: pages.COLOURS.index(r["colour"]))
    row.update(must_holds=all(r["must_holds"] for r in ran), should_holds=all(r["should_holds"] for r in ran), data=worst["data"],
               recovery=worst["recovery"], colour=worst["colour"], shown=ran.index(worst))
    if len(classes) > 1:
        return dict(row, result="FLAKY", colour="flaky")
    if case["expectation"] == "INFO":
        return dict(row, result="INFO")
    holds = row["must_holds"] and (row["should_holds"] or not strict)
    seen = tapped and all(r["tapped"] for r in ran)
    return dict(row, result=("PASS" if seen else "PASS (wire)") if holds else "FAIL")


def counts(rows: Sequence[Json]) -> Json:
    counted = [r for r in rows if r["result"] not in ("NOT RUN", "INFO")]
    return {"must": sum(r["must_holds"] and r["result"] != "FLAKY" for r in counted),
            "should": sum(r["should_holds"] and r["result"] != "FLAKY" for r in counted), "of": len(counted),
            "flaky": sum(r["result"] == "FLAKY" for r in rows), "not_run": sum(r["result"] == "NOT RUN" for r in rows),
            "info": sum(r["result"] == "INFO" for r in rows)}


def summary(column: Json) -> str:
    """Returns a line such as "my_driver: 92 of 107 MUST, 71 of 96 SHOULD, 2 flaky"."""
    n = column["counts"]
    text = f"{column['name']}: {n['must']} of {n['of']} MUST, {n['should']} of {n['of']} SHOULD, {n['flaky']} flaky"
    return text + (f", {n['not_run']} not run" if n["not_run"] else "") + ("" if column["tap"] != "none" else " (wire only)")


def passed(column: Json) -> bool:
    """Returns whether every counted case holds."""
    return all(r["result"] in ("PASS", "PASS (wire)", "INFO", "NOT RUN") for r in column["cases"])


def reasons(row: Json, strict: bool = True) -> List[str]:
    """Returns the checks of a case that do not hold, one sentence each."""
    if row["result"] == "NOT RUN":
        return [row["why"]]
    found = []
    for kind in ("must", "should") if strict else ("must",):
        for run in row["runs"]:
            for check in run.get("wall_clock", {}).get(kind, ()):
                if not check["holds"]:
                    text = f"{kind.upper()}: {check['what']} ({check['value']})"
                    if text not in found:
                        found.append(text)
    return found


def causes(rows: Sequence[Json]) -> List[Json]:
    """Groups the cases that fail in the same way, because one bug of a driver can fail many cases. Groups with a MUST come first,
    then large groups."""
    found: Dict[str, Json] = {}
    for row in rows:
        if row["result"] in ("NOT RUN", "INFO"):
            continue
        why = reasons(row, strict=False) or reasons(row)
        # Numbers are replaced, because they differ between the cases of a group.
        alike = "; ".join(sorted({re.sub(r"\d+(\.\d+)?", "n", text) for text in why}))
        if alike:
            cause = found.setdefault(alike, {"why": "; ".join(why), "must": why[0].startswith("MUST"), "cases": []})
            cause["cases"].append(row["number"])
    return sorted(found.values(), key=lambda c: (not c["must"], -len(c["cases"])))


def causes_text(column: Json, most: int = 8) -> str:
    """Returns the groups as text for a terminal; empty if every case holds."""
    lines = []
    for cause in causes(column["cases"]):
        numbers = cause["cases"][:most] + (["..."] if len(cause["cases"]) > most else [])
        lines.append(f"  {len(cause['cases']):>3}  {cause['why']}\n       {' '.join(numbers)}")
    return "\n".join(["Cases that fail alike:", *lines]) if lines else ""


def junit(columns: Sequence[Json], strict: bool) -> bytes:
    suites = xml.Element("testsuites")
    for column in columns:
        rows = column["cases"]
        failed = [r for r in rows if r["result"] in ("FAIL", "FLAKY")]
        suite = xml.SubElement(suites, "testsuite", name=column["name"], tests=str(len(rows)), failures=str(len(failed)),
                               skipped=str(column["counts"]["not_run"]), errors="0")
        for row in rows:
            seconds = sum(run.get("wall_clock", {}).get("watched_s", 0) for run in row["runs"])
            case = xml.SubElement(suite, "testcase", classname=f"{column['name']}.{row['kind']} {row['name']}",
                                  name=f"{row['number']} {row['sentence']}", time=f"{seconds:.2f}")
            if row["result"] == "NOT RUN":
                xml.SubElement(case, "skipped", message=row["why"])
            elif row in failed:
                why = reasons(row, strict or row["result"] == "FLAKY")
                failure = xml.SubElement(case, "failure", type=row["result"], message="; ".join(why)[:500] or row["result"])
                failure.text = f"data {row['data']}, recovery {row['recovery']}\n" + "\n".join(why) + (
                    f"\na good driver {row['good_driver']}" if row.get("good_driver") else "") + f"\nrepeat: {row['repeat']}"
            elif not row["should_holds"]:
                xml.SubElement(case, "system-out").text = "\n".join(reasons(row))
    return xml.tostring(suites, encoding="utf-8", xml_declaration=True)


def write(out: pathlib.Path, columns: Sequence[Json], strict: bool) -> None:
    """Writes index.json, junit.xml, index.html and the page of each case into the folder of a run."""
    index = {"schema": SCHEMA, "version": VERSION, "strict": strict, "drivers": list(columns)}
    (out / "index.json").write_text(json.dumps(index, indent=1) + "\n", encoding="utf-8")
    (out / "junit.xml").write_bytes(junit(columns, strict))
    (out / "index.html").write_text(pages.matrix(columns, summary, causes), encoding="utf-8")
    for column in columns:
        for row in column["cases"]:
            folder = out / row["folder"]
            if folder.is_dir():
                (folder / "index.html").write_text(pages.case_page(column, row, folder, reasons(row)), encoding="utf-8")


def read(folder: pathlib.Path) -> Json:
    """Reads the index of a report. Raises ValueError if the folder has none that this program can read."""
    try:
        index = dict(json.loads((folder / "index.json").read_text(encoding="utf-8")))
    except (OSError, ValueError) as why:
        raise ValueError(f"{folder}: no report of the judge: {why}") from None
    if index.get("schema") != SCHEMA:
        raise ValueError(f"{folder}: index.json is not a report of the judge")
    if int(index.get("version", 0)) > VERSION:
        raise ValueError(f"{folder}: report of version {index['version']}; this program reads up to {VERSION}")
    return index


def merge(folders: Sequence[pathlib.Path], out: pathlib.Path) -> List[Json]:
    """Merges reports into one with a column for each driver. Drivers of the same name get a number."""
    columns: List[Json] = []
    strict = True
    for folder in folders:
        index = read(folder)
        strict = strict and bool(index["strict"])
        for column in index["drivers"]:
            names = [c["name"] for c in columns]
            name = column["name"]
            while name in names:
                stem, _, number = name.partition(" #")
                name = f"{stem} #{int(number or 1) + 1}"
            place = f"driver-{len(columns) + 1}"
            rows = []
            for row in column["cases"]:
                source, target = folder / row["folder"], f"{place}/{row['number']}"
                if source.is_dir():
                    shutil.copytree(source, out / target, dirs_exist_ok=True)
                rows.append(dict(row, folder=target))
            columns.append(dict(column, name=name, cases=rows))
    out.mkdir(parents=True, exist_ok=True)
    write(out, columns, strict)
    return columns


def without_wall_clock(item: Any) -> Any:
    """Returns an index without the values that depend on time. It is equal for equal seeds."""
    if isinstance(item, dict):
        return {key: without_wall_clock(value) for key, value in item.items() if key != "wall_clock"}
    return [without_wall_clock(one) for one in item] if isinstance(item, list) else item
