"""Weights of the user: where they lie, whether they are whole, and what they are. Standard library only.

Nothing is fetched. Whatever is missing is an error that names the file, where it comes from, and its license.
"""

import hashlib
import json
import os
import struct
from pathlib import Path

from .protocol import BadInput

MODELS_VARIABLE = "MOTES_MODELS"
LARGEST_HEADER = 100 << 20
SIZES = {"F64": 8, "F32": 4, "F16": 2, "BF16": 2, "I64": 8, "I32": 4, "I16": 2, "I8": 1, "U8": 1, "BOOL": 1}

SOURCES = {
    "stable-diffusion-v1-5": ("the folder stable-diffusion-v1-5/stable-diffusion-v1-5 of Hugging Face", "CreativeML OpenRAIL-M"),
    "ic-light": ("the repository lllyasviel/ic-light of Hugging Face", "CreativeML OpenRAIL-M"),
    "instruct-pix2pix": ("the folder timbrooks/instruct-pix2pix of Hugging Face", "MIT"),
    "marigold-iid-appearance-v1-1": ("the folder prs-eth/marigold-iid-appearance-v1-1 of Hugging Face", "CreativeML OpenRAIL++-M"),
    "moge-2-vits-normal-onnx": ("the repository Ruicheng/moge-2-vits-normal-onnx of Hugging Face", "MIT"),
    "stable-diffusion-xl-base-1.0": ("the folder stabilityai/stable-diffusion-xl-base-1.0 of Hugging Face", "CreativeML OpenRAIL++-M"),
    "controlnet-depth-sdxl-1.0": ("the folder diffusers/controlnet-depth-sdxl-1.0 of Hugging Face", "CreativeML OpenRAIL++-M"),
    "dpt-hybrid-midas": ("the folder Intel/dpt-hybrid-midas of Hugging Face", "Apache-2.0"),
    "diffusionlight": ("the project DiffusionLight-Turbo and its repository on Hugging Face", "MIT"),
}
"""Place and license of the weights, by the folder that they are looked for in."""


def source(name):
    """The remedy for weights that are missing."""
    place, license_name = SOURCES[name]
    return f"weights come from {place} (license: {license_name}); motes fetches none"


def license_of(name):
    """The license of weights, for descriptions."""
    return SOURCES[name][1]


def located(given, name, flag):
    """The path that the user gave, or `name` in the folder of MOTES_MODELS."""
    if given is None:
        folder = os.environ.get(MODELS_VARIABLE)
        if not folder:
            raise BadInput(f"{flag} is not given", f"{flag} PATH, or {MODELS_VARIABLE}=FOLDER with {name} in it; {source(name)}")
        given = Path(folder) / name
    path = Path(given)
    if not path.exists():
        raise BadInput(f"no such file or folder: {path}", source(name))
    return path


def other_kind(first, path):
    """The error about a file that begins so, and is no safetensors file."""
    if first.startswith((b"PK\x03\x04", b"\x80\x02")):
        return BadInput(
            f"a pickled checkpoint, which could run code: {path}",
            "take the .safetensors file of the same weights, or convert it with safetensors.torch.save_file",
        )
    if first.startswith(b"version "):
        return BadInput(f"a pointer of Git LFS, not the weights: {path}", "git lfs pull in its folder")
    return BadInput(f"no safetensors file, or one that is cut short: {path}", "get the file again; compare its size")


def header(path):
    """Names of the tensors of a safetensors file, with type and shape. Only the beginning is read, and the length compared."""
    path = Path(path)
    if path.is_dir():
        raise BadInput(f"a folder where a file is due: {path}", "name the .safetensors file in it")
    try:
        size = path.stat().st_size
        with open(path, "rb") as file:
            first = file.read(8)
            length = struct.unpack("<Q", first)[0] if len(first) == 8 else -1
            if not 2 <= length <= min(LARGEST_HEADER, size - 8):
                raise other_kind(first, path)
            document = json.loads(file.read(length))
            tensors = {name: entry for name, entry in document.items() if name != "__metadata__"}
            end = max((entry["data_offsets"][1] for entry in tensors.values()), default=0)
            found = {name: (entry["dtype"], tuple(entry["shape"])) for name, entry in tensors.items()}
    except OSError as error:
        raise BadInput(f"cannot be read ({error.strerror}): {path}") from error
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        raise BadInput(f"no safetensors file: {path}", "get the file again") from error
    if 8 + length + end != size:
        raise BadInput(f"the file is cut short or has a tail: {size} bytes, {8 + length + end} are due: {path}", "get the file again")
    if not found:
        raise BadInput(f"the file has no tensors: {path}", "get the file again")
    return found


