//! Light that white matte Gaussians would receive, with and without the shadows of what photos speak against.

use glam::Vec3;
use motes_math::falloff::quartic_falloff;
use motes_math::luminance::luminance;
use motes_shading::emitters::Emitters;
use motes_shading::environment::Environment;
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};
use motes_shading::tracing::{Empty, MeshTracer};

use crate::captured_light::Lit;
use crate::lamps::Lights;
use crate::scene::RelightScene;
use crate::surface_point::white_matte;

/// Keeps the random numbers apart from those of pixels, vertices and baked colors.
const FIRST_ITEM: u64 = 1 << 52;
/// Light from all around, as a share of the mean: bounces, and what a surface that is not where it should be hides.
const AMBIENT: f32 = 0.15;
/// Natural logarithm of the light with over without a disputed shadow at which a value counts half.
const DISPUTED_LOG_RATIO: f32 = 0.35;

/// Light at `places`, each with its normal.
pub(super) fn lit(
    scene: &RelightScene,
    light: &Lights<'_>,
    places: &[(Vec3, Vec3)],
    samples: u32,
    seed: u64,
) -> Lit {
    let points = white(places);
    let options = IntegrationOptions {
        light_samples: samples,
        brdf_samples: samples / 2,
        ray_bias: scene.ray_bias,
        seed,
        ..IntegrationOptions::default()
    };
    let under = |tracer: &MeshTracer| -> Vec<Vec3> {
        let shader =
            Shader::new(light.environment, tracer, None, options).with_emitters(light.lamps);
        shader.shade(&points, FIRST_ITEM).iter().map(|s| s.total()).collect()
    };
    let mut radiance = under(&scene.tracer);
    let mut agreed = Vec::new();
    if let Some(rest) = scene.undisputed() {
        let without = under(rest);
        let floor = luminance(floor(&radiance));
        agreed = radiance.iter().zip(&without).map(|(a, b)| alike(*a, *b, floor)).collect();
        for (with, without) in radiance.iter_mut().zip(&without) {
            *with = 0.5 * (*with + *without);
        }
    }
    Lit { radiance, agreed }
}

/// Radiance of white Lambert matter at `places` that lamps light, with nothing between.
pub(super) fn of_lamps(lamps: &Emitters, places: &[(Vec3, Vec3)], seed: u64) -> Vec<Vec3> {
    let darkness = Environment::default();
    let options = IntegrationOptions {
        light_samples: 0,
        brdf_samples: 0,
        seed,
        ..IntegrationOptions::default()
    };
    let shader = Shader::new(&darkness, &Empty, None, options).with_emitters(Some(lamps));
    shader.shade(&white(places), FIRST_ITEM).iter().map(|lit| lit.total()).collect()
}

fn white(places: &[(Vec3, Vec3)]) -> Vec<SurfacePoint> {
    places.iter().map(|&(position, normal)| white_matte(position, normal)).collect()
}

/// Light from all around: a share of the mean of what is finite.
pub(super) fn floor(lit: &[Vec3]) -> Vec3 {
    let sum: Vec3 = lit.iter().filter(|v| v.is_finite()).sum();
    (sum / lit.len().max(1) as f32 * AMBIENT).max(Vec3::splat(1e-6))
}

/// 1 where two lights are the same, 1/2 where they differ by [`DISPUTED_LOG_RATIO`] over a floor; 1 where that is not a number.
fn alike(a: Vec3, b: Vec3, floor: f32) -> f32 {
    let off = ((luminance(a) + floor) / (luminance(b) + floor)).ln();
    if off.is_finite() { quartic_falloff(1.0, off, DISPUTED_LOG_RATIO) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use motes_shading::tracing::TriangleMesh;

    use super::*;

    #[test]
    fn a_lamp_that_nothing_hides_sends_its_irradiance_over_pi() {
        let half = 0.01;
        let corner = |x: f32, y: f32| Vec3::new(x * half, y * half, 2.0);
        let mesh = TriangleMesh {
            vertices: vec![
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(-1.0, 1.0),
                corner(1.0, 1.0),
            ],
            triangles: vec![[0, 1, 2], [1, 3, 2]],
        };
        let lamp = Emitters::new(&mesh, &[Vec3::new(300.0, 200.0, 100.0); 4]).unwrap();
        let places = [
            (Vec3::ZERO, Vec3::Z),
            (Vec3::new(2.0, 0.0, 0.0), Vec3::Z),
            (Vec3::ZERO, Vec3::X),
            (Vec3::ZERO, -Vec3::Z),
        ];
        let [below, aside, edge_on, behind] = of_lamps(&lamp, &places, 0).try_into().unwrap();
        // L A cos cos / (π d²).
        let wanted = Vec3::new(300.0, 200.0, 100.0) * 4e-4 / (std::f32::consts::PI * 4.0);
        assert!((below / wanted - 1.0).abs().max_element() < 1e-3, "{below} {wanted}");
        assert!((4.0 * aside / wanted - 1.0).abs().max_element() < 0.02, "{aside} {wanted}");
        assert!(edge_on.max_element() < 0.01 * below.x && behind == Vec3::ZERO, "{edge_on}");
    }

    #[test]
    fn lights_agree_as_far_as_they_are_the_same_over_the_floor() {
        let half = DISPUTED_LOG_RATIO.exp();
        assert_eq!(alike(Vec3::ONE, Vec3::ONE, 0.1), 1.0);
        assert!((alike(Vec3::splat(half), Vec3::ONE, 0.0) - 0.5).abs() < 1e-3);
        assert!(
            alike(Vec3::ZERO, Vec3::ONE, 0.1) < 0.01 && alike(Vec3::ZERO, Vec3::ONE, 9.0) > 0.9
        );
        assert_eq!(alike(Vec3::NAN, Vec3::ONE, 0.1), 1.0);
    }
}
