"""Turns rendered PNGs into the files under testdata/: JPEG photos with EXIF, cameras, lists, the tiny capture.

Kept apart from render.py so that encoding can be redone without rendering, and because Blender writes the date and
the render time into its PNGs, which would make two equal runs differ.
"""

import argparse
import json
import os
import shutil

import numpy as np
from PIL import Image
from PIL.TiffImagePlugin import IFDRational

QUALITY = 90
# Each held-out photo has a training photo on either side, at the walk's other height, and two of its own beyond.
TEST = (4, 10, 15, 21)
# Spread over the walk, both heights in each, and the five are among the ten: only photos are taken away.
TRAIN_10 = (1, 3, 6, 8, 11, 13, 16, 18, 22, 24)
TRAIN_5 = (1, 6, 13, 18, 24)


def name(number):
    return "photo_%02d.jpg" % number


def exif(lens_mm, sensor_mm, size):
    """What a camera writes: the lens in millimeters, and its 35 mm equivalent rounded to a whole number."""
    e = Image.Exif()
    e[0x010F], e[0x0110], e[0x0112] = "motes", "lab scene (rendered)", 1
    sub = e.get_ifd(0x8769)
    sub[0x920A] = IFDRational(round(lens_mm * 10), 10)
    sub[0xA405] = round(lens_mm * 36.0 / sensor_mm)
    sub[0xA001] = 1  # sRGB
    sub[0xA002], sub[0xA003] = size
    return e


def write_list(path, numbers):
    with open(path, "w", newline="\n") as f:
        f.writelines(name(k) + "\n" for k in numbers)


def photos(source, target):
    with open(os.path.join(source, "frames.json")) as f:
        data = json.load(f)
    folder, poses = os.path.join(target, "photos"), os.path.join(target, "true_poses")
    os.makedirs(folder, exist_ok=True)
    os.makedirs(poses, exist_ok=True)
    total = 0
    for frame in data["frames"]:
        file = frame["file_path"]
        path = os.path.join(folder, file)
        with Image.open(os.path.join(source, file.replace(".jpg", ".png"))) as im:
            picture = im.convert("RGB")
        picture.save(path, quality=QUALITY, subsampling=0, optimize=True,
                     exif=exif(data["lens_mm"], data["sensor_mm"], picture.size))
        total += os.path.getsize(path)
        frame["file_path"] = "../photos/" + file
    numbers = range(1, len(data["frames"]) + 1)
    train = [k for k in numbers if k not in TEST]
    transforms = {
        "camera_model": "PINHOLE", "frames": data["frames"],
        "train_filenames": ["../photos/" + name(k) for k in train],
        "test_filenames": ["../photos/" + name(k) for k in TEST],
    }
    with open(os.path.join(poses, "transforms.json"), "w", newline="\n") as f:
        json.dump(transforms, f, indent=1)
        f.write("\n")
    write_list(os.path.join(target, "test_list.txt"), TEST)
    write_list(os.path.join(target, "train_10.txt"), TRAIN_10)
    write_list(os.path.join(target, "train_5.txt"), TRAIN_5)
    print("%d photos, %.2f MB" % (len(numbers), total / 1e6))


def tiny(source, target):
    images, sparse = os.path.join(target, "images"), os.path.join(target, "sparse", "0")
    os.makedirs(images, exist_ok=True)
    os.makedirs(sparse, exist_ok=True)
    for file in sorted(os.listdir(os.path.join(source, "images"))):
        with Image.open(os.path.join(source, "images", file)) as im:
            plain = Image.fromarray(np.asarray(im.convert("RGB")))  # drops Blender's text chunks
        plain.save(os.path.join(images, file), optimize=True)
    for file in ("cameras.txt", "images.txt", "points3D.txt"):
        shutil.copyfile(os.path.join(source, "sparse", "0", file), os.path.join(sparse, file))


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--photos", help="folder that render.py filled")
    p.add_argument("--tiny", help="folder that render.py --tiny filled")
    p.add_argument("--testdata", required=True, help="the repository's testdata folder")
    a = p.parse_args()
    if a.photos:
        photos(a.photos, os.path.join(a.testdata, "lab"))
    if a.tiny:
        tiny(a.tiny, os.path.join(a.testdata, "captures", "tiny"))


if __name__ == "__main__":
    main()
