"""Renders the lab photos and the tiny capture. See README.md for the commands."""

import argparse
import json
import math
import os
import random
import sys

import bpy
import numpy as np
from mathutils import Matrix, Vector

import scene

WIDTH, HEIGHT = 1024, 680
LENS_MM, SENSOR_MM = 34.6, 36.0   # a 35 mm lens is rarely exactly that; EXIF will say 35
PHOTOS = 24
EXPOSURE = 0.25                   # stops; the brightest paint stays below white
TINY_WIDTH, TINY_HEIGHT, TINY_VIEWS, TINY_POINTS = 96, 72, 9, 400


def look_at(eye, target, roll):
    """Camera-to-world with OpenGL axes: x right, y up, z backward."""
    z = (eye - target).normalized()
    x = Vector((0, 0, 1)).cross(z).normalized()
    y = z.cross(x)
    m = Matrix((x, y, z)).transposed() @ Matrix.Rotation(roll, 3, "Z")
    m = m.to_4x4()
    m.translation = eye
    return m


def walk(count, first_deg, last_deg, heights_deg, distance, seed):
    """Someone walks round the table and takes the pictures at alternating heights, not quite steadily."""
    rng = random.Random(seed)
    poses = []
    for k in range(count):
        step = (last_deg - first_deg) / (count - 1)
        azimuth = math.radians(first_deg + k * step + rng.uniform(-0.12, 0.12) * step)
        height = math.radians(heights_deg[k % len(heights_deg)] + rng.uniform(-1.2, 1.2))
        r = distance * rng.uniform(0.97, 1.03)
        target = Vector((rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), 0.75 + rng.uniform(-0.15, 0.15)))
        eye = Vector((0, 0, 0.75)) + r * Vector((math.cos(height) * math.cos(azimuth),
                                                 math.cos(height) * math.sin(azimuth), math.sin(height)))
        poses.append(look_at(eye, target, math.radians(rng.uniform(-1.5, 1.5))))
    return poses


def set_up(width, height, samples, threads):
    s = bpy.context.scene
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.sensor_width, data.lens = "HORIZONTAL", SENSOR_MM, LENS_MM
    data.clip_start, data.clip_end = 0.1, 200.0
    s.camera = bpy.data.objects.new("camera", data)
    bpy.context.collection.objects.link(s.camera)
    s.render.engine = "CYCLES"
    s.render.resolution_x, s.render.resolution_y, s.render.resolution_percentage = width, height, 100
    s.render.use_persistent_data = True
    s.render.image_settings.file_format = "PNG"
    s.render.image_settings.color_mode = "RGB"
    s.render.image_settings.color_depth = "8"
    s.render.dither_intensity = 0.0
    if threads:
        s.render.threads_mode, s.render.threads = "FIXED", threads
    # Plain sRGB without a film curve: linear light can be had back from the photos by the inverse sRGB curve.
    s.view_settings.view_transform, s.view_settings.look = "Standard", "None"
    s.view_settings.exposure, s.view_settings.gamma = EXPOSURE, 1.0
    c = s.cycles
    c.device, c.samples, c.use_adaptive_sampling, c.seed = "CPU", samples, False, 1
    c.max_bounces, c.diffuse_bounces, c.glossy_bounces = 4, 3, 2
    c.caustics_reflective = c.caustics_refractive = False
    c.use_denoising, c.denoiser = True, "OPENIMAGEDENOISE"
    c.denoising_input_passes, c.denoising_prefilter = "RGB_ALBEDO_NORMAL", "ACCURATE"
    return s


def render(s, pose, path):
    s.camera.matrix_world = pose
    s.render.filepath = path
    bpy.ops.render.render(write_still=True)


def rows(matrix):
    return [[float(v) for v in row] for row in matrix]


def photos(out, samples, threads, only):
    s = set_up(WIDTH, HEIGHT, samples, threads)
    os.makedirs(out, exist_ok=True)
    focal = LENS_MM / SENSOR_MM * WIDTH
    frames = []
    for k, pose in enumerate(walk(PHOTOS, -126.0, 24.0, (22.0, 35.0), 10.4, 7)):
        name = "photo_%02d" % (k + 1)
        frames.append({"file_path": name + ".jpg", "w": WIDTH, "h": HEIGHT, "fl_x": focal, "fl_y": focal,
                       "cx": WIDTH / 2, "cy": HEIGHT / 2, "transform_matrix": rows(pose)})
        path = os.path.join(out, name + ".png")
        # A picture that is there is kept, so that a stopped run goes on where it was.
        if (not only or k + 1 in only) and not os.path.exists(path):
            render(s, pose, path + ".part.png")
            os.replace(path + ".part.png", path)
            print("rendered", name, flush=True)
    with open(os.path.join(out, "frames.json"), "w") as f:
        json.dump({"frames": frames, "lens_mm": LENS_MM, "sensor_mm": SENSOR_MM}, f)


