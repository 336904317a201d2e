//! A sky behind clouds, without a sun.

use std::f64::consts::PI;

use motes_scene::ImageF32;

use super::{EnvironmentError, EnvironmentMap, MapOptions};

/// Lumens per watt at 555 nm: what turns the sky's radiance into luminance.
const LUMINOUS_EFFICACY: f64 = 683.0;

/// The CIE standard overcast sky (Moon & Spencer 1942): the zenith is three times as bright as the horizon, at every azimuth;
/// white of D65, as thick clouds are. Below the horizon a Lambertian ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OvercastSky {
    /// Of a horizontal plane, lux.
    pub illuminance_lx: f64,
    /// Reflectance of the ground, 0 to 1.
    pub ground_albedo: f64,
}

impl Default for OvercastSky {
    fn default() -> Self {
        Self { illuminance_lx: 10_000.0, ground_albedo: 0.3 }
    }
}

impl OvercastSky {
    /// Radiance over that of the horizon, by the sine of the elevation (0 to 1).
    pub fn over_horizon(sin_elevation: f64) -> f64 {
        1.0 + 2.0 * sin_elevation
    }

    /// The map in the unit of [`super::SunSky`] times the exposure of `options`; `height` rows, twice as many columns.
    ///
    /// # Errors
    /// When the exposure is not positive.
    pub fn build(
        &self,
        height: usize,
        options: &MapOptions,
    ) -> Result<EnvironmentMap, EnvironmentError> {
        let irradiance = self.illuminance_lx / LUMINOUS_EFFICACY;
        let zenith = irradiance * 9.0 / (7.0 * PI);
        let ground = (irradiance * self.ground_albedo / PI) as f32;
        let mut image = ImageF32::filled(2 * height, height, 3, ground);
        for y in 0..height {
            let sin_elevation = (PI * (y as f64 + 0.5) / height as f64).cos();
            if sin_elevation > 0.0 {
                let radiance = (zenith * Self::over_horizon(sin_elevation) / 3.0) as f32;
                (0..2 * height).for_each(|x| image.pixel_mut(x, y).fill(radiance));
            }
        }
        EnvironmentMap::new(&image, options)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::environment::{Environment, irradiance};

    #[test]
    fn the_ground_has_the_light_that_was_asked_for_and_no_direction_has_a_shadow() {
        let sky = OvercastSky { illuminance_lx: 8000.0, ground_albedo: 0.2 };
        let map = sky.build(64, &MapOptions::default()).unwrap();
        let light = Environment::new(Some(map), None).harmonics();
        let up = irradiance(&light, DVec3::Y) * LUMINOUS_EFFICACY;
        assert!((up / 8000.0 - 1.0).abs().max_element() < 0.02, "{up}");
        let side = |d: DVec3| irradiance(&light, d).y;
        assert!((side(DVec3::X) - side(DVec3::NEG_Z)).abs() < 1e-3 * side(DVec3::X));
    }
}
