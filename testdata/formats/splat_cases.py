"""Gaussians in the formats of other programs."""

import base64
import gzip
import io
import json
import os
import shutil
import struct
import zipfile

from cases import HERE, invalid, put, valid
from ply_cases import LE, ply

N = 5


def f32(*values):
    return struct.pack(f"<{len(values)}f", *values)


def f16(*values):
    return struct.pack(f"<{len(values)}e", *values)


def splats():
    rows = b"".join(f32(i, 0.5 * i, -1.0, 0.1, 0.2, 0.3 + i) + bytes([10 * i, 128, 255, 200 - i])
                    + bytes([255, 128, 128, 128 + i]) for i in range(N))
    valid("splat", "five.splat", rows)
    bad = lambda name, expect, data: invalid("splat", name + ".splat", expect, data)
    bad("empty", "this one has 0", b"")
    bad("cut", "a .splat file has 32 bytes per Gaussian, this one has 153", rows[:-7])
    bad("negative-scale", "the scale of Gaussian 1 is", rows[:44] + f32(-1.0) + rows[48:])
    bad("not-a-number", "the scale of Gaussian 0 is", rows[:12] + f32(float("nan")) + rows[16:])


def spz_streams(version, degree, n=N):
    k = 3 * ((degree + 1) ** 2 - 1)
    byte = lambda i, j: (37 * i + 11 * j) % 256
    position = [f16(i, -i, 0.5) if version == 1 else
                b"".join((4096 * v & 0xffffff).to_bytes(3, "little") for v in (i, -i, 2))
                for i in range(n)]
    rotation = [bytes([128, 140, 110]) if version < 3 else
                struct.pack("<I", 3 << 30 | (100 + i) << 20 | 612 << 10 | 50) for i in range(n)]
    return [b"".join(position), bytes(200 + i for i in range(n)),
            bytes(byte(i, j) for i in range(n) for j in range(3)),
            bytes(60 + byte(i, j) // 8 for i in range(n) for j in range(3)), b"".join(rotation),
            bytes(100 + byte(i, j) // 4 for i in range(n) for j in range(k))]


def spz_header(version, degree, n=N, magic=0x5053474e, bits=12, flags=0, last=0):
    return struct.pack("<IIIBBBB", magic, version, n, degree, bits, flags, last)


def spz_gzip(version, degree, streams=None, **header):
    body = b"".join(spz_streams(version, degree) if streams is None else streams)
    return gzip.compress(spz_header(version, degree, **header) + body, mtime=0)


def zstd_frame(data):
    """One segment of one raw block."""
    return (struct.pack("<IBQ", 0xfd2fb528, 0xe0, len(data))
            + (len(data) << 3 | 1).to_bytes(3, "little") + data)


def spz_zstd(degree, streams=None, table=32, sizes=None, **header):
    streams = spz_streams(4, degree) if streams is None else streams
    frames = [zstd_frame(s) for s in streams]
    raw = [len(s) for s in streams] if sizes is None else sizes
    head = spz_header(4, degree, last=len(frames), **header) + struct.pack("<I12x", table)
    return (head + b"".join(struct.pack("<QQ", len(f), r) for f, r in zip(frames, raw))
            + b"".join(frames))


def spz():
    for version in (1, 2, 3):
        valid("spz", f"version-{version}.spz", spz_gzip(version, 2))
    valid("spz", "version-4.spz", spz_zstd(3))
    valid("spz", "version-4-degree-4.spz", spz_zstd(4))
    valid("spz", "degree-0.spz", spz_gzip(3, 0))
    valid("spz", "antialiased.spz", spz_gzip(3, 1, flags=1))
    extension = struct.pack("<II", 0xadbe0002, 12) + f32(1, 2, 3)
    valid("spz", "extension-passed-over.spz",
          spz_gzip(3, 1, streams=[extension] + spz_streams(3, 1), flags=2))
    bad = lambda name, expect, data: invalid("spz", name + ".spz", expect, data)
    whole = spz_gzip(3, 2)
    bad("cut", "cannot be decompressed", whole[:-20])
    bad("header-cut", "the header", gzip.compress(spz_header(3, 0)[:14], mtime=0))
    bad("magic", "the magic number is not NGSP", spz_gzip(3, 1, magic=7))
    bad("version-9", "spz version 9", spz_gzip(9, 1))
    bad("version-4-in-gzip", "version 4 in a gzip stream", spz_gzip(4, 1))
    bad("degree-7", "the SH degree is 7", spz_gzip(3, 7, streams=[]))
    bad("fractional-bits", "coordinates have 77 fractional bits", spz_gzip(3, 1, bits=77))
    bad("rows-4e9", "4294967295 Gaussians of SH degree 1 take", spz_gzip(3, 1, n=2**32 - 1))
    bad("one-row-too-few", "there are at least", spz_gzip(3, 1, n=N - 1))
    bad("text", "cannot be decompressed", b"\x1f\x8b and then text")
    four = spz_zstd(3)
    bad("v4-cut", "take", four[:-9])
    bad("v4-header-cut", "the table of streams is said to be at byte 32", four[:20])
    bad("v4-table", "the table of streams is said to be at byte 9999999", spz_zstd(3, table=9999999))
    bad("v4-rows-4e9", "is said to have 45 when decompressed", spz_zstd(3, n=2**32 - 1))
    sizes = [len(s) for s in spz_streams(4, 3)]
    bad("v4-sizes", "is said to have 44 when decompressed", spz_zstd(3, sizes=[44] + sizes[1:]))
    bad("v4-stream-short", "44 bytes instead of 45",
        spz_zstd(3, streams=[spz_streams(4, 3)[0][:-1]] + spz_streams(4, 3)[1:], sizes=sizes))
    bad("v4-streams-2", "2 streams instead of 6", spz_zstd(3, streams=spz_streams(4, 3)[:2]))
    broken = bytearray(four)
    broken[32 + 96] ^= 0xff
    bad("v4-frame", "cannot be decompressed", bytes(broken))


def ksplat_file(level, degree=1, n=N, count=None, sections=1, capacity=2, major=0, minor=1,
                bucket=None):
    """Two full buckets of two splats and one of the rest."""
    number = f32 if level == 0 else f16
    harmonics = [0, 9, 24, 45][degree]
    header = bytearray(4096)
    struct.pack_into("<BB2xI8xIH", header, 0, major, minor, sections, n if count is None else count,
                     level)
    struct.pack_into("<ff", header, 36, -2.0, 2.0)
    section = bytearray(1024)
    struct.pack_into("<IIIIfH2xI4xII", section, 0, n, n, capacity, 3, 4.0, 12, 0, 2, 1)
    struct.pack_into("<H", section, 40, degree)
    rows = b""
    for i in range(n):
        where = f32(i, -i, 0.25) if level == 0 else struct.pack("<3H", 32767 + 100 * i, 32767, 5)
        sh = [(j % 7 - 3) / 4 for j in range(harmonics)]
        tail = number(*sh) if level < 2 else bytes(int((v + 2) / 4 * 255) for v in sh)
        rows += (where + number(0.1, 0.2, 0.3) + number(1, 0, 0.5, i / 8)
                 + bytes([i, 2 * i, 30, 128 + i]) + tail)
    buckets = b"".join(f32(10.0 * b, 1, 2) for b in range(3))
    lengths = struct.pack("<I", n - 4 if bucket is None else bucket)
    return bytes(header) + bytes(section) * sections + lengths + buckets + rows


def ksplat():
    for level in range(3):
        valid("ksplat", f"level-{level}.ksplat", ksplat_file(level, degree=level))
    bad = lambda name, expect, data: invalid("ksplat", name + ".ksplat", expect, data)
    whole = ksplat_file(1)
    bad("cut", "splats take", whole[:-9])
    bad("header-cut", "the header take 4096 bytes", whole[:100])
    bad("version", "ksplat version 7.1", ksplat_file(1, major=7))
    bad("level-5", "compression level 5", whole[:20] + b"\x05" + whole[21:])
    bad("sections-4e9", "the section headers take", whole[:4] + b"\xff" * 4 + whole[8:])
    bad("count", "the header promises 6 splats, the sections have 5", ksplat_file(1, count=6))
    bad("splats-4e9", "splats take", whole[:4096] + b"\xff" * 8 + whole[4104:])
    bad("degree-9", "SH degree 9", whole[:4136] + b"\x09" + whole[4137:])
    bad("bucket", "a splat is in bucket", ksplat_file(1, n=8, bucket=1))


def gltf_parts(n=N, degree=1, change=None):
    prefix = "KHR_gaussian_splatting:"
    columns = [("POSITION", "VEC3", [v for i in range(n) for v in (i, -i, 0.5)]),
               (prefix + "ROTATION", "VEC4", [0, 0, 0.6, 0.8] * n),
               (prefix + "SCALE", "VEC3", [0.1, 0.2, 0.3] * n),
               (prefix + "OPACITY", "SCALAR", [0.25 + i / 8 for i in range(n)])]
    for band in range(degree + 1):
        for c in range(2 * band + 1):
            columns.append((f"{prefix}SH_DEGREE_{band}_COEF_{c}", "VEC3",
                            [(i + c - band) / 8 for i in range(3 * n)]))
    columns.append(("_ROUGHNESS", "SCALAR", [i / 10 for i in range(n)]))
    binary, views, accessors, attributes = b"", [], [], {}
    for name, shape, values in columns:
        data = f32(*values)
        attributes[name] = len(views)
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126, "count": n,
                          "type": shape})
        binary += data
    document = {
        "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_gaussian_splatting"], "scene": 0,
        "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "mode": 0, "extensions": {
            "KHR_gaussian_splatting": {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}}}]}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(binary)}]}
    if change:
        change(document)
    return document, binary