def tiny(out, samples, threads):
    """The small capture of testdata/captures/tiny."""
    poses = walk(TINY_VIEWS, -90.0, 30.0, (27.0, 35.0), 9.2, 11)
    exact(out, set_up(TINY_WIDTH, TINY_HEIGHT, samples, threads), poses, TINY_POINTS)


def exact(out, s, poses, count):
    """A capture with exact cameras: PNGs, and a COLMAP text model of `count` true surface points."""
    width, height = s.render.resolution_x, s.render.resolution_y
    images, sparse = os.path.join(out, "images"), os.path.join(out, "sparse", "0")
    os.makedirs(images, exist_ok=True)
    os.makedirs(sparse, exist_ok=True)
    focal, cx, cy = LENS_MM / SENSOR_MM * width, width / 2, height / 2
    names = ["view_%02d.png" % (k + 1) for k in range(len(poses))]
    colors = []
    for name, pose in zip(names, poses):
        path = os.path.join(images, name)
        if not os.path.exists(path):
            render(s, pose, path + ".part.png")
            os.replace(path + ".part.png", path)
        picture = bpy.data.images.load(path)
        pixels = np.array(picture.pixels[:]).reshape(height, width, -1)[::-1, :, :3]
        colors.append(np.round(pixels * 255).astype(int))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    inverse = [pose.inverted() for pose in poses]

    def project(k, point):
        p = inverse[k] @ point
        if p.z >= -0.1:
            return None
        u, v = cx - focal * p.x / p.z, cy + focal * p.y / p.z
        return (u, v) if 0 <= u < width and 0 <= v < height else None

    def first_hit(k, direction):
        eye = poses[k].translation
        hit, place, *_ = s.ray_cast(depsgraph, eye, direction.normalized())
        return place.copy() if hit else None

    rng = random.Random(3)
    points, seen = [], [[] for _ in poses]
    while len(points) < count:
        k = len(points) % len(poses)
        u, v = rng.uniform(1, width - 1), rng.uniform(1, height - 1)
        direction = poses[k].to_3x3() @ Vector(((u - cx) / focal, -(v - cy) / focal, -1.0))
        point = first_hit(k, direction)
        if point is None:
            continue
        track = []
        for j in range(len(poses)):
            at = project(j, point)
            ray = point - poses[j].translation
            there = first_hit(j, ray) if at else None
            if there is not None and (there - point).length < 0.002 * ray.length:
                track.append((j, at))
        if len(track) < 3:  # as in a real model: points seen from two places only are shaky
            continue
        values = [colors[j][int(at[1])][int(at[0])] for j, at in track]
        entry = []
        for j, at in track:
            entry.append((j + 1, len(seen[j])))
            seen[j].append((at[0], at[1], len(points) + 1))
        points.append((point, np.median(values, axis=0).round().astype(int), entry))

    with open(os.path.join(sparse, "cameras.txt"), "w") as f:
        f.write("# CAMERA_ID MODEL WIDTH HEIGHT fx fy cx cy\n")
        f.write("1 PINHOLE %d %d %.9g %.9g %g %g\n" % (width, height, focal, focal, cx, cy))
    with open(os.path.join(sparse, "images.txt"), "w") as f:
        f.write("# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then X Y POINT3D_ID of its observations\n")
        for j, name in enumerate(names):
            # COLMAP wants world-to-camera with y down and z forward.
            m = Matrix.Diagonal((1, -1, -1, 1)) @ inverse[j]
            q, t = m.to_quaternion(), m.translation
            f.write("%d %.9f %.9f %.9f %.9f %.9f %.9f %.9f 1 %s\n" % (j + 1, *q, *t, name))
            f.write(" ".join("%.3f %.3f %d" % o for o in seen[j]) + "\n")
    with open(os.path.join(sparse, "points3D.txt"), "w") as f:
        f.write("# POINT3D_ID X Y Z R G B ERROR, then IMAGE_ID POINT2D_IDX of its track\n")
        for i, (point, color, entry) in enumerate(points):
            track = " ".join("%d %d" % e for e in entry)
            f.write("%d %.6f %.6f %.6f %d %d %d 0 %s\n" % (i + 1, *point, *color, track))


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--out", required=True, help="working folder for the rendered PNGs")
    p.add_argument("--tiny", action="store_true", help="write the tiny capture to --out instead of the photos")
    p.add_argument("--samples", type=int, default=12, help="per pixel, before denoising")
    p.add_argument("--threads", type=int, default=0)
    p.add_argument("--only", type=int, nargs="*", help="numbers of the photos to render")
    a = p.parse_args()
    scene.build()
    if a.tiny:
        tiny(a.out, a.samples, a.threads)
    else:
        photos(a.out, a.samples, a.threads, a.only)


if __name__ == "__main__":
    sys.exit(main())
