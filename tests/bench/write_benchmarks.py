#!/usr/bin/env python3
"""Writes docs/benchmarks.md with its two pictures, and its detailed tables, from results of `sonard_bench --json`.

usage: write_benchmarks.py BENCH.json [SET.json...] DOCS_FOLDER TABLES_FOLDER
       write_benchmarks.py --instruction-sets SET.json... TABLES_FOLDER
       write_benchmarks.py --curves BENCH.json DOCS_FOLDER
  BENCH.json  the whole run
  SET.json    rates with one instruction set, the best first: the chapter "Instruction sets"
  --instruction-sets  all files are SET.json: replaces that chapter of the tables and keeps everything else
  --curves  replaces the chapter on how times grow and its picture, and keeps everything else
Standard library only. tests/tools/benchmarks.sh makes the JSON and calls this; the pages are not edited by hand.
"""

import json
import re
import sys
from datetime import date
from pathlib import Path

from benchmark_drawings import bars, cost, exponents, in_words, lines_of

# name: required rate, and the goals with two threads by instruction set [pings/s]; instruction sets without a value have no goal.
GOALS = {
    "P1": (75, {"avx512": 400, "avx2": 160}),
    "P2": (60, {"avx512": 200, "avx2": 90}),
    "P3a": (40, {"avx512": 320, "avx2": 130}),
    "P3b": (40, {"avx512": 250, "avx2": 100}),
    "P3c": (40, {"avx512": 350, "avx2": 140}),
    "P3d": (40, {"avx512": 120, "avx2": 55}),
    "P4a": (40, {"avx512": 180, "avx2": 75}),
    "P4b": (25, {"avx512": 80, "avx2": 30}),
}
# Thread ms of the prototype's stages for P1 (2 processors with AVX-512), from which the goal was derived.
FLOOR = {"trace": 2.9 + 0.44, "cull": 0.09, "scatter": 1.9, "synthesize": 1.4, "noise": 0.17, "form beams": 0.42, "receive": 0.2}
NAME = "benchmarks"  # the file name of both pages
PEER = "## Beside a peer"  # a chapter that is written by hand
# Reasons for the cost of a ping, by the quantity that grows.
KNEES = {
    "rays a column": "every ray is traced and is a scatterer; a ray of a denser fan costs less; the knee is weak",
    "rows": "the cell count is constant up to 437 rows; finer rows need finer cells in both directions, 14.6 times as many from 874 to 3,496 rows",
    "beams": "cells do not depend on beams; beyond the columns of the default fan, rays and coupling grow with beams",
    "triangles, finer": "cells and rays stay constant; the tree grows (probably its memory; not measured)",
    "triangles, wider": "triangles out of range are not visited",
    "sonars": "sonars share scene and cells; a ping costs as much as with one sonar",
}
PAPER = [  # Choi 2025, Table 3: 512 beams, 10 m, RTX 2080 Ti and i9-9900K
    ("paper, 300 rays a beam, GPU", 0.3),
    ("paper, raster, 11 rays, GPU", 2.0),
    ("its public successor, GPU (36 ms a frame)", 1000 / 36),
]


def verdict(value, must, goal, smaller=False):
    reached = (lambda limit: value <= limit) if smaller else (lambda limit: value >= limit)
    return "goal" if goal is not None and reached(goal) else "holds" if reached(must) else "**missed**"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows] + [""]


def instruction_set(result):
    """Returns "avx2" for "cpu, avx2, 2 threads, Embree 3.13.5"."""
    return result["engine"].split(", ")[1]


def measured_on(report):
    return report.get("date", date.today().isoformat())


def other_machines(text, measured):
    """Returns the sub-chapters of `text` for machines whose instruction set is not `measured`: "### avx512: ..."."""
    chapters = re.findall(r"^### (\w+)(: .*?)(?=^##|\Z)", text, flags=re.M | re.S)
    return [line for name, rest in chapters if name != measured for body in [f"### {name}{rest}"] for line in body.rstrip("\n").split("\n") + [""]]


def by_threads(results, case, scene):
    return {r["threads"]: r for r in results if r["case"] == case and r["scene"] == scene}


