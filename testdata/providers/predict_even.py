#!/usr/bin/env python3
"""A provider of the kind predict without a model: every normal faces the camera, and the base color is the photo's own color, or
with --wrong that of its negative. For tests, and where one with a model begins.
"""

import json
import struct
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "editors"))
import png  # noqa: E402

WRONG = "--wrong" in sys.argv
DESCRIPTION = {
    "format": "motes/provider",
    "version": "1.0",
    "name": "predict-even",
    "program_version": "wrong" if WRONG else "1",
    "kinds": ["predict"],
    "models": [{"id": "none", "license": "CC0-1.0"}],
    "deterministic": True,
}


def write_exr(path, width, height, planes):
    """OpenEXR, 32-bit scanlines, not compressed; `planes` has lists of numbers by channel."""
    names = sorted(planes)

    def attribute(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value

    channels = b"".join(n.encode() + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for n in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2) + attribute("channels", "chlist", channels)
    header += attribute("compression", "compression", b"\0") + attribute("dataWindow", "box2i", window)
    header += attribute("displayWindow", "box2i", window) + attribute("lineOrder", "lineOrder", b"\0")
    header += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    header += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    header += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    size = 4 * width * len(names)
    first = len(header) + 8 * height
    offsets = b"".join(struct.pack("<Q", first + y * (size + 8)) for y in range(height))
    rows = b"".join(
        struct.pack("<ii", y, size)
        + b"".join(struct.pack("<%df" % width, *planes[n][y * width:(y + 1) * width]) for n in names)
        for y in range(height))
    path.write_bytes(header + offsets + rows)


def decode(v):
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4


class BadRequest(Exception):
    """What is wrong with a request, in one line."""


def answer(path):
    folder = path.parent
    try:
        task = json.loads(path.read_text(encoding="utf-8"))["task"]["predict"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadRequest(f"not a request that is answered here: {error!r}: {path}") from error
    maps = []
    for k, name in enumerate(task["pictures"]):
        width, height, rows = png.read(folder / name)
        flat = [0.0] * (width * height)
        for quantity in task["quantities"]:
            if quantity == "normal":
                planes = {"X": flat, "Y": flat, "Z": [-1.0] * (width * height)}
            elif quantity == "base-color":
                table = [decode((255 - v if WRONG else v) / 255) for v in range(256)]
                planes = {n: [table[v] for row in rows for v in row[c::3]] for c, n in enumerate("RGB")}
            else:
                planes = {"Z" if quantity == "depth" else "Y": flat}
            file = "%s-%d.exr" % (quantity, k)
            write_exr(folder / file, width, height, planes)
            maps.append({"picture": k, "quantity": quantity, "map": file})
    reply = {"format": "motes/provider-reply", "version": "1.0", "result": {"predict": {"maps": maps}}}
    (folder / "reply.json").write_text(json.dumps(reply), encoding="utf-8")
    return folder / "reply.json"


def serve():
    for line in sys.stdin:
        try:
            said = {"reply": str(answer(Path(json.loads(line)["request"])))}
        except BadRequest as error:
            said = {"error": str(error), "exit_code": 2}
        print(json.dumps(said), flush=True)


if "--describe" in sys.argv:
    print(json.dumps(DESCRIPTION))
elif "--serve" in sys.argv:
    serve()
else:
    try:
        answer(Path(sys.argv[sys.argv.index("--request") + 1]))
    except BadRequest as error:
        sys.exit(sys.stderr.write(f"predict-even: {error}\n") and 2)
