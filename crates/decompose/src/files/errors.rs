//! Errors of the steps as the user should see them.

use motes_stage::StageError;

use crate::error::DecomposeError;

/// An error of the library as the user should see it.
pub(super) fn explained(error: &DecomposeError) -> StageError {
    let text = error.to_string();
    match error {
        DecomposeError::Canceled => StageError::interrupted("interrupted: no scene was written"),
        DecomposeError::NoSurface => {
            StageError::bad_input(text).help("train with more photos, or pass --surface")
        }
        DecomposeError::NothingSeen(_) => StageError::bad_input(text).help(
            "check that capture and Gaussians belong together, and that masks leave something",
        ),
        DecomposeError::AnchorMissesSurface(_) => StageError::usage(text),
        DecomposeError::Mesh(_) | DecomposeError::Relight(_) => StageError::bad_input(text),
    }
}
