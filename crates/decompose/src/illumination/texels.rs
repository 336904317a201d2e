//! The light over the texels of an octahedral map.

use glam::Vec3;
use motes_shading::environment::Environment;
use motes_shading::sampling::PointSet;

use super::octahedron::Octahedron;

/// Directions of light per texel side, for its mean.
const FINE: usize = 8;
/// Directions chosen by how bright they are, so that no sun is missed.
const DRAWN: u32 = 1 << 16;
const PURPOSE: u32 = 67;

/// What comes from one texel of the square.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Texel {
    /// Mean over the texel.
    pub radiance: Vec3,
    /// Unit vector to where most of it comes from.
    pub to_light: Vec3,
    /// Steradians.
    pub solid_angle: f32,
}

/// The light over every texel of an octahedral map of so many along a side: directions on a grid and directions drawn by
/// brightness, with the balance heuristic (Veach & Guibas 1995), normalized by the sum of the weights.
pub(crate) fn light_by_texels(light: &Environment, side: usize, seed: u64) -> Vec<Texel> {
    let square = Octahedron { side };
    let areas = square.solid_angles();
    let per_texel = (FINE * FINE) as f32;
    // Radiance, weight, and directions by how bright they are.
    let mut sums = vec![(Vec3::ZERO, 0.0f32, Vec3::ZERO); side * side];
    let mut add = |k: usize, d: Vec3, radiance: Vec3, pdf: f32| {
        let weight = 1.0 / (per_texel / areas[k] + pdf * DRAWN as f32);
        sums[k].0 += radiance * weight;
        sums[k].1 += weight;
        sums[k].2 += d * (radiance.element_sum() * weight);
    };
    for k in 0..side * side {
        for fine in 0..FINE * FINE {
            let at = |low: usize, k: usize| low as f32 + (k as f32 + 0.5) / FINE as f32;
            let d = square.direction(at(k % side, fine % FINE), at(k / side, fine / FINE));
            let (radiance, pdf) = light.radiance_pdf(d);
            add(k, d, radiance, pdf);
        }
    }
    let points = PointSet::new(seed, 0, PURPOSE, DRAWN);
    for sample in (0..DRAWN).filter_map(|k| light.sample(points.point(k))) {
        add(square.texel(sample.to_light), sample.to_light, sample.radiance, sample.pdf);
    }
    let texel = |(k, (sum, weights, along)): (usize, (Vec3, f32, Vec3))| Texel {
        radiance: sum / weights.max(1e-30),
        to_light: along
            .normalize_or(square.direction((k % side) as f32 + 0.5, (k / side) as f32 + 0.5)),
        solid_angle: areas[k],
    };
    sums.into_iter().enumerate().map(texel).collect()
}

#[cfg(test)]
mod tests {
    use motes_scene::ImageF32;
    use motes_shading::environment::{EnvironmentMap, MapOptions, direction_from_uv};

    use super::*;

    const SIDE: usize = 28;

    #[test]
    fn a_small_sun_keeps_its_power_and_its_place() {
        let (w, h) = (512, 256);
        let mut map = ImageF32::from_data(w, h, 3, vec![0.1; 3 * w * h]);
        map.pixel_mut(100, 60).copy_from_slice(&[4e4; 3]);
        let options = MapOptions::default();
        let light = Environment::new(EnvironmentMap::new(&map, &options).ok(), None);
        let power = light.map().unwrap().power();
        let square = Octahedron { side: SIDE };
        let means = light_by_texels(&light, SIDE, 3);
        let areas = square.solid_angles();
        let found: f32 = means.iter().zip(&areas).map(|(m, a)| m.radiance.x * a).sum();
        assert!((f64::from(found) / power - 1.0).abs() < 0.02, "{found} {power}");
        let brightest =
            (0..means.len()).max_by(|&a, &b| means[a].radiance.x.total_cmp(&means[b].radiance.x));
        let (u, v) = (100.5 / w as f64, 60.5 / h as f64);
        let sun = options.orientation.world_from_map(direction_from_uv(u, v)).as_vec3();
        assert_eq!(brightest, Some(square.texel(sun)));
        assert!(means[square.texel(sun)].to_light.angle_between(sun) < 0.01);
    }

    #[test]
    fn darkness_is_dark() {
        let texels = light_by_texels(&Environment::default(), 8, 0);
        assert!(texels.iter().all(|t| t.radiance == Vec3::ZERO && t.to_light.is_normalized()));
    }
}
