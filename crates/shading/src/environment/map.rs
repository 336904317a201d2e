//! A lat-long map: radiance between texel centers is bilinear (wrapped in u, clamped in v), and
//! so is the density of its sampler.
//!
//! Every texel carries a tent of its neighbors' width. Choosing a texel with probability
//! `p_ij` and then a point of its tent has the density `Σ p_ij tent_ij(u, v)`: the bilinear
//! interpolation of `p_ij`. So density and radiance have the same shape inside a texel as well,
//! and a density that is constant per texel would not. `p_ij` is proportional to mean radiance
//! times solid angle; on the sphere `pdf = pdf_uv / (2 π² sin θ)`.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Vec3, Vec4};
use motes_scene::ImageF32;
use thiserror::Error;

use super::turns::turns;
use super::{CleanUp, Convention, Orientation};
use crate::alias::AliasTable;
use crate::sampling::unit_f32;

/// Largest radiance kept, so that products with densities stay finite in f32.
const MAX_RADIANCE: f32 = 1e24;

/// Why a map cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum EnvironmentError {
    /// Not RGB or RGBA, or no pixels.
    #[error("an environment map needs pixels of 3 or 4 channels, got {0}x{1} with {2}")]
    Shape(usize, usize, usize),
    /// Exposure must be a positive number.
    #[error("the exposure of an environment must be a positive number, got {0}")]
    Exposure(f32),
}

/// How a map is placed and scaled.
#[derive(Clone, Copy, Debug)]
pub struct MapOptions {
    /// Factor on the map's values.
    pub exposure: f32,
    /// Whose axes the map has, and how it is turned.
    pub orientation: Orientation,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self { exposure: 1.0, orientation: Orientation::new(Convention::OpenExr) }
    }
}

/// A lat-long map, ready for look-up and sampling. 24 bytes per texel.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Radiance, and the density of the sampler over the unit square of (u, v).
    pub(super) texels: Vec<Vec4>,
    pub(crate) alias: Option<AliasTable>,
    pub(super) orientation: Orientation,
    map_from_world: Mat3,
    clean_up: CleanUp,
    power: f64,
}

impl EnvironmentMap {
    /// From a linear lat-long image, row 0 up, any size from 1x1; alpha is ignored.
    ///
    /// # Errors
    /// When the image has no pixels or not 3 or 4 channels, or the exposure is not positive.
    /// Values that no light has are repaired and counted, see [`CleanUp`].
    pub fn new(image: &ImageF32, options: &MapOptions) -> Result<Self, EnvironmentError> {
        let (width, height) = (image.width, image.height);
        if width * height == 0 || !(3..=4).contains(&image.channels) {
            return Err(EnvironmentError::Shape(width, height, image.channels));
        }
        if !(options.exposure > 0.0 && options.exposure.is_finite()) {
            return Err(EnvironmentError::Exposure(options.exposure));
        }
        let mut values: Vec<f32> =
            image.data.chunks_exact(image.channels).flat_map(|p| [p[0], p[1], p[2]]).collect();
        let clean_up = CleanUp::run(&mut values);
        let mut texels: Vec<Vec4> = values
            .chunks_exact(3)
            .map(|p| (Vec3::from_slice(p) * options.exposure).min(Vec3::splat(MAX_RADIANCE)))
            .map(|c| c.extend(0.0))
            .collect();
        drop(values);

        let mut weights = vec![0.0; width * height];
        let mut power = 0.0;
        for (y, (row, weights)) in
            texels.chunks_exact(width).zip(weights.chunks_exact_mut(width)).enumerate()
        {
            let solid_angle = row_solid_angle(y, height) / width as f64;
            for (texel, weight) in row.iter().zip(weights) {
                // The plain mean: luminance would starve saturated blue.
                let mass = f64::from(texel.truncate().element_sum()) / 3.0 * solid_angle;
                power += mass;
                *weight = mass as f32;
            }
        }
        let alias = AliasTable::new(&weights);
        let density = if power > 0.0 { (width * height) as f64 / power } else { 0.0 };
        for (texel, weight) in texels.iter_mut().zip(&weights) {
            texel.w = (f64::from(*weight) * density) as f32;
        }
        let orientation = options.orientation;
        let map_from_world = orientation.map_from_world.as_mat3();
        Ok(Self { width, height, texels, alias, orientation, map_from_world, clean_up, power })
    }

