"""The two large halls, lengths in metres: a court with arcades in the sun, and a warehouse with racks under rows of lamps."""

import math

from . import images
from .gltf import Scene
from .shapes import Mesh, arc, box, differentiated, lathe, line, quad, sphere, surface
from .vec import placed, unit

# ---- atrium ----

BAY, DEEP = 2.4, 3.2  # from column to column, depth of the walks around the court
HALF_X, HALF_Z = 1.5 * BAY, 5 * BAY  # the court is three bays by ten
SLAB, UPPER, ROOF, TOP = 4.4, 4.75, 8.25, 9.7  # under the gallery, its floor, under the roof, the edge of the attic
THICK, PIER = 0.5, 0.3


def arch(spring, top, steps=12):
    """The wall over one bay with a round arch in it, from the height of the capitals up; x runs along the wall."""
    mesh, half = Mesh(), BAY / 2
    radius = half - PIER
    turns = [(-math.cos(math.pi * i / steps), math.sin(math.pi * i / steps)) for i in range(steps + 1)]
    below = [((-half, spring), (0.0, -1.0)), ((-radius, spring), (0.0, -1.0))]
    curve = [((radius * c, spring + radius * s), (-c, -s)) for c, s in turns]
    outline = [below, *([a, b] for a, b in zip(curve, curve[1:])), [((radius, spring), (0.0, -1.0)), ((half, spring), (0.0, -1.0))]]
    for ((ax, ay), na), ((bx, by), nb) in outline:
        for z in (-THICK / 2, THICK / 2):
            normal = (0.0, 0.0, math.copysign(1.0, z))
            corners = [mesh.vertex((x, y, z), normal) for x, y in ((ax, ay), (bx, by), (bx, top), (ax, top))]
            mesh.triangle(*corners[:3])
            mesh.triangle(corners[0], corners[2], corners[3])
        rim = [mesh.vertex((x, y, z), (*n, 0.0)) for z in (-THICK / 2, THICK / 2) for (x, y), n in (((ax, ay), na), ((bx, by), nb))]
        mesh.triangle(rim[0], rim[1], rim[3])
        mesh.triangle(rim[0], rim[3], rim[2])
    return mesh


def column(height, radius):
    """A square plinth, a round shaft that narrows a little, and a capital under a square plate."""
    foot, plate = 0.16, 0.14
    wide = radius + 0.09
    neck = radius * 0.86
    shaft = [arc(radius, foot + 0.06, 0.06, -90.0, 90.0, 3), line(radius, foot + 0.12, neck, height - 0.42),
             arc(neck, height - 0.39, 0.03, -90.0, 90.0, 2), line(neck, height - 0.36, PIER - 0.03, height - plate)]
    square = PIER - 0.01
    return lathe(shaft, 16).merge(box((-wide, 0.0, -wide), (wide, foot, wide))).merge(
        box((-square, height - plate, -square), (square, height, square)))


def curtain(width, drop):
    """Cloth in folds, hung from its upper edge and drawn in a little further down."""

    def point(u, v):
        fall = 1.0 - v
        fold = (0.05 + 0.05 * fall) * math.sin(2.0 * math.pi * 5.0 * u + 0.8 * math.sin(3.0 * fall))
        narrow = 1.0 - 0.16 * math.sin(math.pi * min(1.0, 0.62 * fall + 0.1)) ** 2
        sag = 0.07 * math.cos(2.0 * math.pi * u) * fall
        return ((u - 0.5) * width * narrow, -drop * fall + sag, fold)
    return surface(differentiated(point), 36, 7)


def railing():
    mesh = Mesh().merge(box((-BAY / 2, 0.86, -0.09), (BAY / 2, 0.98, 0.09))).merge(box((-BAY / 2, 0.0, -0.08), (BAY / 2, 0.1, 0.08)))
    for i in range(7):
        x = (i - 3) * 0.27
        mesh.merge(box((x - 0.045, 0.1, -0.045), (x + 0.045, 0.86, 0.045)))
    return mesh


