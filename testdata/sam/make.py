#!/usr/bin/env python3
"""Makes the ONNX files of this folder: graphs with the inputs and outputs of exports of SAM, whose result is a known function.

A mask is where the color is that of the clicked place: no weights, a few kB, and wrong as soon as a click lands elsewhere.
`expected.json` holds what ONNX Runtime computes, with the steps before and after it written down again in NumPy.

    python3 -m venv venv && venv/bin/pip install onnx onnxruntime numpy pillow
    venv/bin/python testdata/sam/make.py
"""

import json
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper
from PIL import Image

HERE = Path(__file__).parent
SIDE, GRID = 64, 16
FLOAT, INT64 = TensorProto.FLOAT, TensorProto.INT64
MEAN = {False: [123.675, 116.28, 103.53], True: [255 * v for v in (0.485, 0.456, 0.406)]}
DEVIATION = {False: [58.395, 57.12, 57.375], True: [255 * v for v in (0.229, 0.224, 0.225)]}
ORDER = ["single", "subpart", "whole", "part"]
# Pixels between those whose logits are kept.
EVERY = 13
SCORES = [0.70, 0.60, 0.93, 0.84]


class Graph:
    """A graph under construction; calling an operator's name adds it."""

    def __init__(self):
        self.nodes, self.constants, self.count = [], [], 0

    def name(self):
        self.count += 1
        return f"t{self.count}"

    def constant(self, value, dtype=np.float32):
        name = self.name()
        self.constants.append(numpy_helper.from_array(np.array(value, dtype), name))
        return name

    def __getattr__(self, op):
        def add(*inputs, out=None, **attributes):
            inputs = [i if isinstance(i, str) else self.constant(i) for i in inputs]
            out = out or self.name()
            self.nodes.append(helper.make_node(op, inputs, [out], **attributes))
            return out

        return add

    def shape(self, value, sizes):
        return self.Reshape(value, self.constant(sizes, np.int64))

    def reduce(self, op, value, axes, keep=0):
        return getattr(self, op)(value, self.constant(axes, np.int64), keepdims=keep)

    def save(self, path, inputs, outputs):
        values = lambda items: [helper.make_tensor_value_info(n, t, s) for n, t, s in items]
        graph = helper.make_graph(self.nodes, "g", values(inputs), values(outputs), self.constants)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=8)
        onnx.checker.check_model(model, full_check=True)
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(model.SerializeToString())


def centers():
    line = (np.arange(GRID) + 0.5) * SIDE / GRID
    x, y = np.meshgrid(line, line)
    return np.stack([x, y]).astype(np.float32)


def encoder(kind):
    """Colors, averaged over 4 x 4 pixels."""
    g = Graph()
    if kind == "colors":
        # As samexporter does with its preprocessing: colors 0 to 255 of the filled part.
        name, given = "input_image", ["image_height", "image_width", 3]
        image = g.Div(g.Sub(name, MEAN[False]), DEVIATION[False])
        image = g.Unsqueeze(g.Transpose(image, perm=[2, 0, 1]), g.constant([0], np.int64))
        missing = g.Sub(g.constant([1, 3, SIDE, SIDE], np.int64), g.Shape(image))
        pads = g.Concat(g.constant([0, 0, 0, 0], np.int64), missing, axis=0)
        image = g.shape(g.Pad(image, pads), [1, 3, SIDE, SIDE])
    else:
        name = {"meta": "images", "js": "pixel_values", "sam2": "image", "sam2-js": "pixel_values"}[kind]
        image, given = name, [1, 3, SIDE, SIDE]
    pooled = dict(kernel_shape=[4, 4], strides=[4, 4])
    size = [1, 3, GRID, GRID]
    if kind in ("sam2", "sam2-js"):
        names = ["high_res_feats_0", "high_res_feats_1", "image_embed"]
        if kind == "sam2-js":
            names = [f"image_embeddings.{k}" for k in range(3)]
        mean = g.AveragePool(image, **pooled)
        for out, share in zip(names, [0.25, 0.25, 0.5]):
            g.Mul(mean, share, out=out)
        outputs = [(n, FLOAT, size) for n in names]
    else:
        mean = g.AveragePool(image, out="image_embeddings", **pooled)
        outputs = [("image_embeddings", FLOAT, size)]
        if kind == "js":
            nothing = g.Mul(g.reduce("ReduceSum", mean, [0, 1, 2, 3], 0), 0.0)
            g.Add(g.constant(centers()[None]), nothing, out="image_positional_embeddings")
            outputs.append(("image_positional_embeddings", FLOAT, [1, 2, GRID, GRID]))
    g.save(HERE / kind / "vision_encoder.onnx", [(name, FLOAT, given)], outputs)