def rates(report, scene):
    rows = []
    for case, (must, goals) in GOALS.items():
        found = by_threads(report["results"], case, scene)
        if not found:
            continue
        most = found[max(found)]
        goal = goals.get(instruction_set(most))
        one = f"{found[1]['pings_per_second']:.0f}" if 1 in found else ""
        rows.append([case, most["description"], one, f"{most['pings_per_second']:.0f}", f"{1e3 / most['min_ms']:.0f}",
                     f"{most['processor_ms']:.2f}", must, goal or "", verdict(most["pings_per_second"], must, goal)])
    return table(["case", "what", "1 thread", "all threads", "best ping", "processor ms", "required", "goal", "result"], rows)


def stages(report, scene):
    one = [by_threads(report["results"], case, scene) for case in GOALS]
    one = [found[min(found)] for found in one if found]
    names = [name for name in one[0]["thread_ms"] if any(r["thread_ms"][name] >= 0.005 for r in one)]
    rows = [[r["case"], r["threads"]] + [f"{r['thread_ms'][name]:.2f}" for name in names] for r in one]
    lines = table(["case", "threads"] + names, rows)
    p1 = next((r for r in one if r["case"] == "P1"), None)
    if p1:
        cells = [[stage, f"{ms:.2f}", f"{p1['thread_ms'].get(stage, 0):.2f}",
                  f"{100 * ms / p1['thread_ms'][stage]:.0f} %" if p1["thread_ms"].get(stage) else ""]
                 for stage, ms in FLOOR.items()]
        lines += ["Beside the prototype that the goals were derived from (P1, thread ms; without specular echoes, motion and framing):", ""]
        lines += table(["stage", "prototype", "here", "prototype over here"], cells)
    return lines


def demo_of(d):
    return d["profile"] + ("" if d["on_request"] else f", {d['rate_hz']:.0f} Hz")


def ticks_of(d):
    return f"{d['skipped_ticks']} of {d['pings'] + d['skipped_ticks']} ticks skipped"


def demos(report):
    rows = [[d["profile"], "on request" if d["on_request"] else f"{d['rate_hz']:.0f} Hz", d["beams"], d["rows"], f"{d['range_m']:g}",
             f"{d['latency']['median_ms']:.1f}", f"{d['latency']['p95_ms']:.1f}", f"{d['processor_ms']:.1f}", ticks_of(d)]
            for d in report["demos"]]
    return table(["profile", "rate", "beams", "rows", "range, m", "median, ms", "p95, ms", "processor ms", ""], rows)


