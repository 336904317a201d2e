//! A segmenter of single pictures, such as SAM behind a provider.

use crate::error::SelectError;
use crate::source::SelectSource;

/// A prompt for one view, in pixels of its working size.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PicturePrompt {
    /// Points, and whether each is on the object.
    pub points: Vec<([f64; 2], bool)>,
    /// Left, top, right and bottom of a rectangle around the object.
    pub around: Option<[f64; 4]>,
    /// Where the object is thought to be: columns, rows, and logits over the whole picture.
    pub logits: Option<(usize, usize, Vec<f32>)>,
}

/// What a segmenter answers.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureMask {
    /// Share of each pixel of the working size that belongs, 0 to 1.
    pub mask: Vec<f32>,
    /// Intersection over union that the segmenter expects, 0 to 1.
    pub predicted_iou: f64,
}

/// Makes masks of one object in one picture.
pub trait PictureSegmenter: Sync {
    /// Up to three masks, the largest first, of a view of the capture.
    ///
    /// # Errors
    /// The view has no picture, or the segmenter fails.
    fn segment(
        &self,
        source: &SelectSource<'_>,
        view: usize,
        prompt: &PicturePrompt,
    ) -> Result<Vec<PictureMask>, SelectError>;
}
