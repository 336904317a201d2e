//! Values that are flags too.

use clap::ValueEnum;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What happens to shadows on a plain splat, whose light is not known.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake")]
pub enum ShadowMode {
    /// They stay where they are.
    #[default]
    None,
    /// The darkening of the ground beside an object goes with it.
    Ratio,
}
