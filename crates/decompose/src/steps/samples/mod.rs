//! Points of the surface with what the photos show of them, and normals that other tools predicted.

mod normal_priors;
mod options;

use crate::error::DecomposeError;
use crate::observation::{Observed, Sample, SeenView, Wanted};
use crate::state::State;
use motes_scene::Switch;

pub use options::Options;

/// Chooses the points that light and material are fitted to.
///
/// # Errors
/// When no point is seen by enough photos, or a pixel whose base color is given shows no surface.
pub fn run(state: &mut State<'_>, options: &Options) -> Result<(), DecomposeError> {
    let inputs = state.inputs;
    let mut surface = state.surface().clone();
    if let Some(normals) = normal_priors::normals(
        &state.observed.scene,
        inputs.photos,
        &inputs.known.normal_priors,
        options.weight_prior_normals,
    ) {
        surface.normals = normals;
    }
    let lights = match inputs.model.indirect {
        Switch::Off => 0,
        Switch::Auto | Switch::On => inputs.light_count(),
    };
    let wanted = Wanted { points: options.samples, observations: options.point_photos };
    state.observed = Observed::of(surface, inputs.photos, wanted, lights)?;
    let Observed { scene, samples, views, .. } = &state.observed;
    state.camera_distance = median_distance(samples, views);
    for anchor in &inputs.known.anchors {
        anchor.position(inputs.photos, scene)?;
    }
    Ok(())
}

fn median_distance(samples: &[Sample], views: &[SeenView<'_>]) -> f32 {
    let mut all: Vec<f32> = samples
        .iter()
        .flat_map(|s| {
            s.observations.iter().map(|o| (views[o.photo as usize].rays.eye - s.position).length())
        })
        .collect();
    all.sort_by(f32::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(1.0)
}
