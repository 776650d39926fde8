"""Makes the one-page summary, docs/validation.md, from the tables of the validation chapters. Runs nothing."""

import math
import re

from texts import table, tables_of

# Groups of oracles. A test compares them with tests/oracles/oracle_table.py. "+" are the measurements beyond the numbered
# oracles.
GROUPS = [
    ("range, sound speed", range(1, 3)), ("levels and their slopes", range(3, 10)), ("specular echoes", range(10, 13)),
    ("widths, side lobes", range(14, 18)), ("fast against direct sums", range(18, 20)), ("ray and beam counts", range(21, 23)),
    ("speckle statistics", range(23, 27)), ("absorption, sound speed", range(27, 30)), ("noise", range(30, 32)),
    ("flat bed, shadow", range(32, 34)), ("speckle between pings", range(34, 38)), ("multipath", range(38, 40)),
    ("motion in the ping", range(40, 41)), ("samples, gain", range(41, 43)), ("record end, odd inputs", range(43, 45)),
    ("modes, conical beams", range(45, 47)), ("others", "+"),
]
NUMBER = re.compile(r"[+-]?(?:inf|nan|[\d.]+(?:e[+-]?\d+)?)")


def first_number(cell):
    """Returns the number at the beginning of a cell, or after `at least`, `below` or `±`."""
    return float(NUMBER.search(cell.replace(",", ""))[0])


def share_of_tolerance(expected, measured, tolerance):
    """Returns how much of its tolerance a measurement uses, from cells of the oracles' table: 0 is exact, above 1 is out."""
    limit, value = first_number(expected), first_number(measured)
    if math.isnan(value):
        return math.inf
    if tolerance:
        off = abs(value - limit)
        allowed = 0 if tolerance == "exact" else first_number(tolerance)
        return off / allowed if allowed else (math.inf if off else 0)
    if expected.startswith("at least"):  # for shares: compares the parts that are missing from the whole
        whole = 100 if "%" in expected else 1
        missing = whole - value
        return missing / (whole - limit) if whole > limit else (math.inf if missing > 0 else 0)
    return max(0, value / limit) if limit > 0 else limit / value  # "below"


def times_of(what):
    match = re.search(r"\(worst of (\d+)\)$", what)
    return int(match[1]) if match else 1


def oracle_rows(text):
    """Returns a row per group (its measurement closest to the tolerance), and how many measurements and rows out of tolerance."""
    (_, records), = tables_of(text)
    measured = [r for r in records if r[5] in ("yes", "NO")]
    rows = []
    for name, numbers in GROUPS:
        own = [r for r in measured if (r[0] == "+" if numbers == "+" else r[0] != "+" and int(r[0]) in numbers)]
        if not own:
            continue
        worst = max(own, key=lambda r: share_of_tolerance(r[2], r[3], r[4]))
        what = re.sub(r" \(worst of \d+\)$", "", worst[1].partition(": ")[2] or worst[1])
        limits = numbers if numbers == "+" else "-".join(str(n) for n in sorted({numbers[0], numbers[-1]}))
        rows.append([limits, name, what, worst[3], " ".join(c for c in (worst[2], worst[4]) if c)])
    return rows, sum(times_of(r[1]) for r in measured), sum(r[5] == "NO" for r in measured)


def largest(values):
    return max(values, key=abs)


def tank(text):
    totals, differences = [rows for head, rows in tables_of(text) if "measured" in head or "validation" in head]
    off = largest([first_number(r[1]) - first_number(r[2]) for r in totals])
    turned = largest([first_number(r[2]) - first_number(r[3]) for r in differences])
    yield ["tank: total echo of the rod", "independent integration, array without taper", f"{off:+.2f} dB", "0.15 dB without taper"]
    yield ["tank: 1.2 MHz minus 2.1 MHz", "the same integration", f"{turned:+.2f} dB", "none"]


def two_cylinders(text):
    head, rows = tables_of(text)[0]
    off = largest([first_number(rows[-1][i]) - float(re.search(r"at ([\d.]+) m", head[i])[1]) for i in (1, 2)])
    yield ["two cylinders: range of the peaks", "nearest points", f"{off:+.3f} m", "none"]
    yield from alike(text)


def alike(text):
    row = next(r for r in tables_of(text)[1][1] if "228 rows" in r[0])
    yield ["the same: raster beside ray", "claim of equal quality",
           f"{row[2]} within 3 dB: {'not equal' if 'does not hold' in text else 'equal'}", "none"]


def pitched_sonar(text):
    (_, rows), = tables_of(text)
    raster, ray = rows[0], next(r for r in rows if r[0].startswith("ray, 228"))
    yield ["pitched sonar: dark floor, raster, ray", f"rows alone: {raster[2]}, {ray[2]}", f"{raster[1]}, {ray[1]}; plate near: {raster[3]}, {ray[3]}",
           "none"]


