//! Steps that change a selection as it is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Changes the selection as it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "post", rename_all = "kebab-case")]
pub enum PostDocument {
    /// Everything that does not belong.
    Invert,
    /// And what is nearer to it than a distance.
    Grow {
        /// World units.
        distance: f64,
    },
    /// Less what is nearer to the outside than a distance.
    Shrink {
        /// World units.
        distance: f64,
    },
}
