#!/usr/bin/env python3
"""Writes the corpus of valid and invalid files beside this script, with nothing but the standard
library, so that no file comes from the writers under test.

DOCUMENT/v1/valid/*      must be read, written and read again without loss
DOCUMENT/v1/invalid/*    must be refused with a message that contains the text of NAME.expect

A case is one call of valid() or invalid() here, or simply a file (and its .expect) put there.
"""

import json
import os
import shutil
import struct
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))


def put(document, kind, name, data):
    path = os.path.join(HERE, document, "v1", kind, name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(data.encode() if isinstance(data, str) else data)


def valid(document, name, data):
    put(document, "valid", name, data)


def invalid(document, name, expect, data):
    put(document, "invalid", name, data)
    put(document, "invalid", name + ".expect", expect + "\n")


# ---- PLY -----------------------------------------------------------------------------------------

STRUCT = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
          "half": "e", "float": "f", "double": "d", "float32": "f", "uint8": "B"}


def columns(degree, order="inria"):
    rest = 3 * ((degree + 1) ** 2 - 1)
    xyz, dc = ["x", "y", "z"], [f"f_dc_{i}" for i in range(3)]
    normals = ["nx", "ny", "nz"]
    f_rest = [f"f_rest_{i}" for i in range(rest)]
    scale, rot = [f"scale_{i}" for i in range(3)], [f"rot_{i}" for i in range(4)]
    if order == "inria":
        return xyz + normals + dc + f_rest + ["opacity"] + scale + rot
    return xyz + scale + ["opacity"] + rot + dc + f_rest  # as brush writes


def value(name, row):
    """Exact in half precision, different in every column and row."""
    if name in ("nx", "ny", "nz"):
        return 0.0
    seed = zlib.crc32(name.encode()) % 97 + 13 * row
    if name.startswith("scale_"):
        return -4.0 + (seed % 16) / 8
    return (seed % 64) / 16 - 2.0 + (0.0625 if name == "rot_0" else 0.0)


def ply(encoding, props, rows, comments=(), newline="\n", count=None, before="", after="",
        before_body=b"", after_body=b"", bom=b""):
    """props: (type, name) or (type, name, value(row)); rows: how many."""
    head = ["ply", f"format {encoding} 1.0"] + [f"comment {c}" for c in comments]
    if before:
        head += before.split("\n")
    head.append(f"element vertex {rows if count is None else count}")
    head += [f"property {p[0]} {p[1]}" for p in props]
    if after:
        head += after.split("\n")
    head.append("end_header")
    body = before_body
    for row in range(rows):
        values = [p[2](row) if len(p) > 2 else value(p[1], row) for p in props]
        if encoding == "ascii":
            body += (" ".join(repr(v) for v in values) + newline).encode()
        else:
            order = "<" if encoding == "binary_little_endian" else ">"
            body += b"".join(struct.pack(order + STRUCT[p[0]], v) for p, v in zip(props, values))
    return bom + (newline.join(head) + newline).encode() + body + after_body


LE, BE = "binary_little_endian", "binary_big_endian"
G = "gaussians-ply"


def floats(names, kind="float"):
    return [(kind, name) for name in names]


