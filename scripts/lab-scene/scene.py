"""The still life of the lab: geometry, materials and light, built in Blender from nothing but numbers.

Lengths are in decimeters (the table is 1 m across), +z is up, the table top is z = 0.
Materials are diffuse but for the vase, which is mildly glossy: a capture of mirrors would teach the wrong lesson.
Every pattern varies over the surface (random per tile, plank or cell), since repeated texture makes false matches.
"""

import math
import random

import bpy
from mathutils import Vector


def srgb(hex_color):
    """'#rrggbb' to linear RGBA, which is what shader sockets take."""
    out = []
    for i in (1, 3, 5):
        c = int(hex_color[i:i + 2], 16) / 255
        out.append(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4)
    return (*out, 1.0)


class Shader:
    """A material under construction; every method adds a node and returns its output socket."""

    def __init__(self, name, seed=0.0):
        self.material = bpy.data.materials.new(name)
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.surface = self.tree.nodes["Principled BSDF"]
        self.surface.inputs["Roughness"].default_value = 0.85
        self.surface.inputs["Specular IOR Level"].default_value = 0.15
        coordinates = self.node("ShaderNodeTexCoord").outputs["Object"]
        # Patterns are functions of position; the offset keeps equal materials on two objects from being equal.
        self.at = self.vector("ADD", coordinates, (seed * 17.3, seed * 5.1, seed * 9.7))

    def node(self, kind, **settings):
        node = self.tree.nodes.new(kind)
        for key, value in settings.items():
            setattr(node, key, value)
        return node

    def put(self, value, socket):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def vector(self, operation, a, b=None):
        node = self.node("ShaderNodeVectorMath", operation=operation)
        self.put(a, node.inputs[0])
        if b is not None:
            self.put(b, node.inputs[1])
        return node.outputs["Vector"]

    def math(self, operation, a, b=0.0):
        node = self.node("ShaderNodeMath", operation=operation)
        self.put(a, node.inputs[0])
        self.put(b, node.inputs[1])
        return node.outputs[0]

    def split(self, v):
        node = self.node("ShaderNodeSeparateXYZ")
        self.put(v, node.inputs[0])
        return node.outputs

    def join(self, x, y, z):
        node = self.node("ShaderNodeCombineXYZ")
        for value, socket in zip((x, y, z), node.inputs):
            self.put(value, socket)
        return node.outputs[0]

    def scaled(self, v, x, y, z):
        return self.vector("MULTIPLY", v, (x, y, z))

    def noise(self, scale, detail=4.0, at=None, roughness=0.55, distortion=0.0):
        node = self.node("ShaderNodeTexNoise")
        self.put(self.at if at is None else at, node.inputs["Vector"])
        node.inputs["Scale"].default_value = scale
        node.inputs["Detail"].default_value = detail
        node.inputs["Roughness"].default_value = roughness
        node.inputs["Distortion"].default_value = distortion
        return node.outputs[0]

    def voronoi(self, scale, feature="F1", output="Distance", at=None):
        node = self.node("ShaderNodeTexVoronoi", feature=feature)
        self.put(self.at if at is None else at, node.inputs["Vector"])
        node.inputs["Scale"].default_value = scale
        return node.outputs[output]

    def random(self, v):
        node = self.node("ShaderNodeTexWhiteNoise", noise_dimensions="3D")
        self.put(v, node.inputs["Vector"])
        return node.outputs["Value"]

    def ramp(self, value, stops, interpolation="LINEAR"):
        node = self.node("ShaderNodeValToRGB")
        ramp = node.color_ramp
        ramp.interpolation = interpolation
        while len(ramp.elements) < len(stops):
            ramp.elements.new(0.5)
        for element, (position, color) in zip(ramp.elements, stops):
            element.position = position
            element.color = srgb(color)
        self.put(value, node.inputs["Fac"])
        return node.outputs["Color"]

    def palette(self, value, colors):
        return self.ramp(value, [(i / len(colors), c) for i, c in enumerate(colors)], "CONSTANT")

    def mix(self, factor, a, b, blend="MIX"):
        node = self.node("ShaderNodeMix", data_type="RGBA", blend_type=blend)
        for value, socket in ((factor, node.inputs[0]), (a, node.inputs[6]), (b, node.inputs[7])):
            self.put(srgb(value) if isinstance(value, str) else value, socket)
        return node.outputs[2]

    def shade(self, color, amount, scale, detail=5.0):
        """Darkens and lightens a color with a fractal: dirt, fiber, pigment."""
        fractal = self.ramp(self.noise(scale, detail, roughness=0.65), [(0.3, "#404040"), (0.7, "#ffffff")])
        return self.mix(amount, color, fractal, "MULTIPLY")

    def done(self, color, bump=None, strength=0.3, distance=0.05, roughness=None, specular=None):
        self.put(color, self.surface.inputs["Base Color"])
        if bump is not None:
            node = self.node("ShaderNodeBump")
            node.inputs["Strength"].default_value = strength
            node.inputs["Distance"].default_value = distance
            self.put(bump, node.inputs["Height"])
            self.put(node.outputs[0], self.surface.inputs["Normal"])
        if roughness is not None:
            self.surface.inputs["Roughness"].default_value = roughness
        if specular is not None:
            self.surface.inputs["Specular IOR Level"].default_value = specular
        return self.material