def service(report):
    rows = [["P0", f"{d['make']} ({demo_of(d)})",
             f"median {d['latency']['median_ms']:.1f} ms, p95 {d['latency']['p95_ms']:.1f} ms; {d['processor_ms']:.1f} "
             f"processor ms; {ticks_of(d)}", "none skipped", "", "holds" if d["skipped_ticks"] == 0 else "**missed**"]
            for d in report.get("demos", []) if d["demo"]]
    if "latency" in report:
        t = report["latency"]
        p99 = t["latency"]["p99_ms"]
        rows.append(["P5", f"latency from a pose and a network trigger to the ping's last byte at a client on loopback: {t['rows']} rows, "
                     f"{t['threads']} threads, {t['triggers']} triggers", f"median {t['latency']['median_ms']:.2f} ms, p99 {p99:.2f} ms, "
                     f"worst {t['latency']['max_ms']:.2f} ms", "25 ms", "10 ms", verdict(p99, 25, 10, True)])
    if "first_pings" in report:
        f = report["first_pings"]
        late = max(f["beyond_two_periods_ms"], 0)
        rows.append(["P14", f"first ping after a change of settings, {f['settings']} settings in turn, {f['threads']} threads",
                     f"median {f['first']['median_ms']:.0f} ms, slowest {f['first']['max_ms']:.0f} ms; at most {late:.0f} ms beyond two "
                     f"periods ({f['slowest']}); processor time {f['median_ratio']:.1f} times a warm ping's",
                     "50 ms beyond two periods", "", "holds" if late <= 50 and f["holds"] else "**missed**"])
    for c in report.get("cold", []):
        ms = c["cold"]["median_ms"]
        rows.append(["P3e", f"jump to a new place, {c['case']}, {c['threads']} thread{'s' if c['threads'] > 1 else ''}, "
                     f"{100 * c['new_tiles']:.0f} % of the tiles new",
                     f"{ms:.0f} ms (worst {c['cold']['max_ms']:.0f}), the next ping {c['warm']['median_ms']:.1f} ms", "500 ms", "60 ms",
                     verdict(c["cold"]["max_ms"], 500, 60, True)])
    if "objects" in report:
        o = report["objects"]
        rows.append(["P7", f"placing {o['objects']} moving objects; and the ping's extra processor time over the same objects at rest",
                     f"{o['place']['median_ms']:.3f} ms; {o['added']['median_ms']:+.2f} ms", "0.5 ms", "0.1 ms",
                     verdict(o["place"]["median_ms"], 0.5, 0.1, True)])
    for s in report.get("side_lobes", []):
        rows.append(["P15", f"{s['case']} with / without side lobes, alternating",
                     f"{s['with']['median_ms']:.2f} / {s['without']['median_ms']:.2f} processor ms; median ratio {round(100 * s['ratio'] - 100):+d} %",
                     "", "+10 %", "goal" if s["ratio"] <= 1.1 else "**missed**"])
    for c in report.get("clients", []):
        share = 100 * c["sender_share"]
        rows.append(["P8", f"{c['clients']} client{'s' if c['clients'] > 1 else ''} at {c['pings_per_second']:.1f} pings/s: the sending thread's share of a processor",
                     f"{share:.1f} %, {c['dropped']} dropped", "40 %, no drop", "15 %",
                     verdict(share, 40, 15, True) if c["dropped"] == 0 else "**missed**"])
    for h in report.get("hashes", []):
        rows.append(["P9", f"{h['case']} with 1, 2, 4 and again 1 threads", "the same bytes" if h["same"] else "**different bytes**",
                     "the same", "", f"SHA-256 {h['sha256'][:16]}..."])
    return table(["case", "what", "measured", "required", "goal", "result"], rows)


def empty_bins(report):
    rows = [[e["case"], e["rows"], "one scatterer a ray, 300 rays" if e["rays"] else "surface cells", e["bins"],
             f"{100 * e['empty_share']:.3f} %"] for e in report["empty_bins"]]
    return table(["case", "rows", "scatterers", "bins on the bed", "empty"], rows)


def cores(report):
    """Returns the rates by threads, and those of several sonars in one daemon."""
    count = sorted({r["threads"] for r in report["threads"]})
    found = {(r["case"], r["threads"]): r for r in report["threads"]}
    rows = []
    for case in dict.fromkeys(r["case"] for r in report["threads"]):
        rate = [found[case, n]["pings_per_second"] for n in count]
        rows.append([case, found[case, count[0]]["description"], f"{rate[0]:.0f}"] + [f"{r:.0f} ({r / rate[0]:.2f})" for r in rate[1:]])
    lines = ["Pings/s by threads; in brackets, multiples of one thread's.", ""]
    lines += table(["case", "what"] + [f"{n} thread{'s' if n > 1 else ''}" for n in count], rows)
    lines += ["P900-90 sonars (2 to 10 m) in one daemon with all threads. Each has a client on loopback that requests "
              "15 pings/s, the product's highest rate.", ""]
    return lines + table(["sonars", "threads", "all, pings/s", "slowest", "fastest", "slowest / fastest"],
                         [[s["sonars"], s["threads"], f"{s['total']:.0f}", f"{s['lowest']:.1f}", f"{s['highest']:.1f}",
                           f"{s['lowest'] / s['highest']:.2f}"] for s in report["sonars"]])


def ratios(report):
    rows = [[r["name"], f"{r['slow_ms']:.1f}", f"{r['fast_ms']:.3f}", f"{r['ratio']:.1f}", f"{r['least']:g}" if r["least"] else "",
             f"{r['difference']:.0e}" if r["difference"] else "", "" if r["holds"] else "**missed**"] for r in report["ratios"]]
    return table(["slow / fast", "slow ms", "fast ms", "ratio", "at least", "differ by", ""], rows)