def gaussians_valid():
    for degree in range(5):
        valid(G, f"degree-{degree}.ply", ply(LE, floats(columns(degree)), 3))
    # All of these hold the same Gaussians.
    inria, brush = floats(columns(1)), floats(columns(1, "brush"))
    valid(G, "same-inria.ply", ply(LE, inria, 5))
    valid(G, "same-big-endian.ply", ply(BE, inria, 5))
    valid(G, "same-ascii.ply", ply("ascii", inria, 5))
    valid(G, "same-ascii-crlf.ply", ply("ascii", inria, 5, newline="\r\n"))
    valid(G, "same-crlf-header.ply", ply(LE, inria, 5, newline="\r\n"))
    valid(G, "same-byte-order-mark.ply", ply("ascii", inria, 5, bom=b"\xef\xbb\xbf"))
    valid(G, "same-brush-order.ply",
          ply(LE, brush, 5, comments=["Exported from Brush", "SH degree: 1"]))
    valid(G, "same-doubles.ply", ply(LE, floats(columns(1), "double"), 5))
    valid(G, "same-halves.ply", ply(LE, floats(columns(1), "half"), 5))
    valid(G, "same-reversed.ply", ply(LE, inria[::-1], 5))
    valid(G, "same-element-before.ply",
          ply(BE, inria, 5, before="element camera 2\nproperty float f\nproperty list uchar int a",
              before_body=struct.pack(">fBiifB", 1.0, 2, 7, 8, 2.0, 0)))
    valid(G, "same-elements-after.ply",
          ply("ascii", inria, 5, after="element face 1\nproperty list uchar int vertex_indices",
              after_body=b"3 0 1 2\n"))
    valid(G, "same-without-last-line-end.ply", ply("ascii", inria, 5)[:-1])

    extra = [("uchar", "label", lambda r: 250 + r), ("int", "object_id", lambda r: -r),
             ("double", "score", lambda r: r / 3), ("ushort", "group", lambda r: 65535 - r),
             ("char", "sign", lambda r: -r), ("short", "s", lambda r: -300 * r),
             ("uint", "u", lambda r: 4294967295 - r), ("float", "roughness", lambda r: 0.5 + r)]
    valid(G, "extra-columns.ply", ply(BE, extra[:4] + floats(columns(0)) + extra[4:], 3))
    normals = [p for p in floats(columns(0)) if p[1] not in ("nx", "ny", "nz")]
    normals += [("float", "nx", lambda r: 0.0), ("float", "ny", lambda r: 1.0),
                ("float", "nz", lambda r: 0.0)]
    valid(G, "normals.ply", ply(LE, normals, 2))
    valid(G, "one-normal.ply", ply(LE, floats(columns(0)[:3]) + [("double", "nx", lambda r: 0.0)]
                                   + floats(columns(0)[6:]), 2))
    flat = [p for p in floats(columns(3)) if p[1] != "scale_2"]
    valid(G, "flat-2dgs.ply", ply(LE, flat, 3, comments=["SplatRenderMode: 2dgs"]))
    rgb = [p for p in floats(columns(0)) if not p[1].startswith("f_")]
    rgb += [("uchar", c, lambda r, i=i: (40 * r + 90 * i) % 256)
            for i, c in enumerate(("red", "green", "blue"))]
    valid(G, "colours-instead-of-sh.ply", ply(LE, rgb, 4, comments=["Vertical Axis: z"]))
    odd = {"x": float("nan"), "opacity": float("inf"), "scale_1": float("-inf")}
    special = [(k, n, lambda r, n=n: odd.get(n, value(n, r)) if r == 1 else value(n, r))
               for k, n in floats(columns(0))]
    valid(G, "not-a-number.ply", ply(LE, special, 3))
    valid(G, "no-rows.ply", ply(LE, floats(columns(3)), 0))
    valid(G, "mip.ply", ply(LE, floats(columns(0)), 1, comments=["SplatRenderMode: mip"]))