def compare(found, wanted, path, of):
    """Raises unless a file has exactly these tensors: `found` and `wanted` are shapes by name, `of` says what of."""
    missing = sorted(set(wanted) - set(found))
    extra = sorted(set(found) - set(wanted))
    if any(name.startswith("model.diffusion_model.") for name in extra):
        raise BadInput(
            f"a checkpoint in one file, in the layout before diffusers: {path}",
            "take the folder of the model with unet/, vae/ and text_encoder/, or convert it with the script of diffusers",
        )
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        raise BadInput(f"weights of another model: {missing[0]}{more} of {of} missing: {path}", "check which file belongs where")
    if extra:
        more = f" and {len(extra) - 1} more" if len(extra) > 1 else ""
        raise BadInput(f"weights of another model: {extra[0]}{more} not of {of}: {path}", "check which file belongs where")
    for name, shape in wanted.items():
        if tuple(found[name]) != tuple(shape):
            a, b = "x".join(map(str, found[name])), "x".join(map(str, shape))
            raise BadInput(f"weights of another model: {name} is {a}, {of} has {b}: {path}", "check which file belongs where")


def part(folder, name):
    """The safetensors file of a part of a model, such as `unet`, and its configuration."""
    folder = Path(folder)
    if folder.is_file():
        raise BadInput(
            f"a file where the folder of a model is due: {folder}",
            "name the folder that has model_index.json, unet/, vae/ and text_encoder/",
        )
    place = folder / name if name else folder
    if not (place / "config.json").is_file():
        raise BadInput(f"no {name or 'config.json'} of a model: {place}", "name the folder that has model_index.json, with all of its parts")
    try:
        config = json.loads((place / "config.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadInput(f"config.json cannot be read ({error}): {place}", "get the folder again") from error
    if not isinstance(config, dict):
        raise BadInput(f"config.json is no object: {place}", "get the folder again")
    names = ["diffusion_pytorch_model.safetensors", "model.safetensors", "diffusion_pytorch_model.fp16.safetensors", "model.fp16.safetensors"]
    for file in names:
        if (place / file).is_file():
            return place / file, config
    raise BadInput(f"no weights in safetensors: {place}", "get diffusion_pytorch_model.safetensors or model.safetensors; .bin files could run code")


def digests_file():
    """Where the digests of large files are kept, or None."""
    base = os.environ.get("XDG_CACHE_HOME") or (os.path.join(os.environ["HOME"], ".cache") if os.environ.get("HOME") else None)
    return Path(base) / "motes" / "weights-sha256.json" if base and os.path.isabs(base) else None


def sha256_of(path):
    """SHA-256 of a file, kept by its path, size and time of change: gigabytes are read once."""
    path = Path(path).resolve()
    stat = path.stat()
    key, kept = f"{path}|{stat.st_size}|{stat.st_mtime_ns}", {}
    place = digests_file()
    try:
        kept = json.loads(place.read_text(encoding="utf-8")) if place else {}
        if isinstance(kept.get(key), str):
            return kept[key]
    except (OSError, ValueError, AttributeError):
        kept = {}
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 24):
            digest.update(block)
    if place:
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            draft = place.with_name(f"{place.name}.{os.getpid()}")
            recent = dict(list(kept.items())[-200:])
            draft.write_text(json.dumps({**recent, key: digest.hexdigest()}), encoding="utf-8")
            os.replace(draft, place)
        except OSError:
            pass  # a folder that cannot be written only costs time
    return digest.hexdigest()


def described(files, license_name):
    """The models of a description: an entry per file."""
    entries = []
    for path in files:
        path = Path(path)
        entries.append({"id": f"{path.parent.name}/{path.name}", "sha256": sha256_of(path), "license": license_name})
    return entries
