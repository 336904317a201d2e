"""IC-Light: a UNet of Stable Diffusion that also sees the foreground, and the background whose light it takes. Needs torch.

After the published demonstrations (lllyasviel/IC-Light): the foreground on gray, its latents beside the noise in every step, with
and without the prompt; then a second pass at a larger size.
"""

import numpy as np
import torch

from . import pictures
from .diffusion import signed, unsigned
from .protocol import BadInput, Failed

GRAY = 127
"""Byte that becomes 0 in the network: x / 127 - 1."""
MOST_SIDE = 2048
"""Of the second pass; attention over more does not fit ordinary memory."""


def scheduler(sampler, schedule):
    """A fresh scheduler. The published ones leave the betas linear, except DDIM."""
    from diffusers import DDIMScheduler, DPMSolverMultistepScheduler, EulerAncestralDiscreteScheduler

    betas = {"num_train_timesteps": 1000, "beta_start": 0.00085, "beta_end": 0.012, "steps_offset": 1}
    betas["beta_schedule"] = "linear" if schedule == "published" and sampler != "ddim" else "scaled_linear"
    if sampler == "dpm":
        return DPMSolverMultistepScheduler(algorithm_type="sde-dpmsolver++", use_karras_sigmas=True, **betas)
    if sampler == "euler-a":
        return EulerAncestralDiscreteScheduler(**betas)
    return DDIMScheduler(clip_sample=False, set_alpha_to_one=False, **betas)


@torch.inference_mode()
def denoised(parts, unet, conditions, texts, how, start=None, strength=1.0):
    """Latents after all steps: from noise, or from `start` under a share of noise.

    `conditions`: latents that stand behind the noise in the input; `texts`: embeddings of prompt and negative prompt;
    `how`: sampler, schedule, steps, guidance, generator.
    """
    steps = how["steps"] if start is None else max(1, round(how["steps"] / strength))
    plan = scheduler(how["sampler"], how["schedule"])
    plan.set_timesteps(steps, device=parts.device)
    first = 0 if start is None else max(steps - min(int(steps * strength), steps), 0)
    first = min(first, steps - 1)
    if first and hasattr(plan, "set_begin_index"):
        plan.set_begin_index(first)
    shape = (1, parts.vae.config.latent_channels, *conditions.shape[2:])
    noise = torch.randn(shape, generator=how["generator"]).to(parts.device, parts.dtype)
    if start is None:
        latents = noise * plan.init_noise_sigma
    else:
        latents = plan.add_noise(start.to(parts.dtype), noise, plan.timesteps[first:first + 1])
    conditions = torch.cat([conditions.to(parts.dtype)] * 2)
    embeddings = torch.cat([texts[1], texts[0]])
    for t in plan.timesteps[first:]:
        seen = plan.scale_model_input(torch.cat([latents] * 2), t)
        predicted = unet(torch.cat([seen, conditions], dim=1), t, encoder_hidden_states=embeddings).sample
        without, toward = predicted.chunk(2)
        predicted = without + how["guidance"] * (toward - without)
        extra = {} if how["sampler"] == "ddim" else {"generator": how["generator"]}
        latents = plan.step(predicted, t, latents, **extra).prev_sample
    return latents


def on_gray(picture, foreground):
    """The foreground before the gray that the network knows as nothing."""
    if foreground is None:
        return picture
    value = GRAY + (picture.astype(np.float32) - GRAY) * foreground[..., None]
    return value.clip(0, 255).astype(np.uint8)


def gradient(side, size, bright=255, dark=0):
    """Bytes of a light from a side, brightest there: height x width x 3."""
    width, height = size
    along = np.linspace(bright, dark, width if side in ("left", "right") else height)
    along = along[::-1] if side in ("right", "bottom") else along
    plane = np.tile(along, (height, 1)) if side in ("left", "right") else np.tile(along[:, None], (1, width))
    return np.stack([plane] * 3, axis=-1).astype(np.uint8)


