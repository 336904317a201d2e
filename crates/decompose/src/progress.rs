//! Progress of a step.

use crate::error::DecomposeError;

/// Called with the share of a step that is done, 0 to 1. An error ends the step.
pub type Tick<'a> = dyn FnMut(f32) -> Result<(), DecomposeError> + 'a;