def gaussians_invalid():
    good = floats(columns(1))
    whole = ply(LE, good, 5)
    text = ply("ascii", good, 5).decode()
    bad = lambda name, expect, data: invalid(G, name + ".ply", expect, data)
    bad("empty", "the file is empty (byte 0)", b"")
    bad("other-kind-of-file", "not a PLY file: it starts with", b"PK\x03\x04 some archive")
    bad("magic-only", "the file ends inside its header (ply header line 2)", b"ply\n")
    bad("header-cut", "the file ends inside its header", whole[:300])
    bad("header-line-without-end", "the line has more than 16384 bytes",
        b"ply\ncomment " + b"x" * 17000)
    bad("body-cut", "but the file has", whole[:-7])
    bad("body-missing", "but the file has", whole[:whole.index(b"end_header\n") + 11])
    bad("rows-1e18", "1000000000000000000 rows are more than the 2^32 - 1 that fit",
        ply(LE, good, 5, count=10**18))
    bad("rows-1e18-ascii", "1000000000000000000 rows are more than the 2^32 - 1 that fit",
        ply("ascii", good, 5, count=10**18))
    bad("rows-beyond-u64", "the number of rows is \"1000000000000000000000000000000\"",
        ply(LE, good, 5, count=10**30))
    bad("rows-negative", "the number of rows is \"-1\"", ply(LE, good, 5, count=-1))
    bad("rows-no-number", "the number of rows is \"many\"", ply(LE, good, 5, count="many"))
    bad("rows-2-32", "4294967296 rows are more than the 2^32 - 1 that fit",
        ply(LE, good, 5, count=2**32))
    bad("rows-below-2-32", "promises 4294967295 rows", ply(LE, good, 5, count=2**32 - 1))
    bad("rows-below-2-32-ascii", "promises 4294967295 rows",
        ply("ascii", good, 5, count=2**32 - 1))
    bad("one-row-too-many", "promises 6 rows", ply(LE, good, 5, count=6))
    bad("one-row-too-few", "there is data after the last row", ply(LE, good, 5, count=4))
    bad("one-row-too-few-ascii", "there is data after the last row",
        ply("ascii", good, 5, count=4))
    bad("huge-element-before", "promises 4000000000000 rows of element \"camera\"",
        ply(LE, good, 5, before="element camera 4000000000000\nproperty double f"))
    bad("text-in-binary", "header and body do not match",
        text.replace("format ascii", f"format {LE}").encode() + b"more " * 60)
    bad("text-in-binary-short", "but the file has",
        ply("ascii", floats(columns(0)), 1, count=20)
        .replace(b"format ascii", f"format {LE}".encode()))
    bad("binary-in-text", "(line ", whole.replace(LE.encode(), b"ascii"))
    bad("copied-in-text-mode", "there is data after the last row",
        ply(LE, floats(columns(0)) + [("uchar", "line", lambda r: 10)], 5)
        .replace(b"\n", b"\r\n"))
    bad("no-format", "there is no format line", whole.replace(f"format {LE} 1.0\n".encode(), b""))
    bad("format-unknown", "the format is \"binary_middle_endian\"",
        whole.replace(LE.encode(), b"binary_middle_endian"))
    bad("format-2", "PLY version \"2.0\" instead of 1.0", whole.replace(b" 1.0\n", b" 2.0\n", 1))
    bad("keyword-unknown", "\"propertie\" is no PLY keyword (ply header line 4)",
        whole.replace(b"property", b"propertie", 1))
    bad("type-unknown", "\"quad\" is no PLY type (ply header line 4)",
        whole.replace(b"property float x", b"property quad x"))
    bad("property-without-element", "a property before the first element",
        b"ply\nformat ascii 1.0\nproperty float x\nend_header\n")
    bad("property-twice", "property \"y\" was already declared on line 5",
        ply(LE, good + floats(["y"]), 2))
    bad("property-without-name", "the property has no name",
        whole.replace(b"property float x\n", b"property float\n"))
    bad("element-twice", "a second element \"vertex\"",
        ply(LE, good, 1, after="element vertex 1\nproperty float x"))
    bad("no-vertex", "there is no element vertex",
        ply(LE, good, 2).replace(b"element vertex", b"element points"))
    for gone in ("opacity", "x", "scale_1", "rot_2", "f_dc_1"):
        bad(f"missing-{gone}", f"property \"{gone}\" is missing",
            ply(LE, [p for p in good if p[1] != gone], 2))
    bad("missing-colour", "property \"f_dc_0\" is missing",
        ply(LE, [p for p in good if not p[1].startswith("f_")], 2))
    bad("list-for-x", "property \"x\" is a list (ply header line 4)",
        whole.replace(b"property float x\n", b"property list uchar float x\n"))
    bad("list-length-float", "the length of a list must be of an integer type",
        whole.replace(b"property float nx\n", b"property list float float nx\n"))
    bad("list-length-negative", "list \"a\" has -3 items",
        ply(LE, good, 2, before="element c 1\nproperty list int int a\nproperty uchar b",
            before_body=struct.pack("<iB", -3, 1)))
    bad("list-length-huge", "the file ends in row 0 of the 1 rows of element \"c\"",
        ply(LE, good, 2, before="element c 1\nproperty list uint double a",
            before_body=struct.pack("<I", 2**32 - 1)))
    bad("list-length-huge-ascii", "the row ends before its 1 properties do (line 33)",
        ply("ascii", good, 2, before="element c 1\nproperty list uint double a",
            before_body=b"4000000000 1 2 3\n"))
    for count in (1, 12, 44, 46, 75):
        props = floats(columns(0)) + floats([f"f_rest_{i}" for i in range(count)])
        bad(f"f-rest-{count}", f"{count} f_rest columns belong to no SH degree", ply(LE, props, 1))
    gap = floats(columns(0)) + floats([f"f_rest_{i}" for i in (0, 1, 2, 3, 4, 5, 6, 7, 9)])
    bad("f-rest-gap", "property \"f_rest_8\" is missing", ply(LE, gap, 1))
    bad("point-cloud", "looks like a point cloud",
        ply(LE, floats(["x", "y", "z"]) + [("uchar", c, lambda r: 9) for c in
                                           ("red", "green", "blue")], 3))
    bad("mesh", "looks like a mesh",
        ply("ascii", floats(["x", "y", "z"]), 3,
            after="element face 1\nproperty list uchar int vertex_indices",
            after_body=b"3 0 1 2\n"))
    bad("compressed", "this is a compressed splat PLY",
        ply(LE, [("uint", n, lambda r: 5) for n in
                 ("packed_position", "packed_rotation", "packed_scale", "packed_color")], 2))
    rows = text.split("end_header\n")
    lines = rows[1].split("\n")
    bad("ascii-row-short", "the row ends before its 26 properties do (line 32)",
        rows[0] + "end_header\n" + "\n".join([lines[0], lines[1].rsplit(" ", 1)[0]] + lines[2:]))
    bad("ascii-row-long", "the row has more values than its 26 properties take (line 31)",
        rows[0] + "end_header\n" + "\n".join([lines[0] + " 1"] + lines[1:]))
    bad("ascii-word", "property \"x\" is \"one\" (line 31)",
        rows[0] + "end_header\n" + "\n".join(["one" + lines[0][lines[0].index(" "):]] + lines[1:]))
    label = good + [("uchar", "label", lambda r: 3)]
    bad("ascii-uchar-300", "property \"label\" is \"300\" (line 32)",
        ply("ascii", label, 1).replace(b" 3\n", b" 300\n"))


