#!/usr/bin/env python3
"""Writes testdata/diffusion: tiny checkpoints, and what diffusers and transformers compute with them. For developers; never part of CI.

    scripts/providers/fixtures.py testdata/diffusion

The tests of crates/provider-diffusion read it. Weights that are stored are random; further ones, and all noise, are numbers that a
formula makes there as here (`hashed`). Needs the packages of requirements-providers.txt.
"""

import hashlib
import json
import sys
import types
from pathlib import Path
from unittest import mock

import numpy as np
import torch
from PIL import Image
from safetensors.torch import save_file

import tiny
from provider_kit import diffusion, editing, lighting, loading, pictures

OPTIONS = types.SimpleNamespace(device="cpu", precision="f32", threads=1)
MERGES = [("l", "i"), ("g", "h"), ("li", "gh"), ("ligh", "t</w>"), ("w", "a"), ("wa", "r"), ("war", "m</w>"), ("t", "h"), ("th", "e</w>"),
          ("Ã", "©"), ("1", "2"), ("a", "a"), ("aa", "a</w>"), ("i", "n"), ("in", "g</w>")]
TEXTS = [
    "warm light", "Warm  LIGHT\tfrom the left, best quality", "", " ", "it's we're I'm you'll they'd don't 'tis", "caf\u00e9 cafe\u0301 \u00c9T\u00c9",
    "12 123 1.5x \u00bd \u2167 \u0663", "snow!!! #1 (a_b) [c]--d... \u201cquoted\u201d", "\u65e5\u672c\u8a9e\u306e\u5149 \U0001f305 \u200d na\u00efve\u00a0x",
    "aaaa aaa aa a lighting", "<|startoftext|>warm<|endoftext|> light <|pad|>", "line\nbreak\r\nand\u2028more", "\u0301 \u1e9e\u0130i \ufb01 \u00c5\u212b", "\x00\x07 bell",
]
"""Words, spaces, signs, contractions, other scripts, composed and decomposed letters, marks."""


def splitmix(values):
    """A round of SplitMix64 (Steele et al., 2014) of whole numbers of 64 bits."""
    z = values + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def hashed(name, shape):
    """Numbers from -1 to 1 by a name: the same wherever whole numbers have 64 bits."""
    seed = 0xCBF29CE484222325
    for byte in name.encode():
        seed = ((seed ^ byte) * 0x100000001B3) % (1 << 64)
    with np.errstate(over="ignore"):
        bits = splitmix(np.arange(int(np.prod(shape)), dtype=np.uint64) + np.uint64(seed))
    values = (bits >> np.uint64(40)).astype(np.float64) / (1 << 23) - 1.0
    return torch.from_numpy(values.astype(np.float32).reshape(shape))


def weight(name, shape):
    """A tensor of a network by its name, with a size that keeps signals as they are."""
    values = hashed(name, shape)
    if len(shape) > 1:
        return values * np.float32((3.0 / (values.numel() / shape[0])) ** 0.5)
    return (1.0 if name.endswith("weight") else 0.0) + np.float32(0.1) * values


class Noise:
    """Draws by number, in place of those of a generator."""

    def __init__(self):
        self.draws = 0

    def __call__(self, *shape, **_):
        shape = tuple(shape[0]) if not isinstance(shape[0], int) else shape
        self.draws += 1
        return hashed(f"noise {self.draws - 1}", shape) * np.float32(3**0.5)

    def patches(self):
        """Where noise is drawn: in the passes, and in two samplers."""
        places = ["torch.randn"] + [f"diffusers.schedulers.scheduling_{n}.randn_tensor" for n in ("dpmsolver_multistep", "euler_ancestral_discrete")]
        return [mock.patch(place, self) for place in places]


def drawn(work):
    """What `work` returns with hashed noise."""
    patches = Noise().patches()
    for patch in patches:
        patch.start()
    try:
        return work()
    finally:
        for patch in patches:
            patch.stop()


def spread(network):
    """A network none of whose tensors is only ones or zeros."""
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.05 * torch.randn_like(parameter)
    return network


def stored(tensors, kind):
    """Tensors of a type of numbers, ready for a file."""
    return {name: t.to(kind).contiguous() for name, t in tensors.items()}


