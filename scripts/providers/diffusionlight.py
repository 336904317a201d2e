#!/usr/bin/env python3
"""A provider of the kind environment: a chrome ball painted into the picture at three exposures, as DiffusionLight does
(Phongthawee et al., 2024; Turbo: Chinchuthakun et al., 2025), then unwrapped and merged.

    diffusionlight.py --model stable-diffusion-xl-base-1.0/ --control controlnet-depth-sdxl-1.0/ --depth dpt-hybrid-midas/ \\
        --turbo turbo.safetensors --exposure exposure.safetensors

docs/stages/providers-python.md is the manual.
"""

import sys
from pathlib import Path

from provider_kit import weights
from provider_kit.protocol import BadInput, BadRequest, Failed, Provider, main

BRIGHT = "a perfect mirrored reflective chrome ball sphere"
DARK = "a perfect black dark mirrored reflective chrome ball sphere"
NEGATIVE = "matte, diffuse, flat, dull"
DARKEST = -5.0
"""Exposure, stops, that the dark prompt stands for."""


class DiffusionLight(Provider):
    """Keeps the pipeline of diffusers between requests."""

    name = "diffusionlight"
    kinds = ("environment",)
    purpose = "The light around a picture as a panorama, from a chrome ball that Stable Diffusion XL paints into it."

    def __init__(self):
        super().__init__()
        self.pipeline, self.depth, self.found = None, None, None

    def add_options(self, parser):
        add = parser.add_argument
        add("--model", metavar="DIR", help="folder of Stable Diffusion XL ($MOTES_MODELS/stable-diffusion-xl-base-1.0)")
        add("--control", metavar="DIR", help="folder of its ControlNet for depth ($MOTES_MODELS/controlnet-depth-sdxl-1.0)")
        add("--depth", metavar="DIR", help="folder of the depth network ($MOTES_MODELS/dpt-hybrid-midas)")
        add("--exposure", metavar="FILE", help="LoRA for exposures ($MOTES_MODELS/diffusionlight/exposure.safetensors)")
        add("--turbo", metavar="FILE", help="LoRA of Turbo for the early steps ($MOTES_MODELS/diffusionlight/turbo.safetensors, where it is there)")
        add("--exposure-scale", type=float, default=0.75, help="how strongly the LoRA for exposures is applied (0.75)")
        add("--swap-at", type=int, default=800, metavar="TIME", help="time step at which Turbo gives way to the exposures (800)")
        add("--steps", type=int, default=30, help="denoising steps (30)")
        add("--guidance", type=float, default=5.0, help="how closely the prompt is followed (5)")
        add("--control-scale", type=float, default=0.5, help="how closely the depth is followed (0.5)")
        add("--stops", default="0,-2.5,-5", metavar="LIST", help="exposures, the brightest first (0,-2.5,-5)")
        add("--size", type=int, default=1024, metavar="PIXELS", help="side of the square that the model works in (1024)")
        add("--ball", type=int, default=256, metavar="PIXELS", help="diameter of the ball in it (256)")
        add("--height", type=int, default=256, metavar="PIXELS", help="height of the panorama (256)")
        add("--device", default="auto", help="auto, cpu, cuda, cuda:1, mps")
        add("--precision", choices=["f32", "f16", "bf16"], help="numbers of the networks (f16 on CUDA, f32 elsewhere)")
        add("--threads", type=int, default=0, metavar="N", help="threads on the CPU (0: as torch chooses)")

    def stops(self):
        """Exposures, the brightest first."""
        try:
            values = [float(value) for value in self.options.stops.split(",")]
        except ValueError:
            values = []
        if not values or values != sorted(values, reverse=True) or values[0] != 0 or values[-1] < DARKEST:
            raise BadRequest(f"--stops {self.options.stops} is no list from 0 down to {DARKEST:g}", "--stops 0,-2.5,-5")
        return values

    def files(self):
        """Finds the folders and files, and checks the heads of the files."""
        if self.found is None:
            o = self.options
            self.stops()
            if o.size < 64 or o.size % 8 or not 8 <= o.ball <= o.size // 2 or o.height < 8 or o.steps < 1:
                raise BadRequest("flags out of range", "--size a multiple of 8 from 64, --ball from 8 to half of it, --height from 8")
            found = {
                "model": weights.located(o.model, "stable-diffusion-xl-base-1.0", "--model"),
                "control": weights.located(o.control, "controlnet-depth-sdxl-1.0", "--control"),
                "depth": weights.located(o.depth, "dpt-hybrid-midas", "--depth"),
            }
            weights.part(found["control"], "")
            weights.part(found["depth"], "")
            for name in ("unet", "vae", "text_encoder", "text_encoder_2"):
                weights.part(found["model"], name)
            found["exposure"] = self.lora(o.exposure, "exposure")
            found["turbo"] = self.lora(o.turbo, "turbo", required=False)
            self.found = found
        return self.found

    @staticmethod
    def lora(given, name, required=True):
        """A file of a LoRA, whose names were looked at."""
        try:
            path = Path(given) if given else weights.located(None, "diffusionlight", f"--{name}") / f"{name}.safetensors"
        except BadInput:
            if required:
                raise
            return None
        if not path.exists():
            if not required and not given:
                return None
            raise BadInput(f"no such file: {path}", weights.source("diffusionlight"))
        if not any("lora" in tensor for tensor in weights.header(path)):
            raise BadInput(f"no LoRA: none of its tensors is called so: {path}", weights.source("diffusionlight"))
        return path

    def described(self):
        o, found = self.options, self.files()
        base = [weights.part(found["model"], name)[0] for name in ("unet", "vae", "text_encoder", "text_encoder_2")]
        models = weights.described(base, weights.license_of("stable-diffusion-xl-base-1.0"))
        models += weights.described([weights.part(found["control"], "")[0]], weights.license_of("controlnet-depth-sdxl-1.0"))
        models += weights.described([weights.part(found["depth"], "")[0]], weights.license_of("dpt-hybrid-midas"))
        models += weights.described([p for p in (found["exposure"], found["turbo"]) if p], weights.license_of("diffusionlight"))
        said = (o.exposure_scale, o.swap_at, o.steps, o.guidance, o.control_scale, o.stops, o.size, o.ball, o.height, o.precision)
        return {
            "program_version": " ".join([self.version, *map(str, said)]),
            "models": models,
            "deterministic": o.device == "cpu",
            "largest_side_px": 16384,
        }

    def prepare(self):
        self.files()

    def loaded(self):
        """The pipeline, and the network for depth."""
        if self.pipeline is None:
            from provider_kit import painting

            self.pipeline, self.depth = painting.load(self.files(), self.options)
        return self.pipeline, self.depth

    def answer(self, request):
        import numpy as np

        from provider_kit import ball, painting, pictures

        picture = pictures.read(request.file(request.task["picture"]))
        pipeline, depth = self.loaded()
        texts = (BRIGHT, DARK, NEGATIVE, DARKEST)
        balls = painting.balls(pipeline, depth, picture, texts, self.stops(), self.options, request.seed)
        light = ball.merged([painted.astype(np.float64) / 255 for painted in balls], self.stops())
        panorama = ball.unwrapped(light, self.options.height)
        if not np.isfinite(panorama).all():
            raise Failed("the network answers values that are not finite", "--precision f32, or check the weights")
        pictures.write_map(request.output("environment.exr"), panorama, "RGB")
        return {"environment": "environment.exr"}


if __name__ == "__main__":
    sys.exit(main(DiffusionLight()))
