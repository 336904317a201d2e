//! The pages that stages write: contents in, one HTML document out.

mod lab;
mod relight;

pub use lab::{LabPage, LabRun, LabView};
pub use relight::{RelightPage, RelightStep, RelightTerm, RelightView};
