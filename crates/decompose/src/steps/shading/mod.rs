//! The shading of every pixel of the photos, as a linear function of base color.

mod cavities;
mod options;

use motes_shading::integrate::IntegrationOptions;

use crate::appearance::vertex_materials::vertex_materials;
use crate::appearance::{BasisScene, PixelShading, SparsePixels};
use crate::error::DecomposeError;
use crate::observation::{Observed, SeenView};
use crate::progress::Tick;
use crate::state::State;

pub use options::Options;

/// Integrates the shading of all photos, those held out last, and darkens metals that are dark from everywhere.
///
/// # Errors
/// What `tick` says.
pub fn run(
    state: &mut State<'_>,
    options: &Options,
    tick: &mut Tick<'_>,
) -> Result<(), DecomposeError> {
    let inputs = state.inputs;
    let Observed { scene, views, samples, vertex_radiance, .. } = &state.observed;
    let light = &state.illumination;
    let materials = vertex_materials(scene, samples, &light.materials);
    let emitters = light.emitters(scene);
    let basis_scene = BasisScene {
        scene,
        lights: &light.lights,
        vertex_radiance,
        emitters: emitters.as_ref(),
        lobes: inputs.model.lobes,
        options: IntegrationOptions {
            ray_bias: state.ray_bias(),
            seed: inputs.seed,
            ..split_rays(options.pixel_rays, state.is_specular(), state.has_indirect())
        },
    };
    let pixels =
        SparsePixels { spacing: options.pixel_spacing.into(), tolerance: options.pixel_tolerance };
    let held_out: Vec<SeenView<'_>> =
        inputs.held_out.iter().map(|p| SeenView::new(p, scene)).collect();
    let count = (views.len() + held_out.len()).max(1) as f32;
    let mut shadings = Vec::with_capacity(views.len() + held_out.len());
    for (i, view) in views.iter().chain(&held_out).enumerate() {
        tick(i as f32 / count)?;
        shadings.push(PixelShading::integrate(view, i, &materials, &basis_scene, pixels));
    }
    let dark = cavities::darkening(scene, views, &shadings[..views.len()], &materials);
    for (shading, view) in shadings.iter_mut().zip(views.iter().chain(&held_out)) {
        shading.darken(view, scene, &dark);
    }
    if let Some(factors) = state.observed.local_factors() {
        for (shading, view) in shadings.iter_mut().zip(views.iter().chain(&held_out)) {
            shading.light(|i| factors.at(view, i));
        }
    }
    state.shading = shadings;
    Ok(())
}

/// Rays toward the light and rays drawn from the material, which highlights and light from the surface ask for.
fn split_rays(rays: u32, is_specular: bool, has_indirect: bool) -> IntegrationOptions {
    let brdf_samples =
        if is_specular { rays / 3 } else { 0 }.max(u32::from(has_indirect) * rays / 4);
    IntegrationOptions {
        light_samples: rays.saturating_sub(brdf_samples).max(1),
        brdf_samples,
        ..IntegrationOptions::default()
    }
}
