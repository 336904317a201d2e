//! Lamps of a studio: three-point lighting.

use glam::DVec3;
use motes_scene::ImageF32;

use super::{EnvironmentError, EnvironmentMap, MapOptions, direction_from_uv};

/// A soft lamp at infinity.
struct Lamp {
    /// Counter-clockwise from the azimuth of the studio, degrees.
    azimuth_deg: f64,
    elevation_deg: f64,
    /// Half of its width, degrees; its edge is soft over a quarter of it.
    radius_deg: f64,
    /// Share of the radiance of the key light.
    strength: f64,
}

/// Three-point lighting of the textbooks: the key light before the object on one side, a larger, weaker fill light on the other, a
/// back light behind it.
const LAMPS: [Lamp; 3] = [
    Lamp { azimuth_deg: 40.0, elevation_deg: 45.0, radius_deg: 18.0, strength: 1.0 },
    Lamp { azimuth_deg: -55.0, elevation_deg: 25.0, radius_deg: 26.0, strength: 0.08 },
    Lamp { azimuth_deg: 170.0, elevation_deg: 50.0, radius_deg: 14.0, strength: 0.6 },
];
/// Radiance of the room, as a share of the key light's: walls that are painted gray.
const ROOM: f64 = 0.015;

/// White lamps in a gray room, around an object that is seen from the azimuth of the studio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StudioLight {
    /// Where the camera of the studio stands, degrees, counter-clockwise seen from above.
    pub azimuth_deg: f64,
    /// Of the key light, W / (m² sr).
    pub key_radiance: f64,
}

impl Default for StudioLight {
    fn default() -> Self {
        Self { azimuth_deg: 0.0, key_radiance: 100.0 }
    }
}

impl StudioLight {
    /// The map times the exposure of `options`; `height` rows, twice as many columns.
    ///
    /// # Errors
    /// When the exposure is not positive.
    pub fn build(
        &self,
        height: usize,
        options: &MapOptions,
    ) -> Result<EnvironmentMap, EnvironmentError> {
        let width = 2 * height;
        let mut image = ImageF32::filled(width, height, 3, 0.0);
        for y in 0..height {
            for x in 0..width {
                let (u, v) = ((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64);
                let radiance = self.radiance(direction_from_uv(u, v)) as f32;
                image.pixel_mut(x, y).fill(radiance);
            }
        }
        EnvironmentMap::new(&image, options)
    }

    /// Radiance from a unit direction of the map: y is up, z azimuth 0, x azimuth 90 degrees.
    fn radiance(&self, direction: DVec3) -> f64 {
        let lamps = LAMPS.iter().map(|lamp| {
            let azimuth = (self.azimuth_deg + lamp.azimuth_deg).to_radians();
            let (sin, cos) = lamp.elevation_deg.to_radians().sin_cos();
            let to_lamp = DVec3::new(cos * azimuth.sin(), sin, cos * azimuth.cos());
            let angle = to_lamp.dot(direction).clamp(-1.0, 1.0).acos().to_degrees();
            let edge = 1.0 - (angle / lamp.radius_deg - 0.75) / 0.25;
            let t = edge.clamp(0.0, 1.0);
            lamp.strength * t * t * (3.0 - 2.0 * t)
        });
        self.key_radiance * (ROOM + lamps.sum::<f64>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{Environment, irradiance};

    #[test]
    fn the_key_side_is_brightest_and_no_side_is_black() {
        let map = StudioLight::default().build(64, &MapOptions::default()).unwrap();
        let light = Environment::new(Some(map), None).harmonics();
        let at = |azimuth: f64| {
            let a = azimuth.to_radians();
            irradiance(&light, DVec3::new(a.sin(), 0.0, a.cos())).y
        };
        let (key, fill) = (at(40.0), at(-55.0));
        assert!(key > 2.0 * fill && fill > 0.1 * key, "{key} {fill}");
        let turned = StudioLight { azimuth_deg: 90.0, ..StudioLight::default() };
        let axis = |azimuth: f64| {
            let a = azimuth.to_radians();
            DVec3::new(a.sin(), 0.0, a.cos())
        };
        let same = StudioLight::default().radiance(axis(0.0)) - turned.radiance(axis(90.0));
        assert!(same.abs() < 1e-9, "{same}");
    }
}
