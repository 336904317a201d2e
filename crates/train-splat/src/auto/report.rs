//! What a decision says for itself.

use serde::{Deserialize, Serialize};

/// One alternative that was measured against the one before it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
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
    pub parameters: usize,
    /// Whether `evidence - cost` exceeds the standard error.
    pub pays: bool,
}

/// One component: what is in, and the evidence.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Decision {
    /// `sh-degree`, `exposure`, `background-model`, ...: the flag that overrides it where there is one.
    pub component: String,
    /// The value in use.
    pub kept: String,
    /// `probe`, `rule`, `flag` or `measured`.
    pub by: String,
    /// One sentence with the numbers.
    pub reason: String,
    /// What was measured, for `by = probe`.
    pub candidates: Vec<Candidate>,
}

impl Decision {
    pub(crate) fn new(component: &str, kept: impl ToString, by: &str, reason: String) -> Self {
        Self {
            component: component.into(),
            kept: kept.to_string(),
            by: by.into(),
            reason,
            candidates: Vec::new(),
        }
    }
}

/// What a probe took; not part of a fit's state, since it differs from run to run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ProbeCost {
    /// Component and value, as in `sh-degree 3`.
    pub name: String,
    /// Optimizer steps.
    pub steps: u32,
    /// CPU seconds, the measurement included.
    pub cpu_seconds: f64,
}
