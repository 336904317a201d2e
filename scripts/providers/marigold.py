#!/usr/bin/env python3
"""A provider of the kind predict: base color, roughness and metallic by Marigold-IID-Appearance (Ke et al., 2025).

    marigold.py --model marigold-iid-appearance-v1-1/

docs/stages/providers-python.md is the manual.
"""

import json
import sys

from provider_kit import weights
from provider_kit.protocol import BadInput, BadRequest, Failed, Provider, main

NAMES = {"base-color": "albedo", "roughness": "roughness", "metallic": "metallicity"}
"""Quantities of the protocol, and what the model calls them."""

DOUBTFUL = 0.1
"""Spread of an ensemble at which a pixel is trusted by half."""


class Marigold(Provider):
    """Keeps the pipeline of diffusers between requests."""

    name = "marigold"
    kinds = ("predict",)
    quantities = ("base-color", "roughness", "metallic")
    purpose = "Base color, roughness and metallic of pictures by Marigold-IID-Appearance."

    def __init__(self):
        super().__init__()
        self.pipeline, self.model, self.index = None, None, None

    def add_options(self, parser):
        add = parser.add_argument
        add("--model", metavar="DIR", help="folder of Marigold-IID-Appearance ($MOTES_MODELS/marigold-iid-appearance-v1-1)")
        add("--size", type=int, default=0, metavar="PIXELS", help="longer side that the model works in (0: as the model says)")
        add("--steps", type=int, default=0, help="denoising steps (0: as the model says)")
        add("--ensemble", type=int, default=1, metavar="COUNT", help="predictions that are joined; from 3 on their spread becomes the confidence (1)")
        add("--device", default="auto", help="auto, cpu, cuda, cuda:1, mps")
        add("--precision", choices=["f32", "f16", "bf16"], help="numbers of the networks (f16 on CUDA, f32 elsewhere)")
        add("--threads", type=int, default=0, metavar="N", help="threads on the CPU (0: as torch chooses)")

    def files(self):
        """Finds the folder, and checks what it says about itself."""
        if self.model is not None:
            return self.model
        o = self.options
        if o.size < 0 or o.steps < 0 or o.ensemble < 1:
            raise BadRequest("flags out of range", "--size and --steps from 0, --ensemble from 1")
        folder = weights.located(o.model, "marigold-iid-appearance-v1-1", "--model")
        weights.part(folder, "unet")
        try:
            index = json.loads((folder / "model_index.json").read_text(encoding="utf-8"))
            properties = index["target_properties"]
            stack = properties["material"]["sub_target_names"]
            space = properties["albedo"]["prediction_space"]
            fits = properties["target_names"] == ["albedo", "material"] and stack[:2] == ["roughness", "metallicity"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise BadInput(f"no Marigold-IID-Appearance: {folder}", weights.source("marigold-iid-appearance-v1-1")) from error
        if not fits or space not in ("srgb", "linear"):
            raise BadInput(f"another model of Marigold, without roughness and metallic: {folder}", weights.source("marigold-iid-appearance-v1-1"))
        self.model, self.index = folder, index
        return folder

    def described(self):
        o = self.options
        files = [weights.part(self.files(), name)[0] for name in ("unet", "vae", "text_encoder")]
        return {
            "program_version": " ".join([self.version, *map(str, (o.size, o.steps, o.ensemble, o.precision))]),
            "models": weights.described(files, weights.license_of("marigold-iid-appearance-v1-1")),
            "deterministic": o.device == "cpu",
            "largest_side_px": 16384,
        }

    def prepare(self):
        self.files()

    def loaded(self):
        """The pipeline on its device."""
        if self.pipeline is None:
            from diffusers import DDIMScheduler, LCMScheduler, MarigoldIntrinsicsPipeline

            from provider_kit import loading

            device, dtype = loading.device_of(self.options)
            plan = loading.scheduler_config(self.model)
            kind = LCMScheduler if plan.get("_class_name") == "LCMScheduler" else DDIMScheduler
            said = ("prediction_type", "target_properties", "default_denoising_steps", "default_processing_resolution")
            self.pipeline = MarigoldIntrinsicsPipeline(
                unet=loading.unet(self.model).to(device, dtype), vae=loading.vae(self.model).to(device, dtype),
                text_encoder=loading.text_encoder(self.model).to(device, dtype), tokenizer=loading.tokenizer(self.model),
                scheduler=kind.from_config(plan), **{key: self.index.get(key) for key in said})
            self.pipeline.set_progress_bar_config(disable=True)
        return self.pipeline

    def answer(self, request):
        from provider_kit import pictures

        maps = []
        for i, name in enumerate(request.task["pictures"]):
            found, sure = self.predicted(pictures.read(request.file(name)), request.seed)
            for quantity in request.task["quantities"]:
                entry = {"picture": i, "quantity": quantity, "map": f"{quantity}-{i}.exr"}
                channels = "RGB" if quantity == "base-color" else "Y"
                pictures.write_map(request.output(entry["map"]), found[quantity], channels)
                if sure is not None:
                    entry["confidence"] = f"{quantity}-{i}-confidence.exr"
                    pictures.write_map(request.output(entry["confidence"]), sure[quantity], "Y")
                maps.append(entry)
        return {"maps": maps}

    def predicted(self, picture, seed):
        """Maps of a picture by quantity, and how sure they are, or None."""
        import numpy as np
        import torch
        from PIL import Image

        from provider_kit import pictures

        o, pipeline = self.options, self.loaded()
        height, width, _ = picture.shape
        size = pictures.working_size(width, height, o.size or pipeline.default_processing_resolution or 768)
        generator = torch.Generator("cpu").manual_seed(seed % (1 << 63))
        made = pipeline(
            Image.fromarray(pictures.resized(picture, size)), num_inference_steps=o.steps or None, ensemble_size=o.ensemble,
            processing_resolution=0, generator=generator, output_uncertainty=o.ensemble >= 3)

        def by_quantity(values):
            values = np.asarray(values, dtype=np.float32)
            if not np.isfinite(values).all():
                raise Failed("the network answers values that are not finite", "--precision f32, or check the weights")
            values = [pictures.resized_map(plane, (width, height)) for plane in values]
            return {"base-color": values[0], "roughness": values[1][..., 0], "metallic": values[1][..., 1]}

        found = {name: np.clip(values, 0, 1) for name, values in by_quantity(made.prediction).items()}
        if self.index["target_properties"]["albedo"]["prediction_space"] == "srgb":
            found["base-color"] = pictures.srgb_decode(found["base-color"].astype(np.float64)).astype(np.float32)
        if made.uncertainty is None:
            return found, None
        spread = by_quantity(made.uncertainty)
        spread["base-color"] = spread["base-color"].max(axis=-1)
        return found, {name: 1 / (1 + (values / DOUBTFUL) ** 2) for name, values in spread.items()}


if __name__ == "__main__":
    sys.exit(main(Marigold()))
