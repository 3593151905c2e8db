"""Two rooms' worth of things that shine: a chessboard seen from near by, and a kitchen. Lengths in metres."""

import math

from . import images
from .gltf import Scene
from .shapes import Mesh, arc, bezier, box, lathe, line, quad, sphere, tube
from .vec import placed

# ---- chess ----

SQUARE = 0.055


def turned(radius, stem, top):
    """A piece's profile: a foot, a waisted stem up to `stem` = (radius, height), and what `top` puts on it."""
    neck, height = stem
    foot = [line(0.0, 0.0, radius, 0.0), arc(radius, 0.004, 0.004, -90.0, 90.0, 5), line(radius, 0.008, radius * 0.82, 0.011)]
    body = bezier((radius * 0.82, 0.011), (radius * 0.8, 0.022), (neck, 0.024), (neck, height), 8)
    collar = [line(neck, height, neck * 1.7, height), arc(neck * 1.7, height + 0.002, 0.002, -90.0, 90.0, 3)]
    return foot + [body] + collar + [line(neck * 1.7, height + 0.004, *top[0][0][:2])] + top


def ball(centre, radius, start=-60.0, end=90.0):
    return [arc(0.0, centre, radius, start, end, 10)]


def crowned(low, high, wide):
    """A cup that opens upwards, closed by a shallow dome with a knob."""
    knob = 0.005
    cup = bezier((0.0085, low), (0.009, low + 0.012), (wide * 0.8, low + 0.014), (wide, high), 6)
    dome = bezier((wide * 0.86, high), (wide * 0.6, high + 0.006), (knob, high + 0.006), (knob * 0.8, high + 0.006), 5)
    return [cup, line(wide, high, wide * 0.86, high), dome, arc(0.0, high + 0.009, knob, -36.8699, 90.0, 6)]


def rook_top(low, high):
    wide, inner, floor = 0.0135, 0.0095, 0.007
    return [line(0.0105, low, wide, low + 0.006), line(wide, low + 0.006, wide, high), line(wide, high, inner, high),
            line(inner, high, inner, high - floor), line(inner, high - floor, 0.0, high - floor)]


def pieces():
    """Name to shape. The king's cross and the knight's head, which no lathe makes, are left out: there are no knights."""
    profiles = {
        "pawn": turned(0.0145, (0.0055, 0.031), ball(0.0435, 0.0105)),
        "rook": turned(0.0175, (0.0095, 0.038), rook_top(0.043, 0.058)),
        "bishop": turned(0.0165, (0.0058, 0.046), [bezier((0.006, 0.05), (0.0135, 0.054), (0.0115, 0.066), (0.003, 0.0715), 8),
                                                   arc(0.0, 0.0745, 0.004, -45.0, 90.0, 5)]),
        "queen": turned(0.019, (0.0078, 0.058), crowned(0.063, 0.083, 0.0145)),
        "king": turned(0.0195, (0.0085, 0.066), crowned(0.071, 0.092, 0.0135)),
    }
    return {name: lathe(profile, 24) for name, profile in profiles.items()}


GAME = [  # side, piece, file, rank: a late middle game, white (glass) near the camera
    ("glass", "king", 6, 0), ("glass", "rook", 3, 0), ("glass", "queen", 4, 2), ("glass", "bishop", 2, 3), ("glass", "pawn", 5, 1),
    ("glass", "pawn", 6, 1), ("glass", "pawn", 7, 2), ("glass", "pawn", 1, 2), ("metal", "king", 6, 7), ("metal", "rook", 5, 7),
    ("metal", "queen", 3, 5), ("metal", "bishop", 5, 4), ("metal", "pawn", 4, 4), ("metal", "pawn", 6, 6), ("metal", "pawn", 7, 6),
    ("metal", "pawn", 1, 5), ("wood", "pawn", 9, 2), ("wood", "rook", 9, 4), ("wood", "bishop", -2, 5),
]


