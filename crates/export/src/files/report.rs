//! What the stage `export` says when it is done.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use super::{AssetReport, BatchReport, ExportFormat, VerifyReport};

/// What the stage says.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Outcome {
    /// Of Gaussians.
    Splat(Box<ExportReport>),
    /// Of many files of Gaussians.
    Batch(Box<BatchReport>),
    /// Of cameras.
    Cameras(CameraReport),
    /// Of a page, a mesh, a shadow.
    Asset(Box<AssetReport>),
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Splat(report) => report.fmt(f),
            Self::Asset(report) => report.fmt(f),
            Self::Batch(report) => report.fmt(f),
            Self::Cameras(report) => {
                write!(f, "{} poses in {}", report.poses, report.output.display())
            }
        }
    }
}

/// The report about cameras.
#[derive(Clone, Debug, Serialize)]
pub struct CameraReport {
    /// What was written.
    pub format: ExportFormat,
    /// Where.
    pub output: PathBuf,
    /// Poses written.
    pub poses: usize,
}

/// The report about Gaussians.
#[derive(Clone, Debug, Serialize)]
pub struct ExportReport {
    /// What was written.
    pub format: ExportFormat,
    /// Where.
    pub output: PathBuf,
    /// Gaussians written.
    pub gaussians: usize,
    /// SH degree of the source.
    pub sh_degree: u8,
    /// Rows with NaN or infinite values that were left out.
    pub dropped_invalid: usize,
    /// Rows that were left out as too faint.
    pub dropped_faint: usize,
    /// Bytes of the product; null for standard output.
    pub bytes: Option<u64>,
    /// Bytes per Gaussian; null for standard output.
    pub bytes_per_gaussian: Option<f64>,
    /// CPU seconds of all threads for writing; null where the system does not tell.
    pub cpu_seconds_write: Option<f64>,
    /// Pictures of the product against those of the source; null without `--verify`.
    pub verify: Option<VerifyReport>,
}

impl fmt::Display for ExportReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.output.display();
        write!(f, "{} Gaussians of SH degree {} in {name}", self.gaussians, self.sh_degree)?;
        if let (Some(bytes), Some(each)) = (self.bytes, self.bytes_per_gaussian) {
            write!(f, ": {:.2} MB, {each:.1} bytes each", bytes as f64 / 1e6)?;
        }
        for (count, what) in [(self.dropped_invalid, "invalid"), (self.dropped_faint, "faint")] {
            if count > 0 {
                write!(f, "\n{count} {what} Gaussians were left out")?;
            }
        }
        if let Some(verify) = &self.verify {
            write!(f, "\n{verify}")?;
        }
        Ok(())
    }
}
