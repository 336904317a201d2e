//! Files of `decompose`: photos and what is known beforehand, the scene folder, the report.

mod inputs;
mod outputs;
mod priors;
mod report;
mod request;
mod residual;

pub use inputs::{KnownArgs, LightConvention};
pub use report::DecomposeReport;
pub use request::Request;