def growth(report):
    """Returns the chapter on curves: the picture, exponents, and the stages that make the growth before and after a knee."""
    first = report["results"][0]
    rows = []
    for c in report["curves"]:
        points = c["points"]
        found = exponents(points)
        marks = [0] + ([found[1]] if found[1] is not None else []) + [len(points) - 1]
        grown = []
        for a, b in zip(marks, marks[1:]):
            before, after = points[a].get("thread_ms", {}), points[b].get("thread_ms", {})
            more = {stage: after.get(stage, 0) - before.get(stage, 0) for stage in {**before, **after}}
            whole = sum(abs(ms) for ms in more.values())
            words = [f"{stage} {before.get(stage, 0):.1f} to {after.get(stage, 0):.1f}" for stage, ms in more.items()
                     if abs(ms) >= 0.2 * whole and abs(ms) >= 0.3]
            grown.append(", ".join(words) or "none")
        rows.append([f"{c['name']}: {c['case']}", f"{points[0]['x']:,.0f} to {points[-1]['x']:,.0f}",
                     f"{1e3 / cost(points[0]):.0f} to {1e3 / cost(points[-1]):.0f}", in_words(found, points), "; then ".join(grown),
                     KNEES.get(c["name"], "")])
    return ["## How times grow", "",
            f"The figures are pings/s of one thread, from the lowest processor time of a ping "
            f"(`sonard_bench --scene local-search --case P1 --curves`; {rates_title(report)}). The exponent is the slope of the processor "
            f"time over the quantity in logarithms; the dashed line is the knee, where two slopes fit better than one. Stages are in "
            f"processor ms per ping, up to the knee and beyond it.", "",
            "![curves](benchmarks-curves.svg)", ""] + table(
                ["what grows", "from, to", "pings/s", "exponent", "stages that change", "why"], rows)


def with_chapter(text, chapter):
    """Returns the page `text` with the lines `chapter` in place of the chapter of the same title, or at its end."""
    body = "\n".join(chapter).rstrip("\n") + "\n"
    pattern = re.compile(rf"^{re.escape(chapter[0])}\n.*?(?=^## |\Z)", flags=re.M | re.S)
    if pattern.search(text):
        return pattern.sub(lambda _: body + "\n", text, count=1).rstrip("\n") + "\n"
    return text.rstrip("\n") + "\n\n" + body


SETS = "## Instruction sets"
SETS_INTRODUCTION = (
    "By machine. The hot loops (`--simd`) and the ray tracer (`SONARD_EMBREE_ISA`) are limited together: `avx2` stands for most "
    "desktops and laptops, `portable` (Embree with SSE 4.2) for older ones. Pings/s; in brackets, how many times faster the first "
    "column is.")


def instruction_sets(reports, scene="local-search"):
    """Returns the chapter on rates and stages with each instruction set of one processor, the best first."""
    found = [{r["case"]: r for r in report["results"] if r["scene"] == scene} for report in reports]
    engines = [next(iter(results.values()))["engine"] for results in found]
    names = [instruction_set(next(iter(results.values()))) for results in found]
    lines = [f"### {names[0]}: {reports[0]['processor']}, {engines[0].split(', ')[-1]}, {measured_on(reports[0])}", ""]
    rows = []
    for case in GOALS:
        rates = [results[case]["pings_per_second"] for results in found if case in results]
        if len(rates) == len(found):
            rows.append([case, found[0][case]["description"], f"{rates[0]:.0f}"]
                        + [f"{rate:.0f} ({rates[0] / rate:.2f})" for rate in rates[1:]])
    lines += table(["case", "what"] + names, rows)
    both = [case for case in ("P1", "P3d") if all(case in results for results in found)]
    stage_names = sorted({stage for results in found for case in both for stage, ms in results[case]["thread_ms"].items() if ms >= 0.005})
    lines += ["Stages, thread ms per ping:", ""]
    lines += table(["case", "instruction set"] + stage_names,
                   [[case, name] + [f"{results[case]['thread_ms'].get(stage, 0):.2f}" for stage in stage_names]
                    for case in both for name, results in zip(names, found)])
    return "\n".join(lines)


