//! What a map holds, in a few numbers.

use glam::{DVec3, Vec3};
use motes_math::luminance::luminance_f64;
use motes_scene::ImageF32;
use motes_shading::environment::Orientation;
use serde::Serialize;

use crate::sphere::{texel_direction, texel_solid_angle};

/// A map in a few numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Mean over the sphere, linear RGB.
    pub mean_radiance: [f64; 3],
    /// Largest luminance.
    pub peak_luminance: f64,
    /// Unit vector, world: the direction of `∫ L w dw`; zero in darkness.
    pub dominant_direction: [f64; 3],
    /// `|∫ L w dw| / ∫ L dw`: 0 for light from everywhere, 1 for light from one direction.
    pub directionality: f64,
}

impl Summary {
    /// Of a map in its own axes, which stand as `orientation` says.
    pub fn of(map: &ImageF32, orientation: &Orientation) -> Self {
        let (w, h) = (map.width, map.height);
        let (mut sum, mut flow, mut peak) = (DVec3::ZERO, DVec3::ZERO, 0.0f64);
        for y in 0..h {
            let omega = texel_solid_angle(y, w, h);
            for x in 0..w {
                let radiance = Vec3::from_slice(map.pixel(x, y)).as_dvec3();
                let l = luminance_f64(radiance);
                sum += radiance * omega;
                flow += texel_direction(x, y, w, h) * (l * omega);
                peak = peak.max(l);
            }
        }
        let total = luminance_f64(sum);
        let toward = orientation.world_from_map(flow.normalize_or_zero());
        Self {
            mean_radiance: (sum / (4.0 * std::f64::consts::PI)).to_array(),
            peak_luminance: peak,
            dominant_direction: toward.to_array(),
            directionality: if total > 0.0 { flow.length() / total } else { 0.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use motes_shading::environment::Convention;

    use super::*;

    #[test]
    fn a_lamp_is_found_and_an_even_light_has_no_direction() {
        let mut map = ImageF32::filled(64, 32, 3, 0.25);
        let orientation = Orientation::new(Convention::Blender);
        let even = Summary::of(&map, &orientation);
        assert!(even.directionality < 1e-3 && (even.mean_radiance[0] - 0.25).abs() < 1e-9);
        // A quarter from the left, at the horizon: +y in Blender's axes.
        map.pixel_mut(16, 15).fill(1e4);
        map.pixel_mut(16, 16).fill(1e4);
        let lit = Summary::of(&map, &orientation);
        assert!(DVec3::from_array(lit.dominant_direction).dot(DVec3::Y) > 0.998);
        assert!(lit.directionality > 0.9 && (lit.peak_luminance - 1e4).abs() < 1.0);
    }
}
