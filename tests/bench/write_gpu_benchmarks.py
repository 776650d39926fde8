#!/usr/bin/env python3
"""Writes the page of the CUDA engine's benchmarks from the folder that `tests/tools/gpu_check.sh run` wrote.

usage: write_gpu_benchmarks.py FOUND PAGE
FOUND has batches.json and single.json (sonard_bench --json) and, if those parts ran, facts.txt, digests.txt, ceiling.txt,
memcheck.txt, initcheck.txt and the tests' *_test.txt.
"""

import json
import pathlib
import re
import sys

# case: (required, goal) [pings/s]. The values of BATCH apply to P10, those of RATIO to P11.
FLOORS = {"P1": (75, 250), "P3a": (40, 200), "P3b": (40, 160), "P3c": (40, 170), "P3d": (40, 100)}
BATCH_FLOOR, BATCH_GOAL = 1000, 5000
RATIO_FLOOR, RATIO_GOAL = 100, 1000


def verdict(value, floor, goal):
    return "goal" if value >= goal else "holds" if value >= floor else "**missed**"


def table(titles, rows):
    yield "| " + " | ".join(titles) + " |"
    yield "|" + "---|" * len(titles)
    for row in rows:
        yield "| " + " | ".join(str(cell) for cell in row) + " |"


def alone(results):
    """Returns the rates of one ping at a time, as for a live sonar."""
    by_device = [r for r in results if r["engine"].startswith("cuda")]
    yield "## One ping at a time"
    yield ""
    yield ("As for a live sonar: each call makes one ping, and its bytes are framed. A separate run times the steps with the "
           "device's events, and tiles and points with the processor's clock. The rest of the median is copying, launching and "
           "waiting.")
    yield ""
    stages = ["cull", "build cells", "specular", "trace", "scatter", "synthesize", "noise", "form beams", "receive", "frame"]
    rows = []
    for r in by_device:
        floor, goal = FLOORS.get(r["case"], (0, 0))
        rows.append([r["case"], r["description"], r["scene"], f'{r["pings_per_second"]:.0f}', f'{r["median_ms"]:.3f}',
                     f'{r["p90_ms"]:.3f}', f'{r["cold_ms"]:.1f}', floor, goal, verdict(r["pings_per_second"], floor, goal)]
                    + [f'{r["thread_ms"][s]:.3f}' for s in stages])
    yield from table(["case", "what", "scene", "pings/s", "median ms", "p90", "cold", "required", "goal", ""] + stages, rows)
    by_cpu = sorted({r["case"] for r in results if not r["engine"].startswith("cuda")})
    if by_cpu:
        yield ""
        yield f'{", ".join(by_cpu)}: not for the device; the CPU computed them (docs/cuda.md).'


def batches(device):
    yield "## In batches"
    yield ""
    yield ("While the engine computes a batch, the pings of the previous one are framed. Required are 1,000 pings/s, the goal is "
           "5,000 (P10). Rates are medians of up to five rounds, after a second of warming up. The last columns are means per "
           "ping: wall time; tiles and points, summed over the threads that find them; and the device's steps, timed with its "
           "events in a separate run. Only wall time includes copies, launches, results and framing.")
    yield ""
    yield from table(["case", "threads", "pings per launch", "pings/s", "", "ms per ping: wall", "tiles and points", "device"],
                     [[r["case"], r["threads"], r["batch"], f'{r["pings_per_second"]:.0f}',
                       verdict(r["pings_per_second"], BATCH_FLOOR, BATCH_GOAL), f'{1e3 / r["pings_per_second"]:.3f}',
                       f'{r["processor_ms"]:.3f}', f'{r["device_ms"]:.3f}'] for r in device["rates"]])
    reference = device["reference"]
    yield ""
    if reference["on_this_device"]:
        yield (f'P11: {reference["ratio"]:.0f} times the public reference code on this device ({reference["ms"]:.1f} ms per frame): '
               f'{verdict(reference["ratio"], RATIO_FLOOR, RATIO_GOAL)} (required {RATIO_FLOOR}, goal {RATIO_GOAL}).')
    else:
        yield (f'P11 is not measured: the public reference code has not run on this device. Against its published {reference["ms"]:.0f} ms '
               f'per frame, on another device, P1 is {reference["ratio"]:.0f} times as fast. `GPU_CHECK_REFERENCE_MS` sets a '
               'measured time.')


def page(report, facts):
    lines = ["# The CUDA engine, measured", "", "Written by `tests/tools/gpu_check.sh`; what it checks: docs/cuda.md.", ""]
    all_facts = {"device": report["device"]["name"], **facts["facts"], "processor": report["processor"]}
    lines += table(["", ""], all_facts.items())
    lines += ["", *alone(report["results"]), "", *batches(report["device"])]
    if "latency" in report:
        t = report["latency"]["latency"]
        lines += ["", "## From trigger to last byte", "",
                  f'P5, a daemon on loopback: median {t["median_ms"]:.2f} ms, p99 {t["p99_ms"]:.2f} ms (required 25, goal 10).']
    for found in report.get("hashes", []):
        same = "the same bytes" if found["same"] else "**different bytes**"
        lines += ["", f'P9, {found["case"]}: {same} with 1, 2, 4 and again 1 threads.']
    if facts.get("distances"):
        lines += ["", 'Differences from the CPU engine with Embree (docs/cuda.md, "Equality with the CPU") in eight pings of P1:',
                  "", "```", facts["distances"].strip(), "```"]
    if facts.get("ceiling"):
        lines += ["", "Rates that the processor allows if the device needs no time (host module without steps):", "", "```",
                  facts["ceiling"].strip(), "```"]
    return "\n".join(lines) + "\n"


def last_word(path, pattern, otherwise):
    """Returns the last message of a tool or a test program."""
    found = re.findall(pattern, path.read_text(encoding="utf-8", errors="replace")) if path.exists() else []
    return found[-1].strip() if found else otherwise


def load(folder):
    """Returns the reports of both runs as one, and the facts."""
    report = json.loads((folder / "single.json").read_text(encoding="utf-8"))
    report["device"] = json.loads((folder / "batches.json").read_text(encoding="utf-8"))["device"]
    facts = {}
    if (folder / "facts.txt").exists():
        facts = dict(line.split("=", 1) for line in (folder / "facts.txt").read_text(encoding="utf-8").splitlines() if "=" in line)
    for test in sorted(folder.glob("cuda_*_test.txt")):
        facts[test.stem] = last_word(test, r"\[  (?:PASSED|FAILED)  \] .*|\[  FAILED  \] .*", "did not end")
    if (folder / "digests.txt").exists():
        facts["digests"] = (folder / "digests.txt").read_text(encoding="utf-8").strip()
    for tool in ("memcheck", "initcheck"):
        facts["compute-sanitizer " + tool] = last_word(folder / f"{tool}.txt", r"ERROR SUMMARY: .*", "not run")
    embree = folder / "cuda_device_embree_rays_test.txt"
    distances = re.findall(r"^\d+: relative L2.*", embree.read_text(encoding="utf-8"), re.MULTILINE) if embree.exists() else []
    ceiling = folder / "ceiling.txt"
    lines = re.findall(r"^P10 .*", ceiling.read_text(encoding="utf-8"), re.MULTILINE) if ceiling.exists() else []
    return report, {"facts": facts, "distances": "\n".join(distances), "ceiling": "\n".join(lines)}


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    pathlib.Path(sys.argv[2]).write_text(page(*load(pathlib.Path(sys.argv[1]))), encoding="utf-8")


if __name__ == "__main__":
    main()