def chess():
    """Glass against brass on a varnished board; three wooden pieces stand beside it."""
    scene = Scene()
    grain = scene.texture(images.wood(128, 64, 3, [(70, 42, 26), (128, 82, 50), (176, 124, 80)]))
    scene.add("table", quad((-1.2, -0.022, 0.9), (2.4, 0, 0), (0, 0, -2.4)), scene.diffuse("table", (1, 1, 1), base_texture=grain), uv_scale=(4.0, 4.0))
    scene.add("wall", quad((-2.0, -0.6, -1.5), (4.0, 0, 0), (0, 2.2, 0)), scene.diffuse("wall", (0.34, 0.40, 0.44)))
    edge = 4 * SQUARE
    varnish = scene.material("walnut", (0.16, 0.085, 0.045), 0.0, 0.35)
    scene.add("frame", box((-edge - 0.025, -0.0215, -edge - 0.025), (edge + 0.025, -0.001, edge + 0.025)), varnish)
    pale, dark = Mesh(), Mesh()
    for i in range(8):
        for j in range(8):
            tile = quad((-edge + SQUARE * i, 0.0, edge - SQUARE * j), (SQUARE, 0, 0), (0, 0, -SQUARE))
            (pale if (i + j) % 2 else dark).merge(tile)
    scene.add("pale_squares", pale, scene.material("maple", (0.70, 0.54, 0.35), 0.0, 0.35))
    scene.add("dark_squares", dark, varnish)
    looks = {"glass": scene.glass("glass", 1.5, (0.86, 0.96, 0.93), 0.08), "satin": scene.metal("satin_brass", (0.89, 0.72, 0.40), 0.4),
             "metal": scene.metal("polished_brass", (0.89, 0.72, 0.40)), "wood": scene.diffuse("beech", (0.58, 0.36, 0.19))}
    shapes, meshes = pieces(), {}
    for i, (side, piece, column, row) in enumerate(GAME):
        look = "satin" if side == "metal" and piece == "pawn" else side
        if (look, piece) not in meshes:
            meshes[look, piece] = scene.mesh(f"{look}_{piece}", [(shapes[piece], looks[look])])
        level = 0.0003 if 0 <= column < 8 else -0.0217
        at = (-edge + SQUARE * (column + 0.5), level, edge - SQUARE * (row + 0.5))
        scene.place(f"{side}_{piece}_{i}", meshes[look, piece], placed(at))
    scene.add("lamp", quad((-0.75, 0.85, -0.55), (0.16, 0, 0), (0, 0, 0.16)), scene.emitter("lamp", (150.0, 132.0, 104.0)))
    scene.add("window", quad((1.1, 0.15, -0.9), (0.0, 0, 1.0), (0, 0.9, 0)), scene.emitter("window", (2.6, 3.2, 4.0)))
    scene.camera("main", (0.10, 0.27, 0.47), (-0.005, 0.015, -0.01), 36.0, 4 / 3)
    return scene


# ---- kitchen ----

WIDE, BACK, FRONT, HIGH = 2.1, -1.7, 2.1, 2.6  # half width, far and near wall, ceiling
COUNTER = 0.9


def kitchen_room(scene):
    plaster = scene.diffuse("plaster", (0.76, 0.73, 0.68))
    grain = scene.texture(images.wood(128, 64, 4, [(84, 52, 32), (150, 104, 66), (198, 150, 104)]))
    boards = scene.material("floorboards", (1, 1, 1), 0.0, 0.45, base_texture=grain)
    scene.add("floor", quad((-WIDE, 0, FRONT), (2 * WIDE, 0, 0), (0, 0, BACK - FRONT)), boards, uv_scale=(3.0, 3.0))
    walls = box((-WIDE - 0.1, HIGH, BACK - 0.1), (WIDE + 0.1, HIGH + 0.1, FRONT + 0.1))
    for low, high in (((-WIDE - 0.1, 0, BACK), (-WIDE, HIGH, FRONT)), ((WIDE, 0, BACK), (WIDE + 0.1, HIGH, FRONT)),
                      ((-WIDE - 0.1, 0, FRONT), (WIDE + 0.1, HIGH, FRONT + 0.1)), ((-WIDE - 0.1, 0, BACK - 0.1), (-0.55, HIGH, BACK)),
                      ((0.55, 0, BACK - 0.1), (WIDE + 0.1, HIGH, BACK)), ((-0.55, 0, BACK - 0.1), (0.55, 1.15, BACK)),
                      ((-0.55, 2.1, BACK - 0.1), (0.55, HIGH, BACK))):
        walls.merge(box(low, high))
    scene.add("walls", walls, plaster)
    bars = box((-0.02, 1.15, BACK - 0.07), (0.02, 2.1, BACK - 0.03)).merge(box((-0.55, 1.61, BACK - 0.07), (0.55, 1.64, BACK - 0.03)))
    scene.add("window_bars", bars, scene.diffuse("white_paint", (0.8, 0.8, 0.78)))
    scene.add("window", quad((-0.55, 1.15, BACK - 0.09), (1.1, 0, 0), (0, 0.95, 0)), scene.emitter("sky", (10.0, 11.6, 13.4)))
    tiles = Mesh()
    for i in range(14):
        for j in range(2):
            tiles.merge(box((-WIDE + 0.005 + 0.3 * i, 0.905 + 0.12 * j, BACK), (-WIDE + 0.295 + 0.3 * i, 1.02 + 0.12 * j, BACK + 0.008)))
    scene.add("tiles", tiles, scene.material("glazed_tiles", (0.30, 0.48, 0.46), 0.0, 0.35))


