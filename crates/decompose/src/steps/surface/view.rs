//! A posed picture in the unit world, single precision.

use glam::{Mat3, Vec2, Vec3};
use motes_math::luminance::luminance;
use motes_math::median::upper_median;
use motes_scene::{Pinhole, Pose, UnitWorld};

use super::splat_depth::DepthMap;
use crate::observation::{Photo, Radiance};

/// Camera and prepared picture of one photo.
pub(super) struct View {
    pub(super) rotation: Mat3,
    pub(super) center: Vec3,
    pub(super) focal: Vec2,
    pub(super) principal: Vec2,
    pub(super) width: usize,
    pub(super) height: usize,
    /// Intrinsics and pose in the unit world, for the rasterizer.
    pub(super) camera: Pinhole,
    pub(super) camera_from_unit: Pose,
    /// `[h, w]`, luminance of the photo raised to 1/2.2: contrast as it is seen, so that shade counts like light.
    pub(super) luma: Vec<f32>,
    /// `[h, w]`, channels raised to 1/2.2, of 255.
    pub(super) color: Vec<[u8; 3]>,
    /// `[h, w]`.
    pub(super) shown: Vec<Shown>,
    /// Every pixel counts fully.
    pub(super) whole: bool,
}

/// What a photo shows of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    /// A mask hides it.
    Nothing,
    /// As bright as it is.
    Whole,
    /// Clipped in some channels,
    Clipped,
    /// or in all of them.
    BurntOut,
}

impl Shown {
    fn of(photo: &Photo, pixel: usize) -> Self {
        match photo.clipped_channels(pixel) {
            _ if photo.usable[pixel] => Self::Whole,
            _ if !photo.is_clipped(pixel) => Self::Nothing,
            channels if channels.all() => Self::BurntOut,
            _ => Self::Clipped,
        }
    }
}

impl View {
    pub(super) fn new(photo: &Photo, unit: &UnitWorld) -> Self {
        let camera_from_unit = unit.pose(&photo.camera_from_world);
        let c = &photo.camera;
        let shown: Vec<Shown> = (0..photo.usable.len()).map(|i| Shown::of(photo, i)).collect();
        Self {
            rotation: camera_from_unit.rotation_matrix().as_mat3(),
            center: camera_from_unit.center_in_world().as_vec3(),
            focal: Vec2::new(c.fx as f32, c.fy as f32),
            principal: Vec2::new(c.cx as f32, c.cy as f32),
            width: c.width,
            height: c.height,
            camera: *c,
            camera_from_unit,
            luma: luma(&photo.radiance_linear),
            color: color(&photo.radiance_linear),
            whole: shown.iter().all(|s| *s == Shown::Whole),
            shown,
        }
    }

    /// How much a pixel counts, 0 to 1.
    #[inline]
    pub(super) fn weight(&self, pixel: usize) -> f32 {
        f32::from(u8::from(self.shown[pixel] == Shown::Whole))
    }

    /// Larger of width and height, pixels.
    pub(super) fn longer_side(&self) -> usize {
        self.width.max(self.height)
    }

    /// Pixel coordinates and depth of a point in front of the camera, whether or not in the picture.
    #[inline]
    pub(super) fn project(&self, p: Vec3) -> Option<Vec3> {
        let q = self.rotation * (p - self.center);
        (q.z > 1e-6).then(|| {
            let s = 1.0 / q.z;
            Vec3::new(
                self.focal.x * q.x * s + self.principal.x,
                self.focal.y * q.y * s + self.principal.y,
                q.z,
            )
        })
    }

    /// Whether anything of a ball may be in the picture.
    pub(super) fn may_show(&self, center: Vec3, radius: f32) -> bool {
        let q = self.rotation * (center - self.center);
        // Distance to the plane through the camera's center and a side of the picture `span` from the principal point.
        let inside = |along: f32, focal: f32, span: f32| {
            focal * along + span * q.z > -radius * focal.hypot(span)
        };
        let (left, top) = (self.principal.x, self.principal.y);
        let (right, bottom) = (self.width as f32 - left, self.height as f32 - top);
        q.z > -radius
            && inside(q.x, self.focal.x, left)
            && inside(-q.x, self.focal.x, right)
            && inside(q.y, self.focal.y, top)
            && inside(-q.y, self.focal.y, bottom)
    }

