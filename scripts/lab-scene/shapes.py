"""Shapes of the lab's still life, lengths in decimeters."""

import math

import bpy
from mathutils import Vector


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
