//! Files of `decompose`: photos and what is known beforehand, the scene folder, the report.

mod command;
mod inputs;
mod outputs;
mod priors;
mod report;
mod request;
mod residual;

pub use command::{Args, run};
pub use inputs::{KnownArgs, LightConvention};
pub use report::DecomposeReport;
pub use request::Request;
