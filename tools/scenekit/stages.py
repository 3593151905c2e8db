"""The plain scenes: each shows one thing the renderer does. Lit diffuse surfaces come out at a radiance of about 0.2 to 1."""

import math

from . import images
from .gltf import Scene
from .shapes import Mesh, arc, box, differentiated, lathe, line, quad, sphere, surface
from .vec import add, mul, placed, unit

WHITE, GREEN, RED = (0.725, 0.71, 0.68), (0.14, 0.45, 0.091), (0.63, 0.065, 0.05)


def prism(corners, height):
    """An upright solid over a convex outline (x, z), without its floor."""
    mesh = Mesh()
    count = len(corners)
    middle = tuple(sum(c[k] for c in corners) / count for k in (0, 1))
    for i in range(count):
        (ax, az), (bx, bz) = corners[i], corners[(i + 1) % count]
        side = quad((ax, 0.0, az), (bx - ax, 0.0, bz - az), (0.0, height, 0.0))
        nx, _, nz = side.normals[0]
        if nx * (ax - middle[0]) + nz * (az - middle[1]) < 0.0:
            side = quad((bx, 0.0, bz), (ax - bx, 0.0, az - bz), (0.0, height, 0.0))
        mesh.merge(side)
    a, b, _, d = corners
    mesh.merge(quad((a[0], height, a[1]), (b[0] - a[0], 0.0, b[1] - a[1]), (d[0] - a[0], 0.0, d[1] - a[1])))
    return mesh


def cornell_room(scene, radiance, light_size):
    """The walls and the camera of Cornell University's box, 1 unit = 100 of its millimetres, and a square ceiling light."""
    white, green, red = scene.diffuse("white", WHITE), scene.diffuse("green", GREEN), scene.diffuse("red", RED)
    x, y, z = 5.56, 5.488, 5.592
    scene.add("floor", quad((0, 0, 0), (0, 0, z), (x, 0, 0)), white)
    scene.add("ceiling", quad((0, y, 0), (x, 0, 0), (0, 0, z)), white)
    scene.add("back", quad((0, 0, z), (0, y, 0), (x, 0, 0)), white)
    scene.add("right", quad((0, 0, 0), (0, y, 0), (0, 0, z)), green)
    scene.add("left", quad((x, 0, 0), (0, 0, z), (0, y, 0)), red)
    half = light_size / 2
    scene.add("light", quad((2.78 - half, y - 0.008, 2.795 - half), (light_size, 0, 0), (0, 0, light_size)),
              scene.emitter("light", radiance))
    scene.camera("camera", (2.78, 2.73, -8.0), (2.78, 2.73, 0.0), 39.3, 1.0)
    return white


def cornell():
    scene = Scene()
    white = cornell_room(scene, (34.0, 24.0, 8.0), 1.18)
    # The published blocks stand on slightly skewed quadrilaterals; these are the nearest parallelograms.
    scene.add("short_block", prism([(1.30, 0.65), (0.82, 2.25), (2.42, 2.74), (2.90, 1.14)], 1.65), white)
    scene.add("tall_block", prism([(4.23, 2.47), (2.65, 2.96), (3.14, 4.56), (4.72, 4.07)], 3.30), white)
    return scene


def cornell_glass():
    scene = Scene()
    cornell_room(scene, (230.0, 190.0, 125.0), 0.5)
    scene.add("mirror_sphere", sphere((3.95, 1.0, 3.9), 1.0, 48, 96), scene.metal("mirror", (0.95, 0.95, 0.95)))
    scene.add("glass_sphere", sphere((1.75, 1.02, 2.0), 1.0, 48, 96), scene.glass("glass", 1.5))
    return scene


def ring():
    """A mirror ring with the lamp straight above its rim: the caustic of a circle for a source on it is a cardioid."""
    scene = Scene()
    scene.add("plane", quad((-3, 0, 3), (6, 0, 0), (0, 0, -6)), scene.diffuse("plane", (0.75, 0.70, 0.60)))
    profile = [line(1.04, 0.0, 1.04, 0.55), line(1.04, 0.55, 1.0, 0.55), line(1.0, 0.55, 1.0, 0.0)]
    scene.add("ring", lathe(profile, 360), scene.metal("polished", (0.96, 0.93, 0.86)))
    scene.point("lamp", (-1.0, 1.3, 0.0), 3.6, (1.0, 0.93, 0.80))
    scene.camera("camera", (0.55, 3.6, 2.75), (0.05, 0.05, 0.05), 36.0, 4 / 3)
    return scene


