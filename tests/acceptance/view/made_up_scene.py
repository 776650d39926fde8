"""A small harbour as GLB files: similar to scenes/demo.yaml, for the pictures of the page's tests."""
import json
import math
import struct


def glb(vertices, normals, triangles, colour):
    """Returns one mesh as GLB; glTF is y-up, so (x, y, z) becomes (x, z, -y)."""
    def packed(rows):
        return b"".join(struct.pack("<3f", x, z, -y) for x, y, z in rows)
    positions, directions = packed(vertices), packed(normals)
    indices = b"".join(struct.pack("<3I", *t) for t in triangles)
    turned = [(x, z, -y) for x, y, z in vertices]
    blob = positions + directions + indices
    offsets = [0, len(positions), len(positions) + len(directions)]
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1]}}],
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": [{"buffer": 0, "byteOffset": o, "byteLength": n}
                        for o, n in zip(offsets, (len(positions), len(directions), len(indices)))],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3",
                       "min": [min(v[i] for v in turned) for i in range(3)], "max": [max(v[i] for v in turned) for i in range(3)]},
                      {"bufferView": 1, "componentType": 5126, "count": len(normals), "type": "VEC3"},
                      {"bufferView": 2, "componentType": 5125, "count": 3 * len(triangles), "type": "SCALAR"}]}
    words = json.dumps(document).encode()
    words += b" " * (-len(words) % 4)
    chunks = struct.pack("<I4s", len(words), b"JSON") + words + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def grid(u_count, v_count, place, colour):
    """Returns the mesh of a surface place(u, v), u and v from 0 to 1, with normals from differences."""
    vertices, normals, triangles = [], [], []
    for i in range(u_count + 1):
        for j in range(v_count + 1):
            u, v, e = i / u_count, j / v_count, 1e-4
            p, a, b = place(u, v), place(u + e, v), place(u, v + e)
            s, t = [a[k] - p[k] for k in range(3)], [b[k] - p[k] for k in range(3)]
            n = (s[1] * t[2] - s[2] * t[1], s[2] * t[0] - s[0] * t[2], s[0] * t[1] - s[1] * t[0])
            size = math.hypot(*n) or 1
            vertices.append(p)
            normals.append(tuple(c / size for c in n))
    for i in range(u_count):
        for j in range(v_count):
            k = i * (v_count + 1) + j
            triangles += [(k, k + v_count + 1, k + 1), (k + 1, k + v_count + 1, k + v_count + 2)]
    return glb(vertices, normals, triangles, colour)


def box(size, colour):
    vertices, normals, triangles = [], [], []
    for axis in range(3):
        for sign in (-1, 1):
            k, (b, c) = len(vertices), ((axis + 1) % 3, (axis + 2) % 3)
            for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = [0.0] * 3
                p[axis], p[b], p[c] = sign * size[axis] / 2, s * size[b] / 2, t * size[c] / 2
                vertices.append(tuple(p))
                normals.append(tuple(float(sign) if i == axis else 0.0 for i in range(3)))
            triangles += [(k, k + 1, k + 2), (k, k + 2, k + 3)] if sign > 0 else [(k, k + 2, k + 1), (k, k + 3, k + 2)]
    return glb(vertices, normals, triangles, colour)


def cylinder(radius, length, colour):
    tau = 2 * math.pi
    return grid(24, 1, lambda u, v: (radius * math.cos(tau * u), radius * math.sin(tau * u), (v - 0.5) * length), colour)


def rock(size, colour):
    def place(u, v):
        a, h = 2 * math.pi * u, math.pi * (v - 0.5)
        r = 1 + 0.1 * math.sin(3 * a) * math.cos(h) + 0.08 * math.cos(5 * h + a)
        return tuple(s / 2 * r * d for s, d in zip(size, (math.cos(a) * math.cos(h), math.sin(a) * math.cos(h), math.sin(h))))
    return grid(16, 10, place, colour)


def torus(radius, tube, colour):
    def place(u, v):
        a, b = 2 * math.pi * u, 2 * math.pi * v
        r = radius + tube * math.cos(b)
        return r * math.cos(a), r * math.sin(a), tube * math.sin(b)
    return grid(28, 12, place, colour)


