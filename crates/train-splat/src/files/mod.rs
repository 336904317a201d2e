//! The session around a fit: photos in, steps with progress and checkpoints, report out.

mod checkpoint;
mod command;
mod failure_words;
mod model_report;
mod page;
mod photos;
mod profile;
mod pseudo;
mod report;
mod resumed;
mod scores;
mod session;
mod snapshots;
mod start;
mod verdict;
mod world;

pub use command::{Args, run};
pub use model_report::ModelReport;
pub use photos::load_training_images;
pub use profile::ProfileReport;
pub use pseudo::{PseudoOptions, PseudoReport, PseudoViews};
pub use report::TrainReport;
pub use scores::{Held, Target, TargetOutcome};
pub use session::{Session, SessionEnd, default_checkpoint};
pub use start::{Start, StartRequest, parse_seconds};
pub use verdict::Verdict;
