#!/usr/bin/env python3
"""Writes the page of the CUDA engine's benchmarks from what `sonard_bench --engine cuda --json` found and from facts of the machine.

usage: write_gpu_benchmarks.py REPORT.json FACTS.json PAGE
FACTS: {"facts": {"driver": "...", ...}, "distances": "lines of the comparison with Embree's rays"}; tests/tools/gpu_check.sh
"""

import json
import pathlib
import sys

# case: (required, goal) [pings/s], as for the CPU; P10 is that of batches.
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
    """One ping at a time: what a live sonar gets."""
    by_device = [r for r in results if r["engine"].startswith("cuda")]
    yield "## One ping at a time"
    yield ""
    yield ("As a live sonar asks for them: a call, a ping, its bytes framed. Steps by the device's events, tiles and points by the "
           "processor's clock, in a run of their own; what is left of the median is copying, launching and waiting.")
    yield ""
    stages = ["cull", "build cells", "specular", "trace", "scatter", "synthesize", "noise", "couple", "receive", "frame"]
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
    yield ("Four batches to a call, two of them under way at a time, framed; required 1,000 pings/s, goal 5,000 (P10). The processor "
           "finds tiles and points of the next batch while the device is at work: the longer of the two sets the rate.")
    yield ""
    yield from table(["case", "pings a launch", "pings/s", "", "ms a ping: processor", "device"],
                     [[r["case"], r["batch"], f'{r["pings_per_second"]:.0f}', verdict(r["pings_per_second"], BATCH_FLOOR, BATCH_GOAL),
                       f'{r["processor_ms"]:.3f}', f'{r["device_ms"]:.3f}'] for r in device["rates"]])
    reference = device["reference"]
    yield ""
    if reference["on_this_device"]:
        yield (f'P11: {reference["ratio"]:.0f} times the public reference code on this device ({reference["ms"]:.1f} ms a frame): '
               f'{verdict(reference["ratio"], RATIO_FLOOR, RATIO_GOAL)} (required {RATIO_FLOOR}, goal {RATIO_GOAL}).')
    else:
        yield (f'P11 is not measured: the public reference code has not run on this device. Against its published {reference["ms"]:.0f} ms '
               f'a frame, on another device, P1 is {reference["ratio"]:.0f} times as fast. `GPU_CHECK_REFERENCE_MS=...` gives a measured one.')


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
        lines += ["", f'P9, {found["case"]}: {same} by 1, 2 and 4 threads and again.']
    if facts.get("distances"):
        lines += ["", 'Beside the CPU engine with Embree (docs/cuda.md, "Equality with the CPU"), eight pings of P1:', "", "```",
                  facts["distances"].strip(), "```"]
    return "\n".join(lines) + "\n"


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    report, facts = (json.loads(pathlib.Path(name).read_text(encoding="utf-8")) for name in sys.argv[1:3])
    pathlib.Path(sys.argv[3]).write_text(page(report, facts), encoding="utf-8")


if __name__ == "__main__":
    main()