def with_sets(text, chapter, before):
    """Returns the tables `text` with this machine's `chapter` on instruction sets, and those of other machines in the page
    `before`."""
    anchor = "## Stages"
    if f"\n{anchor}\n" not in text:
        sys.exit(f'the page has no chapter "{anchor}" to put "{SETS}" before; make the whole page first')
    pattern = re.compile(rf"^{SETS}\n.*?(?=^## |\Z)", flags=re.M | re.S)
    found = pattern.search(before)
    others = other_machines(found.group(), chapter.split()[1].rstrip(":")) if found else []
    whole = "\n".join([SETS, "", SETS_INTRODUCTION, ""] + others + [chapter])
    return re.sub(rf"^(?={anchor})", lambda _: whole + "\n", pattern.sub("", text), count=1, flags=re.M)


def by_case_and_threads(report, scene):
    """Returns (case and threads, result) of the cases that are compared with the paper's figures."""
    for case in ("P1", "P2"):
        for threads, r in sorted(by_threads(report["results"], case, scene).items()):
            yield f"{case}, {threads} thread{'s' if threads > 1 else ''}", r


def rates_title(report):
    results = report["results"]
    load = f"; load average before the run {report['load_average']:.1f}" if "load_average" in report else ""
    parts = "" if any(r["switches"]["side_lobes"] for r in results) else "; side lobes off"
    return f"{instruction_set(results[0])}: {report['processor']}, {measured_on(report)}{load}{parts}"


def page(report, scene="local-search", other_rates=()):
    """Returns the page. `other_rates`: lines of `other_machines`."""
    results, other_rates = report["results"], list(other_rates)
    times = [f"{name}: {r['pings_per_second'] / PAPER[0][1]:.0f}" for name, r in by_case_and_threads(report, scene)]
    lines = ["# Benchmarks", "",
             "`tests/tools/benchmarks.sh` writes this page from results of `sonard_bench`. It also writes tables of stages, instruction sets, ratios "
             "of the hot loops and values of the curves, into the build folder.", "",
             "A ping is timed from the pose to the framed bytes. Times are medians of many pings with warm cells and default quality (noise, specular "
             "echoes, motion, and side lobes unless a heading says off). "
             f"The sonar moves at 0.9 m/s and up to 20 deg/s over rough sand of {results[0]['triangles'] if results else 0:,} triangles "
             f"(scene `{scene}`). Processor ms are those of all threads together. Other programs on the machine lengthen wall times, not "
             "ratios.", "",
             "## Rates", "",
             "Rates are pings/s. The goals are for two threads; [decision 0017](decisions/0017-cpu-engine-speed.MD) lists missed goals. The "
             "chapters below are about the last machine of this chapter, unless they name another.".replace(".MD", ".md"), ""]
    lines += other_rates + [f"### {rates_title(report)}", ""] + rates(report, scene)
    lines += ["## Beside the published times", "",
              "Choi 2025, Table 3 (512 beams, 10 m; NVIDIA RTX 2080 Ti, Intel i9-9900K): 0.9 s for the rays and 2.31 s for the sum, "
              "0.3 Hz with 300 rays per beam. Its public successor reports about 36 ms per frame. Our rates without a GPU, in multiples "
              f"of the paper's {PAPER[0][1]:g} Hz: " + ("; ".join(times) or "not measured") + ".", "", "![rates](benchmarks-rates.svg)", ""]
    lines += ["## As a service", "",
              "P0 times each demo (`sonard --profile NAME`) from a ping's pose to its last byte at a driver on loopback "
              "(`build/release/tests/own_network/in_own_network build/release/tests/bench/sonard_bench --scene local-search --case P0`; "
              "the tables have a row for every product), with two threads.", ""] + service(report)
    if report.get("curves"):
        lines += growth(report)
    return "\n".join(lines)