def kitchen_cabinets(scene):
    paint, steel = scene.material("cabinet_paint", (0.23, 0.33, 0.36), 0.0, 0.5), scene.metal("brushed_steel", (0.62, 0.61, 0.59), 0.4)
    body = box((-WIDE, 0.08, BACK), (-0.3, 0.86, BACK + 0.56)).merge(box((0.3, 0.08, BACK), (WIDE, 0.86, BACK + 0.56)))
    body.merge(box((-0.3, 0.08, BACK), (0.3, 0.62, BACK + 0.56))).merge(box((-0.3, 0.62, BACK + 0.54), (0.3, 0.86, BACK + 0.56)))
    handles = Mesh()
    for i in range(7):
        x = -WIDE + 0.6 * i
        body.merge(box((x + 0.01, 0.1, BACK + 0.56), (x + 0.59, 0.85, BACK + 0.58)))
        handles.merge(box((x + 0.2, 0.76, BACK + 0.6), (x + 0.4, 0.775, BACK + 0.615)))
    for side in (-1, 1):
        for i in range(2):
            x = side * (0.72 + 0.68 * i)
            low, high = sorted((x, x + side * 0.66))
            body.merge(box((low, 1.5, BACK), (high, 2.25, BACK + 0.34)))
            handles.merge(box((x + side * 0.05 - 0.008, 1.56, BACK + 0.35), (x + side * 0.05 + 0.008, 1.76, BACK + 0.365)))
    scene.add("cabinets", body, paint)
    scene.add("handles", handles, steel)
    stone, z = scene.material("counter_stone", (0.52, 0.50, 0.46), 0.0, 0.35), (BACK, BACK + 0.1, BACK + 0.48, BACK + 0.62)
    top = box((-WIDE, 0.86, z[0]), (-0.3, COUNTER, z[3])).merge(box((0.3, 0.86, z[0]), (WIDE, COUNTER, z[3])))
    top.merge(box((-0.3, 0.86, z[0]), (0.3, COUNTER, z[1]))).merge(box((-0.3, 0.86, z[2]), (0.3, COUNTER, z[3])))
    top.merge(box((-0.75, 0.82, 0.0), (0.95, 0.86, 0.75)))
    scene.add("counters", top, stone)
    island = box((-0.6, 0.0, 0.1), (0.8, 0.82, 0.65))
    scene.add("island", island, paint)
    sink = box((-0.29, 0.66, z[1] + 0.01), (0.29, COUNTER - 0.002, z[2] - 0.01), inside=True)
    sink.triangles = [t for t in sink.triangles if min(sink.positions[i][1] for i in t) < 0.8]
    scene.add("sink", sink, steel)

    def spout(t):
        angle = math.pi * max(0.0, t - 0.4) / 0.6
        return (0.0, COUNTER + 0.55 * min(t, 0.4) + 0.09 * math.sin(angle), BACK + 0.06 + 0.09 * (1.0 - math.cos(angle)))
    scene.add("tap", tube(spout, lambda t: 0.013, 16, 12), scene.metal("chrome", (0.78, 0.78, 0.80)))