def inputs_of(kind):
    js = kind in ("js", "sam2-js")
    size, points = [1, 3, GRID, GRID], [1, 1, "n", 2] if js else [1, "n", 2]
    names = ("input_points", "input_labels") if js else ("point_coords", "point_labels")
    inputs = [(names[0], FLOAT, points), (names[1], INT64 if js else FLOAT, points[:-1])]
    embeddings = {
        "js": [("image_embeddings", FLOAT, size), ("image_positional_embeddings", FLOAT, [1, 2, GRID, GRID])],
        "sam2": [(n, FLOAT, size) for n in ("image_embed", "high_res_feats_0", "high_res_feats_1")],
        "sam2-js": [(f"image_embeddings.{k}", FLOAT, size) for k in range(3)],
    }.get(kind, [("image_embeddings", FLOAT, size)])
    inputs += embeddings
    if kind == "sam2-js":
        inputs.append(("input_boxes", FLOAT, [1, "boxes", 4]))
    if not js:
        inputs += [("mask_input", FLOAT, [1, 1, GRID, GRID]), ("has_mask_input", FLOAT, [1])]
    if kind in ("meta", "colors"):
        inputs.append(("orig_im_size", FLOAT, [2]))
    return inputs, [e[0] for e in embeddings if e[0] != "image_positional_embeddings"]


def inside(g, x, y, corners):
    """1 in the box, per cell."""
    x0, y0, x1, y1 = (g.shape(g.Gather(corners, g.constant(k, np.int64), axis=0), [1, 1]) for k in range(4))
    tests = [g.GreaterOrEqual(x, x0), g.LessOrEqual(x, x1), g.GreaterOrEqual(y, y0), g.LessOrEqual(y, y1)]
    return g.Cast(g.And(g.And(tests[0], tests[1]), g.And(tests[2], tests[3])), to=FLOAT)


