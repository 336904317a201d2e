#!/usr/bin/env python3
"""Writes tiny models with random weights into a folder, in the layouts of the real ones. For developers; never part of CI.

    tiny.py FOLDER

Their pictures mean nothing; what is computed is what the real ones compute. Needs the packages of requirements-providers.txt, and onnx.
"""

import json
import sys
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file

WIDTH = 32
"""Channels; networks of Stable Diffusion normalize in groups of 32."""


def tokenizer(folder, padding="<|endoftext|>", merges=()):
    """A CLIP tokenizer whose words are letters, and what `merges` joins: pairs, the most frequent first."""
    folder.mkdir(parents=True, exist_ok=True)
    printable = [*range(ord("!"), ord("~") + 1), *range(ord("¡"), ord("¬") + 1), *range(ord("®"), ord("ÿ") + 1)]
    others = [256 + i for i in range(256 - len(printable))]
    letters = [chr(c) for c in printable + others]
    words = letters + [letter + "</w>" for letter in letters] + [a + b for a, b in merges] + ["<|startoftext|>", "<|endoftext|>"]
    (folder / "vocab.json").write_text(json.dumps({word: i for i, word in enumerate(words)}), encoding="utf-8")
    (folder / "merges.txt").write_text("\n".join(["#version: 0.2", *(f"{a} {b}" for a, b in merges), ""]), encoding="utf-8")
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


def vae(scaling=0.18215, widths=(WIDTH, 2 * WIDTH)):
    """An autoencoder that halves the sides once."""
    from diffusers import AutoencoderKL

    return AutoencoderKL(
        block_out_channels=widths, in_channels=3, out_channels=3, latent_channels=4, norm_num_groups=32, scaling_factor=scaling,
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


def moge(folder):
    """A graph with the inputs and outputs of MoGe-2: a plane that is tilted by the picture, its normal, and a mask."""
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(1)

    def kernel(name, out):
        return numpy_helper.from_array((0.3 * rng.standard_normal((out, 3, 3, 3))).astype(np.float32), name)

    def number(name, value, kind=np.float32):
        return numpy_helper.from_array(np.asarray(value, dtype=kind), name)

    nodes = [
        helper.make_node("Conv", ["image", "w_points"], ["p0"], pads=[1, 1, 1, 1]),
        helper.make_node("Transpose", ["p0"], ["p1"], perm=[0, 2, 3, 1]),
        helper.make_node("Add", ["p1", "away"], ["points"]),
        helper.make_node("Conv", ["image", "w_normal"], ["n0"], pads=[1, 1, 1, 1]),
        helper.make_node("Transpose", ["n0"], ["n1"], perm=[0, 2, 3, 1]),
        helper.make_node("Add", ["n1", "toward"], ["n2"]),
        helper.make_node("LpNormalization", ["n2"], ["normal"], axis=-1, p=2),
        helper.make_node("Conv", ["image", "w_mask"], ["m0"], pads=[1, 1, 1, 1]),
        helper.make_node("Add", ["m0", "one"], ["m1"]),
        helper.make_node("Sigmoid", ["m1"], ["m2"]),
        helper.make_node("Squeeze", ["m2", "axis"], ["mask"]),
        helper.make_node("Cast", ["num_tokens"], ["t0"], to=TensorProto.FLOAT),
        helper.make_node("Mul", ["t0", "scale"], ["metric_scale"]),
    ]
    constants = [kernel("w_points", 3), kernel("w_normal", 3), kernel("w_mask", 1), number("away", [0, 0, 3]), number("toward", [0, 0, -2])]
    constants += [number("one", 1.0), number("scale", 0.001), number("axis", [1], np.int64)]
    shape = [1, 3, "height", "width"]
    inputs = [helper.make_tensor_value_info("image", TensorProto.FLOAT, shape), helper.make_tensor_value_info("num_tokens", TensorProto.INT64, [])]
    maps = [1, "height", "width", 3]
    outputs = [helper.make_tensor_value_info(n, TensorProto.FLOAT, s) for n, s in (("points", maps), ("normal", maps), ("mask", maps[:3]), ("metric_scale", []))]
    graph = helper.make_graph(nodes, "moge", inputs, outputs, constants)
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), folder / "model.onnx")


