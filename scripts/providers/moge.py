#!/usr/bin/env python3
"""A provider of the kind predict: normals and depth by MoGe-2 (Wang et al., 2025) in ONNX, on onnxruntime.

    moge.py --weights moge-2-vits-normal-onnx/

docs/stages/providers-python.md is the manual.
"""

import sys
from pathlib import Path

from provider_kit import weights
from provider_kit.protocol import BadInput, BadRequest, Failed, Provider, main

SURE = 0.5
"""Mask above which the model sees a surface."""


class Moge(Provider):
    """Keeps the session between requests."""

    name = "moge"
    kinds = ("predict",)
    quantities = ("normal", "depth")
    purpose = "Normals and depth of pictures by MoGe-2."

    def __init__(self):
        super().__init__()
        self.session, self.file = None, None

    def add_options(self, parser):
        add = parser.add_argument
        add("--weights", metavar="PATH", help="model.onnx, or its folder ($MOTES_MODELS/moge-2-vits-normal-onnx)")
        add("--size", type=int, default=0, metavar="PIXELS", help="longer side that the network is given (0: that of the picture, at most 1036)")
        add("--tokens", type=int, default=1800, metavar="COUNT", help="tokens that the network spends, 1200 to 3600 (1800)")
        add("--field-of-view", type=float, metavar="DEGREES", help="across the width, where it is known")
        add("--threads", type=int, default=0, metavar="N", help="threads on the CPU (0: as onnxruntime chooses)")

    def files(self):
        """Finds the file."""
        if self.file is None:
            o = self.options
            if o.size < 0 or o.tokens < 1 or not (o.field_of_view is None or 0 < o.field_of_view < 180):
                raise BadRequest("flags out of range", "--size from 0, --tokens from 1, --field-of-view above 0 and below 180")
            path = weights.located(o.weights, "moge-2-vits-normal-onnx", "--weights")
            files = [path] if path.is_file() else sorted(Path(path).glob("*.onnx"))
            if len(files) != 1:
                said = "no file" if not files else f"{len(files)} files"
                raise BadInput(f"{said} *.onnx: {path}", f"name the file; {weights.source('moge-2-vits-normal-onnx')}")
            self.file = files[0]
        return self.file

    def described(self):
        o = self.options
        return {
            "program_version": " ".join([self.version, *map(str, (o.size, o.tokens, o.field_of_view))]),
            "models": weights.described([self.files()], weights.license_of("moge-2-vits-normal-onnx")),
            "deterministic": True,
            "largest_side_px": 16384,
        }

    def prepare(self):
        self.files()

    def loaded(self):
        """The session of onnxruntime, whose inputs and outputs were checked."""
        if self.session is None:
            import onnxruntime

            settings = onnxruntime.SessionOptions()
            settings.intra_op_num_threads = self.options.threads
            settings.log_severity_level = 3
            try:
                session = onnxruntime.InferenceSession(str(self.file), settings, providers=["CPUExecutionProvider"])
            except Exception as error:  # onnxruntime has an exception for each cause
                raise BadInput(f"no ONNX file that can be run ({str(error).splitlines()[0][:120]}): {self.file}", "get the file again") from error
            inputs = {entry.name for entry in session.get_inputs()}
            outputs = {entry.name for entry in session.get_outputs()}
            if "image" not in inputs or not {"points", "normal", "mask"} <= outputs:
                said = f"it has {', '.join(sorted(inputs))} and gives {', '.join(sorted(outputs))}"
                raise BadInput(f"no MoGe-2 with normals, {said}: {self.file}", weights.source("moge-2-vits-normal-onnx"))
            self.session = session
        return self.session

    def answer(self, request):
        import numpy as np

        from provider_kit import pictures

        maps = []
        for i, name in enumerate(request.task["pictures"]):
            picture = pictures.read(request.file(name))
            normal, depth, sure = self.predicted(picture)
            if not (np.isfinite(normal).all() and np.isfinite(depth).all()):
                raise Failed("the network answers values that are not finite", "check the weights")
            confidence = f"confidence-{i}.exr"
            pictures.write_map(request.output(confidence), sure, "Y")
            for quantity in request.task["quantities"]:
                file = f"{quantity}-{i}.exr"
                values, channels = (normal, "XYZ") if quantity == "normal" else (depth, "Z")
                pictures.write_map(request.output(file), values, channels)
                maps.append({"picture": i, "quantity": quantity, "map": file, "confidence": confidence})
        return {"maps": maps}

    def predicted(self, picture):
        """Normals, depth and confidence of a picture, in its size."""
        import numpy as np

        from provider_kit import geometry, pictures

        o, session = self.options, self.loaded()
        height, width, _ = picture.shape
        # Patches of the network are 14 pixels wide.
        size = pictures.working_size(width, height, o.size or min(max(width, height), 1036), 14)
        image = pictures.resized(picture, size).astype(np.float32).transpose(2, 0, 1)[None] / 255
        given = {"image": image}
        if "num_tokens" in {entry.name for entry in session.get_inputs()}:
            given["num_tokens"] = np.asarray(o.tokens, dtype=np.int64)
        names = [entry.name for entry in session.get_outputs()]
        found = dict(zip(names, session.run(None, given)))
        points, mask = found["points"][0].astype(np.float64), found["mask"][0]
        depth = geometry.depth_of_points(points, mask > SURE, width / height, o.field_of_view)
        if "metric_scale" in found:
            depth = depth * float(np.ravel(found["metric_scale"])[0])
        depth = np.where((mask > SURE) & (depth > 0), depth, 0)
        normal = geometry.unit(found["normal"][0])
        resized = [pictures.resized_map(values.astype(np.float32), (width, height)) for values in (normal, depth, mask)]
        # Depth is not mixed over the edge of what has none.
        whole = pictures.resized_map((depth > 0).astype(np.float32), (width, height)) > 0.999
        return geometry.unit(resized[0]), np.where(whole, resized[1], 0), np.clip(resized[2], 0, 1)


if __name__ == "__main__":
    sys.exit(main(Moge()))
