"""A chrome ball in a picture to a panorama, and pictures of it at several exposures to linear light. Needs numpy.

A perfect mirror seen from far away: at the point of the disk with the normal n = (x, y, -sqrt(1 - x^2 - y^2)), in the camera (x right,
y down, z forward), the ball shows the light that comes from r = v - 2 (v . n) n with v = (0, 0, 1).
"""

import numpy as np

GAMMA = 2.4
"""Of the pictures that DiffusionLight was trained on."""
LUMINANCE = np.array([0.212671, 0.715160, 0.072169])
SATURATED_FROM = 0.9
"""Share of the largest value above which a picture is believed less and less."""
EVERY = 3
"""Samples along each side of a pixel of the panorama."""


def merged(exposures, stops, gamma=GAMMA):
    """Linear light from pictures 0 to 1 whose exposures are `stops`, the brightest first, 0 stops.

    From the darkest up, each brighter picture takes over where it is not saturated; colors are those of the brightest.
    """
    linear = [np.power(np.clip(picture, 0, 1), gamma) for picture in exposures]
    lights = [(picture @ LUMINANCE) / 2.0**stop for picture, stop in zip(linear, stops)]
    light = lights[-1]
    for brighter, stop in zip(lights[-2::-1], stops[-2::-1]):
        largest = 2.0**-stop
        saturated = np.clip((brighter - SATURATED_FROM * largest) / ((1 - SATURATED_FROM) * largest), 0, 1)
        darker = saturated * (light > brighter)
        light = brighter * (1 - darker) + light * darker
    return linear[0] * (light / (lights[0] + 1e-10))[..., None]


def directions(height, samples=EVERY):
    """Directions in the camera of a panorama's samples, `height * samples` rows: its middle looks along z, its top up (-y)."""
    rows, columns = height * samples, 2 * height * samples
    down = (np.arange(rows) + 0.5) / rows * np.pi
    around = ((np.arange(columns) + 0.5) / columns * 2 - 1) * np.pi
    around, down = np.meshgrid(around, down)
    return np.stack([np.sin(down) * np.sin(around), -np.cos(down), np.sin(down) * np.cos(around)], axis=-1)


def places(reflected):
    """Where on the disk of the ball, -1 to 1, a direction is seen: x right, y down.

    The normal lies between the direction and that to the camera, (0, 0, -1). Straight behind the ball every point of the rim shows it.
    """
    between = reflected - np.array([0.0, 0.0, 1.0])
    length = np.linalg.norm(between, axis=-1, keepdims=True)
    return np.where(length > 1e-9, between / np.maximum(length, 1e-9), np.array([1.0, 0.0, 0.0]))[..., :2]


def bilinear(picture, x, y):
    """Values of a picture at pixel positions (the middle of the first is 0.5), held at the edge."""
    height, width = picture.shape[:2]
    x, y = np.clip(x - 0.5, 0, width - 1), np.clip(y - 0.5, 0, height - 1)
    left, top = np.minimum(x.astype(int), width - 2 if width > 1 else 0), np.minimum(y.astype(int), height - 2 if height > 1 else 0)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    u, v = (x - left)[..., None], (y - top)[..., None]
    upper = picture[top, left] * (1 - u) + picture[top, right] * u
    lower = picture[bottom, left] * (1 - u) + picture[bottom, right] * u
    return upper * (1 - v) + lower * v


def unwrapped(picture, height, samples=EVERY):
    """The panorama, `2 * height` wide, of the square around a ball; its middle is what the camera looks at, behind the ball."""
    side = picture.shape[0]
    at = places(directions(height, samples))
    # A pixel at the rim mixes the ball with what is behind it: what only such pixels show is taken from those inside of them.
    reach = np.linalg.norm(at, axis=-1, keepdims=True)
    at = at * np.minimum(1, (1 - 3 / side) / np.maximum(reach, 1e-9)) if side > 8 else at
    found = bilinear(picture, 0.5 * side * (1 + at[..., 0]), 0.5 * side * (1 + at[..., 1]))
    blocks = found.reshape(height, samples, 2 * height, samples, picture.shape[2])
    return blocks.mean(axis=(1, 3)).astype(np.float32)