def decoder(kind):
    g = Graph()
    js = kind in ("js", "sam2-js")
    inputs, embeddings = inputs_of(kind)
    parts = [g.shape(name, [3, GRID * GRID]) for name in embeddings]
    colors = parts[0]
    for part in parts[1:]:
        colors = g.Add(colors, part)
    grid = "image_positional_embeddings" if kind == "js" else g.constant(centers())
    grid = g.shape(grid, [2, GRID * GRID])
    x = g.Gather(grid, g.constant([0], np.int64), axis=0)
    y = g.Gather(grid, g.constant([1], np.int64), axis=0)
    points = g.Add(g.shape(inputs[0][0], [-1, 2]), 0.5)
    labels = g.shape(g.Cast(inputs[1][0], to=FLOAT), [-1, 1])
    px = g.Gather(points, g.constant([0], np.int64), axis=1)
    py = g.Gather(points, g.constant([1], np.int64), axis=1)
    square = lambda v: g.Mul(v, v)
    far = g.Add(square(g.Sub(px, x)), square(g.Sub(py, y)))
    near = g.Softmax(g.Mul(far, -0.08), axis=1)
    clicked = g.MatMul(near, g.Transpose(colors, perm=[1, 0]))
    apart = g.Sub(g.Unsqueeze(clicked, g.constant([2], np.int64)), g.Unsqueeze(colors, g.constant([0], np.int64)))
    apart = g.reduce("ReduceSum", square(apart), [1])
    is_label = lambda v: g.Cast(g.Equal(labels, v), to=FLOAT)
    on, beside = is_label(1.0), is_label(0.0)
    least = lambda values, those: g.reduce("ReduceMin", g.Add(values, g.Mul(g.Sub(1.0, those), 1e3)), [0], 1)
    has = lambda those: g.shape(g.reduce("ReduceMax", those, [0]), [1, 1])
    like = g.Sub(5.0, least(apart, on))
    logits = g.Where(g.Greater(has(on), 0.0), like, g.constant([[5.0]]))
    logits = g.Min(logits, g.Sub(least(apart, beside), 5.0))
    if not js:
        corner = lambda v, p: g.reduce("ReduceSum", g.Mul(p, is_label(v)), [0])
        corners = g.Concat(corner(2.0, px), corner(2.0, py), corner(3.0, px), corner(3.0, py), axis=0)
        is_out = g.Mul(g.Sub(1.0, inside(g, x, y, corners)), has(is_label(2.0)))
        logits = g.Sub(logits, g.Mul(20.0, is_out))
        given = g.Mul(g.shape("mask_input", [1, GRID * GRID]), g.shape("has_mask_input", [1, 1]))
        logits = g.Add(logits, g.Mul(given, 0.5))
    if kind == "sam2-js":
        # No box is one that holds everything.
        everything = g.constant([[-1e3, -1e3, 1e3, 1e3]])
        boxes = g.Concat(g.shape("input_boxes", [-1, 4]), everything, axis=0)
        first = g.shape(g.Gather(boxes, g.constant(0, np.int64), axis=0), [4])
        logits = g.Sub(logits, g.Mul(20.0, g.Sub(1.0, inside(g, x, y, first))))
    distance = g.Sqrt(g.Where(g.Greater(has(on), 0.0), least(far, on), g.constant([[0.0]])))
    masks = {"single": logits, "whole": g.Add(logits, 0.5)}
    for name, radius in (("part", 14.0), ("subpart", 7.0)):
        masks[name] = g.Min(logits, g.Sub(radius, distance))
    wanted = range(1, 4) if kind in ("js", "sam2", "sam2-js") else range(4)
    stacked = g.Concat(*(masks[ORDER[k]] for k in wanted), axis=0)
    sizes = [1, 1, len(wanted), GRID, GRID] if js else [1, len(wanted), GRID, GRID]
    names = ("pred_masks", "iou_scores") if js else ("low_res_masks", "iou_predictions")
    if kind == "sam2":
        names = ("masks", "iou_predictions")
    g.Reshape(stacked, g.constant(sizes, np.int64), out=names[0])
    fewer = g.Mul(g.Cast(g.Shape(labels, start=0, end=1), to=FLOAT), 0.02)
    scores = g.Sub(g.constant([SCORES[k] for k in wanted]), fewer)
    g.Reshape(scores, g.constant(sizes[:-2], np.int64), out=names[1])
    outputs = [(names[0], FLOAT, sizes), (names[1], FLOAT, sizes[:-2])]
    if kind in ("meta", "colors"):
        size = g.Cast("orig_im_size", to=INT64)
        size = g.Concat(g.constant([1, 4], np.int64), size, axis=0)
        g.Resize(names[0], "", "", size, out="masks", mode="linear")
        outputs.append(("masks", FLOAT, [1, 4, "h", "w"]))
    g.save(HERE / kind / "prompt_encoder_mask_decoder.onnx", inputs, outputs)


def picture(path, width, height):
    """A red disc and a yellow square on blue; colors in steps, so that the file is small."""
    y, x = np.mgrid[0:height, 0:width] + 0.5
    image = np.zeros((height, width, 3), np.uint8)
    image[...] = (30, 60, 160)
    image[np.hypot(x - 0.3 * width, y - 0.4 * height) <= 0.27 * min(width, height)] = (210, 40, 30)
    image[(abs(x - 0.75 * width) < 0.15 * width) & (abs(y - 0.7 * height) < 0.2 * height)] = (220, 200, 40)
    Image.fromarray(image).save(path, optimize=True)
    return image


def interpolated(values, height, width):
    """Bilinear, pixel centers at one half, border repeated, in f64."""

    def along(values, count):
        n = values.shape[0]
        at = np.clip((np.arange(count) + 0.5) * n / count - 0.5, 0, n - 1)
        low = np.floor(at).astype(int)
        high = np.minimum(low + 1, n - 1)
        share = (at - low)[:, None]
        return values[low] * (1 - share) + values[high] * share

    return along(along(values.astype(float), height).T, width).T


