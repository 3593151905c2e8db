"""The picture on the first page: a gilded cup in low sun, and the nephroid that its inside throws on the coffee.

One unit is a centimetre. Parallel light that a cylinder reflects gathers on a nephroid with its cusp half a radius from the axis.
For the sun at elevation e the wall must stand about R tan e above the coffee, so that the reflected light gets that far.
"""

import math

from . import images
from .gltf import Scene
from .shapes import arc, bezier, differentiated, lathe, line, quad, surface, tube
from .vec import add, mix, mul, placed, unit

SUN = (-0.86, 0.46, -0.46)  # towards the light: from behind, on the left
INNER, RIM, COFFEE = 3.9, 6.6, 4.7  # inner radius of the cup, its height, the level of the coffee


def cup(scene):
    glaze = scene.diffuse("glaze", (0.11, 0.235, 0.40))
    gold = scene.metal("gold", (1.0, 0.80, 0.46))
    outer, lip = INNER + 0.26, 0.13
    base = 0.75  # the saucer's well
    shell = [line(0.0, base + 0.25, 2.0, base + 0.25), line(2.0, base + 0.25, 2.1, base), line(2.1, base, 2.5, base),
             bezier((2.5, base), (2.7, base + 0.5), (outer, base + 0.8), (outer, base + 3.1), 32),
             line(outer, base + 3.1, outer, RIM - 0.55)]
    lining = [line(outer, RIM - 0.55, outer, RIM - lip), arc(INNER + lip, RIM - lip, lip, 0.0, 180.0, 16),
              line(INNER, RIM - lip, INNER, 3.4, 3), arc(INNER - 2.2, 3.4, 2.2, 0.0, -90.0, 6), line(INNER - 2.2, 1.2, 0.0, 1.2)]
    scene.add("cup", lathe(shell, 128), glaze)
    scene.add("lining", lathe(lining, 256), gold)

    # The coffee climbs the wall a little, as wetting liquids do; its edge lies inside the metal.
    edge, climb = INNER + 0.02, 0.22
    meniscus = [line(0.0, COFFEE, edge - climb, COFFEE)[::-1], arc(edge - climb, COFFEE + climb, climb, 0.0, -90.0, 8)]
    scene.add("coffee", lathe(meniscus, 128), scene.diffuse("coffee", (0.52, 0.325, 0.18)))

    reach = [(outer - 0.1, 5.5), (outer + 2.9, 6.1), (outer + 2.6, 2.6), (outer - 0.35, 2.5)]

    def path(t):
        s = 1.0 - t
        x, y = (sum(w * p[k] for w, p in zip((s ** 3, 3 * s * s * t, 3 * s * t * t, t ** 3), reach)) for k in (0, 1))
        return (x, y, 0.0)
    scene.add("handle", tube(path, lambda t: 0.40 - 0.10 * math.sin(math.pi * t), 48, 32), glaze, placed(yaw=38.0))

    saucer = [line(0.0, 0.0, 4.0, 0.0), bezier((4.0, 0.0), (5.2, 0.0), (6.4, 0.7), (7.6, 1.0), 16),
              arc(7.58, 1.09, 0.09, -78.0, 102.0, 8),
              bezier((7.56, 1.18), (6.3, 0.95), (5.2, 0.55), (4.2, 0.5), 16), line(4.2, 0.5, 3.2, 0.5),
              line(3.2, 0.5, 2.9, 0.74), line(2.9, 0.74, 0.0, 0.74)]
    scene.add("saucer", lathe(saucer[:2] + saucer[3:], 128), glaze)
    scene.add("saucer_rim", lathe(saucer[2:3], 160), gold)


def teaspoon(scene, matrix):
    """A bowl and a stem in one sheet: for each s along the length a half width, a sag across it and a height."""

    def width(s):
        bowl = 1.35 * math.sqrt(max(1.0 - ((s - 0.155) / 0.155) ** 2, 0.0)) if s < 0.25 else 0.0
        # The bowl runs into the stem, the stem widens to a rounded end.
        t = min(max((s - 0.2) / 0.16, 0.0), 1.0)
        blend = t * t * (3 - 2 * t)
        stem = 0.26 + 0.34 * max(s - 0.5, 0.0) ** 1.5 * 2
        stem *= math.sqrt(max(1.0 - (max(s - 0.95, 0.0) / 0.05) ** 2, 0.0))
        neck = 1.35 * math.sqrt(max(1.0 - ((min(s, 0.2) - 0.155) / 0.155) ** 2, 0.0))
        return (neck if s < 0.2 else 1.29 + (stem - 1.29) * blend) if s >= 0.2 else bowl

    def point(u, v):
        s, t = 0.0008 + v * 0.9984, 2.0 * u - 1.0
        bowl = max(1.0 - ((s - 0.15) / 0.17) ** 2, 0.0)
        lift = 0.55 * (1.0 - math.exp(-((max(s - 0.12, 0.0) / 0.22) ** 2))) - 0.7 * max(s - 0.6, 0.0) ** 2 * 4
        sag = 0.55 * bowl * bowl + 0.03
        return (width(s) * t, lift - sag * (1.0 - t * t) + 0.6, -12.0 * s)
    scene.add("teaspoon", surface(differentiated(point, 2e-4), 24, 160), scene.metal("silver", (0.95, 0.93, 0.90)), matrix)


