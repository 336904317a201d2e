#!/usr/bin/env python3
"""Writes the corpus of COLMAP models next to this file: valid/text by hand, valid/pycolmap-* with
pycolmap 4.2.1 from it, invalid/* by damaging it. Each invalid model has a sibling CASE.expect with
a piece of the error that it must give."""

import os
import shutil
import struct

import pycolmap

HERE = os.path.dirname(os.path.abspath(__file__))
CAMERAS = """# Camera list with one line of data per camera:
#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]
# Number of cameras: 2
1 SIMPLE_RADIAL 640 480 512.25 320 240 -0.03125
7 OPENCV 800 600 700.5 701.25 400.5 299.5 0.0625 -0.015625 0.001 -0.002
"""
IMAGES = """# Image list with two lines of data per image:
#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME
#   POINTS2D[] as (X, Y, POINT3D_ID)
3 1 0 0 0 0.5 -0.25 2 1 left/first photo.jpg
100.5 200.25 11 300 120 -1 410.75 80.5 12
1 0.5 0.5 0.5 0.5 0 0 3 7 a.png

9 0.8 0 0.6 0 -1 0.125 4 1 zweites Bild \u00fc.jpg
320 240 12 5.5 6.5 11
"""
POINTS = """# 3D point list with one line of data per point:
#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)
11 0.25 -0.5 6 255 128 0 0.75 3 0 9 1
12 -1 1 8.5 1 2 3 -1 3 2 9 0
"""


def write(folder, files):
    path = os.path.join(HERE, folder)
    shutil.rmtree(path, ignore_errors=True)
    os.makedirs(path)
    for name, data in files.items():
        with open(os.path.join(path, name), "wb") as f:
            f.write(data if isinstance(data, bytes) else data.encode())
    return path


def read(folder):
    path = os.path.join(HERE, folder)
    return {n: open(os.path.join(path, n), "rb").read() for n in sorted(os.listdir(path))}


for old in ("valid", "invalid"):
    shutil.rmtree(os.path.join(HERE, old), ignore_errors=True)
text = {"cameras.txt": CAMERAS, "images.txt": IMAGES, "points3D.txt": POINTS}
model = pycolmap.Reconstruction(write("valid/text", text))
# pycolmap's own text reader ends a name at the first space.
model.image(3).name, model.image(9).name = "left/first photo.jpg", "zweites Bild \u00fc.jpg"
for kind, save in (("text", model.write_text), ("binary", model.write_binary)):
    save(write("valid/pycolmap-4-" + kind, {}))
binary = {n: d for n, d in read("valid/pycolmap-4-binary").items() if n.split(".")[0] in ("cameras", "images", "points3D")}
C, I, P = binary["cameras.bin"], binary["images.bin"], binary["points3D.bin"]


def case(name, expect, base=binary, **changes):
    files = dict(base)
    for key, data in changes.items():
        file = key + (".bin" if base is binary else ".txt")
        if data is None:
            del files[file]
        else:
            files[file] = data
    write("invalid/" + name, files)
    with open(os.path.join(HERE, "invalid", name + ".expect"), "w", encoding="utf-8") as f:
        f.write(expect + "\n")


def put(data, at, fmt, value):
    raw = struct.pack("<" + fmt, value)
    return data[:at] + raw + data[at + len(raw):]


