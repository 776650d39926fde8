"""Measures the time per ping, beside Table 3 of Choi 2025."""

import os

from texts import table

# P25, Table 3: RTX 2080 Ti and i9-9900K, P900, 10 m. Ray signal, summation, correction, FFT in seconds; rate in Hz.
PUBLISHED = [("P25, raster, 11 rays", 0.004, 0.04, 0.01, 0.004, 2), ("P25, ray, 300 rays", 0.9, 2.31, 0.01, 0.01, 0.3)]
RUNS = [
    ("raster mode, 11 rows", ["--mode", "raster"]),
    ("paper mode, 300 rays", ["--mode", "paper"]),
    ("paper mode, 300 rays, summed term by term", ["--mode", "paper", "--frequency-sum", "direct"]),
    ("300 fixed rays, our pulse and beams", ["--fixed-fan", "300"]),
    ("default: surface cells", []),
]
STAGES = [("cull", "build cells", "trace", "scatter"), ("synthesize", "noise"), ("form beams",), ("receive",)]
PINGS = 30


def chapter(sonard, folder):
    rows = [[name, *(f"{s:g} s" for s in seconds), f"{hz:g} Hz"] for name, *seconds, hz in PUBLISHED]
    for name, arguments in RUNS:
        bench = sonard.bench("--case", "P1", "--scene", "local-search", "--pings", PINGS, *arguments)
        result = bench["results"][0]
        spent = result["thread_ms"]
        cells = [f"{sum(spent[stage] for stage in group) / 1e3 / result['threads']:.4f} s" for group in STAGES]
        rows.append([name, *cells, f"{result['pings_per_second']:.1f} Hz"])
    machine = f"{bench['processor']}; {result['engine']}"
    text = table(["", "rays and echoes", "sum over frequencies or pulses", "beams", "transform, samples", "rate"], rows)
    return INTRODUCTION.format(machine=machine, pings=PINGS, triangles=result["triangles"], load=os.getloadavg()[0]) + text


INTRODUCTION = """## Cost of a ping

Beside Table 3 of the paper (P900, 10 m, 512 beams; NVIDIA RTX 2080 Ti and Intel i9-9900K). Ours, no GPU: {machine}. By `sonard_bench
--case P1 --scene local-search --pings {pings}`: median rate over rough sand of {triangles} triangles, with a moving sonar. Stages
are thread time divided by threads. Load average of the machine in the last minute: {load:.1f}. A load above the number of
processors lengthens these times. The paper's columns are ray signal, summation, correction and FFT. Our default has other stages;
they are in the columns of the same work.

"""
