//! What a provider says about itself.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ProviderKind, Quantity};
use crate::documents::Document;

/// What a provider says about itself: the answer to `--describe`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes provider")]
pub struct ProviderDescription {
    /// `motes/provider`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Name of the program, for messages and run records.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Version of the program.
    #[serde(default)]
    pub program_version: String,
    /// What it can be asked for.
    #[schemars(length(min = 1))]
    pub kinds: Vec<ProviderKind>,
    /// Of the kind `predict`: the maps that it makes; all of them when absent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub quantities: Vec<Quantity>,
    /// The models behind it.
    #[serde(default)]
    pub models: Vec<ModelDescription>,
    /// Whether the same request always has the same reply, byte for byte.
    #[serde(default)]
    pub deterministic: bool,
    /// Shortest side of a picture that it takes, pixels.
    #[serde(default = "one")]
    #[schemars(range(min = 1))]
    pub smallest_side_px: u64,
    /// Longest side of a picture that it takes, pixels.
    #[serde(default = "most")]
    #[schemars(range(min = 1))]
    pub largest_side_px: u64,
}

fn one() -> u64 {
    1
}

fn most() -> u64 {
    32_768
}

impl Document for ProviderDescription {
    const FORMAT: &'static str = "motes/provider";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 1;
}

impl ProviderDescription {
    /// A provider of these kinds that takes pictures of any size.
    pub fn new(name: &str, program_version: &str, kinds: &[ProviderKind]) -> Self {
        Self {
            format: Self::FORMAT.into(),
            version: Self::version(),
            name: name.into(),
            program_version: program_version.into(),
            kinds: kinds.into(),
            quantities: Vec::new(),
            models: Vec::new(),
            deterministic: false,
            smallest_side_px: one(),
            largest_side_px: most(),
        }
    }
}

/// A file of weights.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ModelDescription {
    /// What it is called: `mobile_sam.onnx`.
    #[schemars(length(min = 1))]
    pub id: String,
    /// SHA-256 of the weights, hexadecimal; null for a model that is not on this machine.
    #[serde(default)]
    pub sha256: Option<String>,
    /// License of the weights: an SPDX identifier where there is one, otherwise `unknown` or its name.
    pub license: String,
}
