"""Measures the cost of each part of the model: the part alone is switched on and off, in the format for 20 pings/s."""

import os

from texts import table

SCENES = ["local-search", "demo"]
CASE, LOW = "P3b", "P3d"
PARTS = ["specular", "texture", "volume", "multipath", "crosstalk", "leak"]
OPT_IN = {"multipath"}  # off by default
GIVEN = {"texture", "volume", "crosstalk", "leak"}  # sonard_bench --give: used if the scene or the sonar has no data for the part
PINGS = 40


def thread_ms(result):
    return sum(result["thread_ms"].values())


def run_of(sonard, case, scene, *arguments):
    return sonard.bench("--case", case, "--scene", scene, "--pings", PINGS, *arguments)


def rate(result):
    return f"{result['pings_per_second']:.1f}"


def rows_of(scene, plain, pairs):
    """Returns the rows of the table. `pairs`: part -> (result without it, result with it); `plain`: the default's result."""
    rows = [[scene, "default", "", rate(plain), "", f"{thread_ms(plain):.1f}"]]
    for part, (off, on) in pairs.items():
        if part in OPT_IN:
            usual = "off"
        else:
            usual = "on" if part not in GIVEN or part in plain["parts_had"] else "on, but no data for it"
        rows.append([scene, part, usual, rate(on), rate(off), f"{thread_ms(on) - thread_ms(off):+.1f}"])
    return rows


HEADER = ["scene", "part", "by default", "pings/s with it", "without it", "thread ms per ping; for a part: more than without it"]


def chapter(sonard, folder):
    rows, lows = [], []
    for scene in SCENES:
        bench = run_of(sonard, CASE, scene)
        pairs = {}
        for part in PARTS:
            give = ["--give", part] if part in GIVEN else []
            pairs[part] = tuple(run_of(sonard, CASE, scene, *give, f"--{part}", state)["results"][0] for state in ("off", "on"))
        rows += rows_of(scene, bench["results"][0], pairs)
        low = run_of(sonard, LOW, scene)["results"][0]
        lows.append([scene, rate(low), f"{low['median_ms']:.1f}", f"{thread_ms(low):.1f}"])
    result = bench["results"][0]
    text = INTRODUCTION.format(machine=f"{bench['processor']}; {result['engine']}", case=CASE, pings=PINGS, load=os.getloadavg()[0])
    return (text + table(HEADER, rows) + f"\nThe low mode at 30 m with as many samples (`--case {LOW}`), default:\n\n" +
            table(["scene", "pings/s", "ms, median", "thread ms"], lows))


INTRODUCTION = """## Cost of the parts

M1200d, high mode, 10 m, 512 beams x 720 rows, from pose to framed bytes, with a moving sonar; {machine}. `sonard_bench --case
{case} --scene SCENE --pings {pings}` ran with `--PART on` and `off` separately; rates are those of the median ping. A part that
scene and sonar lack is added for its row (`--give PART`). Load average of the machine in the last minute: {load:.1f}. A load
above the number of processors lengthens these times. Differences of a few thread ms are chance.

"""
