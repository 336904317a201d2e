//! Evaluation: sets of renders against the photos of a capture, under a stated protocol.

mod options;
mod protocol;
mod report;
mod results;
mod run;

pub use options::{EvaluationOptions, EvaluationOutputs};
pub use protocol::{protocol, protocol_words};
pub use report::EvaluationReport;
pub use results::{GateResult, Results};
pub use run::{Contestant, Course, ScoredView};
