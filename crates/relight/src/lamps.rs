//! Lamps of a scene: whether they shine, and how much of its own light is theirs.

use std::num::NonZero;

use motes_math::disjoint_sets::DisjointSets;
use motes_math::knn::of_nearest;
use motes_math::luminance::luminance;
use motes_scene::{Gaussians, Switch};
use motes_shading::emitters::Emitters;
use motes_shading::environment::Environment;
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};

use crate::scene::RelightScene;
use crate::surface_point::white_vertex;
use crate::windows::is_clipped;

/// Keeps the random numbers apart from those of pixels, vertices and baked colors.
const FIRST_ITEM: u64 = 1 << 54;
/// Vertices that light is compared at.
const PLACES: usize = 512;
/// A Gaussian shows what lies within this many of its largest standard deviations, and of the ray bias.
const EXTENT: f32 = 3.0;
/// Neighbors that are asked whether they touch what is part of a lamp.
const TOUCHING: NonZero<usize> = NonZero::new(9).unwrap();
/// A light this like that of the photos is that of the photos.
const OWN: f32 = 0.999;

/// Light of an environment and of lamps.
#[derive(Clone, Copy)]
pub(crate) struct Lights<'a> {
    pub(crate) environment: &'a Environment,
    pub(crate) lamps: Option<&'a Emitters>,
}

impl Lights<'_> {
    /// Whether these are the very same.
    pub(crate) fn is(&self, other: &Self) -> bool {
        let lamps = [self.lamps, other.lamps].map(|lamps| lamps.map(std::ptr::from_ref));
        std::ptr::eq(self.environment, other.environment) && lamps[0] == lamps[1]
    }
}

/// The lamps that shine under a light which is so much like that of the photos; a light that is not known is taken for theirs.
pub(crate) fn shining(
    scene: &RelightScene,
    switch: Switch,
    likeness: Option<f32>,
) -> Option<&Emitters> {
    let shine = match switch {
        Switch::On => true,
        Switch::Off => false,
        Switch::Auto => likeness.is_none_or(|likeness| likeness > OWN),
    };
    scene.lamps.as_ref().filter(|_| shine)
}

/// Of each Gaussian that shows a lamp which does not shine under a light, the one on the lamp that is nearest to it, perhaps itself: its
/// captured color is light that is switched off. Empty where there is none.
pub(crate) fn switched_off(scene: &RelightScene, light: &Lights<'_>) -> Vec<Option<u32>> {
    if scene.lamps.is_none() || light.lamps.is_some() {
        return Vec::new();
    }
    let (gaussians, surface) = (&scene.gaussians, &scene.surface);
    let shows = |i: u32, nearest: &[(u32, f32)]| {
        let reach = reach(gaussians, i, scene.ray_bias);
        let is_lamp = |&(v, squared): &(u32, f32)| {
            squared <= reach * reach && surface.emission(v as usize).is_some()
        };
        nearest.iter().any(is_lamp)
    };
    let found = of_nearest(&gaussians.means, &surface.vertices, NonZero::<usize>::MIN, shows);
    let shows = |(i, shows): (u32, Option<bool>)| shows == Some(true) && !is_sky(scene, i);
    let on_lamps: Vec<bool> = (0u32..).zip(found).map(shows).collect();
    with_glow(gaussians, scene.ray_bias, &on_lamps, |i| !is_sky(scene, i))
}

/// Whether a Gaussian gives way to the new sky.
fn is_sky(scene: &RelightScene, i: u32) -> bool {
    scene.sky.as_ref().is_some_and(|sky| sky[i as usize] > 0.5)
}

/// How far a Gaussian reaches, world units.
fn reach(gaussians: &Gaussians, i: u32, ray_bias: f32) -> f32 {
    let scales = gaussians.log_scales[i as usize];
    EXTENT * scales.into_iter().fold(f32::NEG_INFINITY, f32::max).exp().max(ray_bias)
}

