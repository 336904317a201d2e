//! `train-report.json`: how a fit of `train-splat` went.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::documents::Document;

/// How a fit went: its size and scores, its curve, and the evidence for the components of the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes train report")]
pub struct TrainReportDocument {
    /// `motes/train-report`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Whether all steps were done.
    #[serde(default)]
    pub complete: bool,
    /// Steps done.
    #[serde(default)]
    pub iterations: u32,
    /// Gaussians written.
    #[serde(default)]
    pub gaussians: u64,
    /// Training photos.
    #[serde(default)]
    pub train_views: u64,
    /// Held-out photos.
    #[serde(default)]
    pub test_views: u64,
    /// Training photos scored: all, unless time was short.
    #[serde(default)]
    pub train_views_scored: u64,
    /// Held-out photos scored.
    #[serde(default)]
    pub test_views_scored: u64,
    /// Mean PSNR of the training photos, dB (8-bit renders, mean of views); null when none was scored.
    #[serde(default)]
    pub psnr_train: Option<f64>,
    /// The same for the held-out photos.
    #[serde(default)]
    pub psnr_test: Option<f64>,
    /// `psnr_train - psnr_test`, dB.
    #[serde(default)]
    pub psnr_gap: Option<f64>,
    /// Wall seconds of the whole stage.
    #[serde(default)]
    pub seconds: f64,
    /// CPU seconds of the whole stage; null where the system does not tell.
    #[serde(default)]
    pub cpu_seconds: Option<f64>,
    /// Peak resident memory, bytes.
    #[serde(default)]
    pub peak_memory_bytes: Option<u64>,
    /// Whether per-photo exposures were fitted.
    #[serde(default)]
    pub exposure: bool,
    /// Spread of the photos' log gains; 0 where it was not measured.
    #[serde(default)]
    pub exposure_gain_spread: f64,
    /// Whether the fit is usable, and what it is judged by. For people: its keys may change with any version.
    #[serde(default)]
    pub verdict: Map<String, Value>,
    /// Components of the model, with the evidence.
    #[serde(default)]
    pub model: TrainedModel,
    /// Length that learning rates refer to, world units.
    #[serde(default)]
    pub extent: f64,
    /// The numbers of the run, by name of the option. For people: its keys may change with any version.
    #[serde(default)]
    pub plan: Map<String, Value>,
    /// Wall seconds, by name of the phase.
    #[serde(default)]
    pub phases: BTreeMap<String, f64>,
    /// Where the time went, with `--profile`. For people: its keys may change with any version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<Map<String, Value>>,
    /// What became of `--target`. For people: its keys may change with any version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<Map<String, Value>>,
    /// The training curve, in the order of the steps.
    pub history: Vec<TrainingPoint>,
}

impl Document for TrainReportDocument {
    const FORMAT: &'static str = "motes/train-report";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 0;
}

/// A point of the training curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrainingPoint {
    /// Steps done.
    pub step: u32,
    /// Gaussians.
    pub gaussians: u64,
    /// Mean loss since the last point.
    pub loss: f64,
    /// Held-out PSNR, dB, when it was evaluated here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub psnr_test: Option<f64>,
    /// Wall seconds since the fit began.
    pub seconds: f64,
}

/// Components of the model, with the evidence.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrainedModel {
    /// Every component, in the order of the decisions.
    #[serde(default)]
    pub components: Vec<ComponentDecision>,
    /// What each probed component costs a run that has it.
    #[serde(default)]
    pub costs: Vec<ComponentCost>,
    /// What every probe took; empty after a resume past them.
    #[serde(default)]
    pub probes: Vec<ProbeCost>,
    /// CPU seconds of all probes.
    #[serde(default)]
    pub probe_cpu_seconds: f64,
    /// Their share of all CPU seconds.
    #[serde(default)]
    pub probe_share: Option<f64>,
}

/// A component of the model: what is in, and why.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ComponentDecision {
    /// `sh-degree`, `exposure`, `background-model`, ...: the flag that overrides it where there is one.
    pub component: String,
    /// The value in use.
    pub kept: String,
    /// `probe`, `rule`, `flag` or `measured`.
    pub by: String,
    /// A sentence with the numbers.
    pub reason: String,
    /// What was measured, for `by` = `probe`.
    #[serde(default)]
    pub candidates: Vec<ComponentCandidate>,
}

/// An alternative that was measured against the one before it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ComponentCandidate {
    /// The value of the flag that would force it.
    pub value: String,
    /// What it was compared with.
    pub against: String,
    /// Held-out PSNR of the probe without it, dB (after color correction for exposures).
    pub psnr_without: f64,
    /// The same with it.
    pub psnr_with: f64,
    /// Gain of held-out log-likelihood, extended to all photos, nats.
    pub evidence_nats: f64,
    /// Its standard error.
    pub error_nats: f64,
    /// What its parameters cost, nats.
    pub cost_nats: f64,
    /// Parameters that it adds at the time of the probe.
    pub parameters: u64,
    /// Whether evidence less cost exceeds the standard error.
    pub pays: bool,
}

/// What a component costs a run that has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ComponentCost {
    /// Component and value.
    pub name: String,
    /// Parameters that it added when it was probed.
    pub parameters: u64,
    /// CPU seconds: a lower bound, from the probe.
    pub cpu_seconds: f64,
}

/// What a probe took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ProbeCost {
    /// Component and value, as in `sh-degree 3`.
    pub name: String,
    /// Optimizer steps.
    pub steps: u32,
    /// CPU seconds, the measurement included.
    pub cpu_seconds: f64,
}