# ---- materials

def planks(name, width, along, colors, seed, gap="#2a1c12"):
    """Boards side by side; every board has its own tone and grain."""
    s = Shader(name, seed)
    x, y, z = s.split(s.at)
    across = s.math("DIVIDE", x, width)
    board = s.math("FLOOR", across)
    chance = s.random(s.join(board, seed, 0.5))
    grain_at = s.join(s.math("MULTIPLY", x, 5.0),
                      s.math("ADD", s.math("MULTIPLY", y, along), s.math("MULTIPLY", board, 13.7)), z)
    grain = s.noise(1.3, 6.0, grain_at, 0.65, 0.6)
    wood = s.ramp(grain, [(0.25, colors[0]), (0.45, colors[1]), (0.6, colors[2]), (0.75, colors[1])])
    tone = s.ramp(chance, [(0.0, "#8f8478"), (0.5, "#c9bfb2"), (1.0, "#ffffff")])
    wood = s.mix(0.8, wood, tone, "MULTIPLY")
    knots = s.voronoi(0.55, at=s.join(x, s.math("MULTIPLY", y, 0.45), board))
    wood = s.mix(s.ramp(knots, [(0.07, "#ffffff"), (0.16, "#000000")]), wood, "#3b2413")
    wood = s.shade(wood, 0.35, 3.5)
    edge = s.math("ABSOLUTE", s.math("SUBTRACT", s.math("FRACT", across), 0.5))
    seam = s.math("GREATER_THAN", edge, 0.485)
    return s.done(s.mix(seam, wood, gap), bump=grain, strength=0.15)


def patchwork(name, tile, colors, seed):
    """A quilt: every patch draws a ground color, a figure color and one of two figures."""
    s = Shader(name, seed)
    x, y, _ = s.split(s.at)
    u, v = s.math("DIVIDE", x, tile), s.math("DIVIDE", y, tile)
    cell = s.join(s.math("FLOOR", u), s.math("FLOOR", v), 0.5)
    first, second = s.random(cell), s.random(s.vector("ADD", cell, (31.0, 7.0, 3.0)))
    third = s.random(s.vector("ADD", cell, (3.0, 57.0, 11.0)))
    fu = s.math("SUBTRACT", s.math("FRACT", u), 0.5)
    fv = s.math("SUBTRACT", s.math("FRACT", v), 0.5)
    au, av = s.math("ABSOLUTE", fu), s.math("ABSOLUTE", fv)
    diamond = s.math("LESS_THAN", s.math("ADD", au, av), s.math("ADD", 0.18, s.math("MULTIPLY", third, 0.3)))
    slope = s.math("SUBTRACT", s.math("MULTIPLY", third, 6.0), 3.0)
    stripes = s.math("GREATER_THAN", s.math("SINE", s.math("MULTIPLY", s.math("ADD", fu, s.math("MULTIPLY", fv, slope)),
                                                            11.0)), 0.15)
    pick = s.math("GREATER_THAN", second, 0.5)
    figure = s.math("ADD", s.math("MULTIPLY", diamond, pick),
                    s.math("MULTIPLY", stripes, s.math("SUBTRACT", 1.0, pick)))
    cloth = s.mix(figure, s.palette(first, colors), s.palette(second, colors[3:] + colors[:3]))
    seam = s.math("GREATER_THAN", s.math("MAXIMUM", au, av), 0.47)
    cloth = s.mix(seam, cloth, "#d9cdb8")
    weave = s.noise(22.0, 2.0)
    return s.done(s.shade(s.shade(cloth, 0.4, 2.2), 0.25, 14.0, 2.0), bump=weave, strength=0.3)


