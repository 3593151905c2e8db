"""Meshes of analytic shapes: exact normals that point out of the solid, counter-clockwise triangles, no zero areas."""

import math

from .vec import add, cross, dot, length, mul, sub, unit


class Mesh:
    """Positions, unit normals, texture coordinates (one each) and triangles."""

    def __init__(self):
        self.positions, self.normals, self.uvs, self.triangles = [], [], [], []

    def vertex(self, position, normal, uv=(0.0, 0.0)):
        self.positions.append(position)
        self.normals.append(normal)
        self.uvs.append(uv)
        return len(self.positions) - 1

    def triangle(self, a, b, c):
        """Adds a triangle, turned so that its front is the side of its normals; one without area is left out."""
        p = [self.positions[i] for i in (a, b, c)]
        face = cross(sub(p[1], p[0]), sub(p[2], p[0]))
        if length(face) < 1e-12:
            return
        mean = add(add(self.normals[a], self.normals[b]), self.normals[c])
        self.triangles.append((a, b, c) if dot(face, mean) > 0.0 else (a, c, b))

    def merge(self, other):
        base = len(self.positions)
        self.positions += other.positions
        self.normals += other.normals
        self.uvs += other.uvs
        self.triangles += [tuple(base + i for i in t) for t in other.triangles]
        return self


def surface(point, nu, nv):
    """A grid over the unit square; `point(u, v)` gives position and normal. Images stand upright where v goes up."""
    mesh = Mesh()
    for j in range(nv + 1):
        for i in range(nu + 1):
            u, v = i / nu, j / nv
            mesh.vertex(*point(u, v), (u, 1.0 - v))
    for j in range(nv):
        for i in range(nu):
            a = j * (nu + 1) + i
            b, c, d = a + 1, a + nu + 2, a + nu + 1
            mesh.triangle(a, b, c)
            mesh.triangle(a, c, d)
    return mesh


def differentiated(point, step=1e-4):
    """Adds normals to `point(u, v) -> position` by central differences (error of second order in `step`)."""

    def with_normal(u, v):
        along_u = sub(point(u + step, v), point(u - step, v))
        along_v = sub(point(u, v + step), point(u, v - step))
        return point(u, v), unit(cross(along_u, along_v))

    return with_normal


def quad(corner, u, v, nu=1, nv=1):
    """A parallelogram with its front towards u x v."""
    normal = unit(cross(u, v))
    return surface(lambda s, t: (add(corner, add(mul(u, s), mul(v, t))), normal), nu, nv)


def box(low, high, inside=False):
    """A box between two corners; `inside` turns the faces inwards."""
    mesh = Mesh()
    size = sub(high, low)
    for axis in range(3):
        u, v = [0.0] * 3, [0.0] * 3
        u[(axis + 1) % 3] = size[(axis + 1) % 3]
        v[(axis + 2) % 3] = size[(axis + 2) % 3]
        far = list(low)
        far[axis] = high[axis]
        if inside:
            mesh.merge(quad(low, u, v)).merge(quad(far, v, u))
        else:
            mesh.merge(quad(low, v, u)).merge(quad(far, u, v))
    return mesh


def sphere(centre, radius, rings, segments):
    return lathe([arc(0.0, 0.0, radius, -90.0, 90.0, rings)], segments, centre)


def line(r0, y0, r1, y1, steps=1):
    """A straight piece of a lathe's profile. Walk it with the solid on the left, seen with r to the right and y up."""
    dr, dy = r1 - r0, y1 - y0
    size = math.hypot(dr, dy)
    return [(r0 + dr * i / steps, y0 + dy * i / steps, dy / size, -dr / size) for i in range(steps + 1)]


def arc(r, y, radius, start, end, steps):
    """A circular piece (degrees); one that runs clockwise is concave, its normals point to its centre."""
    side = 1.0 if end > start else -1.0
    points = []
    for i in range(steps + 1):
        angle = math.radians(start + (end - start) * i / steps)
        c, s = math.cos(angle), math.sin(angle)
        points.append((max(r + radius * c, 0.0) if abs(r + radius * c) > 1e-9 else 0.0, y + radius * s, side * c, side * s))
    return points


def bezier(p0, p1, p2, p3, steps):
    """A cubic piece through (r, y) control points."""
    points = []
    for i in range(steps + 1):
        t = i / steps
        s = 1.0 - t
        weights = (s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t)
        slopes = (-3 * s * s, 3 * s * s - 6 * s * t, 6 * s * t - 3 * t * t, 3 * t * t)
        r, y = (sum(w * p[k] for w, p in zip(weights, (p0, p1, p2, p3))) for k in (0, 1))
        dr, dy = (sum(w * p[k] for w, p in zip(slopes, (p0, p1, p2, p3))) for k in (0, 1))
        size = math.hypot(dr, dy)
        points.append((r, y, dy / size, -dr / size))
    return points


def lathe(pieces, segments, centre=(0.0, 0.0, 0.0)):
    """Turns a profile about the Y axis. Pieces meet in creases unless their end normals agree."""
    mesh = Mesh()
    for piece in pieces:
        first = len(mesh.positions)
        for j, (r, y, nr, ny) in enumerate(piece):
            for i in range(segments + 1):
                # The seam's last column repeats the first to the bit, so that solids are closed.
                angle = 2.0 * math.pi * (i % segments) / segments
                c, s = math.cos(angle), math.sin(angle)
                mesh.vertex(add(centre, (r * c, y, r * s)), (nr * c, ny, nr * s), (1.0 - i / segments, 1.0 - j / (len(piece) - 1)))
        row = segments + 1
        for j in range(len(piece) - 1):
            for i in range(segments):
                a = first + j * row + i
                mesh.triangle(a, a + 1, a + row + 1)
                mesh.triangle(a, a + row + 1, a + row)
    return mesh


def tube(path, radius, steps, segments):
    """Sweeps a circle of radius `radius(t)` along `path(t)`; open at the ends."""

    def tangent(t):
        return unit(sub(path(t + 1e-4), path(t - 1e-4)))

    frames = []
    side = None
    for i in range(steps + 1):
        along = tangent(i / steps)
        # The side is carried from ring to ring, so the tube does not twist.
        guess = side or ((0.0, 0.0, 1.0) if abs(along[2]) < 0.9 else (1.0, 0.0, 0.0))
        side = unit(sub(guess, mul(along, dot(guess, along))))
        frames.append((along, side, cross(along, side)))

    def point(u, v):
        i = round(v * steps)
        along, side, other = frames[i]
        angle = 2.0 * math.pi * (round(u * segments) % segments) / segments
        out = add(mul(side, math.cos(angle)), mul(other, math.sin(angle)))
        slope = (radius(v + 1e-4) - radius(v - 1e-4)) / length(sub(path(v + 1e-4), path(v - 1e-4)))
        return add(path(v), mul(out, radius(v))), unit(sub(out, mul(along, slope)))

    return surface(point, segments, steps)
