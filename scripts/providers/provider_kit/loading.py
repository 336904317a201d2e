"""Networks from the user's files: every tensor is accounted for, so weights of another model never run. Needs torch and diffusers."""

import json
import re
from pathlib import Path

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file

from . import weights
from .protocol import BadInput

PRECISIONS = {"f32": torch.float32, "f16": torch.float16, "bf16": torch.bfloat16}


def device_of(options):
    """The device, and the type of numbers on it; threads are set."""
    if options.threads:
        torch.set_num_threads(options.threads)
    name = options.device
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "mps" if torch.backends.mps.is_available() else "cpu"
    try:
        device = torch.device(name)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:
        raise BadInput(f"the device {name} is not there: {str(error).splitlines()[0]}", "--device cpu") from error
    precision = options.precision or ("f16" if device.type == "cuda" else "f32")
    return device, PRECISIONS[precision]


def add_options(parser):
    """Flags of providers that run torch."""
    parser.add_argument("--device", default="auto", help="auto, cpu, cuda, cuda:1, mps")
    parser.add_argument("--precision", choices=sorted(PRECISIONS), help="numbers of the large network (f16 on CUDA, f32 elsewhere)")
    parser.add_argument("--threads", type=int, default=0, metavar="N", help="threads on the CPU (0: as torch chooses)")


def tensors(path):
    """The tensors of a file in 32 bits, after its header was checked."""
    weights.header(path)
    try:
        return {name: t.float() if t.is_floating_point() else t for name, t in load_file(str(path)).items()}
    except (SafetensorError, OSError) as error:
        raise BadInput(f"cannot be read ({error}): {path}", "get the file again") from error


def filled(network, found, path, of):
    """Puts tensors into a network that has exactly these."""
    weights.compare({n: t.shape for n, t in found.items()}, {n: t.shape for n, t in network.state_dict().items()}, path, of)
    broken = next((name for name, t in found.items() if t.is_floating_point() and not torch.isfinite(t).all()), None)
    if broken:
        raise BadInput(f"the tensor {broken} has values that are not finite: {path}", "get the file again")
    network.load_state_dict(found, strict=True)
    return network.eval().requires_grad_(False)


def made(kind, config, place):
    """A network without weights, by its configuration."""
    try:
        return kind.from_config(config)
    except (TypeError, ValueError, KeyError) as error:
        raise BadInput(f"the configuration is of another kind of network ({str(error).splitlines()[0]}): {place}", "check the folder") from error


def unet(folder, in_channels=None, offsets=None):
    """The UNet of a model folder. With `in_channels` its first convolution is widened by zeros; with `offsets`, a file, that is added."""
    from diffusers import UNet2DConditionModel

    path, config = weights.part(folder, "unet")
    found = tensors(path)
    if in_channels is not None:
        config = {**config, "in_channels": in_channels}
        found = widened(found, in_channels, path)
    network = made(UNet2DConditionModel, config, path)
    shapes = {n: t.shape for n, t in network.state_dict().items()}
    weights.compare({n: t.shape for n, t in found.items()}, shapes, path, "its UNet")
    if offsets is not None:
        found = merged(found, tensors(offsets), offsets)
    return filled(network, found, offsets or path, "the UNet")


def widened(found, in_channels, path):
    """The first convolution with zeros for the channels that are new."""
    first = found.get("conv_in.weight")
    if first is None or first.ndim != 4 or first.shape[1] > in_channels:
        raise BadInput(f"no UNet of Stable Diffusion: {path}", weights.source("stable-diffusion-v1-5"))
    wide = torch.zeros(first.shape[0], in_channels, *first.shape[2:])
    wide[:, :first.shape[1]] = first
    return {**found, "conv_in.weight": wide}


def merged(base, offsets, path):
    """Every tensor of `base` plus the offset of that name."""
    weights.compare({n: t.shape for n, t in offsets.items()}, {n: t.shape for n, t in base.items()}, path, "the UNet that it is added to")
    return {name: tensor + offsets[name] for name, tensor in base.items()}


OLD_VAE = {"query": "to_q", "key": "to_k", "value": "to_v", "proj_attn": "to_out.0"}


def vae(folder):
    """The autoencoder of a model folder; files with the names of attention before diffusers 0.18 are read, too."""
    from diffusers import AutoencoderKL

    path, config = weights.part(folder, "vae")
    network = made(AutoencoderKL, config, path)
    shapes = {n: t.shape for n, t in network.state_dict().items()}
    found = {}
    for name, tensor in tensors(path).items():
        new = re.sub(r"(attentions\.\d+\.)(query|key|value|proj_attn)\.", lambda m: f"{m[1]}{OLD_VAE[m[2]]}.", name)
        found[new] = tensor.reshape(shapes[new]) if new in shapes and tensor.numel() == shapes[new].numel() else tensor
    return filled(network, found, path, "the autoencoder")


def text_encoder(folder):
    """The CLIP text encoder of a model folder, with or without the prefix that newer files leave out."""
    from transformers import CLIPTextConfig, CLIPTextModel

    path, config = weights.part(folder, "text_encoder")
    network = CLIPTextModel(CLIPTextConfig(**config))
    prefixed = any(name.startswith("text_model.") for name in network.state_dict())
    found = {}
    for name, tensor in tensors(path).items():
        if name.endswith("position_ids"):
            continue  # a buffer that old files hold
        bare = name.removeprefix("text_model.")
        found[f"text_model.{bare}" if prefixed else bare] = tensor
    return filled(network, found, path, "the text encoder")


def tokenizer(folder):
    """The tokenizer of a model folder."""
    from transformers import CLIPTokenizer

    place = Path(folder) / "tokenizer"
    if not (place / "vocab.json").is_file() and not (place / "tokenizer.json").is_file():
        raise BadInput(f"no tokenizer of a model: {place}", "name the folder that has model_index.json, with all of its parts")
    return CLIPTokenizer.from_pretrained(str(place), local_files_only=True)


def scheduler_config(folder):
    """scheduler_config.json of a model folder."""
    path = Path(folder) / "scheduler" / "scheduler_config.json"
    try:
        config = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadInput(f"no scheduler of a model: {path}", "name the folder that has model_index.json, with all of its parts") from error
    return config
