//! Gaussians fitted to the photos through the shading that was found.

mod options;
mod photo_fit;

use crate::error::DecomposeError;
use crate::progress::Tick;
use crate::state::State;
use photo_fit::PhotoFit;

pub use options::Options;

/// Fits shapes, opacities, base colors and captured colors of the Gaussians. Without steps they stay.
///
/// # Errors
/// What `tick` says.
pub fn run(
    state: &mut State<'_>,
    options: &Options,
    tick: &mut Tick<'_>,
) -> Result<(), DecomposeError> {
    if options.photo_steps == 0 {
        return Ok(());
    }
    let inputs = state.inputs;
    let fit = PhotoFit {
        views: &state.observed.views,
        shadings: &state.shading,
        render: &inputs.render,
        seed: inputs.seed,
    };
    let base = &state.base_colored.gaussians;
    let (captured, base) = fit.fit(inputs.gaussians, base, options.photo_steps, tick)?;
    state.refined = Some(captured);
    state.base_colored.gaussians = base;
    Ok(())
}
