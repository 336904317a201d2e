//! Files and flags of `decompose`: photos and what is known beforehand, work folder, scene folder, report.

mod command;
mod errors;
mod known;
mod photos;
mod predictions;
mod preset;
mod previews;
mod priors;
mod report;
mod request;
mod scene_folder;
mod verdict;
mod work;

pub use command::{Args, run};
pub use known::KnownArgs;
pub use report::DecomposeReport;
pub use request::Request;
pub use work::StepArgs;