def run(kind, image, prompt):
    """Encoder and decoder with the steps around them: scores, logits of the picture."""
    height, width = image.shape[:2]
    stretches = kind.startswith("sam2")
    scale = SIDE / max(height, width)
    filled = (SIDE, SIDE) if stretches else (int(width * scale + 0.5), int(height * scale + 0.5))
    planes = [Image.fromarray(image[..., k].astype(np.float32), "F") for k in range(3)]
    resized = np.stack([np.asarray(p.resize(filled, Image.Resampling.BILINEAR)) for p in planes], -1)
    padded = np.zeros((3, SIDE, SIDE), np.float32)
    normal = (resized - np.float32(MEAN[stretches])) / np.float32(DEVIATION[stretches])
    padded[:, : filled[1], : filled[0]] = normal.transpose(2, 0, 1)
    load = lambda name: onnxruntime.InferenceSession(str(HERE / kind / name))
    session = load("vision_encoder.onnx")
    given = {session.get_inputs()[0].name: resized if kind == "colors" else padded[None]}
    feeds = dict(zip([o.name for o in session.get_outputs()], session.run(None, given)))
    points, labels = list(prompt.get("points", [])), list(prompt.get("labels", []))
    js = kind in ("js", "sam2-js")
    box = prompt.get("box")
    if box and not js:
        points, labels = points + [box[:2], box[2:]], labels + [2, 3]
    if (not box and not js) or kind == "sam2" or not points:
        points, labels = points + [[0, 0]], labels + [-1]
    points = np.array(points, np.float32) * np.float32([filled[0] / width, filled[1] / height])
    points, labels = points[None], np.array(labels, np.float32)[None]
    if js:
        feeds |= {"input_points": points[None], "input_labels": labels[None].astype(np.int64)}
    else:
        feeds |= {"point_coords": points, "point_labels": labels}
        feeds |= {"mask_input": np.zeros((1, 1, GRID, GRID), np.float32), "has_mask_input": np.zeros(1, np.float32)}
    if kind == "sam2-js":
        corners = np.array(box or [], np.float32).reshape(1, -1, 4)
        feeds["input_boxes"] = corners * np.float32([filled[0] / width, filled[1] / height] * 2)
    if kind in ("meta", "colors"):
        feeds["orig_im_size"] = np.float32([height, width])
    session = load("prompt_encoder_mask_decoder.onnx")
    wanted = [o.name for o in session.get_outputs()][:2]
    feeds = {i.name: feeds[i.name] for i in session.get_inputs()}
    masks, scores = session.run(wanted, feeds)
    grids, scores = masks.reshape(-1, GRID, GRID), scores.ravel()
    logits = []
    for grid in grids:
        whole = interpolated(grid, SIDE, SIDE)[: filled[1], : filled[0]]
        direct = interpolated(grid, height, width)
        logits.append(direct if stretches else interpolated(whole, height, width))
    return scores, logits


PROMPTS = [
    {"picture": "wide.png", "points": [[15, 12]], "labels": [1]},
    {"picture": "wide.png", "points": [[37.5, 21], [15, 12]], "labels": [1, 0]},
    {"picture": "tall.png", "points": [[22.5, 35]], "labels": [1]},
    {"picture": "tall.png", "box": [1, 8, 18, 32]},
]


def half(folder):
    """The encoder with an input and weights of 16 bits, beside the decoder."""
    g = Graph()
    image = g.Mul("images", g.constant([1], np.float16))
    g.AveragePool(image, kernel_shape=[4, 4], strides=[4, 4], out="image_embeddings")
    size = [1, 3, GRID, GRID]
    kind = TensorProto.FLOAT16
    g.save(folder / "vision_encoder.onnx", [("images", kind, [1, 3, SIDE, SIDE])], [("image_embeddings", kind, size)])
    name = "prompt_encoder_mask_decoder.onnx"
    (folder / name).write_bytes((HERE / "meta" / name).read_bytes())


def main():
    images = {"wide.png": picture(HERE / "wide.png", 50, 30), "tall.png": picture(HERE / "tall.png", 30, 50)}
    expected = []
    for kind in ("meta", "colors", "js", "sam2", "sam2-js"):
        encoder(kind)
        decoder(kind)
        for prompt in PROMPTS:
            if kind == "js" and "box" in prompt:
                continue
            scores, logits = run(kind, images[prompt["picture"]], prompt)
            rounded = lambda values, digits: [round(float(v), digits) for v in np.ravel(values)]
            expected.append(
                {
                    "export": kind,
                    "prompt": prompt,
                    "scores": rounded(scores, 6),
                    "areas": [int((v > 0).sum()) for v in logits],
                    "every": EVERY,
                    "logits": [rounded(v.ravel()[::EVERY], 3) for v in logits],
                }
            )
    half(HERE / "half")
    (HERE / "expected.json").write_text(json.dumps(expected) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
