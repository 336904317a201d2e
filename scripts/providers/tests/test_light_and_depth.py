"""Panoramas from rendered balls, depth from points, sizes. Needs numpy and Pillow, and says so where they are not."""

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

try:
    import numpy as np
    from provider_kit import ball, geometry, pictures
except ImportError:
    np = None


def light(direction):
    """A world of soft colors and a sun up on the right, in the camera (x right, y down, z forward)."""
    sun = np.array([0.6, -0.64, 0.48])
    near = np.exp(60 * (direction @ sun - 1))
    base = 0.3 + 0.2 * direction * np.array([1, -1, 1])
    return base + 40 * near[..., None] * np.array([1.0, 0.9, 0.7])


def rendered(side):
    """A mirror ball that fills a square picture, seen from far away."""
    at = (np.arange(side) + 0.5) / side * 2 - 1
    x, y = np.meshgrid(at, at)
    inside = x**2 + y**2 < 1
    normal = np.stack([x, y, -np.sqrt(np.clip(1 - x**2 - y**2, 0, 1))], axis=-1)
    reflected = np.array([0, 0, 1.0]) - 2 * normal[..., 2:] * normal
    return np.where(inside[..., None], light(reflected), 0)


@unittest.skipIf(np is None, "no numpy, or no Pillow")
class Balls(unittest.TestCase):
    """What a ball shows, back on the sphere."""

    def test_a_rendered_ball_unwraps_to_the_light(self):
        made = ball.unwrapped(rendered(768), 64)
        truth = light(ball.directions(64, 1))
        self.assertEqual(made.shape, (64, 128, 3))
        # The rim holds the fifth of the sphere behind the ball in its last pixels.
        known = ball.directions(64, 1)[..., 2] < 0.8
        error = np.abs(made - truth)[known] / truth[known]
        self.assertLess(np.median(error), 0.002)
        self.assertLess(np.quantile(error, 0.99), 0.05)

    def test_the_middle_looks_forward_and_right_is_right(self):
        direction = ball.directions(2, 1)
        self.assertTrue((direction[0, :, 1] < 0).all() and (direction[:, 2, 0] > 0).all() and (direction[:, 1:3, 2] > 0).all())
        self.assertTrue(np.allclose(ball.places(np.array([[0.0, 0, -1], [1, 0, 0]])), [[0, 0], [0.5**0.5, 0]]))
        self.assertTrue(np.isfinite(ball.places(np.array([0.0, 0, 1]))).all())

    def test_exposures_merge_to_the_light(self):
        truth = rendered(64)
        stops = [0.0, -2.5, -5.0]
        taken = [np.clip(truth * 2.0**stop, 0, 1) ** (1 / ball.GAMMA) for stop in stops]
        taken = [np.round(255 * picture) / 255 for picture in taken]
        found = ball.merged(taken, stops)
        self.assertTrue(np.isfinite(found).all())
        luminance, wanted = found @ ball.LUMINANCE, truth @ ball.LUMINANCE
        bright = (wanted > 0.05) & (wanted < 0.9 * 32)
        self.assertLess(np.quantile(np.abs(luminance - wanted)[bright] / wanted[bright], 0.95), 0.05)
        self.assertGreater(luminance.max(), 15)
        self.assertLess((ball.merged(taken[:1], stops[:1]) @ ball.LUMINANCE).max(), 1.01)


@unittest.skipIf(np is None, "no numpy, or no Pillow")
class Depth(unittest.TestCase):
    """Points that a camera sees, moved along its axis."""

    def test_the_shift_of_points_is_found(self):
        height, width = 60, 80
        plane = geometry.view_plane(width, height, width / height)
        depth = 3 + np.sin(np.linspace(0, 5, width))[None, :] + 0.02 * np.arange(height)[:, None]
        for focal in (0.7, 1.6):
            points = np.concatenate([plane / focal * depth[..., None], depth[..., None] - 2.1], axis=-1)
            everywhere = np.ones((height, width), dtype=bool)
            found = geometry.depth_of_points(points, everywhere, width / height)
            self.assertLess(np.abs(found - depth).max(), 1e-4)
            degrees = np.degrees(2 * np.arctan(width / height / (1 + (width / height) ** 2) ** 0.5 / focal))
            known = geometry.depth_of_points(points, everywhere, width / height, degrees)
            self.assertLess(np.abs(known - depth).max(), 1e-4)

    def test_nothing_to_see_has_no_depth(self):
        nothing = np.zeros((4, 5), dtype=bool)
        self.assertFalse(geometry.depth_of_points(np.zeros((4, 5, 3)), nothing, 1.25).any())

    def test_normals_have_length_one(self):
        found = geometry.unit(np.array([[[0.0, 3.0, -4.0], [0.0, 0.0, 0.0]]]))
        self.assertTrue(np.allclose(found, [[[0, 0.6, -0.8], [0, 0, -1]]]))


@unittest.skipIf(np is None, "no numpy, or no Pillow")
class Sizes(unittest.TestCase):
    """Sizes that models work in."""

    def test_sizes_are_multiples_and_never_nothing(self):
        self.assertEqual(pictures.working_size(1600, 1200, 640), (640, 512))
        self.assertEqual(pictures.working_size(1, 1, 512), (512, 512))
        self.assertEqual(pictures.working_size(1, 900, 512), (64, 512))
        self.assertEqual(pictures.working_size(5472, 3648, 512), (512, 320))

    def test_srgb_goes_there_and_back(self):
        values = np.linspace(0, 1, 256)
        self.assertTrue(np.allclose(pictures.srgb_decode(pictures.srgb_encode(values)), values, atol=1e-12))


if __name__ == "__main__":
    unittest.main()