/// Takes what hangs together with Gaussians `on_lamps`, is clipped and `may` be for part of the lamps: a ball that shines is made of
/// Gaussians within it, and of a halo before what stands around it. Each is given with the one on a lamp that is nearest to it.
fn with_glow(
    gaussians: &Gaussians,
    ray_bias: f32,
    on_lamps: &[bool],
    may: impl Fn(u32) -> bool,
) -> Vec<Option<u32>> {
    let core: Vec<u32> = (0..on_lamps.len() as u32).filter(|&i| on_lamps[i as usize]).collect();
    let glows = |i: u32| may(i) && is_clipped(gaussians, i);
    let is_bright = |&i: &u32| on_lamps[i as usize] || glows(i);
    let bright: Vec<u32> = (0..on_lamps.len() as u32).filter(is_bright).collect();
    let at =
        |of: &[u32]| -> Vec<[f32; 3]> { of.iter().map(|&i| gaussians.means[i as usize]).collect() };
    let places = at(&bright);
    let touching = |k: u32, nearest: &[(u32, f32)]| -> Vec<u32> {
        let reach = reach(gaussians, bright[k as usize], ray_bias);
        let near = nearest.iter().filter(|(_, squared)| *squared <= reach * reach);
        near.map(|(j, _)| *j).collect()
    };
    let mut sets = DisjointSets::new(bright.len());
    for (k, row) in (0u32..).zip(of_nearest(&places, &places, TOUCHING, touching)) {
        row.into_iter().flatten().for_each(|j| sets.join(k, j));
    }
    let labels = sets.labels();
    let mut has_lamp = vec![false; bright.len()];
    for (&i, &label) in bright.iter().zip(&labels) {
        has_lamp[label as usize] |= on_lamps[i as usize];
    }
    let nearest = of_nearest(&places, &at(&core), NonZero::<usize>::MIN, |_, nearest| nearest[0].0);
    let mut found = vec![None; on_lamps.len()];
    for ((&i, &label), nearest) in bright.iter().zip(&labels).zip(nearest) {
        if has_lamp[label as usize] {
            found[i as usize] = nearest.map(|k| core[k as usize]);
        }
    }
    found
}

/// Share of the light on the scene's vertices that its lamps give in the photos, 0 to 1.
pub(crate) fn share_of_lamps(scene: &RelightScene, seed: u64) -> f32 {
    let (Some(lamps), Some(own)) = (&scene.lamps, &scene.own_environment) else { return 0.0 };
    let surface = &scene.surface;
    let stride = surface.vertices.len().div_ceil(PLACES).max(1);
    let points: Vec<SurfacePoint> =
        (0..surface.vertices.len()).step_by(stride).map(|v| white_vertex(surface, v)).collect();
    let options = IntegrationOptions {
        light_samples: 16,
        brdf_samples: 0,
        ray_bias: scene.ray_bias,
        seed,
        ..IntegrationOptions::default()
    };
    let received = |light: &Environment, lamps: Option<&Emitters>| -> f32 {
        let shader = Shader::new(light, &scene.tracer, None, options).with_emitters(lamps);
        shader.shade(&points, FIRST_ITEM).iter().map(|s| luminance(s.total())).sum()
    };
    let of_lamps = received(&Environment::default(), Some(lamps));
    let share = of_lamps / (of_lamps + received(own, None));
    if share.is_finite() { share } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use motes_math::sh::SH_C0;

    use super::*;

    #[test]
    fn what_touches_a_lamp_and_is_clipped_is_part_of_it() {
        // A row half a reach apart, brightness of each, and two that nothing touches.
        let gray = [0.2, 1.0, 1.0, 1.0, 0.99, 0.5, 1.0, 1.0];
        let places = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 50.0];
        let gaussians = Gaussians {
            means: places.map(|x| [x, 0.0, 0.0]).to_vec(),
            log_scales: vec![[(2.0 / EXTENT).ln(), -9.0, -9.0]; 8],
            sh: gray.iter().flat_map(|v| [(v - 0.5) / SH_C0 as f32; 3]).collect(),
            ..Gaussians::empty(0)
        };
        let lamps = |on: &[usize], may: &dyn Fn(u32) -> bool| {
            let on: Vec<bool> = (0..8).map(|i| on.contains(&i)).collect();
            with_glow(&gaussians, 0.0, &on, may)
        };
        let lamp = [None, Some(1), Some(1), Some(1), Some(1), None, Some(1), None];
        assert_eq!(lamps(&[1], &|_| true), lamp);
        // Each stands by the nearest on a lamp, and nothing is taken through the sky.
        let two = lamps(&[1, 3], &|_| true);
        assert_eq!(two[..5], [None, Some(1), Some(1), Some(3), Some(3)]);
        assert_eq!(lamps(&[1], &|i| i != 2 && i != 3)[2..], [None; 6]);
        assert_eq!(lamps(&[], &|_| true), [None; 8]);
        // A lamp that was captured dark takes nothing else.
        let dark = lamps(&[0, 7], &|i| i != 1 && i != 2);
        assert_eq!(dark, [Some(0), None, None, None, None, None, None, Some(7)]);
    }

    #[test]
    fn nothing_has_no_lamps() {
        assert!(with_glow(&Gaussians::empty(0), 0.0, &[], |_| true).is_empty());
        let mut gaussians = Gaussians { means: vec![[f32::NAN; 3]; 2], ..Gaussians::empty(0) };
        (gaussians.log_scales, gaussians.sh) = (vec![[f32::NAN; 3]; 2], vec![f32::NAN; 6]);
        assert_eq!(with_glow(&gaussians, 0.0, &[true, false], |_| true), [None; 2]);
    }
}
