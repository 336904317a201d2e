"""Photos, OpenEXR images and safetensors files."""

import json
import os
import struct
import zlib

from cases import HERE, invalid, valid


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
    gray = png(3, 2, 0, 8, [bytes([0, 128, 255]), bytes([1, 2, 3])])
    valid(i, "gray.png", gray)
    valid(i, "gray-1-bit.png", png(3, 2, 0, 1, [b"\xa0", b"\x40"]))
    valid(i, "gray-16-bit.png", png(2, 1, 0, 16, [struct.pack(">HH", 65535, 300)]))
    valid(i, "gray-alpha.png", png(2, 1, 4, 8, [bytes([200, 100, 7, 0])]))
    valid(i, "rgb.png", png(2, 1, 2, 8, [bytes(range(6))]))
    valid(i, "rgba-16-bit.png", png(1, 1, 6, 16, [struct.pack(">HHHH", 65535, 0, 257, 32768)]))
    palette = struct.pack(">I", 6) + b"PLTE" + bytes([9, 8, 7, 1, 2, 3])
    palette += struct.pack(">I", zlib.crc32(palette[4:]))
    valid(i, "palette.png", png(8, 1, 3, 1, [b"\x55"], palette))
    valid(i, "png-named-jpeg.jpg", gray)
    valid(i, "rgb.bmp", bmp(1, 1, b"\1\2\3\0"))
    valid(i, "rgb.ppm", b"P6\n# comment\n2 1\n255\n" + bytes(range(6)))
    here = os.path.join(HERE, "..", "lab", "photos")
    photo = open(os.path.join(here, sorted(os.listdir(here))[0]), "rb").read()
    bad = lambda name, expect, data: invalid(i, name, expect, data)
    bad("empty.png", "the file is empty", b"")
    bad("text.jpg", "not an image of a known format", "this is no photo\n")
    bad("heic.jpg", "HEIC and AVIF pictures are not read",
        b"\0\0\0\x18ftypheic\0\0\0\0mif1heic" + b"\0" * 64)
    bad("cut.png", "cut.png", gray[:-30])
    bad("header-only.png", "header-only.png", gray[:33])
    bad("magic-only.png", "magic-only.png", gray[:8])
    bad("checksum.png", "checksum.png", gray[:29] + b"\0\0\0\0" + gray[33:])
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


def environments():
    e = "environment"
    rgb = [("R", 1, 0.5), ("G", 1, 0.25), ("B", 1, 2.0)]
    valid(e, "half.exr", exr(4, 2, rgb))
    valid(e, "float-with-alpha.exr", exr(2, 1, [(n, 2, v) for n, _, v in rgb] + [("A", 2, 1.0)]))
    valid(e, "layer.exr", exr(2, 1, [("Sky." + n, 2, v) for n, _, v in rgb]))
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
    # 128 + 2: a mantissa of 64 / 256 times four is one.
    valid(e, "flat.hdr", head + b"-Y 1 +X 2\n" + bytes([32, 16, 128, 130]) * 2)
    bad = lambda name, expect, data: invalid(e, name, expect, data)
    bad("empty.exr", "the file is empty", b"")
    bad("photo.exr", "neither an OpenEXR nor a Radiance file", b"\x89PNG\r\n\x1a\n" + b"\0" * 60)
    bad("no-color.exr", "there are no channels R, G and B, only depth.Z",
        exr(1, 1, [("depth.Z", 2, 1.0)]))
    bad("window-30000.exr", "bytes cannot hold", exr(1, 1, rgb, window=(0, 0, 29999, 29999)))
    bad("pixels-cut.exr", "pixels-cut.exr", exr(4, 2, rgb)[:-5])
    bad("huge.hdr", "huge.hdr", head + b"-Y 900000 +X 900000\n")
    bad("cut.hdr", "cut.hdr", head + b"-Y 40 +X 20\n" + b"\1" * 9)
    bad("header-only.hdr", "header-only.hdr", b"#?RADIANCE\n")


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
