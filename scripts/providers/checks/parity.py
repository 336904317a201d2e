"""What is computed here against diffusers, and against published formulas, on tiny models."""

import sys
import types
from pathlib import Path

import numpy as np
import torch

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from provider_kit import diffusion, editing, lighting, loading  # noqa: E402

OPTIONS = types.SimpleNamespace(device="cpu", precision="f32", threads=2)


def difference(a, b):
    """Largest difference over the largest value."""
    a, b = torch.as_tensor(a).double(), torch.as_tensor(b).double()
    return float((a - b).abs().max() / b.abs().max().clamp_min(1e-12))


def run(record, models):
    """All rows."""
    record.section("Parity", ["what", "against", "largest difference, relative", "allowed"])

    def row(what, against, found, allowed):
        record.row(found <= allowed, what, against, f"{found:.1e}", f"{allowed:.0e}")

    for name, channels in (("fc", 8), ("fbc", 12)):
        row(f"IC-Light {name}, all tensors", "tensors added one by one", *merge(models, name, channels))
    row("IC-Light, DPM++ 2M SDE Karras, sigmas", "Karras et al., in 64 bits; largest 25.146", *karras("published", 25.1461))
    row("same, schedule as trained", "same; largest 14.615", *karras("trained", 14.6146))
    for sampler in ("dpm", "euler-a", "ddim"):
        for channels in (8, 12):
            row(f"IC-Light, both passes, {sampler}, {channels} channels", "pipelines of diffusers with the published hook", *both_passes(models, sampler, channels))
    row("IC-Light, embeddings of 3 chunks", "the text encoder, chunk by chunk", *chunks(models))
    row("InstructPix2Pix, DDIM, 25 states", "DDIMScheduler of diffusers", *ddim_states())
    row("InstructPix2Pix, shares of signal", "DDIMScheduler of diffusers", *signal())
    row("InstructPix2Pix, one view, latents", "its pipeline of diffusers", *one_view(models))
    row("joint attention, one view", "attention of diffusers", *joint(models, 1))
    row("joint attention, four views alike", "one view", *joint(models, 4))
    record.section("Reproducibility on the CPU", ["what", "threads", "outcome"])
    for sampler in ("dpm", "ddim"):
        runs = []
        for threads in (1, 2, 2):
            torch.set_num_threads(threads)
            runs.append(ours(models, sampler, 8)[1])
        record.row(torch.equal(runs[1], runs[2]), f"IC-Light, {sampler}, twice", 2, "same bits" if torch.equal(runs[1], runs[2]) else "other bits")
        other = "same bits" if torch.equal(runs[0], runs[1]) else f"largest difference, relative: {difference(runs[0], runs[1]):.1e}"
        record.row(True, f"IC-Light, {sampler}", "1 and 2", other)
    torch.set_num_threads(2)


def merge(models, name, channels):
    """Tensors of the merged UNet."""
    from safetensors.torch import load_file

    file = models / "ic-light" / f"iclight_sd15_{name}.safetensors"
    base = load_file(models / "stable-diffusion-v1-5" / "unet" / "diffusion_pytorch_model.safetensors")
    offsets, found = load_file(file), loading.unet(models / "stable-diffusion-v1-5", channels, file).state_dict()
    worst = 0.0
    for key, offset in offsets.items():
        wanted = offset.float()
        wanted[tuple(slice(0, side) for side in base[key].shape)] += base[key]
        worst = max(worst, difference(found[key], wanted))
    assert set(found) == set(offsets) and offsets["conv_in.weight"].dtype == torch.float16
    return worst, 0.0


def karras(schedule, largest):
    """Sigmas of 25 steps by the formula."""
    plan = lighting.scheduler("dpm", schedule)
    plan.set_timesteps(25)
    if schedule == "published":
        betas = np.linspace(0.00085, 0.012, 1000)
    else:
        betas = np.linspace(0.00085**0.5, 0.012**0.5, 1000) ** 2
    alphas = np.cumprod(1 - betas)
    high, low = (((1 - a) / a) ** 0.5 for a in (alphas[-1], alphas[0]))
    wanted = (high ** (1 / 7) + np.linspace(0, 1, 25) * (low ** (1 / 7) - high ** (1 / 7))) ** 7
    assert abs(float(plan.sigmas[0]) - largest) < 1e-3
    return difference(plan.sigmas[:25], wanted), 1e-5