def tables(report, scene="local-search"):
    lines = ["# Benchmark tables", "",
             "Written by `tests/tools/benchmarks.sh`, as is docs/benchmarks.md, which names the machine.",
             "", "## Published and measured rates", ""]
    rows = [[name, f"{rate:.1f}", ""] for name, rate in PAPER]
    rows += [[f"{name}: {r['description']}", f"{r['pings_per_second']:.1f}", f"{r['pings_per_second'] / PAPER[0][1]:.0f} times the paper's"]
             for name, r in by_case_and_threads(report, scene)]
    lines += table(["", "pings/s", ""], rows)
    lines += ["## Stages", "", "Thread ms per ping, by the engine's own clock.", ""] + stages(report, scene)
    if report.get("demos"):
        lines += ["## Demos (P0)", "", "From a ping's pose to its last byte at a driver on loopback; processor time of the daemon per ping.", ""]
        lines += demos(report)
    if report.get("empty_bins"):
        lines += ["## Range bins without energy (P12)", "",
                  "On a level bed: 10 dB or more below the closed form, in expected power.", ""] + empty_bins(report)
    if report.get("threads"):
        lines += ["## Threads and sonars (P13)", ""] + cores(report)
    if report.get("ratios"):
        lines += ["## Ratios (P6)", "",
                  "The hot loops against plain implementations of the same: one process, one thread, alternating, best of several. They hold "
                  "on a busy machine, and a test requires them. \"differ by\": relative, in the least squares.", ""]
        lines += ratios(report)
    if report.get("curves"):
        lines += ["## How times grow", ""]
        for c in report["curves"]:
            lines += [f"- {c['name']} ({c['case']}): " + ", ".join(f"{p['x']:,.0f}: {cost(p):.2f} ms" for p in c["points"])]
        lines.append("")
    return "\n".join(lines)


def file_of(folder, name):
    return (folder / name).with_suffix(".md")


def old(file):
    return file.read_text(encoding="utf-8") if file.exists() else ""


def write(report, folder, tables_folder, sets=()):
    scene = "local-search"
    entries = [(name, rate, False) for name, rate in PAPER]
    for case in GOALS:
        found = by_threads(report["results"], case, scene)
        if found:
            r = found[max(found)]
            entries.append((f"{case}: {r['description']}", r["pings_per_second"], True))
    overview = file_of(folder, NAME)
    text = page(report, scene, other_machines(old(overview), instruction_set(report["results"][0])))
    peer = re.search(rf"^{PEER}\n.*?(?=^## |\Z)", old(overview), flags=re.M | re.S)  # from a separate run
    overview.write_text(with_chapter(text, peer.group().split("\n")) if peer else text, encoding="utf-8")
    text = tables(report, scene)
    if sets:
        text = with_sets(text, instruction_sets(sets, scene), old(file_of(tables_folder, NAME)))
    file_of(tables_folder, NAME).write_text(text, encoding="utf-8")
    (folder / "benchmarks-rates.svg").write_text(bars(entries), encoding="utf-8")
    if report.get("curves"):
        (folder / "benchmarks-curves.svg").write_text(lines_of(report["curves"]), encoding="utf-8")


def write_curves(report, folder):
    file = file_of(folder, NAME)
    file.write_text(with_chapter(old(file), growth(report)), encoding="utf-8")
    (folder / "benchmarks-curves.svg").write_text(lines_of(report["curves"]), encoding="utf-8")


def main():
    words = sys.argv[1:]
    curves_only = words[:1] == ["--curves"]
    sets_only = words[:1] == ["--instruction-sets"]
    if sets_only or curves_only:
        words = words[1:]
    folders = [Path(name) for name in words if not name.endswith(".json")]
    reports = [json.loads(Path(name).read_text(encoding="utf-8")) for name in words if name.endswith(".json")]
    if not reports or len(folders) != (1 if sets_only or curves_only else 2):
        sys.exit(__doc__.strip())
    if curves_only:
        write_curves(reports[0], folders[0])
    elif sets_only:
        file = file_of(folders[0], NAME)
        file.write_text(with_sets(old(file), instruction_sets(reports), old(file)), encoding="utf-8")
    else:
        write(reports[0], *folders, reports[1:])


if __name__ == "__main__":
    main()