def bed(colour):
    def place(u, v):
        x, y = 40 * (u - 0.5), 40 * (v - 0.5)
        relief = 0.12 * math.sin(0.9 * x) * math.cos(0.7 * y + 0.3 * x)
        return x, y, relief + 0.035 * math.sin(10.5 * (x + 0.2 * y) + math.sin(0.8 * y))
    return grid(160, 60, place, colour)


def quaternion(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0):
    """Returns the quaternion of intrinsic Z-Y-X angles, as a dictionary."""
    r, p, y = (math.radians(a) / 2 for a in (roll_deg, pitch_deg, yaw_deg))
    cr, sr, cp, sp, cy, sy = math.cos(r), math.sin(r), math.cos(p), math.sin(p), math.cos(y), math.sin(y)
    return {"w": cr * cp * cy + sr * sp * sy, "x": sr * cp * cy - cr * sp * sy,
            "y": cr * sp * cy + sr * cp * sy, "z": cr * cp * sy - sr * sp * cy}


SAND, STONE, RUST, STEEL, WOOD, ROCK, RUBBER = ((0.62, 0.57, 0.47), (0.55, 0.58, 0.62), (0.58, 0.33, 0.22), (0.52, 0.62, 0.74), (0.47, 0.36, 0.24),
                                                (0.5, 0.5, 0.52), (0.16, 0.17, 0.18))
PARTS = [  # name, material, GLB, place, roll pitch yaw
    ("bed", "sand", bed(SAND), (0, 0, -5), (0, 0, 0)),
    ("pipe", "steel", cylinder(0.22, 11, RUST), (0.4, -0.2, -4.86), (0, 90, 28)),
    ("wall", "concrete", box((3.6, 0.5, 1.3), STONE), (-0.8, 3.0, -4.45), (0, 0, 12)),
    ("quay", "concrete", box((40, 1.2, 5.2), STONE), (0, 13.5, -2.6), (0, 0, 0)),
    ("drum", "steel", cylinder(0.3, 1.1, STEEL), (2.6, -2.4, -4.5), (0, 0, 0)),
    ("fallen drum", "steel", cylinder(0.3, 0.9, STEEL), (3.4, 1.4, -4.75), (0, 90, 70)),
    ("wreck", "wood", box((3.4, 1.2, 0.7), WOOD), (-2.7, -2.7, -4.85), (14, 2, 35)),
    ("tyre", "rubber", torus(0.32, 0.11, RUBBER), (1.0, 1.8, -4.9), (8, 5, 0)),
    ("buoy", "plastic", rock((0.5, 0.5, 0.5), (0.86, 0.45, 0.1)), (-1.2, 5.4, -3.7), (0, 0, 0)),
    *[(f"pile {i}", "wood", cylinder(0.18, 4.2, WOOD), (x, 11.2, -3), (0, 0, 0)) for i, x in enumerate((-6, -2, 2, 6), 1)],
    *[(f"boulder {i}", "rock", rock(size, ROCK), place, (0, 20 * i, 70 * i)) for i, (size, place) in enumerate((
        ((0.9, 0.7, 0.6), (1.2, 4.6, -4.85)), ((0.9, 0.7, 0.6), (-4.6, 1.1, -4.8)), ((0.9, 0.7, 0.6), (4.9, -0.6, -4.85)),
        ((0.9, 0.7, 0.6), (0.6, -5.2, -4.8)), ((1.7, 1.4, 1.3), (-9.8, 5.6, -4.7)), ((1.7, 1.4, 1.3), (10.6, -3.8, -4.7))), 1)],
]


def entities():
    for name, material, data, (x, y, z), rpy in PARTS:
        yield {"id": name, "frame_id": "world", "metadata": [{"key": "material", "value": material}],
               "models": [{"pose": {"position": {"x": x, "y": y, "z": z}, "orientation": quaternion(*rpy)},
                           "scale": {"x": 1, "y": 1, "z": 1}, "media_type": "model/gltf-binary", "data": data}]}