def glb_file(document, binary, length=None):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + len(binary)
    return (struct.pack("<4sII", b"glTF", 2, total if length is None else length)
            + struct.pack("<I4s", len(text), b"JSON") + text
            + struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def gltf():
    document, binary = gltf_parts()
    valid("gltf", "same-binary.glb", glb_file(document, binary))
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + \
        base64.b64encode(binary).decode()
    valid("gltf", "same-embedded.gltf", json.dumps(document))
    valid("gltf", "linear.glb", glb_file(*gltf_parts(degree=0, change=lambda d: d["meshes"][0][
        "primitives"][0]["extensions"]["KHR_gaussian_splatting"].update(
            colorSpace="lin_rec709_display"))))

    def bad(name, expect, change=None, **more):
        invalid("gltf", name + ".glb", expect, glb_file(*gltf_parts(change=change), **more))

    def at(d, *path):
        for key in path[:-1]:
            d = d[key]
        return d, path[-1]

    def put_at(value, *path):
        def change(d):
            holder, key = at(d, *path)
            holder[key] = value
        return change

    whole = glb_file(*gltf_parts())
    invalid("gltf", "cut.glb", "the header promises", whole[:-4])
    invalid("gltf", "header-cut.glb", "the length take", whole[:10])
    invalid("gltf", "version-1.glb", "binary glTF of version 1", whole[:4] + b"\1" + whole[5:])
    invalid("gltf", "chunk-4e9.glb", "the chunk take", whole[:12] + b"\xff" * 4 + whole[16:])
    invalid("gltf", "no-json.glb", "there is no JSON chunk", struct.pack("<4sII", b"glTF", 2, 12))
    invalid("gltf", "text.gltf", "not a glTF document", "{ not json")
    bad("count-4e9", "4000000000 values do not fit", put_at(4 * 10**9, "accessors", 0, "count"))
    bad("count-1e18", "1000000000000000000 values", put_at(10**18, "accessors", 1, "count"))
    bad("counts-differ", "5 positions, but 4 values", put_at(4, "accessors", 2, "count"))
    bad("view-beyond", "its buffer view ends beyond",
        put_at(10**12, "bufferViews", 0, "byteOffset"))
    bad("stride", "values do not fit", put_at(2**60, "bufferViews", 0, "byteStride"))
    bad("type", "its type is", put_at("VEC2", "accessors", 0, "type"))
    bad("component", "9 is not a component type", put_at(9, "accessors", 0, "componentType"))
    bad("no-splats", "the scene has no Gaussian splats",
        put_at({}, "meshes", 0, "primitives", 0, "extensions"))
    bad("compressed", "requires the extension", put_at(["KHR_other"], "extensionsRequired"))
    bad("ring", "the nodes do not form a tree", put_at([0], "nodes", 0, "children"))
    bad("no-mesh", "there is no mesh 7", put_at(7, "nodes", 0, "mesh"))
    bad("sheared", "scaled unevenly", put_at([1, 2, 3], "nodes", 0, "scale"))
    bad("absolute-buffer", "is absolute", put_at("/etc/passwd", "buffers", 0, "uri"))
    bad("buffer-short", "bytes instead of", put_at(10**9, "buffers", 0, "byteLength"))
    bad("without-opacity", "OPACITY is missing",
        lambda d: d["meshes"][0]["primitives"][0]["attributes"].pop(
            "KHR_gaussian_splatting:OPACITY"))
    bad("half-a-degree", "SH_DEGREE_1_COEF_2 is missing",
        lambda d: d["meshes"][0]["primitives"][0]["attributes"].pop(
            "KHR_gaussian_splatting:SH_DEGREE_1_COEF_2"))


def compressed_file(n=300, degree=1, chunks=None, colors=True, sh_rows=None):
    bounds = [f"{m}_{a}" for m in ("min", "max") for a in "xyz"]
    bounds += [f"{m}_scale_{a}" for m in ("min", "max") for a in "xyz"]
    bounds += [f"{m}_{a}" for m in ("min", "max") for a in "rgb"] if colors else []
    chunks = (n + 255) // 256 if chunks is None else chunks
    rest = 3 * ((degree + 1) ** 2 - 1)
    head = ["ply", f"format {LE} 1.0", f"element chunk {chunks}"]
    head += [f"property float {b}" for b in bounds] + [f"element vertex {n}"]
    head += [f"property uint packed_{p}" for p in ("position", "rotation", "scale", "color")]
    if rest:
        head += [f"element sh {n if sh_rows is None else sh_rows}"]
        head += [f"property uchar f_rest_{i}" for i in range(rest)]
    row = [-1.0, -2.0, -3.0, 1.0, 2.0, 3.0, -6.0, -6.0, -6.0, -2.0, -2.0, -2.0]
    row += [0.0, 0.0, 0.0, 1.0, 0.9, 0.8] if colors else []
    body = f32(*row) * chunks
    body += b"".join(struct.pack("<4I", i * 2654435761 % 2**32, i * 40503 % 2**30 | i % 4 << 30,
                                 i * 97531 % 2**32, i * 8675309 % 2**32) for i in range(n))
    body += bytes((i * 7) % 256 for i in range(rest * (n if sh_rows is None else sh_rows)))
    return ("\n".join(head) + "\nend_header\n").encode() + body


def compressed():
    c = "compressed-ply"
    for degree in range(4):
        valid(c, f"degree-{degree}.compressed.ply", compressed_file(degree=degree))
    valid(c, "first-version.compressed.ply", compressed_file(n=40, colors=False))
    bad = lambda name, expect, data: invalid(c, name + ".compressed.ply", expect, data)
    bad("cut", "but the file has", compressed_file()[:-1])
    bad("too-few-chunks", "300 Gaussians need 2 chunks, there are 1", compressed_file(chunks=1))
    bad("too-few-harmonics", "299 rows of harmonics for 300", compressed_file(sh_rows=299))
    bad("rows-4e9", "the header promises 4000000000 rows",
        compressed_file().replace(b"element vertex 300", b"element vertex 4000000000"))
    bad("no-vertex-column", "property \"packed_scale\" is missing",
        compressed_file().replace(b"packed_scale", b"packed_scala"))
    bad("without-chunks", "there is no element chunk",
        ply(LE, [("uint", n, lambda r: 5) for n in
                 ("packed_position", "packed_rotation", "packed_scale", "packed_color")], 2))
    bad("harmonics-8", "there is data after the last row",
        compressed_file().replace(b"property uchar f_rest_8\n", b""))


def sog():
    """Valid ones come from splat-transform: an encoder of WebP would be longer than all this."""
    peers = os.path.join(HERE, "..", "splats-by-others")
    for name in sorted(os.listdir(peers)):
        if name.endswith(".sog"):
            with open(os.path.join(peers, name), "rb") as file:
                valid("sog", name, file.read())
    with open(os.path.join(peers, "degree-1.sog"), "rb") as file:
        archive = zipfile.ZipFile(io.BytesIO(file.read()))
    good = {name: archive.read(name) for name in archive.namelist()}

    def pack(files):
        data = io.BytesIO()
        with zipfile.ZipFile(data, "w") as out:
            for name, content in files.items():
                out.writestr(zipfile.ZipInfo(name), content)
        return data.getvalue()

    def changed(**values):
        meta = json.loads(good["meta.json"])
        meta.update(values)
        return pack({**good, "meta.json": json.dumps(meta)})

    bad = lambda name, expect, data: invalid("sog", name + ".sog", expect, data)
    whole = pack(good)
    bad("cut", "the zip archive cannot be read", whole[:-40])
    bad("no-meta", "the archive has no file meta.json", pack({"other.txt": "x"}))
    bad("no-image", "the archive has no file quats.webp",
        pack({k: v for k, v in good.items() if k != "quats.webp"}))
    bad("meta-text", "not the JSON of a SOG", pack({**good, "meta.json": "{"}))
    bad("version-1", "SOG version 1", pack({**good, "meta.json": "{}"}))
    bad("version-3", "SOG version 3", changed(version=3))
    bad("count-1e12", "more than the 2^32 - 1 that fit", changed(count=10**12))
    bad("count-4e9", "bytes cannot hold", changed(count=4 * 10**9))
    bad("count-more", "pixels for", changed(count=100000))
    bad("image-text", "not a WebP image", pack({**good, "scales.webp": "text"}))
    bad("image-cut", "not a WebP image that can be read",
        pack({**good, "sh0.webp": good["sh0.webp"][:40]}))
    bad("codebook-empty", "a codebook is empty",
        changed(scales={"codebook": [], "files": ["scales.webp"]}))
    bad("no-name", "an image has no name", changed(quats={"files": []}))
    harmonics = json.loads(good["meta.json"])["shN"]
    bad("bands-9", "9 bands", changed(shN={**harmonics, "bands": 9}))
    bad("palette-1", "has label", changed(shN={**harmonics, "count": 1}))
    bad("bands-other", "pixels", changed(shN={**harmonics, "bands": 3}))
