"""Scenes that move: a pendulum of glass, and a banner in the wind."""

import math

from .gltf import Scene
from .shapes import lathe, line, quad, sphere, surface


def about_z(angle):
    return (0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2))


def pendulum():
    """A glass ball that swings over a floor and draws its caustic, two seconds there and back; the lamp dims and returns."""
    scene = Scene()
    scene.add("floor", quad((-4, 0, 3), (8, 0, 0), (0, 0, -6)), scene.diffuse("floor", (0.6, 0.58, 0.54)))
    scene.add("wall", quad((-4, 0, -1.6), (8, 0, 0), (0, 5, 0)), scene.diffuse("wall", (0.42, 0.5, 0.56)))
    ball, cord = sphere((0, -2.2, 0), 0.4, 20, 40), lathe([line(0.012, -1.8, 0.012, 0.0)], 8)
    glass, dark = scene.glass("glass", 1.5), scene.diffuse("cord", (0.08, 0.08, 0.08))
    hang = scene.node("pendulum", scene.mesh("pendulum", [(ball, glass), (cord, dark)]), translation=(0.0, 3.0, 0.0))
    scene.point("lamp", (1.2, 3.6, 1.6), 30.0, (1.0, 0.92, 0.8))
    lamp = len(scene.lights) - 1
    scene.camera("camera", (0.0, 1.9, 6.4), (0.0, 1.25, 0.0), 32.0, 4 / 3)
    # Angle and angular velocity of a harmonic swing: a cubic spline needs few keys.
    times = [i / 4 for i in range(9)]
    keys = []
    for t in times:
        angle, speed = 0.5 * math.cos(math.pi * t), -0.5 * math.pi * math.sin(math.pi * t)
        rate = (0.0, 0.0, 0.5 * speed * math.cos(angle / 2), -0.5 * speed * math.sin(angle / 2))
        keys += [rate, about_z(angle), rate]
    scene.keys({"node": hang, "path": "rotation"}, times, keys, "CUBICSPLINE")
    scene.pointer(f"/extensions/KHR_lights_punctual/lights/{lamp}/intensity", [0.0, 1.0, 2.0], [(30.0,), (12.0,), (30.0,)])
    return scene


def banner():
    """A banner of four joints and one morph target in the wind, before a wall: two seconds, then as it began."""
    scene = Scene()
    scene.add("wall", quad((-2.5, 0, -0.8), (5, 0, 0), (0, 3, 0)), scene.diffuse("wall", (0.7, 0.68, 0.64)))
    scene.add("floor", quad((-2.5, 0, 2), (5, 0, 0), (0, 0, -2.8)), scene.diffuse("floor", (0.45, 0.44, 0.42)))
    joints, length, columns = 4, 0.5, 16
    cloth = surface(lambda u, v: ((joints * length * u - 1.0, 1.1 + 0.9 * v, 0.0), (0.0, 0.0, 1.0)), columns, 4)
    red = scene.diffuse("cloth", (0.62, 0.1, 0.08))
    mesh = scene.mesh("banner", [(cloth, red)])
    billow = []
    bound, weights = [], []
    for x, _, _ in cloth.positions:
        along = (x + 1.0) / length
        billow.append((0.0, 0.0, 0.12 * math.sin(1.5 * math.pi * along)))
        # From the middle of one joint's length to that of the next.
        low = max(0, min(int(along - 0.5), joints - 1))
        share = max(0.0, along - 0.5 - low) if low + 1 < joints else 0.0
        bound.append((low, min(low + 1, joints - 1), 0, 0))
        weights.append((1.0 - share, share, 0.0, 0.0))
    scene.morph(mesh, [billow])
    chain = []
    for j in range(joints):
        at = (-1.0, 1.5, 0.0) if j == 0 else (length, 0.0, 0.0)
        chain.append(scene.node(f"joint {j}", None, translation=at, parent=chain[-1] if chain else None))
    inverse = [(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1.0 - length * j, -1.5, 0, 1) for j in range(joints)]
    cloth_node = scene.node("banner", mesh, skin=scene.skin(mesh, chain, inverse, bound, weights))
    scene.directional("sun", (0.6, 1.0, 0.8), 2.6, (1.0, 0.95, 0.86))
    scene.spot("lamp", (-2.0, 2.6, 1.8), (0.0, 1.4, 0.0), 12.0, 15.0, 35.0)
    scene.camera("camera", (0.3, 1.7, 4.6), (0.0, 1.35, 0.0), 34.0, 4 / 3)
    times = [i / 4 for i in range(9)]
    for j in range(joints):
        angles = [0.35 * math.sin(math.pi * t - 0.9 * j) for t in times]
        # About y: the cloth sways to and from the wall.
        turns = [(0.0, math.sin(a / 2), 0.0, math.cos(a / 2)) for a in angles]
        scene.keys({"node": chain[j], "path": "rotation"}, times, turns)
    scene.keys({"node": cloth_node, "path": "weights"}, [0.0, 0.5, 1.0, 1.5, 2.0], [(0.0,), (1.0,), (0.0,), (-1.0,), (0.0,)])
    return scene
