//! When a term that a scene may or may not need is used.

use clap::ValueEnum;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// When a term that a scene may or may not need is used.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
#[value(rename_all = "lower")]
pub enum Switch {
    /// Decided from the data; the report says how.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}
