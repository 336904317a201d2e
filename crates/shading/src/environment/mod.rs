//! Light from infinitely far away: a lat-long map, the sun's disc, or both.
//!
//! Radiances are linear, Rec. 709, in the unit of the scene: map value times exposure.

mod clean_up;
mod harmonics;
mod map;
mod orientation;
mod overcast;
pub mod reference;
mod sky;
mod solar_position;
mod studio;
mod sun;
mod sun_spectrum;
mod test_map;
mod turns;

use glam::Vec3;

use crate::integrate::LastPool;

pub use clean_up::CleanUp;
pub use harmonics::{Harmonics, irradiance};
pub use map::{EnvironmentError, EnvironmentMap, MapOptions};
pub use motes_scene::Convention;
pub use orientation::{MapAxes, Orientation, direction_from_uv, uv_from_direction};
pub use overcast::OvercastSky;
pub use sky::{SkyError, SkyRadiance, SunSky};
pub use solar_position::{SolarPosition, UniversalTime, solar_position};
pub use studio::StudioLight;
pub use sun::SunDisc;
pub use test_map::{AXIS_COLORS, axis_test_map};

/// A direction toward the light, chosen about in proportion to radiance.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit vector toward the light, world.
    pub to_light: Vec3,
    /// Radiance of everything in that direction.
    pub radiance: Vec3,
    /// Density of the direction, per steradian, over all lights.
    pub pdf: f32,
}

/// All light from infinity.
#[derive(Clone, Debug, Default)]
pub struct Environment {
    map: Option<EnvironmentMap>,
    sun: Option<SunDisc>,
    sun_probability: f32,
    /// What was drawn from it last, for all who shade under it.
    pub(crate) pool: LastPool,
}

impl Environment {
    /// A map, a sun, both or (darkness) neither.
    pub fn new(map: Option<EnvironmentMap>, sun: Option<SunDisc>) -> Self {
        let map_power = map.as_ref().map_or(0.0, EnvironmentMap::power);
        let sun_power = sun.as_ref().map_or(0.0, SunDisc::power);
        let sun_probability = if !(sun_power > 0.0) {
            0.0
        } else if !(map_power > 0.0) {
            1.0
        } else {
            // Neither light starves: below a tenth its own noise would rule.
            (sun_power / (sun_power + map_power)).clamp(0.1, 0.9) as f32
        };
        Self { map, sun, sun_probability, pool: LastPool::default() }
    }

    /// The map, if there is one.
    pub fn map(&self) -> Option<&EnvironmentMap> {
        self.map.as_ref()
    }

    /// The sun, if there is one.
    pub fn sun(&self) -> Option<&SunDisc> {
        self.sun.as_ref()
    }

    /// Whether no direction carries light. Then nothing can be sampled.
    pub fn is_black(&self) -> bool {
        !self.map.as_ref().is_some_and(|m| m.power() > 0.0) && !(self.sun_probability > 0.0)
    }

    /// Probability with which [`Self::sample`] picks the sun.
    pub fn sun_probability(&self) -> f32 {
        self.sun_probability
    }

    /// Radiance from the unit vector `to_light`, and the density of [`Self::sample`] there.
    #[inline]
    pub fn radiance_pdf(&self, to_light: Vec3) -> (Vec3, f32) {
        let of_map = match &self.map {
            Some(map) => map.radiance_pdf(to_light),
            None => (Vec3::ZERO, 0.0),
        };
        self.with_sun(to_light, of_map)
    }

    /// Radiance and density of the map, and those of the sun where it stands.
    #[inline]
    fn with_sun(&self, to_light: Vec3, (mut radiance, mut pdf): (Vec3, f32)) -> (Vec3, f32) {
        pdf *= 1.0 - self.sun_probability;
        if let Some(sun) = self.sun.as_ref().filter(|sun| sun.contains(to_light)) {
            radiance += sun.radiance;
            pdf += self.sun_probability * sun.pdf();
        }
        (radiance, pdf)
    }

    /// A direction toward the light; `u` are fractions of 2³². None when all is black.
    #[inline]
    pub fn sample(&self, u: [u32; 3]) -> Option<LightSample> {
        let pick = crate::sampling::unit_f32(u[0]);
        let p = self.sun_probability;
        let (to_light, (radiance, pdf)) = match (&self.sun, &self.map) {
            (Some(sun), _) if pick < p => {
                let to_light = sun.sample(u[1], u[2]);
                (to_light, self.radiance_pdf(to_light))
            }
            (_, Some(map)) => {
                // What is left of the first number chooses the texel.
                let rest = (f64::from(u[0]) - f64::from(p) * 4_294_967_296.0) / f64::from(1.0 - p);
                let (to_light, radiance, pdf) = map.sample([rest.max(0.0) as u32, u[1], u[2]])?;
                (to_light, self.with_sun(to_light, (radiance, pdf)))
            }
            _ => return None,
        };
        (pdf > 0.0).then_some(LightSample { to_light, radiance, pdf })
    }
}
