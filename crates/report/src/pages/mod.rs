//! The pages that stages write: contents in, one HTML document out.

mod evaluation;
mod lab;

pub use evaluation::{EvaluationPage, ModelScores, PictureChoice, ViewPictures};
pub use lab::{LabPage, LabRun, LabView};