def models(folder):
    """The files."""
    vocabulary = tiny.tokenizer(folder / "tokenizer", merges=MERGES)
    tiny.text_encoder(folder / "text_encoder", vocabulary)
    from safetensors.torch import load_file

    place = folder / "text_encoder" / "model.safetensors"
    save_file(stored({n: t + 0.05 * torch.randn_like(t) for n, t in load_file(place).items()}, torch.float16), place, {"format": "pt"})
    autoencoder = spread(tiny.vae(widths=(32, 32)))
    autoencoder.save_config(folder / "vae")
    save_file(stored(autoencoder.state_dict(), torch.bfloat16), folder / "vae" / "diffusion_pytorch_model.safetensors", {"format": "pt"})
    network = spread(unet(4))
    network.save_config(folder / "unet")
    save_file(stored(network.state_dict(), torch.float16), folder / "unet" / "diffusion_pytorch_model.fp16.safetensors", {"format": "pt"})
    tiny.scheduler().save_pretrained(folder / "scheduler")
    (folder / "ic-light").mkdir(exist_ok=True)
    for name, channels, kind in (("fc", 8, torch.float16), ("fbc", 12, torch.bfloat16)):
        offsets = {n: 0.02 * torch.randn_like(t) for n, t in unet(channels).state_dict().items()}
        save_file(stored(offsets, kind), folder / "ic-light" / f"iclight_sd15_{name}.safetensors")


def unet(channels):
    """The UNet whose weights are stored."""
    return tiny.unet(channels, block_out_channels=(32, 32))


def hashed_unet():
    """A UNet of InstructPix2Pix with three widths and two blocks a level, whose weights are hashed."""
    network = tiny.unet(
        8, block_out_channels=(32, 64, 96), layers_per_block=2, attention_head_dim=4,
        down_block_types=("CrossAttnDownBlock2D", "CrossAttnDownBlock2D", "DownBlock2D"),
        up_block_types=("UpBlock2D", "CrossAttnUpBlock2D", "CrossAttnUpBlock2D"))
    network.load_state_dict({n: weight(n, tuple(t.shape)) for n, t in network.state_dict().items()})
    return network.eval().requires_grad_(False)


def modules(folder, parts, found):
    """Each network alone."""
    tokens = torch.tensor([[5, 7, 300, 12, 510, 3, 3, 3], [1, 2, 3, 4, 5, 6, 7, 8]])
    found["text.tokens"], found["text.embedding"] = tokens, parts.text_encoder(tokens).last_hidden_state
    photo = hashed("photo", (1, 3, 32, 48))
    found["autoencoder.latents"] = parts.encoded(photo)
    found["autoencoder.pixels"] = parts.vae.decode(hashed("latents", (1, 4, 16, 24))).sample
    for name, channels in (("fc", 8), ("fbc", 12)):
        network = loading.unet(folder, channels, folder / "ic-light" / f"iclight_sd15_{name}.safetensors")
        seen, text = hashed("seen", (2, channels, 16, 24)), hashed("text", (2, 77, 32))
        found[f"unet.{name}"] = network(seen, 601.25, encoder_hidden_states=text).sample
    network, attention = hashed_unet(), editing.JointAttention()
    seen, text = hashed("seen", (4, 8, 16, 24)), hashed("text", (4, 77, 32))
    found["unet.hashed"] = network(seen, 37, encoder_hidden_states=text).sample
    attention.views = 2
    network.set_attn_processor(attention)
    found["unet.joint"] = network(seen, 37, encoder_hidden_states=text).sample


def schedules():
    """Time steps and levels of noise, and states for fixed predictions."""
    plans = []
    for sampler in ("dpm", "euler-a", "ddim"):
        for schedule in ("published", "trained"):
            for steps in (1, 2, 3, 14, 20, 25, 28, 40, 50):
                plan = lighting.scheduler(sampler, schedule)
                plan.set_timesteps(steps)
                entry = {"sampler": sampler, "schedule": schedule, "steps": steps, "times": [float(t) for t in plan.timesteps]}
                if sampler != "ddim":
                    entry["sigmas"] = [float(s) for s in plan.sigmas]
                plans.append(entry | {"states": drawn(lambda: states(plan, sampler))})
    return plans


def states(plan, sampler):
    """Four latents after each step, from the same predictions."""
    latents = hashed("state", (1, 1, 2, 2)) * float(plan.init_noise_sigma)
    made = []
    for i, t in enumerate(plan.timesteps):
        plan.scale_model_input(latents, t)
        extra = {} if sampler == "ddim" else {"generator": None}
        latents = plan.step(hashed(f"prediction {i}", (1, 1, 2, 2)), t, latents, **extra).prev_sample
        made.append([float(v) for v in latents.flatten()])
    return made