def waves(x, z):
    """Height of the pool's water, a few crossing trains of waves."""
    trains = [(0.022, 2.1, 0.7, 0.3), (0.016, -1.2, 2.6, 1.9), (0.010, 3.7, -2.9, 4.0), (0.006, -5.2, -4.1, 0.9), (0.004, 6.9, 5.6, 2.2)]
    return sum(a * math.sin(kx * x + kz * z + phase) for a, kx, kz, phase in trains)


def pool():
    scene = Scene()
    stops = [(48, 112, 140), (96, 176, 196), (140, 210, 216), (208, 236, 232)]
    tiles = []
    for y in range(128):
        row = []
        for x in range(128):
            joint = min(x % 16, y % 16) < 1
            row.append(255 if joint else 40 + int(130 * images.lattice(x // 16, y // 16, 9)))
        tiles.append(row)
    tile = scene.diffuse("tile", (1.0, 1.0, 1.0), base_texture=scene.texture(images.png(128, 128, 3, tiles, images.ramp(stops))))
    deck = scene.diffuse("deck", (0.62, 0.55, 0.45))
    x, z, depth, rim = 2.0, 1.5, 1.1, 0.14
    scene.add("floor", quad((-x, -depth, z), (2 * x, 0, 0), (0, 0, -2 * z)), tile, uv_scale=(2.0, 1.5))
    height = depth + rim
    for name, corner, along in (("far_side", (-x, -depth, -z), (2 * x, 0, 0)), ("near_side", (x, -depth, z), (-2 * x, 0, 0)),
                                ("left_side", (-x, -depth, z), (0, 0, -2 * z)), ("right_side", (x, -depth, -z), (0, 0, 2 * z))):
        scene.add(name, quad(corner, along, (0, height, 0)), tile, uv_scale=(max(map(abs, along)) / 2, height / 2))
    wide = 3.0
    for name, corner, u, v in (("far_deck", (-x - wide, rim, -z), (2 * (x + wide), 0, 0), (0, 0, -wide)),
                               ("near_deck", (-x - wide, rim, z + wide), (2 * (x + wide), 0, 0), (0, 0, -wide)),
                               ("left_deck", (-x - wide, rim, z), (wide, 0, 0), (0, 0, -2 * z)),
                               ("right_deck", (x, rim, z), (wide, 0, 0), (0, 0, -2 * z))):
        scene.add(name, quad(corner, u, v), deck)

    def water(u, v):
        px, pz = -x - 0.01 + u * 2 * (x + 0.01), z + 0.01 - v * 2 * (z + 0.01)
        return px, waves(px, pz), pz
    scene.add("water", surface(differentiated(water), 128, 96), scene.glass("water", 1.33))
    scene.add("light", quad((-1.9, 4.6, -1.3), (0.35, 0, 0), (0, 0, 0.35)), scene.emitter("light", (800.0, 760.0, 680.0)))
    scene.camera("camera", (0.0, 2.75, 4.1), (0.0, -0.5, 0.15), 37.0, 4 / 3)
    return scene


def wall():
    """A white wall that no lamp reaches: what it shows has bounced off the painted floor and the ceiling."""
    scene = Scene()
    white = scene.diffuse("white", (0.80, 0.79, 0.77))
    scene.add("wall", quad((-4, 0, 0), (8, 0, 0), (0, 4, 0)), white)
    scene.add("ceiling", quad((-4, 4, 0), (8, 0, 0), (0, 0, 2.6)), white)
    for name, start, width, colour in (("ochre", -4.0, 3.4, (0.78, 0.48, 0.13)), ("plain", -0.6, 1.2, (0.55, 0.53, 0.50)),
                                       ("blue", 0.6, 3.4, (0.14, 0.30, 0.62))):
        scene.add(f"floor_{name}", quad((start, 0, 6), (width, 0, 0), (0, 0, -6)), scene.diffuse(name, colour))
    # A board between the lamps and the wall; the light gets by underneath.
    scene.add("board", box((-4, 1.9, 2.6), (4, 4.0, 2.7)), white)
    scene.add("post", box((-1.25, 0, 0.7), (-1.0, 1.5, 0.95)), white)
    scene.add("ball", sphere((1.1, 0.42, 0.9), 0.42, 32, 64), white)
    for side in (-1, 1):
        scene.spot(f"lamp_{side + 2}", (1.5 * side, 3.6, 4.4), (1.5 * side, 0, 2.1), 1000.0, 6.0, 11.0, (1.0, 0.95, 0.85))
    scene.camera("camera", (0.0, 1.5, 5.3), (0.0, 0.95, 0.0), 26.0, 16 / 10)
    return scene


def corridors():
    """A corridor with twelve rooms, each with a lamp of its own: most of the light is never seen from the camera.

    The camera stands in the middle, with its back to a door; half of the rooms lie behind it.
    """
    scene = Scene()
    plaster, floor = scene.diffuse("plaster", (0.74, 0.72, 0.68)), scene.diffuse("floor", (0.42, 0.30, 0.20))
    accents = [scene.diffuse(f"paint_{i}", c) for i, c in enumerate(
        [(0.62, 0.18, 0.12), (0.15, 0.42, 0.55), (0.70, 0.52, 0.15), (0.24, 0.45, 0.20), (0.45, 0.22, 0.50), (0.70, 0.70, 0.70)])]
    lamp = scene.emitter("lamp", (60.0, 52.0, 39.0))
    length_z, high, half, deep = 12.0, 2.6, 1.0, 4.0
    scene.add("floor", quad((-half - deep, 0, length_z), (2 * (half + deep), 0, 0), (0, 0, -2 * length_z)), floor)
    scene.add("ceiling", quad((-half - deep, high, -length_z), (2 * (half + deep), 0, 0), (0, 0, 2 * length_z)), plaster)
    scene.add("end", box((-half - deep, 0, -length_z - 0.1), (half + deep, high, -length_z)), plaster)
    scene.add("back_end", box((-half - deep, 0, length_z), (half + deep, high, length_z + 0.1)), plaster)
    middle_wall = box((-half - deep, 0, 0.0), (-0.45, high, 0.1)).merge(box((0.45, 0, 0.0), (half + deep, high, 0.1)))
    scene.add("middle_wall", middle_wall.merge(box((-0.45, 2.05, 0.0), (0.45, high, 0.1))), plaster)
    walls = Mesh()
    for side in (-1, 1):
        for room in range(-3, 3):
            near, door = -4.0 * room, -4.0 * room - 1.2
            for low, top, a, b in ((0.0, high, near, door), (2.05, high, door, door - 1.1), (0.0, high, door - 1.1, near - 4.0)):
                inner, outer = sorted((side * half, side * (half + 0.12)))
                walls.merge(box((inner, low, b), (outer, top, a)))
            back, front = sorted((side * (half + 0.12), side * (half + deep)))
            if room not in (-3, 0):
                walls.merge(box((back, 0, near - 0.06), (front, high, near + 0.06)))
            outer, skin = sorted((side * (half + deep), side * (half + deep - 0.05)))
            number = room + 3 if side < 0 else room + 9
            scene.add(f"outer_{number}", box((outer, 0, near - 4.0), (skin, high, near)), accents[number % 3 if side < 0 else 3 + number % 3])
            middle = side * (half + deep / 2 + (0.9 if room % 2 else -0.6))
            scene.add(f"lamp_{number}", quad((middle - 0.3, high - 0.02, near - 2.3), (0.6, 0, 0), (0, 0, 0.6)), lamp)
    scene.add("walls", walls, plaster)
    scene.add("vase", lathe([arc(0.0, 0.28, 0.28, -90.0, 90.0, 24)], 48, (0.55, 0.0, -5.2)), scene.metal("brass", (0.89, 0.70, 0.36), 0.15))
    scene.camera("camera", (-0.15, 1.5, -0.4), (0.1, 1.15, -8.0), 52.0, 4 / 3)
    return scene


# ---- one still life under every kind of light ----

def cove(scene, colour=(0.72, 0.70, 0.66)):
    """A floor that turns into the back wall without an edge."""
    bend, front, back, top, half = 2.0, 7.0, -3.0, 7.0, 9.0
    straight, curved = front - back, bend * math.pi / 2
    total = straight + curved + top - bend

    def point(u, v):
        s, x = v * total, (2 * u - 1) * half
        if s <= straight:
            return (x, 0.0, front - s), (0.0, 1.0, 0.0)
        if s <= straight + curved:
            a = (s - straight) / bend
            return (x, bend - bend * math.cos(a), back - bend * math.sin(a)), (0.0, math.cos(a), math.sin(a))
        return (x, bend + s - straight - curved, back - bend), (0.0, 0.0, 1.0)
    scene.add("cove", surface(point, 2, 120), scene.diffuse("cove", colour))


def still_life(scene):
    scene.add("ball", sphere((-1.75, 0.6, -0.3), 0.6, 24, 48), scene.diffuse("clay", (0.66, 0.30, 0.20)))
    scene.add("mirror", sphere((-0.15, 0.85, -1.3), 0.85, 36, 72), scene.metal("steel", (0.90, 0.90, 0.92)))
    scene.add("glass", sphere((0.55, 0.55, 0.75), 0.55, 36, 72), scene.glass("glass", 1.5))
    scene.add("block", box((-0.5, 0.0, -0.5), (0.5, 1.3, 0.5)), scene.diffuse("blue", (0.20, 0.34, 0.55)), placed((1.9, 0, -0.7), 28))
    scene.camera("camera", (0.0, 2.3, 6.6), (0.05, 0.62, 0.0), 30.0, 4 / 3)


def light_point():
    scene = Scene()
    cove(scene)
    still_life(scene)
    scene.point("bulb", (-2.3, 3.2, 2.0), 30.0, (1.0, 0.92, 0.78))
    return scene


def light_spot():
    scene = Scene()
    cove(scene)
    still_life(scene)
    scene.spot("warm", (-3.6, 4.4, 2.6), (-0.5, 0.5, -0.3), 100.0, 14.0, 22.0, (1.0, 0.86, 0.66))
    scene.spot("cool", (3.8, 4.0, 2.2), (0.8, 0.5, 0.0), 60.0, 8.0, 20.0, (0.66, 0.82, 1.0))
    return scene


def light_directional():
    """Sunlight through a window onto the still life, in a room that nothing else lights."""
    scene = Scene()
    plaster = scene.diffuse("plaster", (0.76, 0.74, 0.70))
    scene.add("floor", quad((-3.5, 0, 7.5), (7, 0, 0), (0, 0, -11)), scene.diffuse("boards", (0.52, 0.38, 0.25)))
    scene.add("back", quad((-3.5, 0, -3.5), (7, 0, 0), (0, 4, 0)), plaster)
    scene.add("right", quad((3.5, 0, -3.5), (0, 0, 11), (0, 4, 0)), plaster)
    scene.add("ceiling", quad((-3.5, 4, -3.5), (7, 0, 0), (0, 0, 11)), plaster)
    scene.add("behind", quad((3.5, 0, 7.5), (-7, 0, 0), (0, 4, 0)), plaster)
    left = Mesh()
    for low, high, near, far in ((0, 1.0, -3.5, 7.5), (3.4, 4, -3.5, 7.5), (1.0, 3.4, -3.5, -0.6), (1.0, 3.4, 2.0, 7.5),
                                 (2.15, 2.25, -0.6, 2.0), (1.0, 3.4, 0.65, 0.75)):
        left.merge(box((-3.65, low, near), (-3.5, high, far)))
    scene.add("left", left, plaster)
    still_life(scene)
    scene.directional("sun", (-1.0, 0.62, 0.25), 11.0, (1.0, 0.90, 0.74))
    return scene


def light_area():
    scene = Scene()
    cove(scene)
    still_life(scene)
    scene.add("panel", quad((-3.4, 3.4, 1.0), (1.1, 0.9, 0.0), (0.0, -1.1, 1.3)), scene.emitter("panel", (26.0, 24.4, 21.8)))
    return scene


def light_environment():
    """No lamp at all: the sky lights it, the default one or the one given with --environment."""
    scene = Scene()
    scene.add("ground", lathe([line(0.0, 0.0, 9.0, 0.0)[::-1]], 96), scene.diffuse("ground", (0.62, 0.60, 0.56)))
    still_life(scene)
    return scene


def textured():
    """Colour, roughness and relief from pictures: a brick wall, a wooden floor."""
    scene = Scene()
    boards = scene.texture(images.wood(256, 128, 4, [(58, 34, 20), (132, 86, 50), (196, 146, 96)]))
    heights, tones = images.bricks(128, 128, 4, 8)
    palette = images.ramp([(150, 146, 138), (122, 72, 56), (158, 82, 58), (186, 112, 80)])
    rows = [[round(255 * t) for t in tones[y * 128:(y + 1) * 128]] for y in range(128)]
    brick = scene.texture(images.png(128, 128, 3, rows, palette))
    relief = scene.texture(images.normal_map(128, 128, heights, 5.0))
    scene.add("floor", quad((-5, 0, 6), (10, 0, 0), (0, 0, -8)), scene.diffuse("boards", (1, 1, 1), base_texture=boards), uv_scale=(3, 3))
    scene.add("wall", quad((-5, 0, -2), (10, 0, 0), (0, 5, 0)),
              scene.diffuse("brick", (1, 1, 1), base_texture=brick, normalTexture={"index": relief}), uv_scale=(6, 3))
    scene.add("globe", sphere((-1.3, 0.8, -0.2), 0.8, 48, 96),
              scene.diffuse("turned_wood", (1, 1, 1), base_texture=boards), uv_scale=(2, 1))
    scene.add("pot", lathe([line(0.0, 0.0, 0.45, 0.0), line(0.45, 0.0, 0.7, 1.2), line(0.7, 1.2, 0.0, 1.2)], 64, (1.3, 0, 0.1)),
              scene.diffuse("brick_pot", (1, 1, 1), base_texture=brick, normalTexture={"index": relief}), uv_scale=(3, 1))
    scene.add("lamp", quad((2.2, 3.9, 0.6), (0.9, 0, 0), (0, 0, 0.9)), scene.emitter("lamp", (160.0, 144.0, 118.0)))
    scene.camera("camera", (0.0, 2.0, 6.6), (0.0, 1.05, 0.0), 32.0, 4 / 3)
    return scene


def glossy():
    """Metal spheres from nearly polished to satin, and two strips of light for them to show."""
    scene = Scene()
    cove(scene, (0.50, 0.49, 0.48))
    metals = [("silver", (0.95, 0.93, 0.88)), ("gold", (1.0, 0.78, 0.34)), ("copper", (0.95, 0.64, 0.54)),
              ("iron", (0.56, 0.57, 0.58)), ("brass", (0.89, 0.75, 0.42))]
    for i, ((name, colour), roughness) in enumerate(zip(metals, (0.08, 0.16, 0.28, 0.42, 0.6))):
        centre = add((0.0, 0.62, 0.3), mul(unit((i - 2, 0.0, -0.12 * (i - 2) ** 2)), 1.42 * abs(i - 2)) if i != 2 else (0, 0, 0))
        scene.add(f"{name}_sphere", sphere(centre, 0.62, 40, 80), scene.metal(name, colour, roughness))
    for name, x, radiance in (("key", -3.2, (11.0, 10.0, 8.6)), ("rim", 2.2, (5.0, 6.0, 7.6))):
        scene.add(name, quad((x, 4.0, -0.6), (1.0, 0.0, 0.0), (0.0, 0.0, 3.2)), scene.emitter(name, radiance))
    scene.camera("camera", (0.0, 2.5, 7.4), (0.0, 0.58, 0.0), 33.0, 16 / 10)
    return scene
