//! Why there are no masks.

use std::path::PathBuf;

use motes_formats::FormatError;
use thiserror::Error;

/// Why there are no masks. The text says the cause, and the remedy on a line that starts with `help:`.
#[derive(Debug, Error)]
pub enum SamError {
    /// The folder or the file's neighbors are not a pair of encoder and decoder.
    #[error(
        "{cause}: {}\nhelp: SAM in ONNX is two files, an encoder and a decoder: name their folder with --model, or the encoder with --model and the decoder with --decoder",
        path.display()
    )]
    NoPair {
        /// What is missing or too many.
        cause: String,
        /// What was named.
        path: PathBuf,
    },
    /// The file cannot be loaded.
    #[error(
        "the weights cannot be loaded ({cause}): {}\nhelp: {help}",
        path.display()
    )]
    Load {
        /// What the reader says.
        cause: String,
        /// The file.
        path: PathBuf,
        /// What may be wrong with it.
        help: &'static str,
    },
    /// The inputs are not those of a known export.
    #[error(
        "this is not {what}, its inputs are {inputs}: {}\nhelp: known are the exports of segment-anything and samexporter (image_embeddings, point_coords, ...), transformers.js (input_points, input_labels, ...) and SAM 2.1 (image_embed, high_res_feats_0, ...)",
        path.display()
    )]
    Inputs {
        /// What it should be.
        what: &'static str,
        /// What it has.
        inputs: String,
        /// The file.
        path: PathBuf,
    },
    /// Encoder and decoder do not belong together.
    #[error(
        "the decoder needs {missing}, which the encoder does not make: {}\nhelp: use the encoder and decoder of one export of one model",
        path.display()
    )]
    Mismatch {
        /// An input of the decoder.
        missing: String,
        /// The decoder.
        path: PathBuf,
    },
    /// It ran into something.
    #[error("the model failed ({cause}): {}\nhelp: use the encoder and decoder of one export of one model", path.display())]
    Run {
        /// What the engine says.
        cause: String,
        /// The file.
        path: PathBuf,
    },
    /// The request says nothing to segment.
    #[error("the request has neither points nor a box nor logits\nhelp: give one of them")]
    NoPrompt,
    /// A number of the request is none, or out of the picture.
    #[error("{0}")]
    Prompt(String),
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FormatError),
}
