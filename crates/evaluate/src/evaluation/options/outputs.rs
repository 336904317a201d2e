//! What an evaluation leaves behind, as flags.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

/// Files to write.
#[derive(Args, Clone, Debug, Default, Serialize)]
#[command(next_help_heading = "Outputs")]
pub struct EvaluationOutputs {
    /// Write scores and protocol as a motes/metrics document
    #[arg(long, value_name = "FILE.json")]
    pub metrics: Option<PathBuf>,

    /// Write a self-contained HTML page
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,

    /// Maximum number of views shown on the page, evenly spread
    #[arg(long, value_name = "N", default_value_t = 24)]
    pub report_views: usize,

    /// Report of train-splat --metrics, for the training curves of the page
    #[arg(long, value_name = "FILE.json", requires = "report")]
    pub training: Option<PathBuf>,

    /// Save the renders of the first model as PNG
    #[arg(long, value_name = "DIR")]
    pub save_renders: Option<PathBuf>,
}

impl EvaluationOutputs {
    /// The paths that will be written.
    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        [&self.metrics, &self.report, &self.save_renders].into_iter().flatten()
    }
}