XL = {
    "down_block_types": ("DownBlock2D", "CrossAttnDownBlock2D"), "attention_head_dim": (2, 4), "use_linear_projection": True,
    "addition_embed_type": "text_time", "addition_time_embed_dim": 8, "transformer_layers_per_block": (1, 1),
    "projection_class_embeddings_input_dim": 6 * 8 + WIDTH, "cross_attention_dim": 2 * WIDTH,
}
"""What sets the UNet of Stable Diffusion XL apart."""


def stable_diffusion_xl(folder):
    """A folder with two text encoders."""
    from diffusers import EulerDiscreteScheduler

    vocabulary = tokenizer(folder / "tokenizer")
    tokenizer(folder / "tokenizer_2", "!")
    text_encoder(folder / "text_encoder", vocabulary)
    text_encoder(folder / "text_encoder_2", vocabulary, WIDTH)
    unet(4, up_block_types=("CrossAttnUpBlock2D", "UpBlock2D"), **XL).save_pretrained(folder / "unet")
    vae(0.13025).save_pretrained(folder / "vae")
    plan = EulerDiscreteScheduler(beta_start=0.00085, beta_end=0.012, beta_schedule="scaled_linear", steps_offset=1, timestep_spacing="leading")
    plan.save_pretrained(folder / "scheduler")
    index = {
        "_class_name": "StableDiffusionXLPipeline", "_diffusers_version": "0.33.0", "force_zeros_for_empty_prompt": True,
        "scheduler": ["diffusers", "EulerDiscreteScheduler"], "text_encoder": ["transformers", "CLIPTextModel"],
        "text_encoder_2": ["transformers", "CLIPTextModelWithProjection"], "tokenizer": ["transformers", "CLIPTokenizer"],
        "tokenizer_2": ["transformers", "CLIPTokenizer"], "unet": ["diffusers", "UNet2DConditionModel"], "vae": ["diffusers", "AutoencoderKL"],
    }
    (folder / "model_index.json").write_text(json.dumps(index), encoding="utf-8")


def control_and_depth(folder):
    """A ControlNet for the UNet above, and a depth network."""
    from diffusers import ControlNetModel
    from transformers import DPTConfig, DPTForDepthEstimation

    control = ControlNetModel(
        in_channels=4, layers_per_block=1, block_out_channels=(WIDTH, 2 * WIDTH), norm_num_groups=32,
        conditioning_embedding_out_channels=(16, WIDTH), **XL)
    control.save_pretrained(folder / "controlnet-depth-sdxl-1.0")
    config = DPTConfig(
        hidden_size=WIDTH, num_hidden_layers=4, num_attention_heads=4, intermediate_size=37, image_size=32, patch_size=16,
        backbone_out_indices=[0, 1, 2, 3], neck_hidden_sizes=[16, 16, WIDTH, WIDTH], fusion_hidden_size=16, is_hybrid=False)
    DPTForDepthEstimation(config).save_pretrained(folder / "dpt-hybrid-midas")


def loras(folder):
    """Two small changes of the queries in the UNet of Stable Diffusion XL."""
    folder.mkdir(parents=True, exist_ok=True)
    network = unet(4, up_block_types=("CrossAttnUpBlock2D", "UpBlock2D"), **XL)
    for name in ("exposure", "turbo"):
        tensors = {}
        for place, module in network.named_modules():
            if place.endswith(("to_q", "to_v")):
                tensors[f"unet.{place}.lora_A.weight"] = 0.3 * torch.randn(4, module.in_features)
                tensors[f"unet.{place}.lora_B.weight"] = 0.3 * torch.randn(module.out_features, 4)
        save_file(tensors, folder / f"{name}.safetensors")


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
    moge(folder / "moge-2-vits-normal-onnx")
    stable_diffusion_xl(folder / "stable-diffusion-xl-base-1.0")
    control_and_depth(folder)
    loras(folder / "diffusionlight")
    return 0


if __name__ == "__main__":
    sys.exit(main())
