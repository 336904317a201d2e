//! Checking programs that run learned models for stages; `motes-protocol` has the checks.

pub mod files;