def bays():
    """Name, middle and turn of the 26 bays around the court; a bay's +z looks into it."""
    for i in range(10):
        z = -HALF_Z + BAY * (i + 0.5)
        yield f"left_{i}", (-HALF_X, 0.0, z), 90.0
        yield f"right_{i}", (HALF_X, 0.0, z), -90.0
    for i in range(3):
        yield f"far_{i}", (BAY * (i - 1), 0.0, -HALF_Z), 0.0
        yield f"near_{i}", (BAY * (i - 1), 0.0, HALF_Z), 180.0


def lifted(at, height):
    return (at[0], at[1] + height, at[2])


def around(low, high, inner, outer):
    """Four boxes that fill the frame between two rectangles about the origin, given by their half sizes (x, z)."""
    (ix, iz), (ox, oz) = inner, outer
    mesh = Mesh()
    for side in (-1, 1):
        near, far = sorted((side * iz, side * oz))
        mesh.merge(box((-ox, low, near), (ox, high, far)))
        left, right = sorted((side * ix, side * ox))
        mesh.merge(box((left, low, -iz), (right, high, iz)))
    return mesh


def atrium_walls(scene, stone, plaster):
    ledge, wall = THICK / 2 + 0.08, 0.3
    court = (HALF_X - ledge, HALF_Z - ledge)
    outer = (HALF_X + DEEP, HALF_Z + DEEP)
    shell = (outer[0] + wall, outer[1] + wall)
    scene.add("gallery_floor", around(SLAB, UPPER, court, outer), stone)
    scene.add("roof", around(ROOF, ROOF + 0.35, court, shell), stone)
    attic = (HALF_X - THICK / 2, HALF_Z - THICK / 2)
    scene.add("attic", around(ROOF + 0.35, TOP, attic, (HALF_X + THICK / 2, HALF_Z + THICK / 2)), plaster)
    scene.add("outer_walls", around(-0.3, ROOF, outer, shell), plaster)
    doors = Mesh()
    for i in range(5):
        for side in (-1, 1):
            x, z = side * outer[0], BAY * 2 * (i - 2)
            low, high = sorted((x, x - side * 0.06))
            doors.merge(box((low, 0.0, z - 0.6), (high, 2.3, z + 0.6)))
    doors.merge(box((-0.8, 0.0, -outer[1]), (0.8, 2.5, -outer[1] + 0.06)))
    row = scene.mesh("doors", [(doors, scene.diffuse("door", (0.30, 0.17, 0.09)))])
    scene.place("doors_ground", row)
    scene.place("doors_upper", row, placed((0.0, UPPER, 0.0)))


def atrium_floor(scene):
    """Squares of two stones in the court, plain paving under the arcades."""
    pale, dark = Mesh(), Mesh()
    size = BAY / 2
    for i in range(6):
        for j in range(2):
            tile = quad((-HALF_X + size * i, 0.0, size * (j + 1)), (size, 0, 0), (0, 0, -size))
            (dark if (i + j) % 2 else pale).merge(tile)
    strip = scene.mesh("court", [(pale, scene.diffuse("pale_stone", (0.66, 0.60, 0.50))), (dark, scene.diffuse("dark_stone", (0.36, 0.27, 0.21)))])
    for i in range(10):
        scene.place(f"court_{i}", strip, placed((0.0, 0.0, -HALF_Z + BAY * i)))
    x, z = HALF_X + DEEP, HALF_Z + DEEP
    walks = Mesh()
    for side in (-1, 1):
        low, high = sorted((side * HALF_X, side * x))
        walks.merge(quad((low, 0.0, z), (high - low, 0, 0), (0, 0, -2 * z)))
        low, high = sorted((side * HALF_Z, side * z))
        walks.merge(quad((-HALF_X, 0.0, high), (2 * HALF_X, 0, 0), (0, 0, low - high)))
    scene.add("walks", walks, scene.diffuse("paving", (0.50, 0.44, 0.37)))


