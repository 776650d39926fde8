"""Reads PNG pictures as rows of RGB bytes, and measures the difference of two pictures. Standard library only."""
import struct
import zlib


def read_png(data):
    """Returns (width, height, RGB bytes) of a PNG with 8 bits per channel and no interlace."""
    at, body, head = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        content = data[at + 8:at + 8 + size]
        at += 12 + size
        if kind == b"IHDR":
            head = struct.unpack(">IIBBBBB", content)
        elif kind == b"IDAT":
            body += content
    width, height, depth, colour, _, _, interlace = head
    assert depth == 8 and colour in (2, 6) and not interlace, head
    channels = 3 if colour == 2 else 4
    raw, stride = zlib.decompress(body), width * channels
    before, out = bytearray(stride), bytearray()
    for y in range(height):
        line = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        unfilter(raw[y * (stride + 1)], line, before, channels)
        before = line
        out += line if channels == 3 else bytes(b for i, b in enumerate(line) if i % 4 < 3)
    return width, height, bytes(out)


def unfilter(kind, line, above, step):
    if kind == 1:
        for i in range(step, len(line)):
            line[i] = (line[i] + line[i - step]) & 255
    elif kind == 2:
        for i, up in enumerate(above):
            line[i] = (line[i] + up) & 255
    elif kind == 3:
        for i, up in enumerate(above):
            left = line[i - step] if i >= step else 0
            line[i] = (line[i] + (left + up) // 2) & 255
    elif kind == 4:
        for i, up in enumerate(above):
            left = line[i - step] if i >= step else 0
            corner = above[i - step] if i >= step else 0
            a, b, c = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
            line[i] = (line[i] + (left if a <= b and a <= c else up if b <= c else corner)) & 255


def mirrored(width, height, rgb):
    rows = (rgb[3 * width * y:3 * width * (y + 1)] for y in range(height))
    return b"".join(bytes(v for x in range(width - 1, -1, -1) for v in row[3 * x:3 * x + 3]) for row in rows)


def difference(a, b):
    """Returns (mean, 99th percentile, share above 8) of the absolute differences of all channels."""
    assert len(a) == len(b), (len(a), len(b))
    histogram = [0] * 256
    for x, y in zip(a, b):
        histogram[abs(x - y)] += 1
    count, below, p99 = len(a), 0, 0
    while below + histogram[p99] < 0.99 * count:
        below += histogram[p99]
        p99 += 1
    return sum(d * n for d, n in enumerate(histogram)) / count, p99, sum(histogram[9:]) / count
