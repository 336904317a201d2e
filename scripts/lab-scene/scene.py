"""The still life of the lab: built in Blender from nothing but numbers.

Lengths are in decimeters (the table is 1 m across), +z is up, the table top is z = 0.
Materials are diffuse but for the vase, which is mildly glossy: a capture of mirrors would teach the wrong lesson.
Every pattern varies over the surface (random per tile, plank or cell), since repeated texture makes false matches.
"""

import math
import random

import bpy
from mathutils import Vector

from materials import (
    ball_patches,
    book_cloth,
    fruit,
    glaze,
    leaf,
    painting,
    paper_edges,
    patchwork,
    plain,
    planks,
    spotted,
    tiles,
)
from shapes import book, box, ellipsoid, label, new_object, smooth_profile, turned


def build():
    """Makes the scene in an empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    rng = random.Random(20)

    # Courtyard: a tiled floor, and walls that leave the sky out of every photo: splats cannot place a blank sky.
    floor_z, half, wall = -6.5, 21.0, 14.0
    floor = tiles("floor", (2.6, 2.6), ["#b9a78c", "#a38f74", "#c6b79f", "#938570", "#b09a86", "#9c7f66"],
                  "#6f6354", 1.0)
    box("floor", (2 * half, 2 * half, 0.2), floor, (0, 0, floor_z - 0.1), bevel=0)
    walls = tiles("wall", (3.4, 1.5), ["#cfa68c", "#c39a82", "#d9b69a", "#c8a490", "#b8937e", "#d3b29c"],
                  "#d2c3b2", 2.0, "wall")
    for k in range(4):
        a = k * math.pi / 2
        box("wall %d" % k, (2 * half, 0.3, wall), walls, (half * math.cos(a), half * math.sin(a), floor_z + wall / 2),
            a + math.pi / 2, bevel=0)
    palettes = [["#24405e", "#d9a441", "#e9dfc8", "#9e3d2f", "#4f7f78", "#e2c9a0", "#2e2a36"],
                ["#f0e6d0", "#51683f", "#c46f3a", "#1f4e5c", "#d9b26a", "#7d3450", "#efe0c0"],
                ["#3a3350", "#c9825b", "#e8cfa6", "#5c8a94", "#a33f3f", "#dcd7c9", "#3f5d3c"]]
    frame = plain("frame", "#4a3626")
    count = 0
    for k in range(4):
        a = k * math.pi / 2
        out, side = Vector((math.cos(a), math.sin(a), 0)), Vector((-math.sin(a), math.cos(a), 0))
        for offset in (-13.5, -4.5, 4.5, 13.5):
            size = (rng.uniform(3.4, 5.6), rng.uniform(2.6, 3.8))
            where = out * (half - 0.25) + side * (offset + rng.uniform(-1.2, 1.2))
            z = floor_z + rng.uniform(4.3, 5.6)
            picture = painting("painting %d" % count, palettes[count % 3], 3.0 + 1.7 * count)
            box("frame %d" % count, (size[0] + 0.4, 0.2, size[1] + 0.4), frame, (where.x, where.y, z),
                a + math.pi / 2, 0.03)
            where -= out * 0.12
            box("picture %d" % count, (size[0], 0.1, size[1]), picture, (where.x, where.y, z), a + math.pi / 2, 0)
            count += 1
    rug = patchwork("rug", 1.45, ["#7e3b32", "#c2a878", "#34495a", "#b5793f", "#dccdae", "#5d6b4b", "#8c5a4a"], 4.0)
    turned("rug", [(0.001, 0.0), (11.5, 0.0), (11.5, 0.09), (0.001, 0.09)], rug, (0, 0, floor_z), 128)

    # Table.
    oak = planks("oak", 1.15, 0.55, ["#6d4526", "#a87645", "#c99a66"], 5.0)
    turned("table", [(0.001, -0.42), (4.7, -0.42), (4.85, -0.35), (4.9, -0.1), (4.85, 0.0),
                     (0.001, 0.0)], oak, (0, 0, 0), 160)
    for k in range(4):
        a = k * math.pi / 2 + 0.6
        turned("leg %d" % k, smooth_profile([(0.22, floor_z), (0.3, -4.6), (0.24, -2.5), (0.36, -0.4)]), oak,
               (3.4 * math.cos(a), 3.4 * math.sin(a), 0), 32)
    quilt = patchwork("quilt", 0.52, ["#a8433a", "#e3c98f", "#2f5875", "#d98b45", "#efe5cf", "#5f7d55", "#7b4a68",
                                      "#3b3b4a"], 6.0)
    box("quilt", (5.6, 4.0, 0.05), quilt, (0.1, -0.1, 0.025), 0.22, bevel=0.02)
    on = 0.05

    # Books, askew, with a mug on top.
    paper, ink = paper_edges("paper", 7.0), plain("ink", "#efe2bd")
    book("atlas", (2.3, 3.1, 0.52), book_cloth("green cloth", "#2f5a4c", "#c8a95a", 8.0), paper, ink,
         (-1.75, 0.95, on), 1.35, "ATLAS")
    book("optics", (2.0, 2.8, 0.42), book_cloth("red cloth", "#8c3230", "#e0b064", 9.0), paper, ink,
         (-1.7, 0.9, on + 0.52), 1.02, "OPTICS")
    book("light", (1.8, 2.5, 0.36), book_cloth("blue cloth", "#2c4a7a", "#d8d2c0", 10.0), paper, ink,
         (-1.75, 1.0, on + 0.94), 1.62, "LIGHT")
    clay = spotted("stoneware", ["#b9a88d", "#d3c4a8", "#e0d5bd"], ["#5a4636", "#3f5f66", "#8f4f33"],
                   11.0, 5.0, 8.0, 0.2, 0.55)
    stack = on + 1.30
    turned("mug", [(0.001, 0), (0.42, 0), (0.46, 0.05), (0.5, 0.5), (0.5, 1.0), (0.47, 1.02), (0.44, 1.0), (0.43, 0.12),
                   (0.001, 0.1)], clay, (-2.4, 1.05, stack), 96)
    vertices, faces = [], []
    for i in range(33):  # the handle: half a ring, a little taller than wide
        a = math.pi * (i / 32 - 0.5)
        for k in range(16):
            b = 2 * math.pi * k / 16
            r = 0.27 + 0.065 * math.cos(b)
            vertices.append((0.49 + r * math.cos(a), 0.07 * math.sin(b), 0.53 + 1.15 * r * math.sin(a)))
    for i in range(32):
        for k in range(16):
            p, q = i * 16 + k, i * 16 + (k + 1) % 16
            faces.append((p, q, q + 16, p + 16))
    new_object("handle", vertices, faces, clay, (-2.4, 1.05, stack), -2.2)

    # Vase.
    turned("vase", smooth_profile([(0.001, 0.0), (0.62, 0.0), (0.72, 0.12), (1.02, 0.85), (1.0, 1.5), (0.62, 2.15),
                                   (0.4, 2.6), (0.46, 2.95), (0.62, 3.1), (0.56, 3.1), (0.36, 2.7), (0.3, 2.4),
                                   (0.001, 2.3)], 12), glaze("glaze", 12.0), (0.95, 1.35, on), 128)

    # Succulent in a clay pot: leaves set at the golden angle.
    terracotta = spotted("terracotta", ["#9c5737", "#b76d47", "#c98660"], ["#e0b490", "#7a4029", "#d9d0c0"],
                         13.0, 3.4, 7.0, 0.3)
    pot = (2.15, -0.75, 0.0)
    turned("pot", smooth_profile([(0.001, 0.0), (0.5, 0.0), (0.56, 0.1), (0.74, 0.85), (0.86, 0.88), (0.88, 1.12),
                                  (0.78, 1.14), (0.74, 0.98), (0.001, 0.95)], 8), terracotta, pot, 96)
    green = [leaf("leaf %d" % k, 14.0 + 2.3 * k) for k in range(3)]
    for k in range(44):
        ring = math.sqrt((k + 1.5) / 45)
        a = k * 2.399963
        lean = 0.25 + 1.0 * ring
        length = 0.26 + 0.36 * ring
        reach = 0.1 + 0.62 * ring
        ellipsoid("leaf %d" % k, (0.17 + 0.04 * ring, 0.075, length), green[k % 3],
                  (pot[0] + reach * math.cos(a), pot[1] + reach * math.sin(a),
                   1.18 + 0.62 * (1 - ring) + 0.1 * math.sin(k)),
                  a + math.pi / 2, (lean, 0), rows=20, columns=28)

    # Fruit, ball, letter blocks.
    turned("pear", smooth_profile([(0.001, 0.02), (0.3, 0.0), (0.58, 0.3), (0.6, 0.58), (0.42, 0.95), (0.27, 1.25),
                                   (0.18, 1.42), (0.001, 1.46)], 10),
           fruit("pear skin", ["#8a8f3a", "#c2bd55", "#d9cf86"], "#6d4b24", 21.0), (-0.35, -1.55, on), 96)
    turned("stalk", [(0.045, 0.0), (0.035, 0.2), (0.05, 0.38), (0.001, 0.38)], plain("stalk", "#4c3521"),
           (-0.35, -1.55, on + 1.42), 16)
    turned("apple", smooth_profile([(0.001, 0.12), (0.25, 0.0), (0.55, 0.28), (0.62, 0.62), (0.48, 0.98), (0.2, 1.02),
                                    (0.001, 0.86)], 10),
           fruit("apple skin", ["#8f2a24", "#c1503a", "#dfb25e"], "#ecd9a0", 22.0, streak=True), (0.7, -1.95, on), 96)
    ellipsoid("orange", (0.58, 0.58, 0.55),
              fruit("orange peel", ["#c9651d", "#e08a2e", "#eaa84e"], "#9b4513", 23.0, bump_scale=9.0),
              (0.35, -0.75, on + 0.54))
    ellipsoid("lemon", (0.66, 0.44, 0.43),
              fruit("lemon peel", ["#c9a72c", "#e3c94a", "#efe08a"], "#8d8a2a", 24.0, bump_scale=10.0),
              (1.55, -2.35, 0.42), 0.9)
    ellipsoid("ball", (0.85, 0.85, 0.85), ball_patches("ball", 25.0), (-2.15, -1.45, 0.88))
    letter_ink = plain("letter", "#7a2f28")
    block_woods = [planks("block %d" % k, 0.6, 0.8, c, 26.0 + k, "#a07a4e") for k, c in enumerate((
        ["#b98f5a", "#d9b884", "#e8cfa2"], ["#9a6b40", "#c39363", "#d8b184"], ["#a9824e", "#d0a873", "#e2c391"]))]
    blocks = (("A", (-0.75, -0.35, on + 0.36), 0.5), ("B", (-0.55, 0.55, on + 0.36), -0.3),
              ("C", (-0.62, -0.30, on + 1.06), -0.15))
    for k, (letter, place, turn) in enumerate(blocks):
        size = 0.7
        cube = box("block " + letter, (size, size, size), block_woods[k], place, turn, 0.05)
        for side in range(4):
            b = side * math.pi / 2
            label(letter, 0.55, letter_ink, (0.352 * math.cos(b), 0.352 * math.sin(b), 0),
                  (math.pi / 2, 0, b + math.pi / 2), parent=cube)
        label(letter, 0.55, letter_ink, (0, 0, 0.352), (0, 0, 0), parent=cube)

    # Pebbles along the rim: small things in front of one another.
    stones = [spotted("stone %d" % k, g, c, 31.0 + 1.9 * k, 5.0, 8.0, 0.4, cover=0.6) for k, (g, c) in enumerate((
        (["#6b6a66", "#8b8982", "#a9a69c"], ["#e0dbd0", "#3d3b38", "#b08d6a"]),
        (["#7c5f4a", "#9e8066", "#bfa588"], ["#e8dcc4", "#4d3526", "#8c3f2c"]),
        (["#8f9a96", "#aeb8b0", "#cdd2c6"], ["#4a5a5c", "#e9e5d8", "#7d6a4d"])))]
    placed = []
    while len(placed) < 34:
        a, r = rng.uniform(0, 2 * math.pi), rng.uniform(3.05, 4.55)
        size = rng.uniform(0.13, 0.34)
        x, y = r * math.cos(a), r * math.sin(a)
        if any(math.hypot(x - u, y - v) < size + s + 0.06 for u, v, s in placed):
            continue
        placed.append((x, y, size))
        radii = (size, size * rng.uniform(0.65, 0.95), size * rng.uniform(0.45, 0.75))
        ellipsoid("pebble %d" % len(placed), radii, stones[len(placed) % 3], (x, y, radii[2] * 0.9),
                  rng.uniform(0, 6.3), rough=0.12, rng=rng, rows=24, columns=36)

    light()


def light():
    """A bright overcast sky over the courtyard, a window-sized lamp for direction, a weak one opposite."""
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.86, 0.93, 1.0, 1.0)
    background.inputs["Strength"].default_value = 0.62
    for name, place, size, power, color in (("window", (9.0, -5.0, 13.0), 5.0, 2300.0, (1.0, 0.93, 0.82)),
                                             ("fill", (-10.0, 8.0, 11.0), 8.0, 520.0, (0.85, 0.92, 1.0))):
        lamp = bpy.data.lights.new(name, "AREA")
        lamp.shape, lamp.size, lamp.energy, lamp.color = "DISK", size, power, color
        thing = bpy.data.objects.new(name, lamp)
        thing.location = place
        thing.rotation_euler = (-Vector(place)).to_track_quat("-Z", "Y").to_euler()
        bpy.context.collection.objects.link(thing)
