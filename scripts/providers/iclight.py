#!/usr/bin/env python3
"""A provider of the kinds relight and predict (normals) by IC-Light (Zhang, Rao, Agrawala, 2025) on Stable Diffusion 1.5.

    iclight.py --model stable-diffusion-v1-5/ --weights ic-light/

A request with a background takes the light from it (fbc), one without takes it from the prompt (fc). Normals come from four lights.
docs/stages/providers-python.md is the manual.
"""

import sys
from pathlib import Path

from provider_kit import weights
from provider_kit.protocol import BadInput, BadRequest, Provider, main

FC, FBC = 8, 12
"""Channels of the input: noise and foreground; noise, foreground and background."""

QUALITY = "best quality"
NEGATIVE = "lowres, bad anatomy, bad hands, cropped, worst quality"
PUBLISHED = {FC: {"steps": 25, "guidance": 2.0}, FBC: {"steps": 20, "guidance": 7.0}}
"""Steps and guidance of the demonstrations that came with the weights."""


def variants_in(path):
    """Files of offsets by the number of their input channels, in a file or folder."""
    path = Path(path)
    files = [path] if path.is_file() else sorted(path.glob("iclight_sd15_*.safetensors"))
    if not files:
        raise BadInput(f"no iclight_sd15_fc.safetensors or iclight_sd15_fbc.safetensors: {path}", weights.source("ic-light"))
    found = {}
    for file in files:
        first = weights.header(file).get("conv_in.weight", (None, ()))[1]
        channels = first[1] if len(first) == 4 else None
        if channels not in (FC, FBC):
            said = f"{channels} input channels" if channels else "no conv_in.weight"
            raise BadInput(f"no weights of IC-Light: {said}, where 8 or 12 are due: {file}", weights.source("ic-light"))
        found.setdefault(channels, file)
    return found


class IcLight(Provider):
    """Loads each variant when the first request needs it."""

    name = "iclight"
    kinds = ("relight", "predict")
    quantities = ("normal",)
    purpose = "Pictures under another light, and normals, by IC-Light on Stable Diffusion 1.5."

    def __init__(self):
        super().__init__()
        self.parts, self.unets, self.variants, self.model = None, {}, None, None

    def add_options(self, parser):
        add = parser.add_argument
        add("--model", metavar="DIR", help="folder of Stable Diffusion 1.5 in the layout of diffusers ($MOTES_MODELS/stable-diffusion-v1-5)")
        add("--weights", metavar="PATH", help="iclight_sd15_fc.safetensors, iclight_sd15_fbc.safetensors, or their folder ($MOTES_MODELS/ic-light)")
        add("--size", type=int, default=640, metavar="PIXELS", help="longer side that the first pass works in (640)")
        add("--steps", type=int, help="denoising steps (25 by prompt, 20 by background)")
        add("--guidance", type=float, help="how closely the prompt is followed (2 by prompt, 7 by background)")
        add("--light", choices=["none", "left", "right", "top", "bottom"], default="none", help="where light comes from, without a background")
        add("--light-noise", type=float, default=0.9, metavar="SHARE", help="noise over the gradient of --light (0.9)")
        add("--second-scale", type=float, default=1.5, metavar="FACTOR", help="size of the second pass; 1: no second pass (1.5)")
        add("--second-noise", type=float, default=0.5, metavar="SHARE", help="noise of the second pass (0.5)")
        add("--sampler", choices=["dpm", "euler-a", "ddim"], default="dpm", help="DPM++ 2M SDE Karras, Euler ancestral, DDIM")
        add("--schedule", choices=["published", "trained"], default="published", help="betas: linear as in the published demonstrations, or scaled-linear as Stable Diffusion was trained")
        add("--added-prompt", default=QUALITY, metavar="TEXT", help=f"what follows every prompt ({QUALITY})")
        add("--negative", default=NEGATIVE, metavar="TEXT", help="what the picture shall not be")
        add("--device", default="auto", help="auto, cpu, cuda, cuda:1, mps")
        add("--precision", choices=["f32", "f16", "bf16"], help="numbers of the UNet (f16 on CUDA, f32 elsewhere)")
        add("--threads", type=int, default=0, metavar="N", help="threads on the CPU (0: as torch chooses)")

    def files(self):
        """Finds the files, and checks their heads."""
        if self.variants is None:
            o = self.options
            shares = (o.light_noise, o.second_noise)
            if o.size < 64 or not all(0 < share <= 1 for share in shares) or not 1 <= o.second_scale <= 4:
                raise BadRequest("flags out of range", "--size from 64, shares above 0 to 1, --second-scale 1 to 4")
            if o.steps is not None and not 1 <= o.steps <= 1000:
                raise BadRequest(f"--steps {o.steps} is not from 1 to 1000", "leave it out for the published count")
            self.model = weights.located(o.model, "stable-diffusion-v1-5", "--model")
            self.variants = variants_in(weights.located(o.weights, "ic-light", "--weights"))
        return self.variants

    def described(self):
        o = self.options
        variants = self.files()
        base = [weights.part(self.model, name)[0] for name in ("unet", "vae", "text_encoder")]
        models = weights.described(base, weights.license_of("stable-diffusion-v1-5"))
        models += weights.described(variants.values(), weights.license_of("ic-light"))
        said = (o.size, o.steps, o.guidance, o.light, o.light_noise, o.second_scale, o.second_noise, o.sampler, o.schedule, o.added_prompt, o.negative, o.precision)
        return {
            "program_version": " ".join([self.version, *map(str, said)]),
            "models": models,
            "deterministic": o.device == "cpu",
            "largest_side_px": 16384,
        }

    def prepare(self):
        self.files()

    def unet(self, channels):
        """The UNet of a variant, on its device."""
        from provider_kit import diffusion, loading

        if channels not in self.variants:
            name, why = ("fbc", "a background, and normals,") if channels == FBC else ("fc", "light by a prompt alone")
            raise BadInput(f"{why} need iclight_sd15_{name}.safetensors", f"give the folder of both files to --weights; {weights.source('ic-light')}")
        if channels not in self.unets:
            network = loading.unet(self.model, channels, self.variants[channels])
            self.parts = self.parts or diffusion.Parts(self.model, self.options)
            self.unets[channels] = self.parts.placed(network)
        return self.unets[channels]

    def answer(self, request):
        from provider_kit import lighting

        if request.kind == "predict":
            return {"maps": lighting.normals(self, request, FBC)}
        return {"picture": lighting.relit(self, request, FBC if request.task.get("background") else FC)}

    def published(self, channels):
        """Steps and guidance."""
        o, default = self.options, PUBLISHED[channels]
        return o.steps or default["steps"], default["guidance"] if o.guidance is None else o.guidance


if __name__ == "__main__":
    sys.exit(main(IcLight()))
