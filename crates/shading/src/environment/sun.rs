//! A distant disc of constant radiance: the sun as a light of its own.
//!
//! A map would need texels of half a degree to hold it and a denser grid for its edge. Directions
//! are drawn uniformly from the cone, so `L / pdf` is the same for all of them.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use crate::frame::{Frame, FrameF64};
use crate::sampling::unit_f32;

/// Mean angular radius of the sun, radians (0.2666 degrees; 6.957e8 m at one astronomical unit).
pub(super) const SOLAR_RADIUS: f64 = 4.6524e-3;

/// A disc in the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunDisc {
    /// Radiance inside the disc, linear.
    pub radiance: Vec3,
    to_sun: Vec3,
    one_minus_cos: f64,
    pdf: f32,
    frame: [Vec3; 2],
}

impl SunDisc {
    /// A disc round the unit vector `to_sun` (world) with an angular `radius` in radians, at
    /// most π/2. Channels that are negative or not finite become 0.
    pub fn new(to_sun: Vec3, radius: f64, radiance: Vec3) -> Self {
        let to_sun = to_sun.normalize_or(Vec3::Y);
        let half = 0.5 * radius.abs().clamp(1e-5, std::f64::consts::FRAC_PI_2);
        // 1 - cos by the half angle: directly it would lose all digits.
        let one_minus_cos = 2.0 * half.sin().powi(2);
        let frame = Frame::from_normal(to_sun);
        let clean = |v: f32| if v.is_finite() { v.max(0.0) } else { 0.0 };
        Self {
            radiance: Vec3::from(radiance.to_array().map(clean)),
            to_sun,
            one_minus_cos,
            pdf: (1.0 / (TAU * one_minus_cos)) as f32,
            frame: [frame.tangent, frame.bitangent],
        }
    }

    /// Toward the center of the disc, world.
    pub fn to_sun(&self) -> Vec3 {
        self.to_sun
    }

    /// `1 - cos(radius)`.
    pub fn one_minus_cos(&self) -> f64 {
        self.one_minus_cos
    }

    /// Steradians.
    pub fn solid_angle(&self) -> f64 {
        TAU * self.one_minus_cos
    }

    /// Mean of the channels times solid angle.
    pub fn power(&self) -> f64 {
        f64::from(self.radiance.element_sum()) / 3.0 * self.solid_angle()
    }

    /// Whether the unit vector `to_light` lies in the disc; by the chord, `|a - b|² = 2 (1 - cos)`.
    #[inline]
    pub fn contains(&self, to_light: Vec3) -> bool {
        (to_light - self.to_sun).length_squared() <= (2.0 * self.one_minus_cos) as f32
    }

    /// Density of [`Self::sample`], per steradian.
    #[inline]
    pub fn pdf(&self) -> f32 {
        self.pdf
    }

    /// A direction of the disc; arguments are fractions of 2³².
    #[inline]
    pub fn sample(&self, u: u32, v: u32) -> Vec3 {
        // Strictly inside, so that rounding does not push a sample over the edge.
        let depth = unit_f32(u) * self.one_minus_cos as f32 * 0.999_99;
        let (sin_phi, cos_phi) = (std::f32::consts::TAU * unit_f32(v)).sin_cos();
        let r = (depth * (2.0 - depth)).sqrt();
        let side = self.frame[0] * (r * cos_phi) + self.frame[1] * (r * sin_phi);
        (self.to_sun * (1.0 - depth) + side).normalize()
    }

    /// As [`Self::sample`], in f64, arguments in [0, 1).
    pub fn sample_f64(&self, u: f64, v: f64) -> DVec3 {
        let axis = self.to_sun.as_dvec3().normalize();
        let depth = u * self.one_minus_cos;
        let (sin_phi, cos_phi) = (TAU * v).sin_cos();
        let r = (depth * (2.0 - depth)).sqrt();
        FrameF64::from_normal(axis).world_from_local(DVec3::new(
            r * cos_phi,
            r * sin_phi,
            1.0 - depth,
        ))
    }
}