def trajectories(folder, parts, found):
    """Both passes of IC-Light by each sampler, as latents."""
    for name, channels in (("fc", 8), ("fbc", 12)):
        network = loading.unet(folder, channels, folder / "ic-light" / f"iclight_sd15_{name}.safetensors")
        conditions = hashed("conditions", (1, channels - 4, 16, 24))
        texts = [hashed("prompt", (1, 77, 32)), hashed("negative", (1, 77, 32))]
        for sampler in ("dpm", "euler-a", "ddim"):
            how = {"sampler": sampler, "schedule": "published", "steps": 6, "guidance": 2.0, "generator": None}
            first = drawn(lambda: lighting.denoised(parts, network, conditions, texts, how))
            second = drawn(lambda: lighting.denoised(parts, network, conditions, texts, how, first, 0.5))
            found[f"trajectory.{name}.{sampler}.first"], found[f"trajectory.{name}.{sampler}.second"] = first, second


def edits(folder, parts, found):
    """InstructPix2Pix: the pipeline of diffusers for one view, and two views jointly below a level of noise."""
    from diffusers import StableDiffusionInstructPix2PixPipeline

    network = hashed_unet()
    plan = tiny.scheduler()
    plan.register_to_config(set_alpha_to_one=True)
    plan.final_alpha_cumprod = torch.tensor(1.0)
    fresh = hashed("fresh", (1, 4, 16, 24))
    pipeline = StableDiffusionInstructPix2PixPipeline(
        vae=parts.vae, text_encoder=parts.text_encoder, tokenizer=parts.tokenizer, unet=network, scheduler=plan, safety_checker=None,
        feature_extractor=None, requires_safety_checker=False)
    pipeline.set_progress_bar_config(disable=True)
    photo = hashed("photo", (1, 3, 32, 48)) / 2 + 0.5
    found["edit.pipeline"] = pipeline(
        prompt="make it snow", negative_prompt="", image=photo, latents=fresh, num_inference_steps=5, guidance_scale=7.5,
        image_guidance_scale=1.5, output_type="latent").images
    found["edit.pipeline.times"] = plan.timesteps
    network.set_attn_processor(attention := editing.JointAttention())
    attention.views = 2
    options = types.SimpleNamespace(steps=5, text_guidance=7.5, picture_guidance=1.5)
    provider = types.SimpleNamespace(options=options, parts=parts, unet=network, model=folder)
    photos, starts = hashed("photos", (2, 4, 16, 24)), hashed("starts", (2, 4, 16, 24))
    embeddings = [parts.embedded(text) for text in ("make it snow", "ugly")]
    found["edit.joint"] = editing.edited_latents(provider, photos, starts, embeddings, 0.6, fresh)


def photo(width, height):
    """A ball before a slope of colors, and where the ball is."""
    y, x = np.mgrid[:height, :width] + 0.5
    inside = np.hypot(x - 0.5 * width, y - 0.55 * height) < 0.3 * height
    pixels = np.stack([x / width * 255, y / height * 255, 60 + 0 * x], axis=-1)
    pixels[inside] = np.stack([200 - 90 * y / height, 60 + 100 * x / width, 40 + 0 * x], axis=-1)[inside]
    return pixels.astype(np.uint8), (inside * 255).astype(np.uint8)


