#!/usr/bin/env python3
"""Writes tiny models with random weights into a folder, in the layouts of the real ones. For developers; never part of CI.

    tiny.py FOLDER

Their pictures mean nothing; what is computed is what the real ones compute. Needs the packages of requirements-providers.txt, and onnx.
"""

import json
import sys
from pathlib import Path

import torch
from safetensors.torch import save_file

WIDTH = 32
"""Channels; networks of Stable Diffusion normalize in groups of 32."""


def tokenizer(folder, padding="<|endoftext|>"):
    """A CLIP tokenizer whose words are letters."""
    folder.mkdir(parents=True, exist_ok=True)
    printable = [*range(ord("!"), ord("~") + 1), *range(ord("¡"), ord("¬") + 1), *range(ord("®"), ord("ÿ") + 1)]
    others = [256 + i for i in range(256 - len(printable))]
    letters = [chr(c) for c in printable + others]
    words = letters + [letter + "</w>" for letter in letters] + ["<|startoftext|>", "<|endoftext|>"]
    (folder / "vocab.json").write_text(json.dumps({word: i for i, word in enumerate(words)}), encoding="utf-8")
    (folder / "merges.txt").write_text("#version: 0.2\n", encoding="utf-8")
    config = {"tokenizer_class": "CLIPTokenizer", "model_max_length": 77, "pad_token": padding}
    config.update({"bos_token": "<|startoftext|>", "eos_token": "<|endoftext|>", "unk_token": "<|endoftext|>"})
    (folder / "tokenizer_config.json").write_text(json.dumps(config), encoding="utf-8")
    return len(words)


def text_encoder(folder, vocabulary, projection=None):
    """A CLIP text encoder, with the names that files of the real ones have."""
    from transformers import CLIPTextConfig, CLIPTextModel, CLIPTextModelWithProjection

    config = CLIPTextConfig(
        vocab_size=vocabulary, hidden_size=WIDTH, intermediate_size=37, num_hidden_layers=2, num_attention_heads=4,
        max_position_embeddings=77, hidden_act="quick_gelu", projection_dim=projection or WIDTH,
        bos_token_id=vocabulary - 2, eos_token_id=vocabulary - 1, pad_token_id=vocabulary - 1)
    kind = CLIPTextModelWithProjection if projection else CLIPTextModel
    network = kind(config)
    network.save_pretrained(folder)
    if not projection:
        prefixed = {"text_model." + n.removeprefix("text_model."): t.contiguous() for n, t in network.state_dict().items()}
        save_file(prefixed, folder / "model.safetensors", {"format": "pt"})


def unet(in_channels, out_channels=4, **more):
    """A UNet with self- and cross-attention at two levels."""
    from diffusers import UNet2DConditionModel

    config = {
        "sample_size": 32, "layers_per_block": 1, "block_out_channels": (WIDTH, 2 * WIDTH), "norm_num_groups": 32,
        "down_block_types": ("CrossAttnDownBlock2D", "DownBlock2D"), "up_block_types": ("UpBlock2D", "CrossAttnUpBlock2D"),
        "cross_attention_dim": WIDTH, "attention_head_dim": 2,
    }
    return UNet2DConditionModel(in_channels=in_channels, out_channels=out_channels, **{**config, **more})


def vae(scaling=0.18215):
    """An autoencoder that halves the sides once."""
    from diffusers import AutoencoderKL

    return AutoencoderKL(
        block_out_channels=(WIDTH, 2 * WIDTH), in_channels=3, out_channels=3, latent_channels=4, norm_num_groups=32, scaling_factor=scaling,
        down_block_types=("DownEncoderBlock2D",) * 2, up_block_types=("UpDecoderBlock2D",) * 2)


def scheduler():
    """DDIM as Stable Diffusion has it."""
    from diffusers import DDIMScheduler

    return DDIMScheduler(
        beta_start=0.00085, beta_end=0.012, beta_schedule="scaled_linear", clip_sample=False, set_alpha_to_one=False, steps_offset=1)


def stable_diffusion(folder, in_channels):
    """A model folder."""
    vocabulary = tokenizer(folder / "tokenizer")
    text_encoder(folder / "text_encoder", vocabulary)
    unet(in_channels).save_pretrained(folder / "unet")
    vae().save_pretrained(folder / "vae")
    scheduler().save_pretrained(folder / "scheduler")
    (folder / "model_index.json").write_text(json.dumps({"_class_name": "StableDiffusionPipeline"}), encoding="utf-8")


def ic_light(folder):
    """Offsets in 16 bits, as the published ones are."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, channels in (("fc", 8), ("fbc", 12)):
        shapes = unet(channels).state_dict()
        offsets = {n: (0.02 * torch.randn_like(t)).half() for n, t in shapes.items()}
        save_file(offsets, folder / f"iclight_sd15_{name}.safetensors")


def marigold(folder):
    """Marigold for base color, roughness and metallic."""
    vocabulary = tokenizer(folder / "tokenizer")
    text_encoder(folder / "text_encoder", vocabulary)
    unet(12, 8).save_pretrained(folder / "unet")
    vae().save_pretrained(folder / "vae")
    scheduler().save_pretrained(folder / "scheduler")
    index = {
        "_class_name": "MarigoldIntrinsicsPipeline", "_diffusers_version": "0.33.0",
        "default_denoising_steps": 2, "default_processing_resolution": 64, "prediction_type": "intrinsics",
        "scheduler": ["diffusers", "DDIMScheduler"], "text_encoder": ["transformers", "CLIPTextModel"],
        "tokenizer": ["transformers", "CLIPTokenizer"], "unet": ["diffusers", "UNet2DConditionModel"],
        "vae": ["diffusers", "AutoencoderKL"],
        "target_properties": {
            "target_names": ["albedo", "material"],
            "albedo": {"prediction_space": "srgb", "up_to_scale": False},
            "material": {"prediction_space": "stack", "sub_target_names": ["roughness", "metallicity", None], "up_to_scale": False},
        },
    }
    (folder / "model_index.json").write_text(json.dumps(index), encoding="utf-8")


def main():
    """Writes what is there to write."""
    if len(sys.argv) != 2:
        sys.stderr.write("usage: tiny.py FOLDER\n")
        return 2
    torch.manual_seed(1)
    folder = Path(sys.argv[1])
    stable_diffusion(folder / "stable-diffusion-v1-5", 4)
    ic_light(folder / "ic-light")
    stable_diffusion(folder / "instruct-pix2pix", 8)
    marigold(folder / "marigold-iid-appearance-v1-1")
    return 0


if __name__ == "__main__":
    sys.exit(main())