def spotted(name, ground, spots, seed, scale=3.0, grit=9.0, bump_strength=0.35, roughness=0.85, cover=0.45):
    """Stone, clay, paper: cells of a palette strewn on a mottled ground."""
    s = Shader(name, seed)
    base = s.ramp(s.noise(scale * 0.45, 6.0, distortion=0.8), [(0.3, ground[0]), (0.5, ground[1]), (0.7, ground[2])])
    cells = s.voronoi(scale, output="Color")
    inside = s.voronoi(scale, output="Distance")
    red = s.split(cells)[0]
    chip = s.math("MULTIPLY", s.math("LESS_THAN", inside, 0.33), s.math("LESS_THAN", s.split(cells)[1], cover))
    color = s.mix(chip, base, s.palette(red, spots))
    color = s.shade(color, 0.4, grit)
    return s.done(color, bump=s.noise(grit, 4.0), strength=bump_strength, roughness=roughness)


def book_cloth(name, color, foil, seed):
    s = Shader(name, seed)
    marble = s.noise(1.1, 6.0, distortion=2.5)
    veins = s.ramp(marble, [(0.40, "#000000"), (0.46, "#ffffff"), (0.5, "#000000"), (0.56, "#cccccc"),
                            (0.6, "#000000")])
    ground = s.mix(s.math("MULTIPLY", s.split(veins)[0], 0.75), color, foil)
    return s.done(s.shade(ground, 0.5, 5.0), bump=s.noise(26.0, 2.0), strength=0.25)


def paper_edges(name, seed):
    s = Shader(name, seed)
    sheets = s.noise(9.0, 4.0, s.scaled(s.at, 0.25, 0.25, 7.0))
    color = s.ramp(sheets, [(0.3, "#9c8a68"), (0.5, "#e0d3b4"), (0.7, "#f2e8d0")])
    return s.done(s.shade(color, 0.3, 3.0))


def glaze(name, seed):
    """The vase: cobalt brushwork in bands on off-white, under a glaze; the only glossy thing in the scene."""
    s = Shader(name, seed)
    x, y, z = s.split(s.at)
    brush = s.noise(1.7, 5.0, distortion=1.6)
    strokes = s.ramp(brush, [(0.44, "#000000"), (0.50, "#ffffff"), (0.56, "#ffffff"), (0.6, "#000000")])
    band = s.math("SINE", s.math("ADD", s.math("MULTIPLY", z, 5.2), s.math("MULTIPLY", s.noise(0.9, 2.0), 3.0)))
    rings = s.math("GREATER_THAN", band, 0.86)
    color = s.mix(s.split(strokes)[0], "#e9e4d6", "#23459a")
    color = s.mix(rings, color, "#b5532b")
    dots = s.math("LESS_THAN", s.voronoi(3.6), 0.22)
    color = s.mix(s.math("MULTIPLY", dots, 0.8), color, "#1b2c5c")
    return s.done(s.shade(color, 0.25, 4.0), roughness=0.3, specular=0.4)


def fruit(name, colors, speckle, seed, streak=False, bump_scale=14.0):
    s = Shader(name, seed)
    if streak:
        x, y, z = s.split(s.node("ShaderNodeTexCoord").outputs["Object"])
        angle = s.math("ARCTAN2", y, x)
        field = s.noise(2.0, 5.0, s.join(s.math("MULTIPLY", angle, 3.2), seed, s.math("MULTIPLY", z, 0.8)), 0.6)
    else:
        field = s.noise(1.6, 5.0, distortion=0.7)
    color = s.ramp(field, [(0.3, colors[0]), (0.5, colors[1]), (0.7, colors[2])])
    dots = s.math("LESS_THAN", s.voronoi(6.5), 0.2)
    color = s.mix(s.math("MULTIPLY", dots, 0.65), color, speckle)
    return s.done(s.shade(color, 0.3, 6.0), bump=s.voronoi(bump_scale), strength=0.25, roughness=0.6)


def leaf(name, seed):
    s = Shader(name, seed)
    field = s.noise(2.4, 5.0, distortion=1.0)
    color = s.ramp(field, [(0.28, "#355c2c"), (0.48, "#6f9c54"), (0.62, "#a9c583"), (0.75, "#5b7f62")])
    spots = s.math("LESS_THAN", s.voronoi(7.0), 0.2)
    return s.done(s.shade(s.mix(s.math("MULTIPLY", spots, 0.6), color, "#7c3f46"), 0.3, 6.0), roughness=0.7)


