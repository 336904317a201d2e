//! `meta.json`.

use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
pub(super) struct Meta {
    pub(super) version: u32,
    #[serde(default)]
    pub(super) asset: Asset,
    pub(super) count: u64,
    /// `antialiased` or `2dgs`; absent for classic splats.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) model: Option<String>,
    pub(super) means: Means,
    pub(super) scales: Indexed,
    pub(super) quats: Files,
    pub(super) sh0: Indexed,
    #[serde(default, rename = "shN", skip_serializing_if = "Option::is_none")]
    pub(super) sh_n: Option<Harmonics>,
}

#[derive(Default, Serialize, Deserialize)]
pub(super) struct Asset {
    #[serde(default)]
    pub(super) generator: String,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Means {
    pub(super) mins: [f64; 3],
    pub(super) maxs: [f64; 3],
    pub(super) files: Vec<String>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Indexed {
    pub(super) codebook: Vec<f32>,
    pub(super) files: Vec<String>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Files {
    pub(super) files: Vec<String>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Harmonics {
    pub(super) count: u64,
    pub(super) bands: u8,
    pub(super) codebook: Vec<f32>,
    pub(super) files: Vec<String>,
}

/// What tells `meta.json` of another version.
#[derive(Deserialize)]
pub(super) struct Version {
    pub(super) version: Option<u32>,
}
