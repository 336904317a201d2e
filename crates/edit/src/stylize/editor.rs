//! Who edits the pictures.

use motes_formats::FormatError;
use motes_protocol::ProviderError;
use motes_scene::ImageF32;
use thiserror::Error;

/// A view that is to be edited.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// Name of the view.
    pub view: &'a str,
    /// `[h, w, 3]`, sRGB-encoded: the view before any edit.
    pub original: &'a ImageF32,
    /// The view as it is now.
    pub current: &'a ImageF32,
}

/// How far a round of edits may go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// Share of noise that a diffusion model starts from, 0 to 1.
    pub noise: f64,
    /// Of models that draw random numbers; the same for all views of a round.
    pub seed: u64,
}

/// Edits pictures of views of one scene.
pub trait PictureEditor {
    /// The edited pictures, in order, of the same sizes. Those that come together are to be edited alike.
    ///
    /// # Errors
    /// Whatever keeps it from that; the user asked to stop.
    fn edit(
        &self,
        prompt: &str,
        pictures: &[Picture<'_>],
        round: Round,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<ImageF32>, EditorError>;
}

/// Why the editor failed.
#[derive(Debug, Error)]
pub enum EditorError {
    /// The command line has an open quote or no word.
    #[error("the command line of the editor is empty or has an open quote: {0}")]
    Words(String),
    /// It cannot be started.
    #[error("cannot start {program}: {source}")]
    Start {
        /// Its first word.
        program: String,
        /// What the system answered.
        source: std::io::Error,
    },
    /// It ended with an error.
    #[error("the editor failed on {view} ({status}): {said}")]
    Failed {
        /// The view.
        view: String,
        /// How it ended.
        status: String,
        /// The last line of its error output.
        said: String,
    },
    /// It ended well, but there is no picture.
    #[error("the editor wrote no picture for {view} at the place that {{output}} stands for")]
    NoPicture {
        /// The view.
        view: String,
    },
    /// The picture that it wrote has another size.
    #[error("the editor made {width} x {height} pixels of {view}: pictures keep their size")]
    Size {
        /// The view.
        view: String,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The user asked to stop.
    #[error("interrupted")]
    Stopped,
    /// A picture cannot be written or read.
    #[error(transparent)]
    Picture(#[from] FormatError),
    /// The provider gives no answer.
    #[error(transparent)]
    Provider(ProviderError),
}

impl From<ProviderError> for EditorError {
    fn from(error: ProviderError) -> Self {
        match error {
            ProviderError::Stopped => Self::Stopped,
            other => Self::Provider(other),
        }
    }
}
