"""What MoGe leaves to its users: the shift of its points along the axis of the camera, hence depth. Needs numpy."""

import numpy as np

LOOKED_AT = 4096
"""Points that the shift is found from."""


def view_plane(width, height, aspect):
    """Where the ray of each pixel meets the plane at the distance of a focal length; half of the diagonal is 1: height, width, 2."""
    diagonal = (1 + aspect**2) ** 0.5
    u = (np.arange(width) + 0.5) / width * 2 - 1
    v = (np.arange(height) + 0.5) / height * 2 - 1
    return np.stack(np.meshgrid(u * aspect / diagonal, v / diagonal), axis=-1)


def focal_and_error(shift, plane, points, focal=None):
    """The focal length that fits best at a shift, and the mean square of what it leaves, in the view plane."""
    seen = points[:, :2] / (points[:, 2:] + shift)
    if focal is None:
        focal = (seen * plane).sum() / max((seen * seen).sum(), 1e-12)
    return focal, ((focal * seen - plane) ** 2).mean()


def shift_of_points(plane, points, focal=None):
    """The shift along z at which points project onto their pixels: by steps over the possible ones, then golden sections.

    The error has one valley where the points are a surface that a camera sees.
    """
    nearest = points[:, 2].min()
    span = max(np.ptp(points[:, 2]), abs(np.median(points[:, 2])), 1e-6)
    shifts = -nearest + span * np.logspace(-3, 3, 61)
    errors = [focal_and_error(shift, plane, points, focal)[1] for shift in shifts]
    best = int(np.argmin(errors))
    low, high = shifts[max(best - 1, 0)], shifts[min(best + 1, len(shifts) - 1)]
    golden = (5**0.5 - 1) / 2
    for _ in range(60):
        a, b = high - golden * (high - low), low + golden * (high - low)
        if focal_and_error(a, plane, points, focal)[1] <= focal_and_error(b, plane, points, focal)[1]:
            high = b
        else:
            low = a
    return (low + high) / 2


def depth_of_points(points, surface, aspect, field_of_view=None):
    """Depth along the axis of the camera from points that are right but for a shift: height, width.

    `surface` says where there is one, `aspect` is width over height, `field_of_view` degrees across the width.
    """
    height, width, _ = points.shape
    if surface.sum() < 3:
        return np.zeros((height, width))
    every = max(1, int(surface.sum()) // LOOKED_AT)
    plane, known = view_plane(width, height, aspect)[surface][::every], points[surface][::every]
    focal = None
    if field_of_view is not None:
        focal = aspect / (1 + aspect**2) ** 0.5 / np.tan(np.radians(field_of_view) / 2)
    return points[..., 2] + shift_of_points(plane, known, focal)


def unit(normals):
    """Normals of length 1; what has no direction faces the camera straight (x right, y down, z forward)."""
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    straight = np.array([0.0, 0.0, -1.0], dtype=normals.dtype)
    return np.where(length > 1e-6, normals / np.maximum(length, 1e-6), straight)
