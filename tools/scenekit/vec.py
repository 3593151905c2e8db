"""Vectors as tuples. Lengths are in scene units, angles in degrees where a name says so, else in radians."""

import math


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def mul(a, s):
    return tuple(x * s for x in a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(a):
    return math.sqrt(dot(a, a))


def unit(a):
    return mul(a, 1.0 / length(a))


def mix(a, b, t):
    return tuple(x + (y - x) * t for x, y in zip(a, b))


def frame(eye, target, up=(0.0, 1.0, 0.0)):
    """Column-major matrix of a camera or light at `eye` that looks along its -Z to `target`."""
    back = unit(sub(eye, target))
    if abs(dot(back, up)) > 0.999:
        up = (0.0, 0.0, -1.0)
    right = unit(cross(up, back))
    true_up = cross(back, right)
    return [*right, 0.0, *true_up, 0.0, *back, 0.0, *eye, 1.0]


def placed(at=(0.0, 0.0, 0.0), yaw=0.0, pitch=0.0):
    """Column-major rigid motion: turned by `pitch` about X, then by `yaw` about Y (degrees), then moved to `at`."""
    cy, sy = math.cos(math.radians(yaw)), math.sin(math.radians(yaw))
    cx, sx = math.cos(math.radians(pitch)), math.sin(math.radians(pitch))
    return [cy, 0.0, -sy, 0.0, sy * sx, cx, cy * sx, 0.0, sy * cx, -sx, cy * cx, 0.0, *at, 1.0]