def water_glass(scene, at):
    """Glass and water as one body of one index: a heavy foot, a straight wall, the water's level inside."""
    radius, high, level, thick = 3.0, 7.4, 5.6, 0.22
    profile = [line(0.0, 0.0, radius - 0.5, 0.0), arc(radius - 0.5, 0.5, 0.5, -90.0, 0.0, 8),
               bezier((radius, 0.5), (radius, 2.6), (radius + 0.25, 5.0), (radius + 0.3, high - thick / 2), 16),
               arc(radius + 0.3 - thick / 2, high - thick / 2, thick / 2, 0.0, 180.0, 12),
               line(radius + 0.3 - thick, high - thick / 2, radius + 0.2 - thick, level + 0.2, 2),
               arc(radius + 0.0 - thick, level + 0.2, 0.2, 0.0, -90.0, 6), line(radius - thick, level, 0.0, level)]
    scene.add("water", lathe(profile, 144, at), scene.glass("water", 1.38, (0.93, 0.98, 0.97), 8.0))


def sugar(scene, name, material, at, yaw):
    """A cube with rounded edges: a superellipsoid, parameters as of a sphere."""
    size, power = 0.8, 0.28

    def signed(x):
        # At a pole or an edge the sine of a multiple of pi is nearly zero, and its small power is not.
        return math.copysign(abs(x) ** power, x) if abs(x) > 1e-9 else 0.0

    def point(u, v):
        a, b = 2.0 * math.pi * u, (v - 0.5) * math.pi
        across = size * signed(math.cos(b))
        return (across * signed(math.sin(a)), size * signed(math.sin(b)), across * signed(math.cos(a)))

    def exact(u, v):
        a, b = 2.0 * math.pi * u, (v - 0.5) * math.pi

        def gradient(x):
            return math.copysign(abs(x) ** (2.0 - power), x)
        normal = (gradient(math.cos(b)) * gradient(math.sin(a)), gradient(math.sin(b)), gradient(math.cos(b)) * gradient(math.cos(a)))
        return point(u, v), unit(normal)
    scene.add(name, surface(exact, 48, 24), material, placed(add(at, (0.0, size, 0.0)), yaw))


def coffee_cup():
    scene = Scene()
    stops = [(70, 42, 24), (150, 98, 58), (196, 146, 96), (226, 186, 138)]
    boards = scene.texture(images.wood(512, 256, 5, stops))
    scene.add("table", quad((-38, 0, 26), (76, 0, 0), (0, 0, -64)), scene.diffuse("table", (1.0, 1.0, 1.0), base_texture=boards),
              placed(yaw=-14.0), uv_scale=(1.0, 1.0))
    cup(scene)
    teaspoon(scene, placed((10.2, 0.0, 8.4), 7.0))
    water_glass(scene, (9.2, 0.0, -7.6))
    white = scene.diffuse("sugar", (0.86, 0.84, 0.80))
    sugar(scene, "sugar_1", white, (-8.6, 0.0, 5.2), 20.0)
    sugar(scene, "sugar_2", white, (-10.3, 0.0, 4.3), 52.0)

    # The sun is a narrow spot: every photon lands on the table. A window's worth of sky and a pale ceiling fill the shadows and
    # give the metal something to show; both hang as low as the picture allows, since light from afar mostly misses,
    # and the largest footprint of a photon is a tenth of the scene.
    distance = 150.0
    scene.spot("sun", mul(unit(SUN), distance), (1.0, 2.0, -1.0), 6.0 * distance * distance, 7.0, 11.0, (1.0, 0.80, 0.56))
    sky = scene.emitter("sky", (2.2, 2.8, 3.6))
    for i in range(2):
        for j in range(2):
            scene.add(f"pane_{i}{j}", quad((-17.0 + 12.0 * i, 18.0 + 11.3 * j, -28.0), (10.6, 0.0, 0.0), (0.0, 10.0, 0.0)), sky)
    scene.add("ceiling", quad((-22.0, 41.0, -38.0), (55.0, 0.0, 0.0), (0.0, 0.0, 55.0)), scene.emitter("ceiling", (0.44, 0.41, 0.38)))
    scene.camera("camera", (1.6, 32.0, 24.5), (1.2, 2.2, -1.1), 30.0, 16 / 10)
    return scene
