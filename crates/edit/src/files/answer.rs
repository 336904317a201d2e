//! What an edit answers.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::plan::{EditRecord, SkipRecord, StepRecord};
use crate::refit::RefitReport;
use crate::reshade::ReshadeReport;
use motes_protocol::ProviderUse;
use serde::Serialize;

/// What an edit answers: also of a dry run, which writes nothing.
#[derive(Clone, Debug, Serialize)]
pub struct EditAnswer {
    /// The splat or scene folder.
    pub output: PathBuf,
    /// The plan as executed; none beside standard output.
    pub log: Option<PathBuf>,
    /// Gaussians before.
    pub gaussians_before: usize,
    /// Gaussians after.
    pub gaussians: usize,
    /// Operations that changed something or answered.
    pub applied: Vec<StepRecord>,
    /// Operations that did not, and why.
    pub skipped: Vec<SkipRecord>,
    /// What may be wrong.
    pub warnings: Vec<String>,
    /// Pictures that were written.
    pub thumbnails: Vec<PathBuf>,
    /// What light did; null where it had nothing to follow.
    pub light: Option<ReshadeReport>,
    /// What the fit of fillings did; null where there was none.
    pub refit: Option<RefitReport>,
    /// Who edited pictures, where a provider did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub provider: Option<ProviderUse>,
    /// Of all threads.
    pub cpu_seconds: Option<f64>,
}

impl EditAnswer {
    /// What the record of an edit says; `gaussians` before and after it.
    pub(super) fn new(
        output: &Path,
        log: Option<&Path>,
        gaussians: [usize; 2],
        record: &EditRecord,
    ) -> Self {
        let [gaussians_before, gaussians] = gaussians;
        Self {
            output: output.to_owned(),
            log: log.map(Path::to_owned),
            gaussians_before,
            gaussians,
            applied: record.applied.clone(),
            skipped: record.skipped.clone(),
            warnings: record.warnings.clone(),
            thumbnails: Vec::new(),
            light: None,
            refit: None,
            provider: None,
            cpu_seconds: None,
        }
    }
}

impl fmt::Display for EditAnswer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (before, after) = (self.gaussians_before, self.gaussians);
        writeln!(f, "{before} Gaussians became {after}: {}", self.output.display())?;
        for step in &self.applied {
            writeln!(
                f,
                "  {:<8} {:<16} {:>9} of {}",
                step.at, step.op, step.gaussians, step.total
            )?;
            for (name, value) in &step.numbers {
                match value {
                    Some(value) => writeln!(f, "    {name} {value:.6}")?,
                    None => writeln!(f, "    {name} -")?,
                }
            }
        }
        for skip in &self.skipped {
            writeln!(f, "  {:<8} {:<16} skipped: {}", skip.at, skip.op, skip.why)?;
        }
        if let Some(light) = &self.light {
            let (scaled, shaded, filled) = (light.scaled, light.shaded, light.filled);
            writeln!(
                f,
                "light: {scaled} Gaussians scaled, {shaded} shaded anew, {filled} fill holes"
            )?;
        }
        if let Some(refit) = &self.refit {
            let (gaussians, views, [was, is]) = (refit.gaussians, refit.views, refit.residual);
            let share = 100.0 * refit.photo_share;
            writeln!(
                f,
                "fit: {gaussians} Gaussians to {views} photos, believed in {share:.0} % of the pixels: {was:.4} to {is:.4}"
            )?;
        }
        Ok(())
    }
}
