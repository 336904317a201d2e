//! `metrics.json`: how close renders are to photos, and the whole protocol of measuring it.

use motes_scene::{Split, SplitChoice};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::documents::Document;

/// Scores of a model against the photos of a capture.
///
/// The top-level scores are the means over the views of `split`, so that the common question has
/// a short answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes metrics")]
pub struct MetricsDocument {
    /// `motes/metrics`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Split that the top-level scores are about.
    pub split: SplitChoice,
    /// Means over the views of `split`.
    #[serde(flatten)]
    pub mean: Scores,
    /// Training PSNR minus test PSNR, dB; null unless both were measured.
    #[serde(default)]
    pub gap: Option<f64>,
    /// How everything was measured.
    pub protocol: Protocol,
    /// Number of Gaussians of the model.
    #[serde(default)]
    pub gaussians: Option<u64>,
    /// Every measured view, in the order of the capture.
    pub views: Vec<ViewMetrics>,
    /// Means over the training views, when they were measured.
    #[serde(default)]
    pub train: Option<Scores>,
    /// Means over the test views, when they were measured.
    #[serde(default)]
    pub test: Option<Scores>,
    /// The same measured on models of several seeds.
    #[serde(default)]
    pub seeds: Option<SeedMetrics>,
}

impl Document for MetricsDocument {
    const FORMAT: &'static str = "motes/metrics";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 1;
}

/// Scores of a view, or means over views. Null where no pixel counts or nothing was measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scores {
    /// Peak signal-to-noise ratio of the 8-bit render, dB.
    #[serde(default)]
    pub psnr: Option<f64>,
    /// PSNR of the render before rounding, clamped to [0, 1], dB.
    #[serde(default)]
    pub psnr_float: Option<f64>,
    /// PSNR after the color correction of the protocol, dB.
    #[serde(default)]
    pub psnr_color_corrected: Option<f64>,
    /// Structural similarity of the 8-bit render.
    #[serde(default)]
    pub ssim: Option<f64>,
    /// Perceptual distance of the 8-bit render.
    #[serde(default)]
    pub lpips: Option<f64>,
}

/// Scores of one view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ViewMetrics {
    /// Name of the view in the capture.
    pub name: String,
    /// Its role in the capture.
    pub split: Split,
    /// Its scores.
    #[serde(flatten)]
    pub scores: Scores,
    /// Share of pixels that count, in [0, 1].
    #[serde(default = "all_of_it")]
    pub counted_share: f64,
}

fn all_of_it() -> f64 {
    1.0
}

/// How scores are measured. Everything that changes a number is named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Protocol {
    /// How training and test views were told apart, in words.
    pub split_rule: String,
    /// Width and height of the renders, pixels, when all views have one size.
    #[serde(default)]
    pub size_px: Option<[u64; 2]>,
    /// How photos were brought to that size: the name of a filter, or `none`.
    pub resize_filter: String,
    /// What stands behind transparent photos and renders: sRGB-encoded, in [0, 1].
    pub background: [f64; 3],
    /// What sets the brightness of the renders.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view_exposure: Option<String>,
    /// What becomes of masked pixels.
    pub masks: String,
    /// How a mean is taken over views.
    pub mean: String,
    /// PSNR.
    pub psnr: PsnrProtocol,
    /// SSIM.
    pub ssim: SsimProtocol,
    /// LPIPS; null when it was not measured.
    #[serde(default)]
    pub lpips: Option<LpipsProtocol>,
    /// Why LPIPS was not measured.
    #[serde(default)]
    pub lpips_reason: Option<String>,
}

/// How PSNR is measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PsnrProtocol {
    /// Value of a channel at full intensity.
    pub peak: f64,
    /// Encoding of the compared values: `sRGB`.
    pub encoding: String,
    /// Bits to which `psnr` rounds the render.
    pub bits: u64,
    /// Written for equal images, dB: JSON has no infinity.
    pub cap_db: f64,
    /// What `psnr_color_corrected` fits to each view before it compares.
    pub color_correction: String,
}

/// How SSIM is measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SsimProtocol {
    /// Side of the Gaussian window, pixels.
    pub window_px: u64,
    /// Standard deviation of the window, pixels.
    pub sigma_px: f64,
    /// First stabilizer, K1.
    pub k1: f64,
    /// Second stabilizer, K2.
    pub k2: f64,
    /// `same`: zeros around the image (INRIA); `valid`: only windows inside it.
    pub border: String,
}

/// How LPIPS is measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LpipsProtocol {
    /// Backbone: `vgg` or `alex`.
    pub network: String,
    /// Range of the values that the network sees: `[-1, 1]`, or `[0, 1]` as INRIA's script has it.
    pub input_range: String,
    /// SHA-256 of the file of weights.
    pub weights_sha256: String,
}

/// Scores over models that differ only in their seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SeedMetrics {
    /// One row per seed.
    pub rows: Vec<SeedRow>,
    /// Mean over the rows.
    pub mean: Scores,
    /// Sample standard deviation over the rows (n - 1), 0 for one row.
    pub deviation: Scores,
}

/// Scores of the model of one seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SeedRow {
    /// The seed; null when the model does not say.
    #[serde(default)]
    pub seed: Option<u64>,
    /// The model, as given.
    pub gaussians: String,
    /// Means over the views of the document's split.
    #[serde(flatten)]
    pub scores: Scores,
    /// Training PSNR minus test PSNR, dB.
    #[serde(default)]
    pub gap: Option<f64>,
}

/// The value, or nothing where it is NaN or infinite: JSON has no word for those.
pub fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
