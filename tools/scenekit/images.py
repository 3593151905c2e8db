"""Small procedural pictures as PNG. Stored, not compressed: what zlib makes of the same data differs between its versions."""

import math
import struct
import zlib


def png(width, height, colour_type, rows, palette=None):
    """`rows` of bytes; colour type 2 is RGB, 3 is one byte into `palette`, a list of at most 256 RGB triples."""
    raw = b"".join(b"\0" + bytes(row) for row in rows)
    stored = b"\x78\x01"
    for start in range(0, len(raw), 65535):
        part = raw[start:start + 65535]
        stored += struct.pack("<BHH", start + 65535 >= len(raw), len(part), len(part) ^ 0xFFFF) + part
    stored += struct.pack(">I", zlib.adler32(raw))
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour_type, 0, 0, 0))]
    if palette:
        chunks.append((b"PLTE", bytes(c for colour in palette for c in colour)))
    chunks += [(b"IDAT", stored), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks)


def lattice(x, y, seed):
    """A number in [0, 1) for each lattice point (an integer hash)."""
    h = (x * 0x9E3779B1 + y * 0x85EBCA77 + seed * 0xC2B2AE3D) & 0xFFFFFFFF
    for _ in range(2):
        h = ((h ^ (h >> 15)) * 0x2C1B3C6D) & 0xFFFFFFFF
        h ^= h >> 12
    return h / 4294967296.0


def noise(x, y, period_x, period_y, seed):
    """Smooth value noise that repeats after the given numbers of cells."""
    ix, iy = math.floor(x), math.floor(y)
    fx, fy = x - ix, y - iy
    sx, sy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
    corner = [lattice((ix + i) % period_x, (iy + j) % period_y, seed) for j in (0, 1) for i in (0, 1)]
    low = corner[0] + (corner[1] - corner[0]) * sx
    high = corner[2] + (corner[3] - corner[2]) * sx
    return low + (high - low) * sy


def ramp(stops, count=256):
    """A palette through sRGB colours at equal distances."""
    palette = []
    for i in range(count):
        t = i / (count - 1) * (len(stops) - 1)
        k = min(int(t), len(stops) - 2)
        palette.append(tuple(round(a + (b - a) * (t - k)) for a, b in zip(stops[k], stops[k + 1])))
    return palette


def wood(width, height, planks, stops):
    """Planks along x, each with grain of its own and a dark joint; repeats in both directions."""
    rows = []
    for y in range(height):
        plank = y * planks // height
        across = y * planks / height - plank
        shade = 0.30 * lattice(plank, 7, 3) - 0.12
        row = []
        for x in range(width):
            u = x / width
            # Rings of the trunk, cut lengthways: stretched noise folded into lines.
            figure = 5.0 * noise(u * 3, across * 2.2 + plank * 5, 3, 997, 11)
            grain = 0.5 + 0.5 * math.sin(2 * math.pi * (figure + across * 3.0))
            fibre = noise(u * 24, y * 0.9, 24, 997, 5 + plank)
            pores = noise(u * 60, y * 1.7, 60, 1999, 23)
            value = 0.50 + shade + 0.16 * (grain - 0.5) + 0.22 * (fibre - 0.5) - 0.16 * max(0.0, pores - 0.72) / 0.28
            joint = min(across, 1.0 - across) * height / planks
            if joint < 1.0:
                value *= 0.35
            row.append(min(255, max(0, round(255 * value))))
        rows.append(row)
    return png(width, height, 3, rows, ramp(stops))


def bricks(width, height, columns, courses):
    """A brick wall as heights in [0, 1] and a tone for each texel, row by row."""
    heights, tones = [], []
    for y in range(height):
        course = y * courses // height
        across = y * courses / height - course
        for x in range(width):
            along = x * columns / width + 0.5 * (course % 2)
            brick = int(along) % columns
            edge = min((along - int(along)) * 2.0, (1 - along + int(along)) * 2.0, across, 1 - across)
            rise = min(1.0, max(0.0, (edge - 0.04) / 0.08))
            rough = noise(x * 32 / width, y * 32 / height, 32, 32, 17)
            heights.append(rise * (0.8 + 0.2 * rough))
            tones.append(0.15 + 0.1 * rough if rise < 0.3 else 0.4 + 0.4 * lattice(brick, course, 5) + 0.2 * rough)
    return heights, tones


def normal_map(width, height, heights, depth):
    """Tangent-space normals, +Y up, of a height field that repeats; `depth` is in texels."""
    rows = []
    for y in range(height):
        row = []
        for x in range(width):
            def at(i, j):
                return heights[(y + j) % height * width + (x + i) % width]
            nx = -depth * (at(1, 0) - at(-1, 0)) / 2
            ny = depth * (at(0, 1) - at(0, -1)) / 2
            size = math.sqrt(nx * nx + ny * ny + 1)
            row += [round(127.5 + 127.5 * c / size) for c in (nx, ny, 1.0)]
        rows.append(row)
    return png(width, height, 2, rows)
