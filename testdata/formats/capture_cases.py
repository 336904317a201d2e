"""Captures."""

import json

from cases import changed, invalid, put, valid
from ply_cases import LE, floats, ply

IDENTITY = {"rotation_wxyz": [1.0, 0.0, 0.0, 0.0], "translation": [0.0, 0.0, 0.0]}


def capture():
    return {
        "format": "motes/capture", "version": "1.0", "world_origin": [0.0, 0.0, 0.0],
        "points": None,
        "cameras": [{"model": "PINHOLE", "width": 640, "height": 480,
                     "params": [500.0, 500.0, 320.0, 240.0]}],
        "views": [
            {"name": n, "camera": 0, "camera_from_world": dict(IDENTITY), "image": f"images/{n}",
             "split": s} for n, s in (("a.jpg", "train"), ("b.jpg", "test"))],
    }


def captures():
    c = "capture"
    plain = json.dumps(capture(), indent=1)
    valid(c, "plain.json", plain)
    valid(c, "one-line.json", json.dumps(capture()))
    valid(c, "byte-order-mark.json", b"\xef\xbb\xbf" + plain.encode())
    ok = lambda name, change: valid(c, name + ".json", changed(capture, change))
    ok("newer-minor", lambda d: d.update(version="1.9", weather={"clouds": [[], {}]}))

    def full(d):
        d["world_origin"] = [4.5e6, -1e-9, 0.1]
        d["points"] = "same-points.ply"
        d["cameras"].append({"model": "opencv", "width": 1, "height": 131072,
                             "params": [1e7, 1e-3, 0, 0, 0.1, -0.2, 0.003, -4e-5]})
        d["views"][0].update(mask="masks/a é.png", camera=1, name="z 写真.jpg")
        d["views"][0]["camera_from_world"] = {"rotation_wxyz": [0.5, -0.5, 0.5, -0.5],
                                              "translation": [1e5, 2e-300, -3]}
        del d["views"][1]["split"]
    ok("full", full)
    valid(c, "same-points.ply", ply(LE, floats(["x", "y", "z"]), 4))
    ok("rounded-quaternion",
       lambda d: d["views"][0]["camera_from_world"].update(rotation_wxyz=[0.707, 0, 0.707, 0]))

    def bad(name, expect, change):
        invalid(c, name + ".json", expect, changed(capture, change))

    def text(name, expect, data):
        invalid(c, name + ".json", expect, data)
    view = lambda d: d["views"][0]
    camera = lambda d: d["cameras"][0]
    text("empty", "the file is empty", "")
    text("spaces", "the file is empty", " \n")
    text("cut", "the document ends early", plain[:-20])
    text("not-json", "not JSON", "cameras: []\n")
    text("binary", "not JSON", b"\x00\x01\x02\xff\xfe")
    text("two-documents", "trailing characters", plain + plain)
    text("a-list", "no JSON object", "[1, 2]")
    text("not-a-number", "not JSON", plain.replace("320.0", "NaN"))
    text("infinite", "number out of range", plain.replace("320.0", "1e999"))
    text("key-twice", "duplicate field `views`", plain.replace('"points"', '"views": [], "points"'))
    text("nested", "(line 1 column", '{"format": "motes/capture", "version": "1.0", "views": '
         + "[" * 5000)
    text("bad-utf-8", "not JSON", plain.encode().replace(b"a.jpg", b"\xff.jpg"))
    bad("other-document", "this is not a motes/capture document", lambda d: d.update(format="motes/x"))
    bad("no-format", "\"format\" is missing", lambda d: d.pop("format"))
    bad("version-2", "version 2.0 of motes/capture is not known", lambda d: d.update(version="2.0"))
    bad("version-0", "version 0.3 of motes/capture is not known", lambda d: d.update(version="0.3"))
    bad("version-number", "must be like \"1.1\", it is 1.0", lambda d: d.update(version=1.0))
    bad("version-missing", "must be like \"1.1\", it is missing", lambda d: d.pop("version"))
    bad("conventions", "(conventions)", lambda d: d.update(conventions={
        "camera_axes": "x right, y up, z back", "pixel_center": "0.5, 0.5",
        "pose": "camera_point = rotation * world_point + translation", "colors": "sRGB"}))
    bad("no-views", "the capture has no views (views)", lambda d: d.update(views=[]))
    bad("views-missing", "missing field `views`", lambda d: d.pop("views"))
    bad("views-object", "invalid type: map, expected a sequence", lambda d: d.update(views={}))
    bad("camera-dangling", "it refers to camera 1, but there are 1 (views[0].camera)",
        lambda d: view(d).update(camera=1))
    bad("camera-dangling-1e18", "it refers to camera 1000000000000000000",
        lambda d: view(d).update(camera=10**18))
    bad("camera-negative", "invalid value: integer `-1`", lambda d: view(d).update(camera=-1))
    bad("camera-by-name", "invalid type: string \"0\"", lambda d: view(d).update(camera="0"))
    bad("name-twice", "the name \"b.jpg\" is also that of views[0] (views[1].name)",
        lambda d: view(d).update(name="b.jpg"))
    bad("name-empty", "\"\" is not a name", lambda d: view(d).update(name=""))
    bad("name-line-break", "is not a name", lambda d: view(d).update(name="a\nb"))
    bad("split-unknown", "unknown variant `val`", lambda d: view(d).update(split="val"))
    bad("model-unknown", "\"PINHOEL\" is not a camera model", lambda d: camera(d).update(model="PINHOEL"))
    bad("params-too-few", "PINHOLE has 4 parameters, not 3",
        lambda d: camera(d).update(params=[500, 320, 240]))
    bad("params-many", "PINHOLE has 4 parameters, not 2000",
        lambda d: camera(d).update(params=[1] * 2000))
    bad("focal-zero", "fx is 0 (cameras[0].params)",
        lambda d: camera(d).update(params=[0, 500, 320, 240]))
    bad("focal-negative", "fy is -500", lambda d: camera(d).update(params=[500, -500, 320, 240]))
    bad("focal-huge", "fx is 1", lambda d: camera(d).update(params=[1e300, 5, 320, 240]))
    bad("width-zero", "0 x 480 pixels is not plausible", lambda d: camera(d).update(width=0))
    bad("width-1e18", "1000000000000000000 x 480 pixels is not plausible",
        lambda d: camera(d).update(width=10**18))
    bad("width-beyond-u64", "expected u64", lambda d: camera(d).update(width=10**30))
    bad("width-fraction", "expected u64", lambda d: camera(d).update(width=640.5))
    bad("rotation-zero", "has length 0 instead of 1 (views[0].camera_from_world.rotation_wxyz)",
        lambda d: view(d)["camera_from_world"].update(rotation_wxyz=[0, 0, 0, 0]))
    bad("rotation-not-unit", "has length 2 instead of 1",
        lambda d: view(d)["camera_from_world"].update(rotation_wxyz=[2, 0, 0, 0]))
    bad("rotation-overflow", "instead of 1",
        lambda d: view(d)["camera_from_world"].update(rotation_wxyz=[1e300, 1e300, 0, 0]))
    bad("rotation-three", "invalid length 3",
        lambda d: view(d)["camera_from_world"].update(rotation_wxyz=[1, 0, 0]))
    bad("translation-null", "invalid type: null",
        lambda d: view(d)["camera_from_world"].update(translation=[0, None, 0]))
    bad("image-up", "\"../../etc/passwd\" leads out of the folder of the document (views[0].image)",
        lambda d: view(d).update(image="../../etc/passwd"))
    bad("image-up-inside", "leads out of the folder",
        lambda d: view(d).update(image="images/../../x.jpg"))
    bad("image-absolute", "\"/etc/passwd\" is absolute", lambda d: view(d).update(image="/etc/passwd"))
    bad("image-drive", "\"C:/x.jpg\" is absolute", lambda d: view(d).update(image="C:/x.jpg"))
    bad("image-backslash", "has \\ between its parts", lambda d: view(d).update(image="..\\x.jpg"))
    bad("image-nul", "control characters", lambda d: view(d).update(image="a\0.jpg"))
    bad("image-empty", "the file name is empty", lambda d: view(d).update(image=""))
    bad("mask-up", "(views[0].mask)", lambda d: view(d).update(mask="../m.png"))
    bad("points-up", "leads out of the folder of the document (points)",
        lambda d: d.update(points="../points.ply"))
    bad("points-missing", "the file \"nowhere.ply\" does not exist (points)",
        lambda d: d.update(points="nowhere.ply"))
    put(c, "invalid", "broken-points.txt", ply(LE, floats(["x", "y", "z"]), 1, count=10**18))
    bad("points-broken", "1000000000000000000 rows are more than",
        lambda d: d.update(points="broken-points.txt"))
    bad("origin-null", "invalid type: null", lambda d: d.update(world_origin=[0, 0, None]))
