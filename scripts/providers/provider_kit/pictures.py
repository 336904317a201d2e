"""Pictures as arrays, and the sizes that models work in. Needs numpy and Pillow."""

import warnings

import numpy as np
from PIL import Image

from . import exr
from .protocol import BadInput

# More pixels are refused before they are decoded: a small file may hold a very large picture.
MOST_PIXELS = 200_000_000
LARGEST_SIDE = 16384


def srgb_encode(linear):
    """Linear light to sRGB, both 0 to 1."""
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.power(linear, 1 / 2.4) - 0.055)


def srgb_decode(encoded):
    """sRGB to linear light, both 0 to 1."""
    return np.where(encoded <= 0.04045, encoded / 12.92, np.power((encoded + 0.055) / 1.055, 2.4))


def read(path):
    """R, G, B of a PNG, or of an OpenEXR file by the sRGB curve, as bytes: height, width, 3."""
    if path.suffix.lower() == ".exr":
        try:
            width, height, planes = exr.read(path)
            found = [np.frombuffer(planes[name], "<f4").reshape(height, width) for name in "RGB"]
        except (ValueError, KeyError, OSError) as error:
            raise BadInput(f"{path.name} cannot be read: {error}", "write linear R, G, B with zip compression") from error
        values = np.nan_to_num(np.stack(found, axis=-1).astype(np.float64), posinf=1.0)
        return np.round(srgb_encode(values) * 255).astype(np.uint8)
    return np.asarray(opened(path).convert("RGB"))


def read_mask(path):
    """A gray picture as numbers from 0 to 1: height, width."""
    return np.asarray(opened(path).convert("L"), dtype=np.float32) / 255


def opened(path):
    """A decoded picture of Pillow."""
    Image.MAX_IMAGE_PIXELS = MOST_PIXELS
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            image = Image.open(path)
            image.load()
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise BadInput(f"{path.name} has more than {MOST_PIXELS} pixels", "send a smaller picture") from error
    except (OSError, ValueError, SyntaxError) as error:
        raise BadInput(f"{path.name} is no picture that can be read: {error}", "send PNG or OpenEXR") from error
    return image


def write(path, pixels):
    """Writes bytes, height x width x 3, as PNG."""
    Image.fromarray(np.ascontiguousarray(pixels)).save(path)


def write_map(path, values, channels):
    """Writes an array, height x width or height x width x channels, as OpenEXR."""
    values = np.asarray(values, dtype="<f4")
    values = values[..., None] if values.ndim == 2 else values
    height, width, _ = values.shape
    exr.write(path, width, height, {name: values[..., i].tobytes() for i, name in enumerate(channels)})


def resized(pixels, size):
    """Bytes in another size (width, height), by Lanczos."""
    if (pixels.shape[1], pixels.shape[0]) == tuple(size):
        return pixels
    return np.asarray(Image.fromarray(np.ascontiguousarray(pixels)).resize(tuple(size), Image.LANCZOS))


def resized_map(values, size):
    """Floats in another size (width, height), bilinear: of the same kind of array."""
    if (values.shape[1], values.shape[0]) == tuple(size):
        return values
    planes = values[..., None] if values.ndim == 2 else values
    made = [
        np.asarray(Image.fromarray(np.ascontiguousarray(planes[..., i], dtype=np.float32)).resize(tuple(size), Image.BILINEAR))
        for i in range(planes.shape[-1])
    ]
    made = np.stack(made, axis=-1)
    return made[..., 0] if values.ndim == 2 else made


def working_size(width, height, longer_side, multiple=64):
    """Width and height that a model works in: about this longer side, multiples of `multiple`, the shape kept where that allows it.

    Pictures are stretched to it and back, so a pixel stays where it is.
    """
    scale = longer_side / max(width, height)
    return tuple(max(multiple, round(side * scale / multiple) * multiple) for side in (width, height))