def whole(folder, parts):
    """Pictures to pictures, by the providers in Python."""
    pixels, mask = photo(150, 101)
    Image.fromarray(pixels).save(folder / "photo.png")
    Image.fromarray(mask).save(folder / "mask.png")
    Image.fromarray(np.ascontiguousarray(pixels[::-1, ::-1])).save(folder / "background.png")
    seen = lighting.on_gray(pixels, mask.astype(np.float32) / 255)
    flags = {"sampler": "dpm", "schedule": "published", "second_scale": 1.5, "second_noise": 0.5, "light_noise": 0.9, "light": "left", "added_prompt": "best quality", "negative": "lowres"}
    size = pictures.working_size(150, 101, 128)
    for name, channels, steps, guidance, beside in (("fc", 8, 4, 2.0, []), ("fbc", 12, 3, 7.0, [np.ascontiguousarray(pixels[::-1, ::-1])])):
        network = loading.unet(folder, channels, folder / "ic-light" / f"iclight_sd15_{name}.safetensors")
        provider = types.SimpleNamespace(options=types.SimpleNamespace(**flags), parts=parts)
        provider.unet, provider.published = lambda _, n=network: n, lambda _, s=steps, g=guidance: (s, g)
        passes = lighting.Passes(provider, types.SimpleNamespace(seed=0), channels, "warm light")
        start = None if beside else lighting.gradient("left", size)
        made = drawn(lambda: passes.picture([seen, *beside], size, start))
        Image.fromarray(pictures.resized(made, (150, 101))).save(folder / f"relit-{name}.png")
    network = hashed_unet()
    options = types.SimpleNamespace(steps=4, text_guidance=7.5, picture_guidance=1.5, size=64, joint=8, negative="")
    provider = types.SimpleNamespace(options=options, parts=parts, unet=network, model=folder)
    parts.noise = lambda seed, count, size: hashed("fresh", (1, 4, size[1] // parts.factor, size[0] // parts.factor))
    views = [{"original": "photo.png"}, {"original": "photo.png", "start": "background.png"}]
    request = types.SimpleNamespace(
        task={"prompt": "make it snow", "views": views, "noise": 0.8}, seed=0, file=lambda name: folder / name, output=lambda name: folder / name, warn=print)
    editing.edited(provider, request)


def layouts():
    """Names and shapes of the real networks: count of tensors, of numbers, and SHA-256 of the sorted lines `name shape`."""
    from diffusers import AutoencoderKL, UNet2DConditionModel
    from transformers import CLIPTextConfig, CLIPTextModel

    four = ("CrossAttnDownBlock2D",) * 3 + ("DownBlock2D",)
    said = {"in_channels": 4, "block_out_channels": [320, 640, 1280, 1280], "layers_per_block": 2, "cross_attention_dim": 768, "attention_head_dim": 8,
            "down_block_types": four, "up_block_types": ("UpBlock2D",) + ("CrossAttnUpBlock2D",) * 3}
    text = {"vocab_size": 49408, "hidden_size": 768, "intermediate_size": 3072, "num_hidden_layers": 12, "num_attention_heads": 12, "max_position_embeddings": 77}
    vae = {"block_out_channels": [128, 256, 512, 512], "layers_per_block": 2, "latent_channels": 4}
    with torch.device("meta"):
        made = {f"unet-{n}": ({**said, "in_channels": n}, UNet2DConditionModel(**{**said, "in_channels": n})) for n in (4, 8, 12)}
        made["text_encoder"] = (text, CLIPTextModel(CLIPTextConfig(**text)))
        made["vae"] = (vae, AutoencoderKL(
            **vae, down_block_types=("DownEncoderBlock2D",) * 4, up_block_types=("UpDecoderBlock2D",) * 4))
    found = {}
    for name, (config, network) in made.items():
        shapes = {n.removeprefix("text_model."): tuple(t.shape) for n, t in network.state_dict().items() if not n.endswith("position_ids")}
        lines = "".join(f"{n} {'x'.join(map(str, s))}\n" for n, s in sorted(shapes.items()))
        count = sum(int(np.prod(s)) for s in shapes.values())
        found[name] = {"config": config, "tensors": len(shapes), "numbers": count, "sha256": hashlib.sha256(lines.encode()).hexdigest()}
    return found


def main():
    """Writes everything."""
    if len(sys.argv) != 2:
        sys.stderr.write("usage: fixtures.py FOLDER\n")
        return 2
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(1)
    torch.set_num_threads(1)
    models(folder)
    parts = diffusion.Parts(folder, OPTIONS)
    found = {}
    with torch.inference_mode():
        modules(folder, parts, found)
        trajectories(folder, parts, found)
        edits(folder, parts, found)
        whole(folder, parts)
    save_file({n: t.contiguous() for n, t in found.items()}, folder / "expected.safetensors")
    tokens = [{"text": text, "tokens": parts.tokens(text)} for text in TEXTS]
    documents = {"tokens": tokens, "schedules": schedules(), "layouts": layouts()}
    for name, document in documents.items():
        (folder / f"{name}.json").write_text(json.dumps(document, separators=(",", ":")) + "\n", encoding="utf-8")
    for file in folder.rglob("*.safetensors"):
        file.chmod(0o644)
    return 0


if __name__ == "__main__":
    sys.exit(main())