def points():
    p = "points-ply"
    xyz = floats(["x", "y", "z"])
    rgb = [("uchar", c, lambda r, i=i: 60 * i + r) for i, c in enumerate(("red", "green", "blue"))]
    valid(p, "same-colours.ply", ply(LE, xyz + rgb, 4))
    valid(p, "same-ascii.ply", ply("ascii", rgb + xyz, 4))
    valid(p, "same-doubles.ply", ply(BE, floats(["x", "y", "z"], "double") + rgb, 4))
    valid(p, "same-with-normals.ply", ply(LE, xyz + floats(["nx", "ny", "nz"]) + rgb, 4))
    valid(p, "no-colours.ply", ply(LE, xyz, 4))
    valid(p, "gaussians.ply", ply(LE, floats(columns(2)), 4))
    valid(p, "no-rows.ply", ply("ascii", xyz, 0))
    invalid(p, "missing-z.ply", "property \"z\" is missing", ply(LE, xyz[:2] + rgb, 4))
    nan = [("float", "x", lambda r: float("nan") if r == 2 else 1.0)] + xyz[1:]
    invalid(p, "not-a-number.ply", "(row 2 of vertex)", ply(LE, nan, 4))
    invalid(p, "beyond-f32.ply", "the position is [inf,",
            ply(LE, [("double", "x", lambda r: 1e300)] + xyz[1:], 1))
    invalid(p, "rows-1e18.ply", "1000000000000000000 rows are more than",
            ply(LE, xyz, 1, count=10**18))
    invalid(p, "cut.ply", "but the file has", ply(LE, xyz + rgb, 4)[:-1])


# ---- JSON ----------------------------------------------------------------------------------------

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


def changed(make, change):
    document = make()
    change(document)
    return json.dumps(document, indent=1, ensure_ascii=False)


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
    bad("other-document", "this is no motes/capture document", lambda d: d.update(format="motes/x"))
    bad("no-format", "\"format\" is missing", lambda d: d.pop("format"))
    bad("version-2", "version 2.0 of motes/capture is not known", lambda d: d.update(version="2.0"))
    bad("version-0", "version 0.3 of motes/capture is not known", lambda d: d.update(version="0.3"))
    bad("version-number", "must be like \"1.0\", it is 1.0", lambda d: d.update(version=1.0))
    bad("version-missing", "must be like \"1.0\", it is missing", lambda d: d.pop("version"))
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
    bad("name-empty", "\"\" is no name", lambda d: view(d).update(name=""))
    bad("name-line-break", "is no name", lambda d: view(d).update(name="a\nb"))
    bad("split-unknown", "unknown variant `val`", lambda d: view(d).update(split="val"))
    bad("model-unknown", "\"PINHOEL\" is no camera model", lambda d: camera(d).update(model="PINHOEL"))
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


def camera_path():
    return {"format": "motes/camera-path", "version": "1.0", "width": 64, "height": 48,
            "fps": 24.0, "vertical_fov_deg": 50.0,
            "poses": [{"camera_from_world": dict(IDENTITY)} for _ in range(2)]}