def atrium():
    """A court with two storeys of arcades: the sun reaches a strip of its floor and one side, all else is lit by what that returns."""
    scene = Scene()
    stone, plaster = scene.diffuse("sandstone", (0.68, 0.59, 0.46)), scene.diffuse("plaster", (0.74, 0.68, 0.58))
    atrium_floor(scene)
    atrium_walls(scene, stone, plaster)
    low_spring, high_spring = 2.9, 2.05
    low_arch = scene.mesh("ground_arch", [(arch(low_spring, SLAB), plaster)])
    high_arch = scene.mesh("upper_arch", [(arch(high_spring, ROOF - UPPER), plaster), (railing(), stone)])
    low_column = scene.mesh("ground_column", [(column(low_spring, 0.23), stone)])
    high_column = scene.mesh("upper_column", [(column(high_spring, 0.18), stone)])
    for name, at, yaw in bays():
        scene.place(f"ground_arch_{name}", low_arch, placed(at, yaw))
        scene.place(f"upper_arch_{name}", high_arch, placed(lifted(at, UPPER), yaw))
    feet = [(x, 0.0, -HALF_Z + BAY * i) for x in (-HALF_X, HALF_X) for i in range(11)]
    feet += [(x, 0.0, z) for z in (-HALF_Z, HALF_Z) for x in (-BAY / 2, BAY / 2)]
    for i, at in enumerate(feet):
        scene.place(f"ground_column_{i}", low_column, placed(at))
        scene.place(f"upper_column_{i}", high_column, placed(lifted(at, UPPER)))
    corners = Mesh()
    for x in (-HALF_X, HALF_X):
        for z in (-HALF_Z, HALF_Z):
            for low, high in ((low_spring, SLAB), (UPPER + high_spring, ROOF)):
                corners.merge(box((x - THICK / 2, low, z - THICK / 2), (x + THICK / 2, high, z + THICK / 2)))
    scene.add("corner_blocks", corners, plaster)

    cloth = curtain(2 * (BAY / 2 - PIER) + 0.1, 1.7)
    rod = box((-BAY / 2, -0.03, -0.03), (BAY / 2, 0.03, 0.03))
    iron = scene.diffuse("iron", (0.10, 0.09, 0.08))
    dyes = [("red", (0.60, 0.07, 0.05)), ("blue", (0.07, 0.16, 0.46)), ("green", (0.10, 0.34, 0.12))]
    cloths = [scene.mesh(f"curtain_{dye}", [(cloth, scene.diffuse(f"cloth_{dye}", colour)), (rod, iron)]) for dye, colour in dyes]
    for i in range(5):
        z = -HALF_Z + BAY * (2 * i + 0.5)
        scene.place(f"curtain_left_{i}", cloths[i % 3], placed((-HALF_X, low_spring + 0.1, z), 90.0))
        scene.place(f"curtain_right_{i}", cloths[(i + 1) % 3], placed((HALF_X, low_spring + 0.1, z + BAY), -90.0))

    pot = lathe([line(0.0, 0.0, 0.22, 0.0), line(0.22, 0.0, 0.34, 0.55), line(0.34, 0.55, 0.38, 0.55), line(0.38, 0.55, 0.38, 0.66),
                 line(0.38, 0.66, 0.0, 0.66)], 20)
    planter = scene.mesh("planter", [(pot, scene.diffuse("terracotta", (0.60, 0.27, 0.15))),
                                     (sphere((0.0, 1.02, 0.0), 0.44, 10, 18), scene.diffuse("box_tree", (0.10, 0.24, 0.05)))])
    for i, (x, z) in enumerate([(-2.5, -4.8), (2.5, -4.8), (-2.5, 2.4), (2.5, 2.4), (-2.5, -10.4), (2.5, -10.4)]):
        scene.place(f"planter_{i}", planter, placed((x, 0.0, z)))
    basin = [line(1.15, 0.0, 1.15, 0.5), line(1.15, 0.5, 0.92, 0.5), line(0.92, 0.5, 0.92, 0.22), line(0.92, 0.22, 0.18, 0.22),
             line(0.18, 0.22, 0.13, 1.05), line(0.13, 1.05, 0.46, 1.22), line(0.46, 1.22, 0.46, 1.3), line(0.46, 1.3, 0.0, 1.24)]
    scene.add("fountain", lathe(basin, 24, (0.0, 0.0, -1.2)), stone)
    scene.directional("sun", unit((0.36, 1.0, 0.16)), 13.0, (1.0, 0.93, 0.80))
    scene.camera("main", (0.55, 1.9, 11.4), (-0.25, 1.9, -12.0), 37.0, 4 / 3)
    return scene


# ---- warehouse ----

RACK, REACH, LEVELS = 2.7, 1.1, (0.12, 1.95, 3.75)  # length and depth of a bay of shelves, heights of its shelves
BAYS, AISLE, LENGTH, HIGH, HALF = 9, 3.2, 30.0, 7.2, 10.0


