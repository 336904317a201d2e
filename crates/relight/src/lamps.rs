//! Lamps of a scene: whether they shine, and how much of its own light is theirs.

use std::num::NonZero;

use motes_math::knn::of_nearest;
use motes_math::luminance::luminance;
use motes_scene::Switch;
use motes_shading::emitters::Emitters;
use motes_shading::environment::Environment;
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};

use crate::scene::RelightScene;
use crate::surface_point::white_vertex;

/// Keeps the random numbers apart from those of pixels, vertices and baked colors.
const FIRST_ITEM: u64 = 1 << 54;
/// Vertices that light is compared at.
const PLACES: usize = 512;
/// A Gaussian shows what lies within this many of its largest standard deviations, and of the ray bias.
const EXTENT: f32 = 3.0;
/// A light this like that of the photos is that of the photos.
const OWN: f32 = 0.999;

/// Light of an environment and of lamps.
#[derive(Clone, Copy)]
pub(crate) struct Lights<'a> {
    pub(crate) environment: &'a Environment,
    pub(crate) lamps: Option<&'a Emitters>,
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

/// Whether each Gaussian shows a lamp that does not shine under a light: its captured color is light that is switched off. Empty where
/// there is none.
pub(crate) fn switched_off(scene: &RelightScene, light: &Lights<'_>) -> Vec<bool> {
    if scene.lamps.is_none() || light.lamps.is_some() {
        return Vec::new();
    }
    let (gaussians, surface) = (&scene.gaussians, &scene.surface);
    let shows = |i: u32, nearest: &[(u32, f32)]| {
        let scales = gaussians.log_scales[i as usize];
        let largest = scales.into_iter().fold(f32::NEG_INFINITY, f32::max).exp();
        let reach = EXTENT * largest.max(scene.ray_bias);
        let is_lamp = |&(v, squared): &(u32, f32)| {
            squared <= reach * reach && surface.emission(v as usize).is_some()
        };
        nearest.iter().any(is_lamp)
    };
    let found = of_nearest(&gaussians.means, &surface.vertices, NonZero::<usize>::MIN, shows);
    found.into_iter().map(|shows| shows.unwrap_or(false)).collect()
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