class Passes:
    """Both passes for one foreground."""

    def __init__(self, provider, request, channels, prompt):
        self.options = provider.options
        self.unet = provider.unet(channels)
        self.parts = provider.parts
        self.steps, self.guidance = provider.published(channels)
        self.seed = request.seed
        added = [text for text in (prompt.strip(), self.options.added_prompt) if text]
        self.texts = self.parts.embedded_pair(", ".join(added), self.options.negative)

    def latents(self, pixels):
        """Scaled latents of bytes."""
        return self.parts.encoded(signed(pixels, GRAY)[None]) * self.parts.scale

    def conditions(self, seen, size):
        """Latents of foreground and background at a size."""
        return torch.cat([self.latents(pictures.resized(pixels, size)) for pixels in seen], dim=1)

    def picture(self, seen, size, start=None):
        """Bytes of the relit foreground, at the size of the last pass. `seen`: what the network sees, as bytes."""
        o = self.options
        how = {"sampler": o.sampler, "schedule": o.schedule, "steps": self.steps, "guidance": self.guidance}
        how["generator"] = torch.Generator("cpu").manual_seed(self.seed % (1 << 63))
        first = None if start is None else self.latents(start)
        latents = denoised(self.parts, self.unet, self.conditions(seen, size), self.texts, how, first, o.light_noise)
        larger = tuple(max(64, round(side * o.second_scale / 64) * 64) for side in size)
        if o.second_scale > 1 and max(larger) <= MOST_SIDE:
            start = self.latents(pictures.resized(unsigned(self.parts.decoded(latents)[0]), larger))
            latents = denoised(self.parts, self.unet, self.conditions(seen, larger), self.texts, how, start, o.second_noise)
        decoded = self.parts.decoded(latents)[0]
        if not torch.isfinite(decoded).all():
            raise Failed("the network answers values that are not finite", "--precision f32, or check the weights")
        return unsigned(decoded)


def relit(provider, request, channels):
    """Answers `relight`; the name of the picture."""
    o, task = provider.options, request.task
    picture = pictures.read(request.file(task["picture"]))
    height, width, _ = picture.shape
    foreground = None
    if task.get("foreground"):
        foreground = pictures.read_mask(request.file(task["foreground"]))
        if foreground.shape != (height, width):
            raise BadInput(f"the foreground has {foreground.shape[1]}x{foreground.shape[0]} pixels, the picture {width}x{height}", "send both alike")
        if not foreground.any():
            raise BadInput("the foreground is empty: there is nothing to light", "check the mask: white is the object")
    seen = [on_gray(picture, foreground)]
    if task.get("background"):
        seen.append(pictures.read(request.file(task["background"])))
    size = pictures.working_size(width, height, o.size)
    start = gradient(o.light, size) if o.light != "none" and not task.get("background") else None
    made = Passes(provider, request, channels, task.get("prompt") or "").picture(seen, size, start)
    if max(width, height) > 2 * max(made.shape[:2]):
        request.warn(f"the model worked at {made.shape[1]}x{made.shape[0]} pixels, less than half of {width}x{height}: details of the photo are lost")
    pictures.write(request.output("relit.png"), pictures.resized(made, (width, height)))
    return "relit.png"


def normal_of_lights(left, right, top, bottom, sharpness=10.0):
    """Unit normals (x right, y down, z forward; they face the camera) from pictures lit from four sides, linear 0 to 1.

    Each picture is divided by their mean; what a side brightens faces it. `sharpness` is the published exponent.
    """
    mean = (left + right + top + bottom) / 4
    ratio = [(lit + 1e-5) / (mean + 1e-5) - 1 for lit in (left, right, top, bottom)]
    u = ((ratio[1] - ratio[0]) * 0.5).mean(axis=2)
    v = ((ratio[2] - ratio[3]) * 0.5).mean(axis=2)
    w = np.clip(1 - u**2 - v**2, 0, None) ** (0.5 * sharpness)
    normals = np.stack([u, -v, -w], axis=-1)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    facing = np.array([0.0, 0.0, -1.0])
    return np.where(length > 1e-6, normals / np.maximum(length, 1e-6), facing)


def normals(provider, request, channels):
    """Answers `predict`; the maps."""
    maps = []
    for i, name in enumerate(request.task["pictures"]):
        picture = pictures.read(request.file(name))
        height, width, _ = picture.shape
        size = pictures.working_size(width, height, provider.options.size)
        passes = Passes(provider, request, channels, "")
        sides = ("left", "right", "top", "bottom")
        lit = [passes.picture([picture, gradient(side, size, 224, 32)], size).astype(np.float64) / 255 for side in sides]
        found = pictures.resized_map(normal_of_lights(*lit).astype(np.float32), (width, height))
        found /= np.maximum(np.linalg.norm(found, axis=-1, keepdims=True), 1e-6)
        pictures.write_map(request.output(f"normal-{i}.exr"), found, "XYZ")
        maps.append({"picture": i, "quantity": "normal", "map": f"normal-{i}.exr"})
    return maps