def kitchen_things(scene):
    pot = [line(0.0, 0.0, 0.12, 0.0), arc(0.12, 0.015, 0.015, -90.0, 0.0, 3), line(0.135, 0.015, 0.135, 0.16), line(0.135, 0.16, 0.13, 0.16),
           line(0.13, 0.16, 0.13, 0.01), line(0.13, 0.01, 0.0, 0.01)]
    shape = lathe(pot, 32)
    steel = scene.mesh("steel_pot", [(shape, scene.metal("polished_steel", (0.78, 0.77, 0.75)))])
    copper = scene.mesh("copper_pot", [(shape, scene.metal("satin_copper", (0.90, 0.52, 0.36), 0.35))])
    scene.place("steel_pot", steel, placed((1.15, COUNTER + 0.001, BACK + 0.32)))
    scene.place("copper_pot", copper, placed((1.58, COUNTER + 0.001, BACK + 0.30)))
    scene.place("island_pot", steel, placed((0.62, 0.861, 0.3)))
    tumbler = [line(0.0, 0.0, 0.03, 0.0), line(0.03, 0.0, 0.037, 0.11), line(0.037, 0.11, 0.034, 0.11), line(0.034, 0.11, 0.0275, 0.012),
               line(0.0275, 0.012, 0.0, 0.012)]
    glass = scene.mesh("tumbler", [(lathe(tumbler, 32), scene.glass("glass", 1.5, (0.90, 0.97, 0.95), 0.2))])
    for i, (x, z) in enumerate([(0.12, 0.42), (0.27, 0.56), (0.22, 0.26)]):
        scene.place(f"tumbler_{i}", glass, placed((x, 0.861, z)))
    bowl = [line(0.0, 0.0, 0.06, 0.0), bezier((0.06, 0.0), (0.12, 0.01), (0.16, 0.05), (0.17, 0.09), 6), line(0.17, 0.09, 0.162, 0.09),
            bezier((0.162, 0.09), (0.15, 0.055), (0.11, 0.02), (0.0, 0.012), 6)]
    scene.add("bowl", lathe(bowl, 32, (-0.35, 0.861, 0.4)), scene.material("glazed_clay", (0.70, 0.66, 0.58), 0.0, 0.4))
    fruit = sphere((0.0, 0.0, 0.0), 0.042, 10, 16)
    skins = [scene.material(name, colour, 0.0, 0.45) for name, colour in (("orange", (0.80, 0.30, 0.03)), ("apple", (0.50, 0.05, 0.04)))]
    kinds = [scene.mesh(f"fruit_{i}", [(fruit, skin)]) for i, skin in enumerate(skins)]
    for i, (x, y, z) in enumerate([(-0.4, 0.93, 0.36), (-0.3, 0.93, 0.38), (-0.36, 0.93, 0.46), (-0.35, 0.99, 0.4)]):
        scene.place(f"fruit_{i}", kinds[i % 2], placed((x, y, z)))
    shade = lathe([line(0.15, 0.0, 0.03, 0.14), line(0.03, 0.14, 0.0, 0.14)], 24)
    cord = box((-0.004, 0.14, -0.004), (0.004, HIGH - 1.75, 0.004))
    bulb = sphere((0.0, 0.045, 0.0), 0.035, 6, 10)
    lamp = scene.mesh("pendant", [(shade, scene.diffuse("enamel", (0.62, 0.16, 0.10))), (cord, scene.diffuse("cord", (0.1, 0.1, 0.1))),
                                  (bulb, scene.emitter("bulb", (280.0, 222.0, 145.0)))])
    for i, x in enumerate((-0.35, 0.45)):
        scene.place(f"pendant_{i}", lamp, placed((x, 1.75, 0.38)))


def kitchen():
    """A closed room: a window over the sink, two pendant lamps, satin and polished metal, glass, glazed and varnished things."""
    scene = Scene()
    kitchen_room(scene)
    kitchen_cabinets(scene)
    kitchen_things(scene)
    scene.camera("main", (0.95, 1.55, 1.95), (-0.05, 1.05, -0.8), 52.0, 4 / 3)
    return scene