def ball_patches(name, seed):
    s = Shader(name, seed)
    cells = s.split(s.voronoi(1.35, output="Color"))[0]
    color = s.palette(cells, ["#c8442f", "#e8b33a", "#2f6e8e", "#efe6d2", "#4d8a54", "#7a3f78", "#df8a3c"])
    seams = s.math("LESS_THAN", s.voronoi(1.35, "DISTANCE_TO_EDGE"), 0.045)
    figures = s.ramp(s.noise(3.2, 3.0, distortion=1.2), [(0.52, "#000000"), (0.56, "#ffffff")])
    color = s.mix(s.math("MULTIPLY", s.split(figures)[0], 0.35), color, "#f4ead6")
    return s.done(s.shade(s.mix(seams, color, "#332a26"), 0.35, 7.0), bump=s.noise(20.0, 2.0), strength=0.2)


def tiles(name, tile, colors, grout, seed, plane="xy"):
    """Floor tiles or wall stones, each of its own tone, mottled, with stains and with grit of two sizes: far
    surfaces must be worth matching too, or nothing holds them in place."""
    s = Shader(name, seed)
    x, y, z = s.split(s.at)
    a, b = (x, y) if plane == "xy" else (s.math("ADD", x, y), z)
    u, v = s.math("DIVIDE", a, tile[0]), s.math("DIVIDE", b, tile[1])
    u = s.math("ADD", u, s.math("MULTIPLY", s.math("FLOOR", v), 0.5))  # laid like bricks
    chance = s.random(s.join(s.math("FLOOR", u), s.math("FLOOR", v), 0.5 + seed))
    color = s.palette(chance, colors)
    mottled = s.ramp(s.noise(0.9, 6.0, distortion=1.0), [(0.3, "#8f877c"), (0.7, "#ffffff")])
    color = s.mix(0.7, color, mottled, "MULTIPLY")
    stains = s.ramp(s.noise(0.28, 4.0, distortion=1.5), [(0.5, "#000000"), (0.62, "#ffffff")])
    color = s.mix(s.math("MULTIPLY", s.split(stains)[0], 0.4), color, "#6d5a45")
    for scale, cover, amount in ((1.7, 0.35, 0.55), (3.3, 0.4, 0.4)):
        cells = s.split(s.voronoi(scale, output="Color"))
        chip = s.math("MULTIPLY", s.math("LESS_THAN", s.voronoi(scale), s.math("MULTIPLY", cells[2], 0.42)),
                      s.math("LESS_THAN", cells[1], cover))
        chips = s.palette(cells[0], ["#efe3cf", "#5c4a3c", "#8a5a44", "#d9c7a8", "#4c5456"])
        color = s.mix(s.math("MULTIPLY", chip, amount), color, chips)
    eu = s.math("ABSOLUTE", s.math("SUBTRACT", s.math("FRACT", u), 0.5))
    ev = s.math("ABSOLUTE", s.math("SUBTRACT", s.math("FRACT", v), 0.5))
    seam = s.math("MAXIMUM", s.math("GREATER_THAN", eu, 0.5 - 0.03 / tile[0]),
                  s.math("GREATER_THAN", ev, 0.5 - 0.03 / tile[1]))
    return s.done(s.mix(seam, color, grout))


def plain(name, color, seed=0.0):
    s = Shader(name, seed)
    return s.done(s.shade(color, 0.4, 6.0))


def painting(name, colors, seed):
    """An abstract picture for the wall: layered, warped fields of color."""
    s = Shader(name, seed)
    field = s.noise(0.33, 5.0, distortion=2.2)
    step = 0.5 / len(colors)
    return s.done(s.shade(s.ramp(field, [(0.25 + i * step, c) for i, c in enumerate(colors)], "CONSTANT"), 0.35, 2.5))


# ---- geometry

def new_object(name, vertices, faces, material, location=(0, 0, 0), turn=0.0, smooth=True):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.update()
    mesh.materials.append(material)
    if smooth:
        for polygon in mesh.polygons:
            polygon.use_smooth = True
    thing = bpy.data.objects.new(name, mesh)
    thing.location = location
    thing.rotation_euler = (0, 0, turn)
    bpy.context.collection.objects.link(thing)
    return thing


