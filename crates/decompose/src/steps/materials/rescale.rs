//! The scale of light against base color.

use glam::Vec3;
use motes_scene::ScaleAnchor;

use super::find::find_materials;
use super::options::Options;
use super::scale::TELLING_SPREAD;
use crate::appearance::FoundMaterials;
use crate::error::DecomposeError;
use crate::illumination::environment;
use crate::observation::Sample;
use crate::state::{BaseColorAnchor, Illumination, State};

/// Takes `light` to the scale that known base colors, else highlights and what is usual tell, and finds materials anew: the
/// scale moves what is a highlight and what is not. `systematic` is the least error of what highlights tell, log units.
///
/// # Errors
/// When a pixel whose base color is given shows no surface.
pub(crate) fn rescale(
    state: &State<'_>,
    light: &mut Illumination,
    systematic: f32,
    options: &Options,
) -> Result<(), DecomposeError> {
    let (inputs, seen) = (state.inputs, &state.observed);
    let position = |a: &_| known_position(a, state);
    let anchors: Vec<(Vec3, Vec3)> =
        inputs.known.anchors.iter().map(position).collect::<Result<_, _>>()?;
    let scale = &light.materials.scale;
    let by_base = anchored(&seen.samples, &light.materials, &anchors);
    light.anchor = match by_base {
        Some(_) => ScaleAnchor::AlbedoAnchor,
        None if light.anchor == ScaleAnchor::Sky => ScaleAnchor::Sky,
        None if scale.log_spread < TELLING_SPREAD => ScaleAnchor::Specular,
        None => ScaleAnchor::Prior,
    };
    let on_light = by_base.unwrap_or_else(|| match light.anchor {
        ScaleAnchor::Sky => Vec3::splat(scale.least.max(0.0).exp()),
        _ => scale.factor(systematic),
    });
    light.base_color_factor /= on_light;
    light.cells.iter_mut().for_each(|cells| cells.scale(on_light));
    light.lights = light.cells.iter().map(environment).collect();
    light.materials = find_materials(state, light, options);
    Ok(())
}

fn known_position(
    anchor: &BaseColorAnchor,
    state: &State<'_>,
) -> Result<(Vec3, Vec3), DecomposeError> {
    let position = anchor.position(state.inputs.photos, &state.observed.scene)?;
    Ok((position, anchor.base_color_linear))
}

/// Factor on the light that makes the base colors at anchors what they are known to be.
fn anchored(samples: &[Sample], found: &FoundMaterials, anchors: &[(Vec3, Vec3)]) -> Option<Vec3> {
    let mut sum = Vec3::ZERO;
    for (position, known) in anchors {
        let mut near: Vec<(f32, usize)> = samples
            .iter()
            .enumerate()
            .map(|(p, s)| ((s.position - *position).length_squared(), p))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let few = &near[..near.len().min(8)];
        let mean = few.iter().map(|(_, p)| found.base_color_linear[*p]).sum::<Vec3>()
            / few.len().max(1) as f32;
        sum += Vec3::from(
            (mean.max(Vec3::splat(1e-3)) / known.max(Vec3::splat(1e-3))).to_array().map(f32::ln),
        );
    }
    (!anchors.is_empty()).then(|| Vec3::from((sum / anchors.len() as f32).to_array().map(f32::exp)))
}
