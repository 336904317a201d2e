"""Bad weights, pictures and prompts: one error each, with a remedy; and what looks bad but is not."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from safetensors.torch import load_file, save_file

HERE = Path(__file__).resolve().parent.parent
OFFSETS = "iclight_sd15_fc.safetensors"
UNET = "diffusion_pytorch_model.safetensors"


def noise(width, height):
    """A picture of soft noise."""
    small = np.random.default_rng(1).integers(0, 255, (8, 8, 3), dtype=np.uint8)
    return Image.fromarray(small).resize((width, height))


class Bench:
    """A folder with pictures, requests and broken weights."""

    def __init__(self, record, models, folder):
        self.record, self.models, self.folder = record, models, folder / "bad"
        self.folder.mkdir()
        for name, size in (("p", (48, 34)), ("one", (1, 1)), ("thin", (1, 300)), ("large", (5472, 3648))):
            noise(*size).save(self.folder / f"{name}.png")
        Image.new("L", (48, 34), 0).save(self.folder / "empty.png")
        Image.new("L", (8, 8), 255).save(self.folder / "other.png")
        whole = (self.folder / "p.png").read_bytes()
        (self.folder / "half.png").write_bytes(whole[:len(whole) // 2])
        (self.folder / "text.png").write_bytes(b"no picture")
        sys.path.insert(0, str(HERE))
        from provider_kit import pictures

        pictures.write_map(self.folder / "p.exr", np.full((34, 48, 3), 0.2), "RGB")

    def model(self, name, *parts):
        """A copy of a model folder with links to all but these parts, which are copied."""
        copy = self.folder / f"{name}-{len(list(self.folder.iterdir()))}"
        copy.mkdir()
        for entry in (self.models / name).iterdir():
            if entry.name in parts:
                shutil.copytree(entry, copy / entry.name)
            else:
                (copy / entry.name).symlink_to(entry)
        return copy

    def offsets(self, change, name="changed.safetensors"):
        """The offsets of fc after a change."""
        tensors = load_file(self.models / "ic-light" / OFFSETS)
        path = self.folder / f"{len(list(self.folder.iterdir()))}-{name}"
        save_file(change(tensors), path)
        return path

    def expect(self, title, provider, flags, task, code, says, remedy=""):
        """Runs a provider once."""
        path = self.folder / "request.json"
        (self.folder / "reply.json").unlink(missing_ok=True)
        path.write_text(json.dumps({"format": "motes/provider-request", "version": "1.0", "seed": 1, "task": task}), encoding="utf-8")
        line = [sys.executable, str(HERE / f"{provider}.py"), *map(str, flags), "--request", str(path)]
        environment = {**os.environ, "MOTES_MODELS": str(self.models), "XDG_CACHE_HOME": str(self.folder / "cache")}
        began = time.monotonic()
        done = subprocess.run(line, env=environment, capture_output=True, text=True, timeout=600, check=False)
        lines = [part for part in done.stderr.splitlines() if part.startswith((f"{provider}: ", "help: "))]
        said = lines[0] if lines else ""
        fits = done.returncode == code and done.stdout == ""
        if code:
            fits = fits and says in said and len(lines) == 2 and remedy in lines[1] and not (self.folder / "reply.json").exists()
            fits = fits and "Traceback" not in done.stderr
            shown = said.removeprefix(f"{provider}: ").replace(str(self.folder), "DIR").replace(str(self.models), "MODELS")
        else:
            shown = f"answered in {time.monotonic() - began:.0f} s{self.checked(says)}"
            fits = fits and says in shown
        self.record.row(fits, title, done.returncode, shown)
        if not fits:
            sys.stderr.write(done.stderr[-1500:])

    def checked(self, says):
        """Size and warnings of an answer."""
        if not (self.folder / "reply.json").exists():
            return ", not"
        reply = json.loads((self.folder / "reply.json").read_text(encoding="utf-8"))
        name = reply["result"].get("relight", {}).get("picture")
        size = "x".join(map(str, Image.open(self.folder / name).size)) if name else ""
        return f": {size} {' '.join(reply['warnings'])}".rstrip(": ") if says else ""


def run(record, models, folder):
    """All rows."""
    record.section("Bad input", ["what", "exit code", "what is said"])
    bench = Bench(record, models, folder)
    small = ["--device", "cpu", "--size", 64, "--steps", 2]
    weights(bench, small, {"relight": {"picture": "p.png", "prompt": "warm light"}})
    inputs(bench, small)


def weights(bench, small, task):
    """Weights that are not what they should be."""
    say = bench.expect

    cut = bench.model("stable-diffusion-v1-5", "unet")
    whole = (cut / "unet" / UNET).read_bytes()
    (cut / "unet" / UNET).write_bytes(whole[:-1000])
    say("UNet cut short", "iclight", [*small, "--model", cut], task, 3, "cut short", "get the file again")
    say("offsets that are a UNet of Stable Diffusion", "iclight", [*small, "--weights", bench.models / "stable-diffusion-v1-5" / "unet" / UNET], task, 3, "4 input channels", "lllyasviel/ic-light")
    say("a tensor missing", "iclight", [*small, "--weights", bench.offsets(lambda t: {k: v for k, v in t.items() if k != "conv_out.bias"})], task, 3, "conv_out.bias of the UNet that it is added to missing")
    say("a tensor too many", "iclight", [*small, "--weights", bench.offsets(lambda t: {**t, "lora.up": torch.zeros(1)})], task, 3, "lora.up not of the UNet")
    say("a tensor of another shape", "iclight", [*small, "--weights", bench.offsets(lambda t: {**t, "conv_out.bias": torch.zeros(5)})], task, 3, "conv_out.bias is 5")
    say("a tensor with NaN", "iclight", [*small, "--weights", bench.offsets(lambda t: {**t, "conv_out.bias": torch.full((4,), torch.nan)})], task, 3, "conv_out.bias has values that are not finite")
    say("offsets in bf16", "iclight", [*small, "--weights", bench.offsets(lambda t: {k: v.bfloat16() for k, v in t.items()})], task, 0, "")
    say("networks in bf16", "iclight", [*small, "--precision", "bf16"], task, 0, "")
    say("Stable Diffusion for InstructPix2Pix", "ip2p", [*small, "--model", bench.models / "stable-diffusion-v1-5"], {"instruct-edit": {"prompt": "snow", "views": [{"original": "p.png"}]}}, 3, "8 input channels", "timbrooks/instruct-pix2pix")
    other = bench.model("stable-diffusion-v1-5", "vae")
    shutil.copy(bench.models / "stable-diffusion-v1-5" / "text_encoder" / "model.safetensors", other / "vae" / UNET)
    say("text encoder for the autoencoder", "iclight", [*small, "--model", other], task, 3, "of the autoencoder missing")
    single = bench.folder / "v1-5-pruned.safetensors"
    save_file({"model.diffusion_model.input_blocks.0.0.weight": torch.zeros(1)}, single)
    say("one file for the folder of a model", "iclight", [*small, "--model", single], task, 3, "a file where the folder of a model is due", "model_index.json")
    say("a folder without weights", "iclight", [*small, "--weights", bench.folder], task, 3, "no iclight_sd15_fc.safetensors", "lllyasviel/ic-light")
    say("no weights at all", "iclight", [*small, "--model", bench.folder / "none"], task, 3, "no such file or folder", "OpenRAIL-M")
    pickled = bench.folder / "iclight.pt"
    torch.save({"a": torch.zeros(1)}, pickled)
    say("a pickled checkpoint", "iclight", [*small, "--weights", pickled], task, 3, "could run code", "safetensors")
    say("fbc without its file", "iclight", [*small, "--weights", bench.models / "ic-light" / OFFSETS], {"relight": {"picture": "p.png", "background": "p.png"}}, 3, "need iclight_sd15_fbc.safetensors")
    maps = {"predict": {"pictures": ["p.png"], "quantities": ["normal"]}}
    broken = bench.folder / "broken.onnx"
    broken.write_bytes((bench.models / "moge-2-vits-normal-onnx" / "model.onnx").read_bytes()[:300])
    say("ONNX cut short", "moge", ["--weights", broken], maps, 3, "no ONNX file that can be run")
    say("another Marigold", "marigold", ["--device", "cpu", "--model", bench.models / "instruct-pix2pix"], {"predict": {"pictures": ["p.png"], "quantities": ["metallic"]}}, 3, "no Marigold-IID-Appearance")
    if not torch.cuda.is_available():
        say("a device that is not there", "iclight", [*small[2:], "--device", "cuda"], task, 3, "the device cuda is not there", "--device cpu")


def inputs(bench, small):
    """Pictures, masks and prompts."""
    def relight(**more):
        return {"relight": {"picture": "p.png", "prompt": "warm light", **more}}

    say = bench.expect
    say("a picture of one pixel", "iclight", small, relight(picture="one.png"), 0, "1x1")
    say("a picture of 1 x 300 pixels", "iclight", small, relight(picture="thin.png"), 0, "1x300")
    say("a picture of 20 Mpix", "iclight", small, relight(picture="large.png"), 0, "5472x3648 the model worked at")
    say("a picture in OpenEXR", "iclight", small, relight(picture="p.exr"), 0, "48x34")
    say("a PNG cut short", "iclight", small, relight(picture="half.png"), 3, "half.png is no picture that can be read")
    say("a text for a picture", "iclight", small, relight(picture="text.png"), 3, "text.png is no picture that can be read")
    say("an empty mask", "iclight", small, relight(foreground="empty.png"), 3, "the foreground is empty", "check the mask")
    say("a mask of another size", "iclight", small, relight(foreground="other.png"), 3, "the foreground has 8x8 pixels")
    prompt = "warm light " * 930
    say("a prompt of 10 kB", "iclight", small, relight(prompt=prompt), 2, "tokens; the model takes 600", "shorten the prompt")
    edit = {"instruct-edit": {"prompt": prompt, "views": [{"original": "p.png"}]}}
    say("a prompt of 10 kB", "ip2p", small, edit, 2, "tokens, the model reads 75", "shorten the prompt")
    other = {"instruct-edit": {"prompt": "snow", "views": [{"original": "p.png", "start": "one.png"}]}}
    say("a start of another size", "ip2p", small, other, 3, "the start one.png has 1x1 pixels")
    sizes = {"instruct-edit": {"prompt": "snow", "noise": 0.5, "views": [{"original": "p.png"}, {"original": "thin.png"}]}}
    say("views of two sizes", "ip2p", small, sizes, 0, "")
