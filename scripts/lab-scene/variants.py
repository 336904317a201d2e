"""Renders small captures that differ in what a model needs to explain them. See README.md.

    variants.py --out build/variants --kind matte glossy outdoors exposure blurred

Each kind becomes OUT/KIND with images/ and a COLMAP text model with exact cameras, ready for import-colmap. The lab's
still life is the subject of all of them:

- matte: no highlights; a color that does not depend on the view explains it.
- glossy: every surface on the table is polished.
- outdoors: no courtyard; what lies behind the rug is a landscape at infinity, where no surface point is.
- exposure: the matte photos, each with its own gain (within one stop) and a slightly different white balance, in
  linear light.
- blurred: the matte photos out of focus, so that the finest octave holds nothing.
"""

import argparse
import os
import random
import shutil
import sys

import bpy
import numpy as np
from PIL import Image, ImageFilter

import render
import scene

WIDTH, HEIGHT, VIEWS, POINTS = 320, 240, 24, 3000
SKY_WIDTH, SKY_HEIGHT = 2048, 1024
DERIVED = ("exposure", "blurred")


def principled():
    for material in bpy.data.materials:
        if material.use_nodes and "Principled BSDF" in material.node_tree.nodes:
            yield material, material.node_tree.nodes["Principled BSDF"]


def fix(node, tree, name, value):
    for link in list(node.inputs[name].links):
        tree.links.remove(link)
    node.inputs[name].default_value = value


def matte():
    for material, node in principled():
        fix(node, material.node_tree, "Roughness", 1.0)
        fix(node, material.node_tree, "Specular IOR Level", 0.0)


def glossy():
    for material, node in principled():
        if not material.name.startswith(("wall", "floor", "painting", "frame")):
            fix(node, material.node_tree, "Roughness", 0.18)
            fix(node, material.node_tree, "Specular IOR Level", 0.9)


