//! The light of the photos on every Gaussian.

use std::sync::Arc;

use glam::Vec3;
use motes_math::sh::SH_C0;
use motes_math::sigmoid::sigmoid;
use motes_scene::Gaussians;
use rayon::prelude::*;

use super::received::{lit, of_lamps};
use super::{ANCHOR, ROUNDS, mix, unshadowed};
use crate::captured_light::{CapturedLight, Trust};
use crate::graph::Graph;
use crate::lamps::Lights;
use crate::scene::RelightScene;
use crate::surface_point::surface_point;

/// How far what is unexplained over a neighborhood is that of each of its Gaussians alone.
const UNEXPLAINED_ANCHOR: f32 = 0.05;

/// Of `scene` under its `own` light, computed once; none without a confidence.
pub(super) fn captured_light(
    scene: &RelightScene,
    own: &Lights<'_>,
    samples: u32,
    seed: u64,
) -> Option<Arc<CapturedLight>> {
    let confidence = scene.confidence.as_deref()?;
    let find = || Arc::new(find(scene, confidence, own, samples, seed));
    let known = scene.captured_light.get_or_init(find);
    Some(if known.sampled == (samples, seed) { Arc::clone(known) } else { find() })
}

fn find(
    scene: &RelightScene,
    confidence: &[f32],
    own: &Lights<'_>,
    samples: u32,
    seed: u64,
) -> CapturedLight {
    let graph = Graph::new(&scene.gaussians.means);
    let logits = &scene.gaussians.opacity_logits;
    let area = logits.iter().map(|&logit| sigmoid(logit)).collect();
    let trust = Trust { confidence: confidence.to_vec(), area };
    let places = places(scene, &graph, &trust);
    let lit = lit(scene, own, &places, samples, seed);
    let of_lamps = own.lamps.map(|lamps| of_lamps(lamps, &places, seed));
    let open = unshadowed(own.environment, &places, of_lamps.as_deref());
    let log_own = log_own(scene, &graph, &alike(&places, &trust.area));
    CapturedLight { sampled: (samples, seed), graph, trust, places, lit, of_lamps, open, log_own }
}

/// How much a Gaussian listens to another one.
pub(super) fn alike<'a>(
    places: &'a [(Vec3, Vec3)],
    area: &'a [f32],
) -> impl Fn(usize, usize) -> f32 + Sync + 'a {
    |i, j| {
        let cosine = places[i].1.dot(places[j].1).max(0.0);
        cosine * cosine * area[j]
    }
}

/// Where light falls on every Gaussian: normals follow their neighbors where they are not sure, and rays start off
/// the Gaussian by its own thickness there, since nobody knows how deep in it the surface is.
fn places(scene: &RelightScene, graph: &Graph, trust: &Trust) -> Vec<(Vec3, Vec3)> {
    let first: Vec<(Vec3, Vec3)> = (0..scene.gaussians.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| surface_point(scene, i))
        .collect();
    let normals: Vec<Vec3> = first.iter().map(|(_, n)| *n).collect();
    let anchor = |i: usize| mix(ANCHOR, trust.confidence[i].powi(2));
    let smooth = graph.smoothed(&normals, &anchor, &|_, j| trust.area[j], ROUNDS / 4);
    let placed = |i: usize| {
        let (position, normal) = first[i];
        let smooth = smooth[i].normalize_or(normal);
        let unsure = 1.0 - trust.confidence[i];
        (position + smooth * (unsure * thickness(&scene.gaussians, i, smooth)), smooth)
    };
    (0..first.len()).into_par_iter().with_min_len(1024).map(placed).collect()
}

/// Standard deviation of a Gaussian along a unit vector; 0 where it is not finite.
fn thickness(gaussians: &Gaussians, i: usize, along: Vec3) -> f32 {
    let [w, x, y, z] = gaussians.rotations[i];
    let local = glam::Quat::from_xyzw(x, y, z, w).normalize().inverse() * along;
    let scales = Vec3::from(gaussians.log_scales[i]).map(f32::exp);
    let deviation = (local * scales).length();
    if deviation.is_finite() { deviation } else { 0.0 }
}

/// Logarithm of what is smooth in the captured colors and goes with the light that it is part of, of every Gaussian: the local light, and
/// what the model left unexplained over a neighborhood.
fn log_own(
    scene: &RelightScene,
    graph: &Graph,
    alike: &(impl Fn(usize, usize) -> f32 + Sync),
) -> Vec<Vec3> {
    let mut smooth = vec![Vec3::ZERO; scene.gaussians.len()];
    if let Some(residual) = &scene.residual {
        let unexplained = |i: usize| {
            let log_ratio = residual.log_ratio(i, &[SH_C0 as f32]);
            if log_ratio.is_finite() { log_ratio } else { Vec3::ZERO }
        };
        let all = (0..smooth.len()).into_par_iter().with_min_len(1024);
        let unexplained: Vec<Vec3> = all.map(unexplained).collect();
        smooth = graph.smoothed(&unexplained, &|_| UNEXPLAINED_ANCHOR, alike, ROUNDS / 4);
    }
    if let Some(local) = &scene.local_log_factor {
        smooth.iter_mut().zip(local).for_each(|(smooth, local)| *smooth += *local);
    }
    smooth
}

#[cfg(test)]
mod tests {
    use motes_scene::ImageF32;
    use motes_shading::environment::{Environment, EnvironmentMap, MapOptions};

    use super::*;
    use crate::stand_in::tests::scene;

    #[test]
    fn lights_share_what_was_found_for_the_same_samples() {
        let mut scene = scene(&[0.0], &[0.0]);
        let map = EnvironmentMap::new(&ImageF32::filled(8, 4, 3, 1.0), &MapOptions::default());
        let sky = Environment::new(map.ok(), None);
        let own = Lights { environment: &sky, lamps: None };
        let of = |scene: &RelightScene, samples, seed| captured_light(scene, &own, samples, seed);
        assert!(of(&scene, 8, 0).is_none(), "nothing is known of how sure it is");
        scene.confidence = Some(vec![0.5; scene.gaussians.len()]);
        let first = of(&scene, 8, 0).unwrap();
        assert!(Arc::ptr_eq(&first, &of(&scene, 8, 0).unwrap()));
        let [more, other] = [of(&scene, 16, 0), of(&scene, 8, 1)].map(Option::unwrap);
        assert_eq!((more.sampled, other.sampled), ((16, 0), (8, 1)));
        assert!(!Arc::ptr_eq(&first, &other));
        // A white map lights open matter with its radiance.
        let lit = &more.lit.radiance;
        let mean = lit.iter().sum::<Vec3>() / lit.len() as f32;
        assert!((mean - 1.0).abs().max_element() < 0.05, "{mean}");
    }
}