def rack():
    """Posts, beams and boards of one bay; x along the shelves, the middle of the bay at 0."""
    steel, boards = Mesh(), Mesh()
    for x in (-RACK / 2 + 0.05, RACK / 2 - 0.05):
        for z in (-REACH / 2 + 0.05, REACH / 2 - 0.05):
            steel.merge(box((x - 0.05, 0.0, z - 0.05), (x + 0.05, 5.2, z + 0.05)))
    for level in LEVELS:
        for z in (-REACH / 2 + 0.03, REACH / 2 - 0.03):
            steel.merge(box((-RACK / 2 + 0.1, level - 0.12, z - 0.03), (RACK / 2 - 0.1, level, z + 0.03)))
        boards.merge(box((-RACK / 2 + 0.02, level, -REACH / 2), (RACK / 2 - 0.02, level + 0.03, REACH / 2)))
    return steel, boards


def cartons(seed):
    """Boxes on the shelves of one bay, sorted into three kinds; sizes and gaps follow from the seed."""
    kinds = [Mesh(), Mesh(), Mesh()]
    for shelf, level in enumerate(LEVELS):
        x, count = -RACK / 2 + 0.14, 0

        def draw(what):
            return images.lattice(10 * count + what, shelf, seed)
        while x < RACK / 2 - 0.45:
            wide = min(0.34 + 0.46 * draw(0), RACK / 2 - 0.13 - x)
            high, deep = 0.3 + 0.75 * draw(1) ** 1.5, 0.6 + 0.4 * draw(2)
            if draw(3) > 0.12:
                z, base = 0.08 * (draw(4) - 0.5), level + 0.03
                kind = int(2.999 * draw(5) ** 1.6)
                kinds[kind].merge(box((x, base, z - deep / 2), (x + wide, base + high, z + deep / 2)))
                if draw(6) > 0.55 and high < 0.75:
                    over = (0.05 * wide, 0.25 + 0.3 * draw(7))
                    kinds[int(2.999 * draw(8))].merge(box((x + over[0], base + high, z - 0.42 * deep),
                                                          (x + wide - 0.4 * over[0], base + high + over[1], z + 0.38 * deep)))
            x += wide + 0.03 + 0.1 * draw(9)
            count += 1
    return kinds


def warehouse_shell(scene, panel):
    scene.add("floor", quad((-HALF, 0, 1), (2 * HALF, 0, 0), (0, 0, -LENGTH - 1)), scene.material("sealed_concrete", (0.42, 0.41, 0.39), 0.0, 0.45))
    scene.add("ceiling", quad((-HALF, HIGH, -LENGTH), (2 * HALF, 0, 0), (0, 0, LENGTH + 1)), panel)
    walls = Mesh()
    for low, high in (((-HALF - 0.2, 0, -LENGTH), (-HALF, HIGH, 1)), ((HALF, 0, -LENGTH), (HALF + 0.2, HIGH, 1)),
                      ((-HALF - 0.2, 0, -LENGTH - 0.2), (HALF + 0.2, HIGH, -LENGTH)), ((-HALF - 0.2, 0, 1), (HALF + 0.2, HIGH, 1.2))):
        walls.merge(box(low, high))
    scene.add("walls", walls, panel)
    girder = scene.mesh("girder", [(box((-HALF, HIGH - 0.5, -0.12), (HALF, HIGH - 0.02, 0.12)), scene.diffuse("girder", (0.34, 0.37, 0.40)))])
    for i in range(5):
        scene.place(f"girder_{i}", girder, placed((0.0, 0.0, -3.0 - 6.0 * i)))
    gate = Mesh()
    for i in range(8):
        gate.merge(box((-1.5, 0.42 * i, -LENGTH), (1.5, 0.42 * i + 0.38, -LENGTH + 0.08)))
    scene.add("gate", gate, scene.diffuse("gate", (0.16, 0.34, 0.52)))
    lines = Mesh()
    for x in (-AISLE / 2 + 0.15, AISLE / 2 - 0.15):
        lines.merge(quad((x - 0.05, 0.002, 0.0), (0.1, 0, 0), (0, 0, -LENGTH + 1.0)))
    scene.add("lane_marks", lines, scene.diffuse("yellow", (0.75, 0.55, 0.05)))


