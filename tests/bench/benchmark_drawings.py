"""Draws the two pictures of docs/benchmarks.md: rates, and how times grow, with the exponents of the growth."""

import math


def text(x, y, words, size=12, anchor="start"):
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" font-family="sans-serif">{words}</text>'


def bars(entries):
    """Draws rates on a logarithmic axis from 0.1 to 1000 pings a second."""
    left, width, row = 300, 420, 26
    x = lambda rate: left + width * (math.log10(max(rate, 0.1)) + 1) / 4
    height = row * len(entries) + 50
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + width + 90}" height="{height}">',
           f'<rect width="{left + width + 90}" height="{height}" fill="white"/>']
    for power in range(-1, 4):
        at = x(10.0 ** power)
        out += [f'<line x1="{at:.1f}" y1="12" x2="{at:.1f}" y2="{height - 30}" stroke="#ccc"/>',
                text(at, height - 14, f"{10.0 ** power:g}", anchor="middle")]
    out.append(text(left + width / 2, height - 1, "pings a second", 11, "middle"))
    for i, (name, rate, ours) in enumerate(entries):
        top = 16 + i * row
        out += [f'<rect x="{left}" y="{top}" width="{x(rate) - left:.1f}" height="16" fill="{"#2a6f97" if ours else "#999"}"/>',
                text(left - 8, top + 13, name, anchor="end"), text(x(rate) + 6, top + 13, f"{rate:.3g}")]
    return "\n".join(out + ["</svg>", ""])


def cost(point):
    """Returns the milliseconds of a ping: the least processor time if the report has it."""
    return point.get("least_processor_ms", point["median_ms"])


def slope(points):
    """Returns the exponent of the cost over x by least squares in logarithms, and the remaining squares."""
    xs, ys = [math.log(p["x"]) for p in points], [math.log(cost(p)) for p in points]
    x, y = sum(xs) / len(xs), sum(ys) / len(ys)
    exponent = sum((a - x) * (b - y) for a, b in zip(xs, ys)) / sum((a - x) ** 2 for a in xs)
    return exponent, sum((b - y - exponent * (a - x)) ** 2 for a, b in zip(xs, ys))


def exponents(points):
    """Returns (before, index of the knee, after): exponents of the two straight lines through a common point that fit best.
    Returns (all, None, all) if they differ by less than 0.2, or with fewer than three points."""
    splits = [(slope(points[:i + 1]), i, slope(points[i:])) for i in range(1, len(points) - 1)]
    if splits:
        before, knee, after = min(splits, key=lambda split: split[0][1] + split[2][1])
        if abs(after[0] - before[0]) >= 0.2:
            return before[0], knee, after[0]
    every = slope(points)[0]
    return every, None, every


def in_words(exponents_found, points):
    before, knee, after = exponents_found
    return f"{before:.2f}" if knee is None else f"{before:.2f}, from {points[knee]['x']:,.0f} on {after:.2f}"


def lines_of(curves):
    """Draws pings/s over each quantity, both axes logarithmic, three pictures in a row."""
    wide, high, columns = 330, 250, 3
    rows = (len(curves) + columns - 1) // columns
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide * columns}" height="{high * rows}">',
           f'<rect width="{wide * columns}" height="{high * rows}" fill="white"/>']
    for i, curve in enumerate(curves):
        left, top, w, h = i % columns * wide + 50, i // columns * high + 42, wide - 75, high - 92
        points = curve["points"]
        xs, ys = [math.log10(p["x"]) for p in points], [math.log10(1e3 / cost(p)) for p in points]
        y0, y1 = math.floor(min(ys)), max(math.ceil(max(ys)), math.floor(min(ys)) + 1)
        x0, x1 = min(xs), max(max(xs), min(xs) + 0.1)
        place = lambda x, y: (left + w * (x - x0) / (x1 - x0), top + h * (1 - (y - y0) / (y1 - y0)))
        found = exponents(points) if len(points) > 1 else None
        out += [f'<rect x="{left}" y="{top}" width="{w}" height="{h}" fill="none" stroke="#999"/>',
                text(left, top - 24, f"{curve['name']} ({curve['case']})", 11)]
        if found:
            out.append(text(left, top - 9, f"exponent of the cost: {in_words(found, points)}", 10))
            if found[1] is not None:
                at = place(xs[found[1]], y0)[0]
                out.append(f'<line x1="{at:.1f}" y1="{top}" x2="{at:.1f}" y2="{top + h}" stroke="#c44" stroke-dasharray="4 3"/>')
        for power in range(y0, y1 + 1):
            out.append(text(left - 6, place(x0, power)[1] + 4, f"{10.0 ** power:g}", 10, "end"))
        path = " ".join(f"{a:.1f},{b:.1f}" for a, b in (place(x, y) for x, y in zip(xs, ys)))
        out.append(f'<polyline points="{path}" fill="none" stroke="#2a6f97" stroke-width="2"/>')
        for point, x, y in zip(points, xs, ys):
            a, b = place(x, y)
            name = f"{point['x']:g}" if point["x"] < 1e4 else f"{point['x']:.1g}".replace("e+0", "e")
            out += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="#2a6f97"/>', text(a, top + h + 14, name, 9, "middle"),
                    text(a, b - 6, f"{10 ** y:.3g}", 9, "middle")]
        out.append(text(left + w / 2, top + h + 30, "pings/s of one thread", 10, "middle"))
    return "\n".join(out + ["</svg>", ""])
