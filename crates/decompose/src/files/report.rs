//! What `decompose` says when it is done.

use std::fmt;
use std::path::PathBuf;

use crate::steps::surface::GeometryReport;
use motes_formats::decomposition::{DecompositionDocument, StepTimeDocument};
use motes_protocol::ProviderUse;
use serde::Serialize;

/// What a run of `decompose` came to.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum DecomposeReport {
    /// A scene.
    Scene(Box<SceneReport>),
    /// Steps of one, in a work folder.
    Steps(StepsReport),
}

/// What was found, and how.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// The scene folder.
    pub output: PathBuf,
    /// The document that was written.
    pub decomposition: DecompositionDocument,
    /// How the surface was found.
    pub geometry: GeometryReport,
    /// Points that light and material were fitted to.
    pub samples: usize,
    /// Cells of the light after every round.
    pub light_cells: Vec<usize>,
    /// CPU seconds of all threads; null where the system does not tell.
    pub cpu_seconds: Option<f64>,
    /// Mean PSNR of the training views under the light that was found, dB, over the pixels that the Gaussians cover and no mask hides,
    /// whether the surface is met there or not.
    pub train_psnr_db: Option<f64>,
    /// The same for held-out views; where the exposures of training photos were found, after one gain per channel that is fitted to
    /// each of them (least squares, linear).
    pub test_psnr_db: Option<f64>,
    /// Number of held-out views that were looked at.
    pub test_views: usize,
    /// Who predicted normals and base colors, where a provider did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub provider: Option<ProviderUse>,
}

/// What was done up to a step.
#[derive(Clone, Debug, Serialize)]
pub struct StepsReport {
    /// The work folder.
    pub work: PathBuf,
    /// The steps that ran, with their times.
    pub step_times: Vec<StepTimeDocument>,
    /// The step to go on from.
    pub next: Option<String>,
}

impl fmt::Display for DecomposeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scene(report) => report.fmt(f),
            Self::Steps(report) => report.fmt(f),
        }
    }
}

impl fmt::Display for SceneReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let d = &self.decomposition;
        let db = |v: Option<f64>| v.map_or("none".into(), |v| format!("{v:.2} dB"));
        writeln!(
            f,
            "{} triangles, light of {} cells; the model alone, without captured colors: train {}, test {} (held-out photos: {})",
            d.counts.triangles,
            self.light_cells.last().copied().unwrap_or(0),
            db(self.train_psnr_db),
            db(self.test_psnr_db),
            self.test_views
        )?;
        writeln!(f, "scale: {}", d.scale_anchor.explanation)?;
        for term in &d.terms {
            writeln!(
                f,
                "{} {}: {}",
                if term.kept { "kept" } else { "left out" },
                term.name,
                term.evidence
            )?;
        }
        writeln!(f, "scene: {}", self.output.display())
    }
}

impl fmt::Display for StepsReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for time in &self.step_times {
            writeln!(f, "{}: {:.1} s", time.step, time.seconds)?;
        }
        let work = self.work.display();
        match &self.next {
            Some(next) => writeln!(f, "go on with: --from {next} --work {work}"),
            None => writeln!(f, "all steps are in {work}"),
        }
    }
}