def turned(name, profile, material, location, sides=96, turn=0.0):
    """A body of revolution from (radius, height) pairs."""
    vertices, faces = [], []
    for radius, height in profile:
        for k in range(sides):
            a = 2 * math.pi * k / sides
            vertices.append((radius * math.cos(a), radius * math.sin(a), height))
    for row in range(len(profile) - 1):
        for k in range(sides):
            a, b = row * sides + k, row * sides + (k + 1) % sides
            faces.append((a, b, b + sides, a + sides))
    faces.append(tuple(reversed(range(sides))))
    faces.append(tuple(range((len(profile) - 1) * sides, len(profile) * sides)))
    return new_object(name, vertices, faces, material, location, turn)


def smooth_profile(knots, steps=10):
    """Catmull-Rom through the knots, so that a few numbers draw a pot."""
    points = [knots[0]] + list(knots) + [knots[-1]]
    out = []
    for i in range(1, len(points) - 2):
        p0, p1, p2, p3 = points[i - 1:i + 3]
        for k in range(steps):
            t = k / steps
            out.append(tuple(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t * t
                                    + (3 * b - a - 3 * c + d) * t ** 3) for a, b, c, d in zip(p0, p1, p2, p3)))
    out.append(knots[-1])
    return [(max(r, 0.001), h) for r, h in out]


def box(name, size, material, location, turn=0.0, bevel=0.04):
    x, y, z = (s / 2 for s in size)
    corners = [(sx * x, sy * y, sz * z) for sz in (-1, 1) for sy in (-1, 1) for sx in (-1, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    thing = new_object(name, corners, faces, material, location, turn, smooth=False)
    if bevel:
        modifier = thing.modifiers.new("bevel", "BEVEL")
        modifier.width, modifier.segments = bevel, 3
    return thing


def ellipsoid(name, radii, material, location, turn=0.0, tilt=(0, 0), rough=0.0, rng=None, rows=40, columns=64):
    """A sphere stretched to the radii; `rough` dents it with a few random waves, which makes pebbles."""
    waves = []
    if rough:
        for _ in range(7):
            direction = Vector((rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1))) * 1.6
            waves.append((direction, rng.uniform(0, 6.28), rng.uniform(0.3, 1.0) * rough))
    vertices, faces = [], []
    for i in range(rows + 1):
        theta = math.pi * i / rows
        for k in range(columns):
            phi = 2 * math.pi * k / columns
            d = Vector((math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), -math.cos(theta)))
            scale = 1 + sum(size * math.sin(d.dot(w) + phase) for w, phase, size in waves)
            vertices.append((d.x * scale * radii[0], d.y * scale * radii[1], d.z * scale * radii[2]))
    for i in range(rows):
        for k in range(columns):
            a, b = i * columns + k, i * columns + (k + 1) % columns
            faces.append((a, b, b + columns, a + columns))
    thing = new_object(name, vertices, faces, material, location)
    thing.rotation_euler = (tilt[0], tilt[1], turn)
    return thing


def label(text, size, material, location, rotation, depth=0.01, parent=None):
    """Letters in Blender's built-in font, slightly raised."""
    curve = bpy.data.curves.new(text, "FONT")
    curve.body, curve.size, curve.extrude = text, size, depth
    curve.align_x = curve.align_y = "CENTER"
    curve.materials.append(material)
    thing = bpy.data.objects.new("label " + text, curve)
    thing.location, thing.rotation_euler = location, rotation
    thing.parent = parent
    bpy.context.collection.objects.link(thing)
    return thing


def book(name, size, cover, pages, ink, location, turn, title):
    """Two boards, a spine and a block of pages; title on the front board and on the spine."""
    x, y, z = size
    hub = bpy.data.objects.new(name, None)
    hub.location, hub.rotation_euler = location, (0, 0, turn)
    bpy.context.collection.objects.link(hub)
    board = 0.07
    parts = [
        box(name + " pages", (x - 0.16, y - 0.2, z - 2 * board), pages, (-0.02, 0, z / 2), bevel=0.02),
        box(name + " lower", (x, y, board), cover, (0, 0, board / 2), bevel=0.02),
        box(name + " upper", (x, y, board), cover, (0, 0, z - board / 2), bevel=0.02),
        box(name + " spine", (board, y, z), cover, (-x / 2, 0, z / 2), bevel=0.02),
    ]
    for part in parts:
        part.parent = hub
    label(title, 0.42, ink, (-0.1, -0.5, z), (0, 0, -math.pi / 2), parent=hub)
    label(title, z * 0.62, ink, (-x / 2 - board / 2, 0, z / 2), (math.pi / 2, 0, -math.pi / 2), parent=hub)


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
