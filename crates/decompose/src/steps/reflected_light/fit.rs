//! The light that explains what glossy parts and metals reflect.

use glam::Vec3;

use crate::appearance::FoundMaterials;
use crate::illumination::CellLight;
use crate::steps::light::cost::SolveOptions;
use crate::steps::light::glossy::{Glossy, GlossyScene};
use crate::steps::light::problem::{LightProblem, base_colors};
use crate::steps::light::solve::solve;
use crate::steps::light::transport::TracedCells;

/// Where reflections are fitted, the light is smoother by this factor (they tell single cells apart, and their errors with them), ...
const SMOOTHER: f32 = 2.0;
/// ... and the mean base color is held: lobes in the wrong place would make the light dim.
const HOLD: f32 = 30.0;

/// Moves the light, from where shading put it, to where it explains what parts of the materials `found` reflect too, with this
/// weight of reflections. The mean base color stays.
pub(super) fn fit_to_reflections(
    problem: &LightProblem<'_>,
    lights: &mut [CellLight],
    found: &FoundMaterials,
    weight: f32,
    traced: &mut TracedCells,
) {
    let Some(first) = lights.first() else { return };
    let (rows, lit) = problem.lit_points(first, &problem.bounces(), traced);
    let base: Vec<Vec<Vec3>> =
        lit.iter().zip(&*lights).map(|(l, light)| base_colors(l, light)).collect();
    let pairs = problem.pairs_under(lights, &rows, &lit, problem.seed);
    let mut glossy: Vec<Glossy> = (0..problem.lights)
        .map(|l| {
            let scene = GlossyScene {
                scene: problem.scene,
                samples: problem.samples,
                found,
                vertex_radiance: problem.vertex_radiance.get(l).map_or(&[], Vec::as_slice),
                lobes: problem.model.lobes,
                ray_bias: problem.ray_bias,
                seed: problem.seed,
            };
            Glossy::new(scene.points(&rows[l], l as u32, &lights[l]), &base[l])
        })
        .collect();
    let by_shading = problem.solve_options();
    let options = SolveOptions {
        smooth: SMOOTHER * by_shading.smooth,
        scale: HOLD,
        // Reflections tell where light comes from.
        above: 0.0,
        clear_sky: 0.0,
        glossy: weight,
        typical_base_color: typical(&base),
        rate: 0.05,
        ..by_shading
    };
    solve(lights, &lit, &pairs, &mut glossy, &options);
}

/// Mean base color, geometric, one number for all channels.
fn typical(base: &[Vec<Vec3>]) -> f32 {
    let log = |b: &Vec3| b.max(Vec3::splat(1e-4)).map(f32::ln).element_sum() / 3.0;
    let all = || base.iter().flatten();
    (all().map(log).sum::<f32>() / all().count().max(1) as f32).exp()
}
