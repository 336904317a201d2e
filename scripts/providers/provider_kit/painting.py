"""A chrome ball painted into a picture by Stable Diffusion XL with a ControlNet for depth. Needs torch, diffusers and peft."""

import json

import numpy as np
import torch
from PIL import Image

from . import loading, pictures
from .protocol import BadInput

DILATED = 20
"""Pixels by which the painted disk is wider than the ball, for a sharp rim."""


def load(found, options):
    """Pipeline and depth network from checked folders."""
    from diffusers import ControlNetModel, StableDiffusionXLControlNetInpaintPipeline, UniPCMultistepScheduler
    from transformers import DPTForDepthEstimation

    device, dtype = loading.device_of(options)
    here = {"local_files_only": True, "use_safetensors": True}
    try:
        control = ControlNetModel.from_pretrained(str(found["control"]), torch_dtype=dtype, **here)
        pipeline = StableDiffusionXLControlNetInpaintPipeline.from_pretrained(
            str(found["model"]), controlnet=control, vae=loading.vae(found["model"]), unet=loading.unet(found["model"]),
            torch_dtype=dtype, add_watermarker=False, **here)
        depth = DPTForDepthEstimation.from_pretrained(str(found["depth"]), **here).to(device).eval()
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        text = str(error).splitlines()[0][:200]
        raise BadInput(f"the parts of the model do not load: {text}", "get the folders again; they must be those of the manual") from error
    pipeline.scheduler = UniPCMultistepScheduler.from_config(pipeline.scheduler.config)
    for name in ("exposure", "turbo"):
        if found[name]:
            try:
                pipeline.load_lora_weights(str(found[name].parent), weight_name=found[name].name, adapter_name=name, local_files_only=True)
            except (OSError, ValueError, RuntimeError, KeyError) as error:
                text = str(error).splitlines()[0][:200]
                raise BadInput(f"a LoRA of another model ({text}): {found[name]}", "take those of DiffusionLight for Stable Diffusion XL") from error
    pipeline.to(device=device, dtype=dtype)
    # The autoencoder of this model overflows in 16 bits.
    pipeline.vae.to(torch.float32)
    pipeline.set_progress_bar_config(disable=True)
    return pipeline, (depth, preparation(found["depth"], depth), device)


def preparation(folder, network):
    """Side, mean and deviation that the depth network was trained with."""
    try:
        said = json.loads((folder / "preprocessor_config.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        said = {}
    size = said.get("size", network.config.image_size)
    side = size.get("height", network.config.image_size) if isinstance(size, dict) else size
    return int(side), said.get("image_mean", [0.5] * 3), said.get("image_std", [0.5] * 3)


@torch.inference_mode()
def depth_of(square, parts):
    """A gray picture of depth as the ControlNet was trained on: white is near."""
    network, (side, mean, deviation), device = parts
    pixels = pictures.resized(np.asarray(square), (side, side)).astype(np.float32) / 255
    given = torch.from_numpy(((pixels - mean) / deviation).astype(np.float32)).movedim(-1, 0)[None].to(device)
    found = network(pixel_values=given).predicted_depth[:, None].float()
    found = torch.nn.functional.interpolate(found, size=square.size[::-1], mode="bicubic", align_corners=False)[0, 0]
    low, high = found.min(), found.max()
    gray = ((found - low) / (high - low).clamp_min(1e-6) * 255).round().clamp(0, 255)
    return gray.to(torch.uint8).cpu().numpy()


def disk(side, diameter):
    """Where a disk in the middle of a square is."""
    along = np.arange(side) + 0.5 - side / 2
    return along[None, :] ** 2 + along[:, None] ** 2 <= (diameter / 2) ** 2


def squared(picture, side):
    """The picture in the middle of a black square, as a picture of Pillow."""
    height, width, _ = picture.shape
    scale = side / max(height, width)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    made = np.zeros((side, side, 3), dtype=np.uint8)
    left, top = (side - size[0]) // 2, (side - size[1]) // 2
    made[top:top + size[1], left:left + size[0]] = pictures.resized(picture, size)
    return Image.fromarray(made)


def adapters(pipeline, options):
    """What the pipeline calls after each step: Turbo paints the first steps, the LoRA for exposures the others."""
    loaded = pipeline.get_list_adapters().get("unet", [])
    def apply(name):
        pipeline.set_adapters([name], [1.0 if name == "turbo" else options.exposure_scale])
    apply("turbo" if "turbo" in loaded else "exposure")

    def swap(_, __, time, values):
        if "turbo" in loaded and float(time) <= options.swap_at:
            apply("exposure")
        return values
    return swap


@torch.inference_mode()
def balls(pipeline, depth, picture, texts, stops, options, seed):
    """Squares around the ball, bytes, one per exposure."""
    bright, dark, negative, darkest = texts
    square = squared(picture, options.size)
    gray = depth_of(square, depth)
    painted = disk(options.size, options.ball + DILATED)
    gray[disk(options.size, options.ball)] = 255  # the ball is nearer than everything
    control = Image.fromarray(np.stack([gray] * 3, axis=-1))
    mask = Image.fromarray((painted * 255).astype(np.uint8))
    known = [pipeline.encode_prompt(text, negative_prompt=negative, do_classifier_free_guidance=True) for text in (bright, dark)]
    first = (options.size - options.ball) // 2
    made = []
    for stop in stops:
        share = stop / darkest
        mixed = [a + share * (b - a) for a, b in zip(*known)]
        result = pipeline(
            prompt_embeds=mixed[0], negative_prompt_embeds=known[0][1], pooled_prompt_embeds=mixed[2],
            negative_pooled_prompt_embeds=known[0][3], image=square, mask_image=mask, control_image=control, height=options.size,
            width=options.size, strength=1.0, num_inference_steps=options.steps, guidance_scale=options.guidance,
            controlnet_conditioning_scale=options.control_scale, generator=torch.Generator("cpu").manual_seed(seed % (1 << 63)),
            callback_on_step_end=adapters(pipeline, options))
        pixels = np.asarray(result.images[0].convert("RGB"))
        made.append(pixels[first:first + options.ball, first:first + options.ball])
    return made