    /// Homogeneous pixel coordinates of a direction, or of a point relative to the camera's center.
    #[inline]
    pub(super) fn image_of(&self, d: Vec3) -> Vec3 {
        let q = self.rotation * d;
        Vec3::new(
            self.focal.x * q.x + self.principal.x * q.z,
            self.focal.y * q.y + self.principal.y * q.z,
            q.z,
        )
    }

    /// Direction of a pixel in the unit world whose component along the axis of view is 1.
    #[inline]
    pub(super) fn ray(&self, x: f32, y: f32) -> Vec3 {
        let d = (Vec2::new(x, y) - self.principal) / self.focal;
        self.rotation.transpose() * d.extend(1.0)
    }

    /// [`Self::ray`] through the center of a pixel.
    #[inline]
    pub(super) fn pixel_ray(&self, [x, y]: [usize; 2]) -> Vec3 {
        self.ray(x as f32 + 0.5, y as f32 + 0.5)
    }

    /// What a pixel sees at a depth.
    #[inline]
    pub(super) fn place(&self, pixel: [usize; 2], depth: f32) -> Vec3 {
        self.center + self.pixel_ray(pixel) * depth
    }

    /// Where its middle is at the median depth; `None` without a depth.
    pub(super) fn middle(&self, map: &DepthMap) -> Option<Vec3> {
        let mut depths: Vec<f32> = map.depth.iter().copied().filter(|z| *z > 0.0).collect();
        let median = upper_median(&mut depths, f32::total_cmp)?;
        Some(self.place([self.width / 2, self.height / 2], median))
    }

    /// Column and row of the pixel that contains a point of the picture.
    #[inline]
    pub(super) fn pixel(&self, x: f32, y: f32) -> Option<usize> {
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f32 && y < self.height as f32;
        inside.then(|| y as usize * self.width + x as usize)
    }

    /// First of the four pixels whose centers are around a point, and how far it lies from the first to the others; none outside of the picture.
    #[inline]
    fn around(&self, x: f32, y: f32) -> Option<(usize, f32, f32)> {
        let (x, y) = (x - 0.5, y - 0.5);
        let (right, bottom) = ((self.width - 1) as f32, (self.height - 1) as f32);
        if !(x >= 0.0 && y >= 0.0 && x < right && y < bottom) {
            return None;
        }
        let (i, j) = (x as usize, y as usize);
        Some((j * self.width + i, x - i as f32, y - j as f32))
    }

    /// Color between the centers of pixels, 0 to 1, raised to 1/2.2; none outside of the picture or where it does not count.
    pub(super) fn color_at(&self, p: Vec2) -> Option<Vec3> {
        let (first, u, v) = self.around(p.x, p.y)?;
        let four = [first, first + 1, first + self.width, first + self.width + 1];
        if four.iter().any(|&k| self.shown[k] != Shown::Whole) {
            return None;
        }
        let [a, b, c, d] = four.map(|k| Vec3::from(self.color[k].map(f32::from)) / 255.0);
        Some(a.lerp(b, u).lerp(c.lerp(d, u), v))
    }

    /// Brightness between the centers of pixels, as in `luma`, and the weight of the first of them; none outside of the picture.
    #[inline]
    pub(super) fn luma_at(&self, x: f32, y: f32) -> Option<(f32, f32)> {
        self.between(&self.luma, x, y)
    }

    /// [`Self::luma_at`] of other values per pixel.
    #[inline]
    pub(super) fn between(&self, values: &[f32], x: f32, y: f32) -> Option<(f32, f32)> {
        let (first, u, v) = self.around(x, y)?;
        let mix = |k: usize| values[k] + (values[k + 1] - values[k]) * u;
        let (top, low) = (mix(first), mix(first + self.width));
        Some((top + (low - top) * v, self.weight(first)))
    }

    /// Column and row of a pixel.
    #[inline]
    pub(super) fn at(&self, pixel: u32) -> [usize; 2] {
        [pixel as usize % self.width, pixel as usize / self.width]
    }

    /// Length that one pixel covers at depth 1.
    pub(super) fn footprint(&self) -> f32 {
        1.0 / self.focal.max_element()
    }
}

fn luma(linear: &Radiance) -> Vec<f32> {
    // `max` first: it turns NaN into 0.
    linear.pixels().map(|p| luminance(p).max(0.0).clamp(0.0, 1e6).powf(1.0 / 2.2)).collect()
}

fn color(linear: &Radiance) -> Vec<[u8; 3]> {
    let of = |v: f32| (v.max(0.0).clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0).round() as u8;
    linear.pixels().map(|p| p.to_array().map(of)).collect()
}
