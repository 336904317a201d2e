"""Gaussian and point PLY files."""

import struct
import zlib

from cases import invalid, valid

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
    valid(G, "colors-instead-of-sh.ply", ply(LE, rgb, 4, comments=["Vertical Axis: z"]))
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
    bad("keyword-unknown", "\"propertie\" is not a PLY keyword (ply header line 4)",
        whole.replace(b"property", b"propertie", 1))
    bad("type-unknown", "\"quad\" is not a PLY type (ply header line 4)",
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
    bad("missing-color", "property \"f_dc_0\" is missing",
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
    valid(p, "same-colors.ply", ply(LE, xyz + rgb, 4))
    valid(p, "same-ascii.ply", ply("ascii", rgb + xyz, 4))
    valid(p, "same-doubles.ply", ply(BE, floats(["x", "y", "z"], "double") + rgb, 4))
    valid(p, "same-with-normals.ply", ply(LE, xyz + floats(["nx", "ny", "nz"]) + rgb, 4))
    valid(p, "no-colors.ply", ply(LE, xyz, 4))
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


def surface(order="<", vertices=None, columns=None, faces=((0, 1, 2), (2, 1, 3)), count=None,
            list_type="uchar", item="int", name="vertex_indices", extra="", encoding=None):
    """Four vertices and two triangles; columns: names of float columns in their order."""
    columns = columns or SURFACE
    text = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = ["ply", f"format {encoding or text} 1.0", f"element vertex {4 if vertices is None else vertices}"]
    head += [f"property float {c}" for c in columns]
    head += [f"element face {len(faces) if count is None else count}",
             f"property list {list_type} {item} {name}"] + ([extra] if extra else []) + ["end_header"]
    cells = dict(nx=0.0, ny=0.0, nz=1.0, roughness=0.25, metallic=1.0)
    body = b""
    for row in range(4 if vertices is None else min(vertices, 4)):
        cells.update(x=row % 2, y=row // 2, z=0.5, base_color_0=row / 4, base_color_1=0.5, base_color_2=1.0)
        body += b"".join(struct.pack(order + "f", cells.get(c, 7.0)) for c in columns)
    for face in faces:
        body += struct.pack(order + STRUCT[list_type], len(face))
        body += b"".join(struct.pack(order + STRUCT[item], v) for v in face)
        if extra:
            body += struct.pack(order + "f", 9.0)
    return ("\n".join(head) + "\n").encode() + body


SURFACE = ["x", "y", "z", "nx", "ny", "nz", "base_color_0", "base_color_1", "base_color_2",
           "roughness", "metallic"]


def surfaces():
    s = "surface-ply"
    valid(s, "same-plain.ply", surface())
    valid(s, "same-big-endian.ply", surface(">"))
    valid(s, "same-other-order.ply", surface(columns=SURFACE[::-1] + ["quality"]))
    valid(s, "same-wide-lists.ply", surface(list_type="uint", item="short", name="vertex_index"))
    valid(s, "same-face-columns.ply", surface(extra="property float area"))
    valid(s, "no-material.ply", surface(columns=SURFACE[:6]))
    valid(s, "no-rows.ply", surface(vertices=0, faces=()))
    bad = lambda name, expect, data: invalid(s, name + ".ply", expect, data)
    bad("ascii", "binary PLY files only", surface(encoding="ascii"))
    bad("no-faces", "there is no element face", ply(LE, floats(SURFACE), 2))
    bad("no-normals", "property \"nx\" of the vertices is missing", surface(columns=SURFACE[:3]))
    bad("half-a-material", "property \"metallic\" of the vertices is missing",
        surface(columns=SURFACE[:-1]))
    bad("quad", "face 1 has 4 corners", surface(faces=((0, 1, 2), (0, 1, 3, 2))))
    bad("corner-beyond", "[2, 1, 4] names a vertex of 4", surface(faces=((0, 1, 2), (2, 1, 4))))
    bad("corner-negative", "face 0 has the corner -1", surface(faces=((0, 1, -1),)))
    bad("list-negative", "face 0 has -3 corners",
        surface(list_type="char")[:-26] + b"\xfd" + b"\0" * 25)
    bad("corners-float", "no list vertex_indices of whole numbers", surface(item="float"))
    bad("not-a-number", "(row 0 of vertex)", surface().replace(struct.pack("<f", 0.5),
                                                               struct.pack("<f", float("nan")), 1))
    bad("cut", "but the file has", surface(vertices=4)[:-30])
    bad("cut-in-face", "the file ends in row 1 of the 2 rows of element \"face\"", surface()[:-1])
    bad("longer", "there is data after the last row", surface() + b"abc")
    bad("rows-1e18", "1000000000000000000 rows are more than", surface(count=10**18))
    bad("rows-4e9", "but the file has", surface(count=4 * 10**9))
