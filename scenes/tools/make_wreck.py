#!/usr/bin/env python3
"""Writes scenes/meshes/wreck.obj: a small broken fishing boat, our own geometry, lying on its keel in object axes.

Metres, z up, x towards the bow, origin amidships under the keel. Materials by name: steel (hull, wheelhouse), wood (deck, mast).
Run from anywhere: python3 scenes/tools/make_wreck.py
"""
import math
import pathlib

LENGTH, BEAM, DEPTH = 5.6, 1.9, 1.15
STATIONS, RIBS = 44, 12


def half_breadth(t, h):
    """Returns the half width at station t (-1 stern .. 1 bow) and height h (0 keel .. 1 gunwale)."""
    plan = (1 - max(t, 0) ** 2.2) if t > 0 else (1 - 0.25 * t * t)
    section = h ** (0.35 + 0.45 * max(t, 0))
    return 0.5 * BEAM * max(plan, 0.02) * section


def sheer(t):
    return DEPTH * (1 + 0.22 * t * t + 0.1 * max(t, 0))


class Obj:
    def __init__(self):
        self.vertices, self.lines, self.known = [], [], {}

    def vertex(self, p):
        key = tuple(round(c, 4) for c in p)
        if key not in self.known:
            self.vertices.append(key)
            self.known[key] = len(self.vertices)
        return self.known[key]

    def material(self, name):
        self.lines.append(f"usemtl {name}")

    def face(self, *points):
        ids = []
        for p in points:
            i = self.vertex(p)
            if i not in ids:
                ids.append(i)
        if len(ids) >= 3:
            self.lines.append("f " + " ".join(map(str, ids)))

    def box(self, low, high):
        (x0, y0, z0), (x1, y1, z1) = low, high
        p = lambda i: ((x1 if i & 1 else x0), (y1 if i & 2 else y0), (z1 if i & 4 else z0))
        for q in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)):
            self.face(*(p(i) for i in q))


def hull_point(i, j, side):
    t = -1 + 2 * i / STATIONS
    h = j / RIBS
    keel = 0.16 * max(t, 0) ** 3 * DEPTH
    return (0.5 * LENGTH * t, side * half_breadth(t, h), keel + (sheer(t) - keel) * h)


def torn(i, j, side):
    """Returns whether a face lies in the hole amidships on the port side, which has a ragged edge."""
    if side < 0:
        return False
    ragged = 1.3 * math.sin(2.1 * i) + 0.9 * math.sin(4.7 * j + i)
    return ((i - 17) / 5.5) ** 2 + ((j - 7) / 3.4) ** 2 < 1 + 0.12 * ragged


def main():
    obj = Obj()
    obj.material("steel")
    for side in (1, -1):
        for i in range(STATIONS):
            for j in range(RIBS):
                if torn(i, j, side):
                    continue
                quad = [hull_point(i, j, side), hull_point(i + 1, j, side), hull_point(i + 1, j + 1, side), hull_point(i, j + 1, side)]
                obj.face(*(quad[::-1] if side > 0 else quad))
    for j in range(RIBS):  # transom
        obj.face(hull_point(0, j, -1), hull_point(0, j, 1), hull_point(0, j + 1, 1), hull_point(0, j + 1, -1))
    obj.box((-1.9, -0.5, 0.95), (-0.8, 0.5, 1.75))  # wheelhouse
    obj.material("wood")
    for i in range(STATIONS):
        if 20 <= i <= 27:  # the hold is open
            continue
        a, b = hull_point(i, RIBS, 1), hull_point(i + 1, RIBS, 1)
        drop = 0.12
        obj.face((a[0], -a[1], a[2] - drop), (b[0], -b[1], b[2] - drop), (b[0], b[1], b[2] - drop), (a[0], a[1], a[2] - drop))
    # The mast lies across the bow, fallen to starboard.
    n, radius, start, end = 12, 0.06, (0.5, 0.3, 1.35), (2.0, -1.9, 0.25)
    axis = [e - s for s, e in zip(start, end)]
    norm = math.sqrt(sum(c * c for c in axis))
    u = (axis[1] / norm, -axis[0] / norm, 0.0)
    scale = math.hypot(u[0], u[1])
    u = (u[0] / scale, u[1] / scale, 0.0)
    d = [c / norm for c in axis]
    v = (d[1] * u[2] - d[2] * u[1], d[2] * u[0] - d[0] * u[2], d[0] * u[1] - d[1] * u[0])
    ring = lambda c, k: tuple(c[m] + radius * (math.cos(2 * math.pi * k / n) * u[m] + math.sin(2 * math.pi * k / n) * v[m]) for m in range(3))
    for k in range(n):
        obj.face(ring(start, k), ring(start, k + 1), ring(end, k + 1), ring(end, k))
        obj.face(start, ring(start, k + 1), ring(start, k))
        obj.face(end, ring(end, k), ring(end, k + 1))
    out = pathlib.Path(__file__).resolve().parent.parent / "meshes" / "wreck.obj"
    lines = ["# A small broken fishing boat; made by scenes/tools/make_wreck.py. Metres, z up."]
    lines += [f"v {x:g} {y:g} {z:g}" for x, y, z in obj.vertices] + obj.lines
    out.write_text("\n".join(lines) + "\n")
    print(f"{out.name}: {len(obj.vertices)} vertices, {sum(l.startswith('f') for l in obj.lines)} faces")


if __name__ == "__main__":
    main()