def local_search(text):
    (_, rows), = tables_of(text)
    for name in ("default", "300 fixed rays, our pulse, beams and law"):
        row = next(r for r in rows if r[0] == name)
        yield [f"level sand, {name.split(',')[0]}", row[1], f"{row[4]}; {row[3]} of the bins within 1 dB", "none"]


def differences(text):
    rows = tables_of(text)[0][1]
    off = largest([first_number(r[1]) - first_number(r[2]) for r in rows])
    yield ["paper mode: level against grazing angle", "the printed law's extra cosine", f"{off:+.2f} dB", "none"]


def coverage(text):
    (_, rows), = tables_of(text)
    worst = max(rows, key=lambda r: abs(first_number(r[6])))
    whole = sum(first_number(r[5]) == 100 for r in rows)
    yield [f"flat bed, {len(rows)} modes of all sonars, {whole} with all bins within 1 dB", "closed form",
           f"{worst[6]} ({worst[0]})", "1 dB"]


def capture(text):
    (_, rows), = tables_of(text)
    worst = max(rows, key=lambda r: abs(first_number(r[3])))
    within = re.search(r"^(\d+ of \d+) within (\d+ %)\.$", text, re.M)
    yield [f"recorded pings of an M1200d: {within[1]} statistics within", "`like-the-capture.yaml`",
           f"{worst[3]} ({worst[0]}: {worst[4] or 'within'})", f"{within[2]}, or explained"]


def tell_apart(text):
    (_, judged), (_, features), (_, near_features) = tables_of(text)
    by_sector = next(r for r in judged if r[0] == "unseen sector, texture")
    control = next(r for r in judged if r[0].startswith("control"))
    yield ["the same: patches that a classifier tells apart", f"guessing; ours against ours {control[1]} %",
           f"{by_sector[1]} % ({by_sector[2]}; most by: {features[0][0]})", "aim: at most 55 %"]
    near = re.search(r"^- unseen sector, texture: .*?32 to 159 ([\d.]+) %", text, re.M)
    yield ["the same, near floor only", "guessing", f"{near[1]} % (most by: {near_features[0][0]})", "aim: at most 65 %"]
    another = next(r for r in judged if r[0] == "another bed, unseen sector, texture")
    yield ["the same with another bed and the product's pulse", "guessing", f"{another[1]} % ({another[2]})",
           "aim: at most 60 %"]


CASES = {"tank": tank, "pitched-sonar": pitched_sonar, "two-cylinders": two_cylinders, "local-search": local_search, "differences": differences, "coverage": coverage,
         "capture": capture, "tell-apart": tell_apart}
CHAPTERS = [*CASES, "oracles", "cost"]  # all chapters of the page
PICTURE_FILE = "capture.png"


def cost(text):
    (_, rows), = tables_of(text)
    rates = {r[0]: r[5] for r in rows}
    machine = " ".join(re.search(r"Ours, no GPU: (.*?)\.\sBy `", text, re.S)[1].split())
    return (f"P900, 10 m, 512 beams: {rates['default: surface cells']} by default, {rates['paper mode, 300 rays']} in paper mode with 300 "
            f"rays; published: {rates['P25, ray, 300 rays']}.\nOurs, no GPU: {machine}.")


def page_of(chapters):
    """Returns the page, from the chapters that exist."""
    text = TITLE
    rows = [row for name, of in CASES.items() if name in chapters for row in of(chapters[name])]
    if rows:
        text += CASES_TITLE + table(["what", "compared with", "result, or largest deviation", "tolerance"], rows)
        text += PICTURE if "capture" in chapters else ""
    if "oracles" in chapters:
        rows, count, missed = oracle_rows(chapters["oracles"])
        verdict = f"**Out of tolerance: {missed} rows.**" if missed else "All are within tolerance."
        text += ORACLES_TITLE.format(count=count, verdict=verdict)
        text += table(["oracles", "group", "closest to its tolerance", "measured", "expected"], rows)
    if "cost" in chapters:
        text += COST_TITLE + cost(chapters["cost"]) + "\n"
    return text


TITLE = """# Validation

Generated by `tests/validation/validate.sh` (15 minutes on two cores; `--summary` rewrites this page alone). All values are measured
on the program. Method, values and pictures are in its tables in `build/validation`; the model's equations in
[acoustics](acoustics.MD), times in [benchmarks](benchmarks.MD). "The paper" is Choi 2025 (*Sensors* 25(5):1516). It publishes
times and pictures, but no other values.
""".replace(".MD", ".md")  # links are from docs/, where the page is
CASES_TITLE = """
## Experiments

"""
PICTURE = """
![A recorded ping and ours](validation/capture.png)
"""
ORACLES_TITLE = """
## Oracles

Closed forms in the tests (`./test.sh`): {count} measurements. {verdict} The nearest to its tolerance in each group:

"""
COST_TITLE = """
## Cost of a ping

"""