def camera_paths():
    c = "camera-path"
    valid(c, "plain.json", json.dumps(camera_path()))
    ok = lambda name, change: valid(c, name + ".json", changed(camera_path, change))
    ok("zoom", lambda d: d["poses"][1].update(vertical_fov_deg=20.5))
    ok("defaults", lambda d: d.pop("fps"))

    def bad(name, expect, change):
        invalid(c, name + ".json", expect, changed(camera_path, change))
    bad("no-poses", "the path has no poses", lambda d: d.update(poses=[]))
    bad("fov-zero", "an angle of view of 0 degrees", lambda d: d.update(vertical_fov_deg=0))
    bad("fov-180", "an angle of view of 180 degrees (poses[1].vertical_fov_deg)",
        lambda d: d["poses"][1].update(vertical_fov_deg=180))
    bad("fps-zero", "0 frames per second", lambda d: d.update(fps=0))
    bad("width-1e18", "a frame of 1000000000000000000 x 48", lambda d: d.update(width=10**18))
    bad("rotation-zero", "(poses[0].camera_from_world.rotation_wxyz)",
        lambda d: d["poses"][0]["camera_from_world"].update(rotation_wxyz=[0, 0, 0, 0]))
    bad("a-capture", "this is no motes/camera-path document", lambda d: d.update(format="motes/capture"))


def metrics():
    scores = {"psnr": 25.5, "psnr_float": 25.51, "psnr_color_corrected": 26.0, "ssim": 0.8,
              "lpips": None}
    return {
        "format": "motes/metrics", "version": "1.0", "split": "test", **scores, "gap": 3.25,
        "protocol": {
            "split_rule": "every 8th view by name", "size_px": [640, 480], "resize_filter": "none",
            "background": [0.0, 0.0, 0.0], "masks": "left out", "mean": "mean of the views' scores",
            "psnr": {"peak": 1.0, "encoding": "sRGB", "bits": 8, "cap_db": 128.0,
                     "color_correction": "affine RGB, least squares"},
            "ssim": {"window_px": 11, "sigma_px": 1.5, "k1": 0.01, "k2": 0.03, "border": "same"},
            "lpips": None, "lpips_reason": "no weights were given"},
        "gaussians": 1000,
        "views": [{"name": "a.jpg", "split": "test", **scores, "counted_share": 1.0}],
        "train": {**scores, "psnr": 28.75}, "test": scores, "seeds": None,
    }


def metrics_files():
    m = "metrics"
    valid(m, "plain.json", json.dumps(metrics()))
    row = {"seed": 1, "gaussians": "a.ply", "psnr": 25.0, "gap": None}
    valid(m, "seeds.json", changed(metrics, lambda d: d.update(
        seeds={"rows": [row, {**row, "seed": None}], "mean": {"psnr": 25.0}, "deviation": {}})))
    valid(m, "lpips.json", changed(metrics, lambda d: d["protocol"].update(
        lpips={"network": "vgg", "input_range": "[-1, 1]", "weights_sha256": "00"},
        lpips_reason=None)))

    def bad(name, expect, change):
        invalid(m, name + ".json", expect, changed(metrics, change))
    bad("no-protocol", "missing field `protocol`", lambda d: d.pop("protocol"))
    bad("split-unknown", "unknown variant `val`", lambda d: d.update(split="val"))
    bad("psnr-text", "invalid type: string \"25\"", lambda d: d["views"][0].update(psnr="25"))
    bad("version-2", "version 2.1 of motes/metrics is not known", lambda d: d.update(version="2.1"))


def run_record():
    return {
        "format": "motes/run", "version": "1.0", "tool": "train-splat", "tool_version": "0.1.0",
        "git": None, "argv": ["train-splat", "--seed", "7"], "config": {"seed": 7, "list": [1.5]},
        "seed": 7, "threads": 2,
        "inputs": [{"role": "capture", "path": "capture.json", "sha256": "0" * 64}],
        "outputs": ["gaussians.ply"], "warnings": [], "start": "2026-01-02T03:04:05Z",
        "wall_s": 1.5, "cpu_s": 2.75, "peak_memory_bytes": 123456789, "report": {"psnr": 20.25},
    }


