//! What the surface is made of: parts of one kind and roughness, and the scale of light against base color.

mod borders;
mod coat;
mod contrast;
mod find;
mod mirrors;
mod options;
mod profile;
mod regions;
mod report;
mod rescale;
mod scale;
mod telling;

use crate::error::DecomposeError;
use crate::progress::Tick;
use crate::state::{Illumination, State};

pub(crate) use find::find_materials;
pub use options::Options;
pub use report::{lobe_terms, part_terms, scale_explanation};
pub(crate) use rescale::rescale;

/// Times that light and materials are brought to one scale.
const ROUNDS: u8 = 2;
/// Least error of what highlights tell about the scale, log units: normals and the shape of the light bend them all alike, so
/// more points do not make them surer.
const SYSTEMATIC: f32 = 0.2;

/// Finds the materials, and with light that was found the scale between the two.
///
/// # Errors
/// When a pixel whose base color is given shows no surface, or `tick` says so.
pub fn run(
    state: &mut State<'_>,
    options: &Options,
    tick: &mut Tick<'_>,
) -> Result<(), DecomposeError> {
    find_again(state, options);
    if state.inputs.known.lights.is_empty() {
        let mut light = take_illumination(state);
        for round in 0..ROUNDS {
            tick(f32::from(1 + round) / f32::from(1 + ROUNDS))?;
            rescale(state, &mut light, SYSTEMATIC, options)?;
        }
        state.illumination = light;
    }
    Ok(())
}

/// Finds the materials on the surface as it is, under the light as it is.
pub(crate) fn find_again(state: &mut State<'_>, options: &Options) {
    let found = find_materials(state, &state.illumination, options);
    state.illumination.materials = found;
}

fn take_illumination(state: &mut State<'_>) -> Illumination {
    std::mem::replace(&mut state.illumination, Illumination::known(Vec::new()))
}
