#!/usr/bin/env python3
"""A provider of the kinds relight and instruct-edit without a model: warm light from the prompt's word, a different exposure for
each picture, as models have it. For tests.

    "red 1.4" in the prompt multiplies linear red by 1.4; "green" and "blue" likewise.
"""

import json
import sys
import zlib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "editors"))
import png  # noqa: E402

DESCRIPTION = {
    "format": "motes/provider",
    "version": "1.0",
    "name": "warm-light",
    "program_version": "1",
    "kinds": ["relight", "instruct-edit"],
    "models": [{"id": "none", "license": "CC0-1.0"}],
    "deterministic": True,
}


def decode(v):
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4


def encode(v):
    return 12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055


def gains(prompt):
    words = prompt.split()
    value = {word: float(words[i + 1]) for i, word in enumerate(words[:-1]) if word in ("red", "green", "blue")}
    return [value.get(name, 1.0) for name in ("red", "green", "blue")]


def lit(folder, name, to, gain, background=None):
    width, height, rows = png.read(folder / name)
    if background:
        # The mean color of the background is the light.
        _, _, behind = png.read(folder / background)
        pixels = [row[c::3] for row in behind for c in (0, 1, 2)]
        mean = [decode(sum(map(sum, pixels[c::3])) / (255 * width * height)) for c in (0, 1, 2)]
        gain = [g * m / max(max(mean), 1e-6) for g, m in zip(gain, mean)]
    # Some pictures come out darker than others.
    exposure = 1.0 - 0.2 * (zlib.crc32(bytes(rows[height // 2])) % 3) / 2
    tables = [bytes(min(255, round(255 * encode(min(1.0, exposure * g * decode(v / 255))))) for v in range(256)) for g in gain]
    for row in rows:
        for c in (0, 1, 2):
            row[c::3] = bytes(row[c::3]).translate(tables[c])
    png.write(folder / to, width, height, rows)


class BadRequest(Exception):
    """What is wrong with a request, in one line."""


def answer(path):
    folder = path.parent
    try:
        ((kind, task),) = json.loads(path.read_text(encoding="utf-8"))["task"].items()
        if kind not in DESCRIPTION["kinds"]:
            raise ValueError(kind)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise BadRequest(f"not a request that is answered here: {error!r}: {path}") from error
    if kind == "relight":
        lit(folder, task["picture"], "lit.png", gains(task["prompt"]), task.get("background"))
        result = {"picture": "lit.png"}
    else:
        # The original says what to do, the start how far it is done: without noise nothing changes.
        names = []
        for k, view in enumerate(task["views"]):
            names.append(f"edited-{k}.png")
            keep = task["noise"] == 0
            lit(folder, view.get("start", view["original"]) if keep else view["original"], names[-1],
                [1, 1, 1] if keep else gains(task["prompt"]))
        result = {"pictures": names}
    reply = {"format": "motes/provider-reply", "version": "1.0", "result": {kind: result}}
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
        sys.exit(sys.stderr.write(f"warm-light: {error}\n") and 2)
