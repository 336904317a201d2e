//! Why something cannot be selected.

use motes_formats::FormatError;
use thiserror::Error;

/// Why something cannot be selected. The text says the cause, and the remedy on a line that starts with
/// `help:`.
#[derive(Debug, Error)]
pub enum SelectError {
    /// No view has this name.
    #[error("the capture has no view named \"{name}\"\nhelp: its {count} views are {known}")]
    NoSuchView {
        /// What was asked for.
        name: String,
        /// Number of views.
        count: usize,
        /// The first names.
        known: String,
    },
    /// The pixel is not in the picture.
    #[error("pixel {x},{y} is outside view \"{view}\", which has {width}x{height} pixels")]
    PixelOutside {
        /// Name of the view.
        view: String,
        /// Column.
        x: f64,
        /// Row.
        y: f64,
        /// Columns of the view.
        width: usize,
        /// Rows of the view.
        height: usize,
    },
    /// A prompt in pixels needs views.
    #[error("{0} needs the views of a capture\nhelp: give --capture")]
    NoCapture(&'static str),
    /// The camera has distortion.
    #[error(
        "the camera of view \"{0}\" is not a pinhole\nhelp: import the photos with import-colmap, which undistorts them"
    )]
    NotPinhole(String),
    /// No Gaussian is drawn at the pixel.
    #[error("nothing is drawn at pixel {x},{y} of view \"{view}\"\nhelp: click on something solid")]
    NothingThere {
        /// Name of the view.
        view: String,
        /// Column.
        x: f64,
        /// Row.
        y: f64,
    },
    /// A prompt has nothing positive.
    #[error("the prompt does not say what to select\nhelp: give a click without \"-\", or a box")]
    NothingPositive,
    /// The Gaussians lack a column.
    #[error("the Gaussians have no property \"{name}\"\nhelp: they have {known}")]
    NoSuchProperty {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// No plane carries the scene.
    #[error("no support plane was found: no plane holds a fifth of what the views show")]
    NoPlane,
    /// A number makes no sense.
    #[error("{0}")]
    BadValue(String),
    /// A mask has another shape than its view.
    #[error(
        "the mask of view \"{view}\" has {found} pixels, the view {wanted}: {path}\nhelp: masks may be scaled, but must have the aspect ratio of the view"
    )]
    MaskShape {
        /// Name of the view.
        view: String,
        /// Size of the mask.
        found: String,
        /// Size of the view.
        wanted: String,
        /// The file.
        path: String,
    },
    /// The segmenter failed; it says why and what helps.
    #[error("{0}")]
    Segmenter(String),
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// A file cannot be read.
    #[error(transparent)]
    Format(#[from] FormatError),
}