def warehouse_lamps(scene):
    """Fluorescent troughs over each aisle, and a warmer one over the gate."""
    shade = scene.diffuse("trough", (0.7, 0.7, 0.7))
    glow, warm = scene.emitter("tubes", (66.0, 69.0, 70.0)), scene.emitter("warm_tubes", (100.0, 78.0, 50.0))
    tubes, trough = quad((-0.15, 0.0, -0.75), (0.3, 0, 0), (0, 0, 1.5)), Mesh()
    trough.merge(box((-0.2, 0.01, -0.8), (0.2, 0.12, 0.8)))
    for z in (-0.4, 0.4):
        trough.merge(box((-0.01, 0.12, z - 0.01), (0.01, HIGH - 6.2, z + 0.01)))
    cool, amber = (scene.mesh(name, [(tubes, light), (trough, shade)]) for name, light in (("lamp", glow), ("warm_lamp", warm)))
    side = AISLE / 2 + 2 * REACH + 0.1 + AISLE / 2
    for aisle, x in enumerate((-side, 0.0, side)):
        for i in range(5):
            # A lamp in each side aisle is dark, so that their far ends differ.
            if (aisle, i) in ((0, 2), (2, 3)):
                continue
            scene.place(f"lamp_{aisle}_{i}", amber if i == 4 else cool, placed((x, 6.2, -2.6 - 6.0 * i)))


def warehouse():
    """Six rows of shelves full of boxes and three aisles with lamps: long lines of sight, many small surfaces at all depths."""
    scene = Scene()
    panel = scene.diffuse("panel", (0.72, 0.73, 0.72))
    warehouse_shell(scene, panel)
    warehouse_lamps(scene)
    steel, boards = rack()
    blue, wood = scene.material("painted_steel", (0.10, 0.22, 0.48), 0.0, 0.4), scene.diffuse("boards", (0.46, 0.33, 0.20))
    kinds = [scene.diffuse("cardboard", (0.52, 0.36, 0.21)), scene.diffuse("pale_cardboard", (0.66, 0.54, 0.38)),
             scene.material("plastic", (0.45, 0.10, 0.07), 0.0, 0.5)]
    variants = [scene.mesh(f"bay_{v}", [(steel, blue), (boards, wood), *zip(cartons(40 + v), kinds)]) for v in range(4)]
    first = AISLE / 2 + REACH / 2
    for row, x in enumerate((-first - 2 * REACH - AISLE - 0.1, -first - REACH - 0.1, -first, first, first + REACH + 0.1,
                             first + 2 * REACH + AISLE + 0.1)):
        for i in range(BAYS):
            draw = images.lattice(row, i, 77)
            z = -2.0 - RACK * (i + 0.5) - (1.6 if i > 4 else 0.0)
            scene.place(f"bay_{row}_{i}", variants[int(4 * draw)], placed((x, 0.0, z), 90.0 if int(8 * draw) % 2 else -90.0))

    pallet = Mesh()
    for z in (-0.5, -0.05, 0.4):
        pallet.merge(box((-0.6, 0.0, z), (0.6, 0.1, z + 0.1)))
    pallet.merge(box((-0.6, 0.1, -0.5), (0.6, 0.13, 0.5)))
    load = [Mesh(), Mesh()]
    for layer in range(3):
        for i in range(2):
            for j in range(2):
                if layer < 2 or i + j < 2:
                    low = (-0.57 + 0.58 * i, 0.14 + 0.4 * layer, -0.47 + 0.48 * j)
                    load[(i + j + layer) % 2].merge(box(low, (low[0] + 0.55, low[1] + 0.39, low[2] + 0.45)))
    stack = scene.mesh("loaded_pallet", [(pallet, wood), *zip(load, kinds)])
    for i, (x, z, yaw) in enumerate([(0.75, -5.4, 12.0), (-0.85, -11.0, 84.0), (0.2, -24.5, -20.0), (5.2, -8.0, 5.0)]):
        scene.place(f"pallet_{i}", stack, placed((x, 0.0, z), yaw))
    scene.camera("main", (-0.45, 2.6, 0.4), (0.15, 2.1, -20.0), 52.0, 4 / 3)
    return scene
