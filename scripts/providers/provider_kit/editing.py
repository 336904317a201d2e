"""InstructPix2Pix: guidance by text and by picture, DDIM below a level of noise, views that attend to each other. Needs torch.

The level of noise is that of Instruct-NeRF2NeRF (Haque et al., 2023): steps are spread below it. Joint attention is that of MVDream
(Shi et al., 2024), whose only change to self-attention is that its tokens are those of all views; it needs no other weights.
"""

import numpy as np
import torch
import torch.nn.functional as F

from . import loading, pictures
from .diffusion import signed, unsigned
from .protocol import BadInput, Failed


class JointAttention:
    """Self-attention over the tokens of all views; cross-attention as ever.

    The batch is passes x views: rows of one pass see each other. `views` is set before each run.
    """

    def __init__(self):
        self.views = 1

    def __call__(self, attn, hidden_states, encoder_hidden_states=None, attention_mask=None, temb=None):
        batch, length, channels = hidden_states.shape
        joint = encoder_hidden_states is None
        if joint:
            hidden_states = hidden_states.reshape(batch // self.views, self.views * length, channels)
        context = hidden_states if joint else encoder_hidden_states

        def heads(values):
            return values.unflatten(-1, (attn.heads, -1)).transpose(1, 2)

        found = F.scaled_dot_product_attention(heads(attn.to_q(hidden_states)), heads(attn.to_k(context)), heads(attn.to_v(context)))
        found = attn.to_out[1](attn.to_out[0](found.transpose(1, 2).flatten(-2)))
        return found.reshape(batch, length, channels) / attn.rescale_output_factor


def alphas(config):
    """Products of the alphas of a scheduler configuration, in 64 bits: the share of signal at each of its time steps."""
    count = config.get("num_train_timesteps", 1000)
    first, last = config.get("beta_start", 0.00085), config.get("beta_end", 0.012)
    kind = config.get("beta_schedule", "scaled_linear")
    if kind == "scaled_linear":
        betas = np.linspace(first**0.5, last**0.5, count, dtype=np.float64) ** 2
    elif kind == "linear":
        betas = np.linspace(first, last, count, dtype=np.float64)
    else:
        raise BadInput(f"the scheduler has the schedule {kind}, which is not known here", "give the folder of InstructPix2Pix")
    if config.get("prediction_type", "epsilon") != "epsilon":
        raise BadInput(f"the model predicts {config['prediction_type']}, not noise", "give the folder of InstructPix2Pix")
    return np.cumprod(1 - betas)


def times_below(noise, steps, count):
    """Time steps from `noise` (0 to 1, of `count`) down, evenly spread; the level after the last one is clean."""
    top = min(int(noise * count), count - 1)
    return [int(round(t)) for t in np.linspace(top, 0, steps, endpoint=False)]


def ddim(latents, predicted, now, then):
    """One deterministic step of DDIM (Song et al., 2021): from the share of signal `now` to `then`."""
    clean = (latents - (1 - now) ** 0.5 * predicted) / now**0.5
    return then**0.5 * clean + (1 - then) ** 0.5 * predicted


def guided(text, picture, none, text_scale, picture_scale):
    """Noise by dual guidance: equation 3 of InstructPix2Pix."""
    return none + text_scale * (text - picture) + picture_scale * (picture - none)


@torch.inference_mode()
def edited_latents(provider, photos, starts, embeddings, noise, fresh):
    """Scaled latents of views of one size, edited jointly. `photos` are not scaled, `starts` are; `fresh` is the noise."""
    o, parts = provider.options, provider.parts
    views = len(photos)
    signal = alphas(loading.scheduler_config(provider.model))
    times = times_below(noise, o.steps, len(signal))
    levels = [signal[t] for t in times] + [1.0]
    latents = levels[0] ** 0.5 * starts.float() + (1 - levels[0]) ** 0.5 * fresh.float()
    if noise >= 1:
        latents = fresh.float().expand_as(starts).clone()
    text, negative = embeddings
    texts = torch.cat([text.expand(views, -1, -1), negative.expand(2 * views, -1, -1)])
    photos = torch.cat([photos, photos, torch.zeros_like(photos)]).to(parts.dtype)
    for t, now, then in zip(times, levels, levels[1:]):
        seen = torch.cat([torch.cat([latents.to(parts.dtype)] * 3), photos], dim=1)
        predicted = provider.unet(seen, torch.tensor(t, device=parts.device), encoder_hidden_states=texts).sample.float()
        predicted = guided(*predicted.chunk(3), o.text_guidance, o.picture_guidance)
        latents = ddim(latents, predicted, now, then)
    return latents


def edited(provider, request):
    """Answers `instruct-edit`; names of the pictures."""
    task, o, parts = request.task, provider.options, provider.parts
    noise = float(task.get("noise", 1.0))
    views = [read_view(request, view) for view in task["views"]]
    names = [f"edited-{i}.png" for i in range(len(views))]
    if int(noise * 1000) < 1:
        for name, (_, start) in zip(names, views):
            pictures.write(request.output(name), start)
        return names
    embeddings = [parts.embedded(text) for text in (task["prompt"], o.negative)]
    attention = JointAttention()
    provider.unet.set_attn_processor(attention)
    for group in groups(views, o.joint):
        if len(views) > o.joint > 1:
            request.warn(f"{len(views)} views are edited in groups of at most {o.joint}, which agree less (--joint)")
        size = pictures.working_size(views[group[0]][0].shape[1], views[group[0]][0].shape[0], o.size)
        photos = torch.stack([signed(pictures.resized(views[i][0], size)) for i in group])
        starts = torch.stack([signed(pictures.resized(views[i][1], size)) for i in group])
        attention.views = len(group)
        # The same noise for every view and group of a seed: what is edited alone later agrees with what was edited jointly.
        fresh = parts.noise(request.seed, 1, size)
        latents = edited_latents(provider, parts.encoded(photos), parts.encoded(starts) * parts.scale, embeddings, noise, fresh)
        for i, decoded in zip(group, parts.decoded(latents)):
            if not torch.isfinite(decoded).all():
                raise Failed("the network answers values that are not finite", "--precision f32, or check the weights")
            height, width, _ = views[i][0].shape
            pictures.write(request.output(names[i]), pictures.resized(unsigned(decoded), (width, height)))
    return names


def read_view(request, view):
    """Bytes of the photo and of the start."""
    photo = pictures.read(request.file(view["original"]))
    if not view.get("start"):
        return photo, photo
    start = pictures.read(request.file(view["start"]))
    if start.shape != photo.shape:
        (a, b), (c, d) = (start.shape[:2], photo.shape[:2])
        raise BadInput(f"the start {view['start']} has {b}x{a} pixels, its photo {d}x{c}", "send both alike")
    return photo, start


def groups(views, most):
    """Numbers of views that are edited jointly: of one size, evenly spread over groups of at most `most`."""
    sizes = {}
    for i, (photo, _) in enumerate(views):
        sizes.setdefault(photo.shape, []).append(i)
    found = []
    for alike in sizes.values():
        count = -(-len(alike) // most)
        found += [alike[k::count] for k in range(count)]
    return found
