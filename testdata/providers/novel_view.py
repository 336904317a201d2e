#!/usr/bin/env python3
"""A provider of the kind novel-view without a model: the rendering as it is, or with --negative its negative, trusted by --confidence.

It is built on the kit of scripts/providers, as one with a model would be.
"""

import array
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "editors"), str(HERE.parent.parent / "scripts" / "providers")]
import png  # noqa: E402
from provider_kit import exr  # noqa: E402
from provider_kit.protocol import Provider, main  # noqa: E402


class NovelView(Provider):
    """Answers with what it gets."""

    name = "novel-view"
    kinds = ("novel-view",)
    purpose = "Renderings as they are; for tests."

    def add_options(self, parser):
        parser.add_argument("--negative", action="store_true")
        parser.add_argument("--confidence", type=float)

    def described(self):
        options = f"{self.options.negative} {self.options.confidence}"
        return {"program_version": options, "models": [{"id": "none", "license": "CC0-1.0"}], "deterministic": True}

    def answer(self, request):
        source, made = request.file(request.task["rendering"]), request.output("view.png")
        width, height, rows = png.read(source)
        if self.options.negative:
            png.write(made, width, height, [bytes(255 - v for v in row) for row in rows])
        else:
            shutil.copyfile(source, made)
        result = {"picture": "view.png"}
        if self.options.confidence is not None:
            plane = array.array("f", [self.options.confidence] * (width * height)).tobytes()
            exr.write(request.output("confidence.exr"), width, height, {"Y": plane})
            result["confidence"] = "confidence.exr"
        return result


if __name__ == "__main__":
    sys.exit(main(NovelView()))
