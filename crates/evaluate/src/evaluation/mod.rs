//! Evaluation: sets of renders against the photos of a capture, under a stated protocol.

mod options;
mod outputs;
mod protocol;
mod report;
mod results;
mod run;

pub use options::{BorderChoice, EvaluationOptions};
pub use outputs::EvaluationOutputs;
pub use protocol::{protocol, protocol_words};
pub use report::EvaluationReport;
pub use results::{GateResult, Results};
pub use run::{Contestant, Course, ScoredView};