def settings(sampler):
    """What a run needs."""
    return {"sampler": sampler, "schedule": "published", "steps": 4, "guidance": 2.0, "generator": torch.Generator("cpu").manual_seed(7)}


def known(models, channels):
    """UNet, parts, embeddings and conditions of a small picture."""
    name = "fc" if channels == 8 else "fbc"
    folder = models / "stable-diffusion-v1-5"
    network = loading.unet(folder, channels, models / "ic-light" / f"iclight_sd15_{name}.safetensors")
    parts = diffusion.Parts(folder, OPTIONS)
    texts = parts.embedded_pair("warm light, best quality", "lowres")
    generator = torch.Generator("cpu").manual_seed(3)
    conditions = torch.randn(1, channels - 4, 32, 48, generator=generator)
    return network, parts, texts, conditions


def ours(models, sampler, channels):
    """Latents of the first pass and of the second, as computed here."""
    network, parts, texts, conditions = known(models, channels)
    how = settings(sampler)
    first = lighting.denoised(parts, network, conditions, texts, how)
    return first, lighting.denoised(parts, network, conditions, texts, how, first, 0.5)


def both_passes(models, sampler, channels):
    """The same by the pipelines of diffusers, whose UNet appends the conditions in a hook."""
    from diffusers import StableDiffusionImg2ImgPipeline, StableDiffusionPipeline

    mine = ours(models, sampler, channels)
    network, parts, texts, conditions = known(models, channels)
    plain = network.forward

    def hooked(sample, timestep, encoder_hidden_states, **more):
        more["cross_attention_kwargs"] = {}
        seen = torch.cat([sample, torch.cat([conditions] * sample.shape[0])], dim=1)
        return plain(seen, timestep, encoder_hidden_states, **more)

    network.forward = hooked
    network.register_to_config(in_channels=4)
    how = settings(sampler)
    shared = dict(
        vae=parts.vae, text_encoder=parts.text_encoder, tokenizer=parts.tokenizer, unet=network, safety_checker=None,
        feature_extractor=None, requires_safety_checker=False)
    asked = dict(
        prompt_embeds=texts[0], negative_prompt_embeds=texts[1], guidance_scale=2.0, generator=how["generator"], output_type="latent",
        cross_attention_kwargs={"conditions": 1})
    first = StableDiffusionPipeline(scheduler=lighting.scheduler(sampler, "published"), **shared)
    second = StableDiffusionImg2ImgPipeline(scheduler=lighting.scheduler(sampler, "published"), **shared)
    for pipeline in (first, second):
        pipeline.set_progress_bar_config(disable=True)
    pixels = parts.factor
    found = first(height=32 * pixels, width=48 * pixels, num_inference_steps=4, **asked).images
    again = second(image=found, strength=0.5, num_inference_steps=8, **asked).images
    return max(difference(mine[0], found), difference(mine[1], again)), 1e-5


def chunks(models):
    """Three chunks of a long prompt."""
    parts = diffusion.Parts(models / "stable-diffusion-v1-5", OPTIONS)
    text = "a" * 160
    found, negative = parts.embedded_pair(text, "b")
    tokens = parts.tokenizer(text, add_special_tokens=False)["input_ids"]
    begin, end = parts.tokenizer.bos_token_id, parts.tokenizer.eos_token_id
    worst = 0.0
    for i in range(3):
        row = [begin, *tokens[75 * i:75 * i + 75]]
        row += [end] * (77 - len(row))
        with torch.inference_mode():
            wanted = parts.text_encoder(torch.tensor([row])).last_hidden_state
        worst = max(worst, difference(found[:, 77 * i:77 * i + 77], wanted))
    assert found.shape == negative.shape == (1, 231, 32)
    return worst, 1e-6


