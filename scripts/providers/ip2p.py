#!/usr/bin/env python3
"""A provider of the kind instruct-edit by InstructPix2Pix (Brooks, Holynski, Efros, 2023), several views jointly.

    ip2p.py --model instruct-pix2pix/

docs/stages/providers-python.md is the manual.
"""

import sys

from provider_kit import weights
from provider_kit.protocol import BadInput, BadRequest, Provider, main


class InstructPix2Pix(Provider):
    """Edits pictures as a text says."""

    name = "ip2p"
    kinds = ("instruct-edit",)
    purpose = "Pictures edited as a text says, several views of a scene alike, by InstructPix2Pix."

    def __init__(self):
        super().__init__()
        self.parts, self.unet, self.model = None, None, None

    def add_options(self, parser):
        add = parser.add_argument
        add("--model", metavar="DIR", help="folder of InstructPix2Pix in the layout of diffusers ($MOTES_MODELS/instruct-pix2pix)")
        add("--size", type=int, default=512, metavar="PIXELS", help="longer side that the model works in (512)")
        add("--steps", type=int, default=20, help="denoising steps (20)")
        add("--text-guidance", type=float, default=7.5, metavar="SCALE", help="how closely the text is followed (7.5)")
        add("--picture-guidance", type=float, default=1.5, metavar="SCALE", help="how closely the photo is kept (1.5)")
        add("--negative", default="", metavar="TEXT", help="what the pictures shall not be")
        add("--joint", type=int, default=8, metavar="VIEWS", help="views that attend to each other at most; 1: each alone (8)")
        add("--device", default="auto", help="auto, cpu, cuda, cuda:1, mps")
        add("--precision", choices=["f32", "f16", "bf16"], help="numbers of the UNet (f16 on CUDA, f32 elsewhere)")
        add("--threads", type=int, default=0, metavar="N", help="threads on the CPU (0: as torch chooses)")

    def files(self):
        """Finds the folder, and checks the heads of its files."""
        if self.model is None:
            o = self.options
            if o.size < 64 or not 1 <= o.steps <= 1000 or o.joint < 1:
                raise BadRequest("flags out of range", "--size from 64, --steps 1 to 1000, --joint from 1")
            folder = weights.located(o.model, "instruct-pix2pix", "--model")
            path, config = weights.part(folder, "unet")
            first = weights.header(path).get("conv_in.weight", (None, ()))[1]
            if config.get("in_channels") != 8 or len(first) != 4 or first[1] != 8:
                raise BadInput(f"no weights of InstructPix2Pix, whose UNet has 8 input channels: {path}", weights.source("instruct-pix2pix"))
            self.model = folder
        return self.model

    def described(self):
        o = self.options
        files = [weights.part(self.files(), name)[0] for name in ("unet", "vae", "text_encoder")]
        said = (o.size, o.steps, o.text_guidance, o.picture_guidance, o.negative, o.joint, o.precision)
        return {
            "program_version": " ".join([self.version, *map(str, said)]),
            "models": weights.described(files, weights.license_of("instruct-pix2pix")),
            "deterministic": o.device == "cpu",
            "largest_side_px": 16384,
        }

    def prepare(self):
        self.files()

    def answer(self, request):
        from provider_kit import diffusion, editing, loading

        if self.unet is None:
            network = loading.unet(self.model)
            self.parts = diffusion.Parts(self.model, self.options)
            self.unet = self.parts.placed(network)
        return {"pictures": editing.edited(self, request)}


if __name__ == "__main__":
    sys.exit(main(InstructPix2Pix()))
