"""Materials of the lab's still life: patterns that vary over the surface, since repeated texture makes false matches."""

import bpy


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