HUGE = 2**40
image = 8  # offset of the first image record: id, quaternion, translation, camera, name
name_at = image + 4 + 56 + 4
name_end = I.index(b"\0", name_at)
case("bin-truncated-cameras", "cannot fit", cameras=C[:60])
case("bin-truncated-images", "cannot fit into the", images=I[:-5])
case("bin-truncated-points", "cannot fit into the", points3D=P[:-3])
case("bin-empty-cameras", "the file ends in the middle", cameras=b"")
case("bin-huge-camera-count", "cannot fit into the", cameras=put(C, 0, "Q", HUGE))
case("bin-huge-image-count", "cannot fit into the", images=put(I, 0, "Q", HUGE))
case("bin-huge-point-count", "cannot fit into the", points3D=put(P, 0, "Q", 2**64 - 1))
case("bin-huge-keypoint-count", "cannot fit into the", images=put(I, name_end + 1, "Q", HUGE))
case("bin-huge-track", "cannot fit into the", points3D=put(P, 8 + 8 + 24 + 3 + 8, "Q", HUGE))
case("bin-trailing-bytes", "follow the last record", points3D=P + b"\1\2\3")
case("bin-holds-text", "this is text, but the suffix .bin", cameras=CAMERAS)
case("bin-unknown-camera-model", "camera model 99 is unknown", cameras=put(C, 12, "i", 99))
case("bin-negative-camera-model", "camera model -1 is unknown", cameras=put(C, 12, "i", -1))
case("bin-zero-focal", "which is not a length in pixels", cameras=put(C, 32, "d", 0.0))
case("bin-nan-focal", "parameter f is NaN", cameras=put(C, 32, "d", float("nan")))
case("bin-infinite-distortion", "parameter k is inf", cameras=put(C, 56, "d", float("inf")))
case("bin-zero-width", "is not plausible", cameras=put(C, 16, "Q", 0))
case("bin-absurd-height", "is not plausible", cameras=put(C, 24, "Q", 2**62))
case("bin-duplicate-camera", "the id is used twice", cameras=put(C, 8, "I", 7))
case("bin-zero-quaternion", "rotation quaternion is zero", images=I[:image + 4] + bytes(32) + I[image + 36:])
case("bin-nan-pose", "not finite", images=put(I, image + 36, "d", float("nan")))
case("bin-dangling-camera", "camera 77, which does not exist", images=put(I, image + 60, "I", 77))
case("bin-duplicate-image", "the id is used twice", images=put(I, image, "I", 9))
case("bin-name-not-utf8", "is not UTF-8", images=I[:name_at] + b"\xff" + I[name_at + 1:])
case("bin-name-without-end", "in the middle of a name", images=I[:name_at + 3] + b"A" * 300)
case("bin-nan-point", "the position has a value that is not finite", points3D=put(P, 16, "d", float("nan")))
base = text
case("no-images", "neither cameras.bin + images.bin", base, images=None)
case("text-holds-binary", "this is not text", base, cameras=C)
case("text-holds-bytes", "this is not text", base, points3D=b"\xff\xfe\x00\x01" * 9)
case("text-unknown-camera-model", "camera model \"TELESCOPE\" is unknown", base, cameras=CAMERAS.replace("OPENCV", "TELESCOPE"))
case("text-missing-parameter", "the line ends before parameter p2", base, cameras=CAMERAS.replace(" -0.002", ""))
case("text-extra-parameter", "has only 4 parameters", base, cameras=CAMERAS.replace("-0.03125", "-0.03125 1"))
case("text-no-number", "should be a number, but is \"wide\"", base, cameras=CAMERAS.replace("640", "wide"))
case("text-negative-width", "should be a number, but is \"-640\"", base, cameras=CAMERAS.replace("640", "-640"))
case("text-nan-pose", "not finite", base, images=IMAGES.replace("-0.25", "nan"))
case("text-zero-quaternion", "rotation quaternion is zero", base, images=IMAGES.replace("3 1 0 0 0", "3 0 0 0 0"))
case("text-missing-second-line", "an image takes two lines", base, images=IMAGES.replace("a.png\n\n", "a.png\n"))
case("text-no-name", "is empty", base, images=IMAGES.replace(" 7 a.png", " 7"))
case("text-path-traversal", "leads out of the image folder", base, images=IMAGES.replace("a.png", "../../etc/a.png"))
case("text-absolute-name", "is an absolute path", base, images=IMAGES.replace("a.png", "/etc/a.png"))
case("text-windows-name", "is an absolute path", base, images=IMAGES.replace("a.png", "C:\\a.png"))
case("text-duplicate-name", "is also that of image 3", base, images=IMAGES.replace("a.png", "left/first photo.jpg"))
case("text-dangling-camera", "camera 4, which does not exist", base, images=IMAGES.replace(" 7 a.png", " 4 a.png"))
case("text-color-too-large", "the color (0 to 255) should be a number", base, points3D=POINTS.replace("255", "256"))
case("text-duplicate-point", "the id is used twice", base, points3D=POINTS.replace("\n12 ", "\n11 "))
case("text-broken-track", "the line ends before the keypoint index", base, points3D=POINTS.replace("9 1\n", "9\n"))