def run_records():
    r = "run"
    valid(r, "plain.json", json.dumps(run_record()))

    def sparse(d):
        for key in ("tool_version", "git", "seed", "cpu_s", "peak_memory_bytes", "warnings"):
            del d[key]
        del d["inputs"][0]["sha256"]
    valid(r, "sparse.json", changed(run_record, sparse))
    invalid(r, "no-argv.json", "missing field `argv`", changed(run_record, lambda d: d.pop("argv")))
    invalid(r, "threads-negative.json", "invalid value: integer `-1`",
            changed(run_record, lambda d: d.update(threads=-1)))
    invalid(r, "nested.json", "recursion limit",
            json.dumps(run_record()).replace("[1.5]", "[" * 5000 + "]" * 5000))


# ---- images --------------------------------------------------------------------------------------

def png(width, height, color, bits, rows, chunks=b"", size=None):
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data
                + struct.pack(">I", zlib.crc32(kind + data)))
    head = struct.pack(">IIBBBBB", *(size or (width, height)), bits, color, 0, 0, 0)
    body = zlib.compress(b"".join(b"\0" + row for row in rows), 9)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunks + chunk(b"IDAT", body)
            + chunk(b"IEND", b""))


def bmp(width, height, data):
    return (b"BM" + struct.pack("<IHHI", 54 + len(data), 0, 0, 54)
            + struct.pack("<IiiHHIIiiII", 40, width, height, 1, 24, 0, len(data), 0, 0, 0, 0) + data)


def tiff(tags, data):
    entries = b"".join(struct.pack("<HHII", tag, kind, count, number)
                       for tag, kind, count, number in sorted(tags))
    return (b"II*\0" + struct.pack("<I", 8) + struct.pack("<H", len(tags)) + entries + b"\0" * 4
            + data)


def images():
    i = "images"
    grey = png(3, 2, 0, 8, [bytes([0, 128, 255]), bytes([1, 2, 3])])
    valid(i, "grey.png", grey)
    valid(i, "grey-1-bit.png", png(3, 2, 0, 1, [b"\xa0", b"\x40"]))
    valid(i, "grey-16-bit.png", png(2, 1, 0, 16, [struct.pack(">HH", 65535, 300)]))
    valid(i, "grey-alpha.png", png(2, 1, 4, 8, [bytes([200, 100, 7, 0])]))
    valid(i, "rgb.png", png(2, 1, 2, 8, [bytes(range(6))]))
    valid(i, "rgba-16-bit.png", png(1, 1, 6, 16, [struct.pack(">HHHH", 65535, 0, 257, 32768)]))
    palette = struct.pack(">I", 6) + b"PLTE" + bytes([9, 8, 7, 1, 2, 3])
    palette += struct.pack(">I", zlib.crc32(palette[4:]))
    valid(i, "palette.png", png(8, 1, 3, 1, [b"\x55"], palette))
    valid(i, "png-named-jpeg.jpg", grey)
    valid(i, "rgb.bmp", bmp(1, 1, b"\1\2\3\0"))
    valid(i, "rgb.ppm", b"P6\n# comment\n2 1\n255\n" + bytes(range(6)))
    here = os.path.join(HERE, "..", "lab", "photos")
    photo = open(os.path.join(here, sorted(os.listdir(here))[0]), "rb").read()
    bad = lambda name, expect, data: invalid(i, name, expect, data)
    bad("empty.png", "the file is empty", b"")
    bad("text.jpg", "not an image of a known format", "this is no photo\n")
    bad("heic.jpg", "not an image of a known format",
        b"\0\0\0\x18ftypheic\0\0\0\0mif1heic" + b"\0" * 64)
    bad("cut.png", "cut.png", grey[:-30])
    bad("header-only.png", "header-only.png", grey[:33])
    bad("magic-only.png", "magic-only.png", grey[:8])
    bad("checksum.png", "checksum.png", grey[:29] + b"\0\0\0\0" + grey[33:])
    bad("width-zero.png", "width-zero.png", png(3, 2, 0, 8, [b"abc"] * 2, size=(0, 2)))
    bad("pixels-900-million.png", "more than the 500 megapixels",
        png(3, 2, 0, 8, [b"abc"] * 2, size=(30000, 30000)))
    bad("pixels-2-31.png", "pixels-2-31.png",
        png(3, 2, 0, 8, [b"abc"] * 2, size=(2**31 - 1, 2**31 - 1)))
    bad("pixels-100-million.png", "bytes cannot hold",
        png(3, 2, 0, 8, [b"abc"] * 2, size=(10000, 10000)))
    bad("fewer-rows-than-said.png", "fewer-rows-than-said.png",
        png(3, 2, 0, 8, [b"abc"] * 2, size=(3, 400)))
    bad("cut.jpg", "the JPEG file ends early", photo[:6000])
    bad("scanless.jpg", "scanless.jpg", photo[:200])
    bad("soi-only.jpg", "soi-only.jpg", b"\xff\xd8\xff\xe0")
    huge = bytearray(photo[:9000] + b"\xff\xd9")
    at = 2
    while huge[at + 1] not in (0xc0, 0xc1, 0xc2):
        at += 2 + struct.unpack(">H", huge[at + 2:at + 4])[0]
    huge[at + 5:at + 9] = struct.pack(">HH", 65000, 65000)
    bad("pixels-4-billion.jpg", "more than the 500 megapixels", bytes(huge[:at + 300] + b"\xff\xd9"))
    bad("width-huge.bmp", "width-huge.bmp", bmp(2**31 - 1, 2**31 - 1, b""))
    bad("cut.bmp", "cut.bmp", bmp(100, 100, b"\1\2\3\0"))
    bad("huge.ppm", "huge.ppm", b"P6\n1000000 1000000\n255\n" + b"\0" * 9)
    bad("cut.ppm", "cut.ppm", b"P6\n100 100\n255\n" + b"\0" * 9)
    tags = [(256, 4, 1, 70000), (257, 4, 1, 70000), (258, 3, 1, 8), (259, 3, 1, 1),
            (262, 3, 1, 1), (273, 4, 1, 200), (277, 3, 1, 1), (278, 4, 1, 70000),
            (279, 4, 1, 2**32 - 1)]
    bad("huge.tif", "huge.tif", tiff(tags, b"\0" * 64))
    bad("strips-2-32.tif", "tag 273 has more values than the file can hold",
        tiff([(256, 4, 1, 8), (257, 4, 1, 8), (273, 4, 2**32 - 1, 8), (279, 4, 2**32 - 1, 8),
              (258, 3, 1, 8), (262, 3, 1, 1), (277, 3, 1, 1)], b"\0" * 64))
    bad("huge.hdr", "huge.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 900000 +X 900000\n")
    bad("riff.webp", "riff.webp", b"RIFF" + struct.pack("<I", 2**32 - 1) + b"WEBPVP8L" + b"\xff" * 20)