    /// What was repaired.
    pub fn clean_up(&self) -> CleanUp {
        self.clean_up
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Where the map's axes are.
    pub fn orientation(&self) -> Orientation {
        self.orientation
    }

    /// The same picture with its axes elsewhere.
    pub fn turned(mut self, orientation: Orientation) -> Self {
        self.orientation = orientation;
        self.map_from_world = orientation.map_from_world.as_mat3();
        self
    }

    /// `∫ (R + G + B) / 3 dw` over the sphere, texel by texel; 0 for a black map.
    pub fn power(&self) -> f64 {
        self.power
    }

    /// Bilinear look-up: radiance and density over (u, v), `u` in [0, 1], `v` in [0, 1]; NaN looks up
    /// the first texel.
    #[inline]
    fn bilinear(&self, u: f32, v: f32) -> Vec4 {
        let x = u * self.width as f32 - 0.5;
        let y = (v * self.height as f32 - 0.5).clamp(0.0, (self.height - 1) as f32);
        // Not below -1/2: the floor by a conversion, which cuts off.
        let left = if x < 0.0 { -1.0 } else { x as u32 as f32 };
        let row0 = y as usize;
        let (s, t) = (x - left, y - row0 as f32);
        let x0 = if left < 0.0 { self.width - 1 } else { (left as usize).min(self.width - 1) };
        let x1 = if x0 + 1 == self.width { 0 } else { x0 + 1 };
        let row1 = (row0 + 1).min(self.height - 1);
        let at = |x: usize, y: usize| self.texels[y * self.width + x];
        let top = at(x0, row0) + (at(x1, row0) - at(x0, row0)) * s;
        let bottom = at(x0, row1) + (at(x1, row1) - at(x0, row1)) * s;
        top + (bottom - top) * t
    }

    /// Density per steradian where the density over the unit square is `density`.
    #[inline]
    fn per_steradian(density: f32, sin_theta: f32) -> f32 {
        density / (2.0 * PI * PI * sin_theta.max(1e-7))
    }

    /// Radiance from the unit vector `to_light` (world), and the density of
    /// [`Self::sample_direction`] there, per steradian; both finite.
    #[inline]
    pub fn radiance_pdf(&self, to_light: Vec3) -> (Vec3, f32) {
        let d = self.map_from_world * to_light;
        let sin_theta = (d.x * d.x + d.z * d.z).sqrt();
        let texel = self.bilinear(turns(d.x, -d.z), 2.0 * turns(sin_theta, d.y));
        (texel.truncate(), Self::per_steradian(texel.w, sin_theta))
    }

    /// A unit vector toward the light (world); `u` are fractions of 2³². None for a black map.
    #[inline]
    pub fn sample_direction(&self, u: [u32; 3]) -> Option<Vec3> {
        self.sample(u).map(|(to_light, _, _)| to_light)
    }

    /// As [`Self::sample_direction`], with what [`Self::radiance_pdf`] says there: its place in the map
    /// is known, so no angle has to be found again.
    #[inline]
    pub fn sample(&self, u: [u32; 3]) -> Option<(Vec3, Vec3, f32)> {
        let texel = self.alias.as_ref()?.pick(u[0]);
        let (x, y) = ((texel % self.width) as f32, (texel / self.width) as f32);
        let (su, sv) = (unit_f32(u[1]), unit_f32(u[2]));
        let u = (x + 0.5 + tent(su)) / self.width as f32;
        // The tents of the first and the last column reach over the seam.
        let u = if u < 0.0 { u + 1.0 } else { u };
        let u = if u > 1.0 { u - 1.0 } else { u };
        let v = (y + row_offset(sv, texel / self.width, self.height)) / self.height as f32;
        let (sin_phi, cos_phi) = (TAU * u).sin_cos();
        let (sin_theta, cos_theta) = (PI * v).sin_cos();
        let d = Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi);
        let texel = self.bilinear(u, v);
        let pdf = Self::per_steradian(texel.w, sin_theta);
        Some((self.map_from_world.transpose() * d, texel.truncate(), pdf))
    }
}

/// A number with the density `1 - |x|` on [-1, 1].
#[inline]
fn tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() }
}

/// Where in the tent of row `y`, from its upper edge. Clamping makes the outer half of the first
/// and last row flat: half of the tent's mass spread over half a row.
#[inline]
fn row_offset(u: f32, y: usize, height: usize) -> f32 {
    if (u < 0.5 && y == 0) || (u >= 0.5 && y == height - 1) { u } else { 0.5 + tent(u) }
}

/// Solid angle of a row of texels.
pub(super) fn row_solid_angle(y: usize, height: usize) -> f64 {
    let edge = |y: usize| (std::f64::consts::PI * y as f64 / height as f64).cos();
    std::f64::consts::TAU * (edge(y) - edge(y + 1))
}
