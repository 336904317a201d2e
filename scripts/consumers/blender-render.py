"""Renders a relightable .glb with its environment in Blender's Cycles, as a view of a capture sees it.

    python blender-render.py MESH.glb ENVIRONMENT.exr CAPTURE.json VIEW OUT.exr [SAMPLES [BOUNCES]]

Needs the package bpy. The picture is linear, without a view transform: photo units, as `relight` writes them.
"""

import json
import math
import sys

import bpy
from mathutils import Matrix, Quaternion, Vector


def world_from_camera(view):
    """The pose as Blender's cameras have it: +x right, +y up, looking along -z."""
    pose = view["camera_from_world"]
    rotation = Quaternion(pose["rotation_wxyz"]).to_matrix()
    center = -(rotation.transposed() @ Vector(pose["translation"]))
    axes = rotation.transposed() @ Matrix(((1, 0, 0), (0, -1, 0), (0, 0, -1)))
    return axes, center


def blender_from_world(mesh):
    """The importer turns glTF's (x, y, z) into (x, -z, y); the file says how the world became glTF."""
    rows = mesh["gltf_from_world"]
    gltf_from_world = Matrix([list(row)[:3] for row in rows])
    return Matrix(((1, 0, 0), (0, 0, -1), (0, 1, 0))) @ gltf_from_world


def add_camera(scene, capture, view, to_blender):
    model = capture["cameras"][view["camera"]]
    width, height = model["width"], model["height"]
    params = model["params"]
    fx, fy, cx, cy = params if len(params) == 4 else (params[0], *params)
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "HORIZONTAL"
    camera.sensor_width = 36
    camera.lens = 36 * fx / width
    camera.shift_x = (width / 2 - cx) / width
    camera.shift_y = (cy - height / 2) / width
    camera.clip_start, camera.clip_end = 1e-3, 1e4
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.pixel_aspect_y = fx / fy
    node = bpy.data.objects.new("camera", camera)
    axes, center = world_from_camera(view)
    scale = to_blender.determinant() ** (1 / 3)
    node.matrix_world = Matrix.Translation(to_blender @ center) @ ((1 / scale) * to_blender @ axes).to_4x4()
    scene.collection.objects.link(node)
    scene.camera = node


def add_light(scene, path):
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    scene.world = world
    nodes, links = world.node_tree.nodes, world.node_tree.links
    image = nodes.new("ShaderNodeTexEnvironment")
    image.image = bpy.data.images.load(path)
    image.image.colorspace_settings.name = "Linear Rec.709"
    links.new(image.outputs["Color"], nodes["Background"].inputs["Color"])


def main():
    glb, light, capture_path, name, out, *rest = sys.argv[1:]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=glb)
    scene = bpy.context.scene
    with open(capture_path, encoding="utf-8") as file:
        capture = json.load(file)
    view = next(view for view in capture["views"] if view["name"] == name)
    mesh = next(item for item in scene.objects if item.type == "MESH")
    owner = mesh if "gltf_from_world" in mesh else mesh.parent
    add_camera(scene, capture, view, blender_from_world(owner))
    add_light(scene, light)
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = int(rest[0]) if rest else 64
    scene.cycles.use_denoising = True
    scene.cycles.max_bounces = int(rest[1]) if len(rest) > 1 else 4
    scene.cycles.sample_clamp_indirect = 0
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 1.0
    scene.view_settings.view_transform = "Raw"
    scene.view_settings.look = "None"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = out
    bpy.ops.render.render(write_still=True)
    radians = math.degrees(2 * math.atan(18 / scene.camera.data.lens))
    print(f"rendered {name}: {len(mesh.data.polygons)} triangles, {radians:.1f} degrees across")


main()