# ---- EXR -----------------------------------------------------------------------------------------

def exr(width, height, channels, window=None, attributes=(), compression=0, samples=True):
    """Uncompressed scan lines. channels: (name, kind, value) with kind 0 uint, 1 half, 2 float."""
    def attribute(name, kind, data):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(data)) + data
    channels = sorted(channels)
    listed = b"".join(name.encode() + b"\0" + struct.pack("<iBBBBii", kind, 0, 0, 0, 0, 1, 1)
                      for name, kind, _ in channels) + b"\0"
    box = struct.pack("<iiii", *(window or (0, 0, width - 1, height - 1)))
    head = struct.pack("<II", 20000630, 2)
    head += attribute("channels", "chlist", listed)
    head += attribute("compression", "compression", bytes([compression]))
    head += attribute("dataWindow", "box2i", box) + attribute("displayWindow", "box2i", box)
    head += attribute("lineOrder", "lineOrder", b"\0")
    head += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    for name, text in attributes:
        head += attribute(name, "string", text.encode())
    head += b"\0"
    lines = []
    if samples:
        for y in range(height):
            line = b"".join(struct.pack("<" + "Ief"[kind], number)
                            for _, kind, number in channels for _ in range(width))
            top = window[1] if window else 0
            lines.append(struct.pack("<iI", top + y, len(line)) + line)
    at, table = len(head) + 8 * len(lines), b""
    for line in lines:
        table += struct.pack("<Q", at)
        at += len(line)
    return head + table + b"".join(lines)