def value_noise(rng, height, width, cells):
    """Smooth noise in [0, 1] on a panorama that wraps round; cells along the width."""
    rows = max(2, cells // 2)
    grid = rng.random((rows + 1, cells))
    y, x = np.linspace(0, rows, height, endpoint=False), np.linspace(0, cells, width, endpoint=False)
    y0, x0 = y.astype(int), x.astype(int)
    ty, tx = (y - y0)[:, None], (x - x0)[None, :]
    ty, tx = ty * ty * (3 - 2 * ty), tx * tx * (3 - 2 * tx)
    x1 = (x0 + 1) % cells
    top = grid[y0][:, x0] * (1 - tx) + grid[y0][:, x1] * tx
    bottom = grid[y0 + 1][:, x0] * (1 - tx) + grid[y0 + 1][:, x1] * tx
    return top * (1 - ty) + bottom * ty


def fractal(rng, cells, octaves):
    total = sum(0.55 ** k * value_noise(rng, SKY_HEIGHT, SKY_WIDTH, cells << k) for k in range(octaves))
    return total / sum(0.55 ** k for k in range(octaves))


def landscape():
    """A panorama in linear light, row 0 at the zenith: clouds, two ridges, fields."""
    rng = np.random.default_rng(5)
    elevation = 90 - 180 * (np.arange(SKY_HEIGHT)[:, None] + 0.5) / SKY_HEIGHT
    clouds = np.clip((fractal(rng, 12, 5) - 0.45) * 5, 0, 1)[..., None]
    low, high = np.array([0.72, 0.8, 0.88]), np.array([0.16, 0.34, 0.72])
    height = np.clip(elevation / 60, 0, 1)[..., None]
    picture = (low + (high - low) * height) * (1 - clouds) + 0.85 * clouds
    for top, wobble, dark, light in ((9.0, 9.0, (0.13, 0.19, 0.27), (0.3, 0.36, 0.4)),
                                     (2.0, 6.0, (0.05, 0.09, 0.03), (0.26, 0.3, 0.1))):
        ridge = top + wobble * (fractal(rng, 10, 5)[SKY_HEIGHT // 2][None, :] - 0.5)
        shade = np.clip(fractal(rng, 48, 4) * 2.2 - 0.6, 0, 1)[..., None]
        color = np.array(dark) + (np.array(light) - np.array(dark)) * shade
        picture = np.where((elevation < ridge)[..., None], color, picture)
    fields = value_noise(rng, SKY_HEIGHT, SKY_WIDTH, 96)
    palette = np.array([(0.3, 0.22, 0.07), (0.1, 0.2, 0.04), (0.36, 0.31, 0.14), (0.17, 0.25, 0.08), (0.22, 0.13, 0.06)])
    patches = palette[np.clip((fields * 5).astype(int), 0, 4)] * (0.75 + 0.5 * fractal(rng, 64, 3))[..., None]
    return np.where((elevation < -4)[..., None], patches, picture)


def outdoors():
    for thing in list(bpy.data.objects):
        if thing.name.startswith(("wall", "floor", "frame", "picture")):
            bpy.data.objects.remove(thing, do_unlink=True)
    matte()
    pixels = np.ones((SKY_HEIGHT, SKY_WIDTH, 4), np.float32)
    pixels[..., :3] = landscape()[::-1]  # Blender's row 0 is the bottom
    image = bpy.data.images.new("landscape", SKY_WIDTH, SKY_HEIGHT, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    tree = bpy.context.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    background = tree.nodes["Background"]
    tree.links.new(node.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.8


def shoot(kind, out, samples, threads):
    scene.build()
    {"matte": matte, "glossy": glossy, "outdoors": outdoors}[kind]()
    heights = (6.0, 20.0) if kind == "outdoors" else (22.0, 35.0)
    poses = render.walk(VIEWS, -126.0, 24.0, heights, 10.4, 7)
    render.exact(os.path.join(out, kind), render.set_up(WIDTH, HEIGHT, samples, threads), poses, POINTS)


def to_linear(v):
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def to_srgb(v):
    v = np.clip(v, 0, 1)
    return np.where(v <= 0.0031308, v * 12.92, 1.055 * v ** (1 / 2.4) - 0.055)


def derive(kind, out):
    """Photos changed after the fact; the cameras stay."""
    rng = random.Random(31)
    source, target = os.path.join(out, "matte"), os.path.join(out, kind)
    os.makedirs(os.path.join(target, "images"), exist_ok=True)
    shutil.copytree(os.path.join(source, "sparse"), os.path.join(target, "sparse"), dirs_exist_ok=True)
    for file in sorted(os.listdir(os.path.join(source, "images"))):
        with Image.open(os.path.join(source, "images", file)) as im:
            photo = im.convert("RGB")
        if kind == "blurred":
            photo = photo.filter(ImageFilter.GaussianBlur(2.0))
        else:
            stops, warm = rng.uniform(-0.5, 0.5), rng.uniform(-0.08, 0.08)
            gain = 2.0 ** (np.array([stops + warm, stops, stops - warm]) - 0.25)
            linear = to_linear(np.asarray(photo, float) / 255) * gain
            photo = Image.fromarray(np.round(to_srgb(linear) * 255).astype(np.uint8))
        photo.save(os.path.join(target, "images", file))


def main():
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("--out", required=True)
    p.add_argument("--kind", nargs="+", default=["matte", "glossy", "outdoors", "exposure", "blurred"],
                   choices=["matte", "glossy", "outdoors", "exposure", "blurred"])
    p.add_argument("--samples", type=int, default=24, help="per pixel, before denoising")
    p.add_argument("--threads", type=int, default=0)
    a = p.parse_args()
    for kind in sorted(a.kind, key=lambda k: k in DERIVED):
        if kind in DERIVED:
            derive(kind, a.out)
        else:
            shoot(kind, a.out, a.samples, a.threads)


if __name__ == "__main__":
    sys.exit(main())
