//! Sentences about fits that fail.

use crate::{Failure, PoseCheck};

/// The sentence for poses that contradict the photos.
pub(super) fn contradiction(poses: &PoseCheck) -> String {
    format!(
        "the poses contradict the photos: only {} of {} matches between photos that look alike lie \
         where the poses say; check that every photo has its own pose (file names, order) and the \
         convention of the poses, or find them again with import-colmap --photos",
        poses.agreeing, poses.matches
    )
}

/// The sentence for a failure, to follow the name of the photos.
pub(super) fn what_is_wrong(failure: &Failure) -> String {
    match failure {
        Failure::Empty => "no Gaussian is left".into(),
        Failure::BlankPhotos => "there is nothing to see: each shows one color".into(),
        Failure::FlatAlpha => {
            "the opacity is the same everywhere, where the photos have an outline".into()
        }
        Failure::BelowBaseline { psnr, needed } => format!(
            "the fit has {psnr:.2} dB, and a picture without any shape (one color or a blur per \
             photo) {needed:.2} dB"
        ),
    }
}