def reference_ddim(clean_end):
    """The scheduler of diffusers."""
    from diffusers import DDIMScheduler

    return DDIMScheduler(
        beta_start=0.00085, beta_end=0.012, beta_schedule="scaled_linear", clip_sample=False, set_alpha_to_one=clean_end, steps_offset=1)


def ddim_states():
    """25 states for fixed predictions."""
    plan, levels = reference_ddim(True), editing.alphas({})
    plan.set_timesteps(25)
    generator = torch.Generator().manual_seed(5)
    state = mine = torch.randn(1, 4, 8, 8, generator=generator, dtype=torch.float64)
    times, worst = [int(t) for t in plan.timesteps], 0.0
    for i, t in enumerate(times):
        predicted = torch.randn(1, 4, 8, 8, generator=generator, dtype=torch.float64)
        state = plan.step(predicted, t, state).prev_sample
        then = levels[times[i + 1]] if i + 1 < len(times) else 1.0
        mine = editing.ddim(mine, predicted, levels[t], then)
        worst = max(worst, difference(mine, state))
    return worst, 1e-5


def signal():
    """Products of alphas."""
    return difference(editing.alphas({}), reference_ddim(False).alphas_cumprod), 1e-5


def one_view(models):
    """A whole edit of one view; the pipeline's time steps are used here, too."""
    from diffusers import StableDiffusionInstructPix2PixPipeline
    from diffusers.models.attention_processor import AttnProcessor2_0

    folder = models / "instruct-pix2pix"
    network, parts = loading.unet(folder), diffusion.Parts(folder, OPTIONS)
    options = types.SimpleNamespace(steps=4, text_guidance=7.5, picture_guidance=1.5)
    provider = types.SimpleNamespace(options=options, parts=parts, unet=network, model=folder)
    photo = torch.rand(1, 3, 64, 96, generator=torch.Generator().manual_seed(1))
    fresh = parts.noise(9, 1, (96, 64))
    plan = reference_ddim(True)
    plan.set_timesteps(4)
    times, own = [int(t) for t in plan.timesteps], editing.times_below
    latents = parts.encoded(2 * photo - 1)
    embeddings = [parts.embedded(text) for text in ("make it snow", "")]
    network.set_attn_processor(editing.JointAttention())
    try:
        editing.times_below = lambda *_: times
        mine = editing.edited_latents(provider, latents, latents * parts.scale, embeddings, 1.0, fresh)
    finally:
        editing.times_below = own
    network.set_attn_processor(AttnProcessor2_0())
    pipeline = StableDiffusionInstructPix2PixPipeline(
        vae=parts.vae, text_encoder=parts.text_encoder, tokenizer=parts.tokenizer, unet=network, scheduler=plan, safety_checker=None,
        feature_extractor=None, requires_safety_checker=False)
    pipeline.set_progress_bar_config(disable=True)
    found = pipeline(
        prompt="make it snow", negative_prompt="", image=photo, latents=fresh, num_inference_steps=4, guidance_scale=7.5,
        image_guidance_scale=1.5, output_type="latent").images
    return difference(mine, found), 1e-5


def joint(models, views):
    """The network with joint attention over views that are alike, against one view with that of diffusers."""
    network = loading.unet(models / "instruct-pix2pix")
    generator = torch.Generator().manual_seed(2)
    seen, text = torch.randn(1, 8, 32, 32, generator=generator), torch.randn(1, 77, 32, generator=generator)
    with torch.inference_mode():
        wanted = network(seen, 500, encoder_hidden_states=text).sample
        attention = editing.JointAttention()
        attention.views = views
        network.set_attn_processor(attention)
        found = network(seen.expand(views, -1, -1, -1), 500, encoder_hidden_states=text.expand(views, -1, -1)).sample
        # Views that differ do see each other.
        if views > 1:
            other = torch.cat([seen.expand(views - 1, -1, -1, -1), torch.randn(1, 8, 32, 32, generator=generator)])
            apart = network(other, 500, encoder_hidden_states=text.expand(views, -1, -1)).sample[:1]
            assert difference(apart, wanted) > 1e-3
    return difference(found, wanted.expand_as(found)), 1e-5
