//! The shadow and the bounce of an asset on the ground of a splat.
//!
//! A Gaussian of the ground is multiplied by the ratio of the light that white matter receives there with and without the asset, as
//! in Debevec 1998. The light has two parts: the lamp counts as far as the splat already lets it through (`V`), so that a shadow does not
//! fall into a shadow twice:
//!
//! ```text
//! color after = color before (E_rest + V E_lamp)(with) / (E_rest + V E_lamp)(without)
//! ```

use glam::{DVec3, Vec3};
use motes_math::sigmoid::sigmoid;
use motes_scene::{Gaussians, Lobes, Surface};
use motes_shading::environment::Environment;
use relight::{Probe, QualityOptions, RelightScene, Relighter, SceneError};
use serde::Serialize;

use estimate_environment::place::shadows::ShadowMap;

use super::{LightAt, LocalLight};
use crate::changes::color::scale_shown;

/// Directions toward the light per Gaussian.
const SAMPLES: u32 = 256;
/// Fainter Gaussians show nothing.
const LEAST_OPACITY: f32 = 0.02;
/// Ratios closer to 1 change nothing that shows.
const TOLERANCE: f32 = 4e-3;
/// Least and largest ratio.
const RATIOS: (f32, f32) = (0.02, 4.0);

/// What a shadow did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ShadowNumbers {
    /// Gaussians that became darker or brighter.
    pub changed: usize,
    /// Least ratio of luminance.
    pub deepest: f64,
}

/// Multiplies the Gaussians near the ground by the shadow of `surface` (the asset, world, with materials). `reach` is how far it can
/// fall, `thickness` how far from the level of the base ground may lie, world units.
///
/// # Errors
/// When the surface is broken.
pub fn cast_shadow(
    scene: &mut Gaussians,
    place: &LightAt,
    surface: &Surface,
    light: &LocalLight,
    shadows: Option<&ShadowMap>,
    (reach, thickness): (f64, f64),
    seed: u64,
) -> Result<ShadowNumbers, SceneError> {
    let level = place.base.dot(place.up);
    let point = |row: u32| DVec3::from_array(scene.means[row as usize].map(f64::from));
    let near = |row: &u32| {
        let p = point(*row);
        (p.dot(place.up) - level).abs() < thickness
            && p.distance(place.base) < reach
            && sigmoid(scene.opacity_logits[*row as usize]) > LEAST_OPACITY
    };
    let rows: Vec<u32> = (0..scene.len() as u32).filter(near).collect();
    let probe = |row: &u32| {
        // On the level of the ground: Gaussians lie around it, and below it all is dark.
        let p = point(*row);
        let on = p + place.up * (level - p.dot(place.up));
        let position = on.as_vec3();
        Probe { position, normal: place.up.as_vec3(), item: u64::from(*row) }
    };
    let probes: Vec<Probe> = rows.iter().map(probe).collect();
    let with = prepared(surface, place.up)?;
    let without = prepared(&Surface::default(), place.up)?;
    let received = |of: &RelightScene, light: &Environment| {
        let options = QualityOptions { caution: 0.0, ..QualityOptions::default() };
        Relighter::new(of, light, &options, seed).white_radiance(&probes, SAMPLES)
    };
    let rest = [received(&with, &light.rest), received(&without, &light.rest)];
    let lamp = light.lamp.as_ref().map(|l| [received(&with, l), received(&without, l)]);
    let open = |i: usize| {
        let up = place.up;
        shadows.map_or(1.0, |map| map.visibility(probes[i].position.as_dvec3(), up)) as f32
    };
    let stride = 3 * scene.sh_coefficients();
    let mut numbers = ShadowNumbers { changed: 0, deepest: 1.0 };
    for (i, row) in rows.iter().enumerate() {
        let v = open(i);
        let sum = |k: usize| rest[k][i] + lamp.as_ref().map_or(Vec3::ZERO, |l| v * l[k][i]);
        let (after, before) = (sum(0), sum(1));
        let ratio = [0, 1, 2].map(|c| {
            let ratio = after[c] / before[c].max(1e-6);
            if before[c] > 1e-6 { ratio.clamp(RATIOS.0, RATIOS.1) } else { 1.0 }
        });
        if ratio.iter().all(|r| (r - 1.0).abs() < TOLERANCE) {
            continue;
        }
        let first = *row as usize * stride;
        scale_shown(&mut scene.sh[first..first + stride], ratio);
        numbers.changed += 1;
        let mean = f64::from(ratio.iter().sum::<f32>()) / 3.0;
        numbers.deepest = numbers.deepest.min(mean);
    }
    Ok(numbers)
}

/// A surface without Gaussians, for light at points.
fn prepared(surface: &Surface, up: DVec3) -> Result<RelightScene, SceneError> {
    let mut none = Gaussians::empty(0);
    motes_scene::Materials::default().attach(&mut none);
    RelightScene::new(none, surface.clone(), Lobes::default(), true, up.as_vec3())
}