def exrs():
    e = "exr-aov"
    layers = [("R", 1, 0.5), ("G", 1, 0.25), ("B", 1, 2.0), ("depth.Z", 2, 3.7),
              ("object_id", 0, 2**32 - 1), ("ViewLayer.Normal.X", 2, float("inf"))]
    whole = exr(4, 3, layers, attributes=[("comments", "grün"), ("owner", "")])
    valid(e, "layers.exr", whole)
    valid(e, "one-channel.exr", exr(1, 1, [("Y", 2, 0.1)]))
    valid(e, "window-elsewhere.exr", exr(2, 2, [("Z", 2, 1.5)], window=(-5, 7, -4, 8)))
    bad = lambda name, expect, data: invalid(e, name + ".exr", expect, data)
    bad("empty", "the file is empty", b"")
    bad("text", "not an EXR file", "no image\n")
    bad("magic-only", "magic-only.exr", whole[:8])
    bad("header-cut", "header-cut.exr", whole[:200])
    bad("pixels-cut", "pixels-cut.exr", whole[:-10])
    bad("table-missing", "table-missing.exr", exr(4, 3, layers, samples=False))
    bad("window-2-62", "window-2-62.exr",
        exr(1, 1, layers, window=(-2**30, -2**30, 2**30, 2**30)))
    bad("window-30000", "bytes cannot hold", exr(1, 1, layers, window=(0, 0, 29999, 29999)))
    bad("window-inside-out", "window-inside-out.exr", exr(1, 1, layers, window=(5, 5, 0, 0)))
    bad("no-channels", "no-channels.exr", exr(1, 1, []))
    bad("compression-99", "compression-99.exr", exr(1, 1, layers, compression=99))
    bad("compressed-by-name-only", "compressed-by-name-only.exr", exr(40, 30, layers, compression=3)[:-9])
    bad("attribute-2-32", "attribute-2-32.exr",
        whole.replace(b"string\0" + struct.pack("<I", 5), b"string\0" + b"\xff\xff\xff\xff"))


# ---- safetensors ---------------------------------------------------------------------------------

def tensors(header, data=b"", length=None):
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    return struct.pack("<Q", len(text) if length is None else length) + text + data


def tensor(dtype, shape, start, end):
    return {"dtype": dtype, "shape": shape, "data_offsets": [start, end]}


def tensor_files():
    t = "tensors"
    data = struct.pack("<ffff", 0.5, -1, 2, float("nan")) + bytes([1, 2, 3])
    two = {"__metadata__": {"step": "7"}, "means": tensor("F32", [2, 2], 0, 16),
           "mask": tensor("U8", [3], 16, 19)}
    valid(t, "two.safetensors", tensors(two, data))
    valid(t, "none.safetensors", tensors({}))
    valid(t, "scalar.safetensors", tensors({"a": tensor("U64", [], 0, 8)}, b"\xff" * 8))
    bad = lambda name, expect, data: invalid(t, name + ".safetensors", expect, data)
    bad("empty", "the file ends in the middle of its data", b"")
    bad("short", "the file ends in the middle of its data", b"\1\0\0")
    bad("text", "a header of", "this is no tensor file\n")
    bad("header-1e18", "a header of 1000000000000000000 bytes does not fit",
        tensors(two, data, length=10**18))
    bad("header-cut", "does not fit", tensors(two, data)[:40])
    bad("header-not-json", "(safetensors header)", tensors(b"[not json]", data))
    bad("data-cut", "but the file has", tensors(two, data)[:-1])
    bad("data-longer", "but the file has", tensors(two, data + b"x"))
    bad("hole", "(safetensors header)", tensors({"a": tensor("U8", [3], 16, 19)}, data))
    bad("overlap", "(safetensors header)",
        tensors({"a": tensor("U8", [3], 0, 3), "b": tensor("U8", [3], 2, 5)}, data))
    bad("backwards", "(safetensors header)", tensors({"a": tensor("U8", [3], 3, 0)}, data))
    bad("shape-1e18", "(safetensors header)",
        tensors({"a": tensor("F32", [10**18, 10**18], 0, 16)}, data[:16]))
    bad("shape-mismatch", "(safetensors header)", tensors({"a": tensor("F32", [5], 0, 16)}, data[:16]))
    bad("shape-negative", "(safetensors header)", tensors({"a": tensor("F32", [-4], 0, 16)}, data[:16]))
    bad("offset-1e18", "but the file has",
        tensors({"a": tensor("U8", [10**18], 0, 10**18)}, data))
    bad("type-unknown", "(safetensors header)", tensors({"a": tensor("F31", [4], 0, 16)}, data[:16]))
    bad("type-bf16", "elements of type BF16 (tensor \"a\")",
        tensors({"a": tensor("BF16", [8], 0, 16)}, data[:16]))


def main():
    for name in os.listdir(HERE):
        path = os.path.join(HERE, name)
        if os.path.isdir(path):
            shutil.rmtree(path)
    for part in (gaussians_valid, gaussians_invalid, points, captures, camera_paths, metrics_files,
                 run_records, images, exrs, tensor_files):
        part()


main()
