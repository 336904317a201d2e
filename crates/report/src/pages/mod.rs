//! The pages that stages write: contents in, one HTML document out.

mod evaluation;
mod lab;
mod relight;

pub use evaluation::{EvaluationPage, ModelScores, PictureChoice, ViewPictures};
pub use lab::{LabPage, LabRun, LabView};
pub use relight::{RelightPage, RelightStep, RelightTerm, RelightView};
