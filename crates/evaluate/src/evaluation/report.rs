//! The report of the stage: the metrics document, and a table for people.

use motes_scene::SplitChoice;
use std::fmt;

use motes_formats::metrics::{MetricsDocument, Scores, ViewMetrics};
use serde::Serialize;

/// A metrics document that can be printed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct EvaluationReport(pub MetricsDocument);

impl fmt::Display for EvaluationReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let document = &self.0;
        let longest = document.views.iter().map(|view| view.name.chars().count()).max();
        let width = longest.unwrap_or(0).max(12);
        let columns = ["PSNR", "float", "corrected", "SSIM", "LPIPS"];
        write!(f, "{:width$}  split", "view")?;
        for column in columns {
            write!(f, " {column:>9}")?;
        }
        writeln!(f)?;
        for ViewMetrics { name, split, scores, .. } in &document.views {
            row(f, &format!("{name:width$}"), split.name(), scores)?;
        }
        let name = if document.seeds.is_some() { "mean, models" } else { "mean" };
        row(f, &format!("{name:width$}"), document.split.name(), &document.mean)?;
        if let Some(seeds) = &document.seeds {
            row(f, &format!("{:width$}", "deviation"), document.split.name(), &seeds.deviation)?;
        }
        let other = match document.split {
            SplitChoice::Train => None,
            _ => document.train.map(|scores| ("train", scores)),
        };
        if let Some((split, scores)) = other {
            row(f, &format!("{:width$}", "mean"), split, &scores)?;
        }
        if let Some(gap) = document.gap {
            writeln!(f, "gap (train PSNR minus test PSNR): {gap:.2} dB")?;
        }
        Ok(())
    }
}

fn row(f: &mut fmt::Formatter<'_>, name: &str, split: &str, scores: &Scores) -> fmt::Result {
    write!(f, "{name}  {split:5}")?;
    let values = [
        (scores.psnr, 2),
        (scores.psnr_float, 2),
        (scores.psnr_color_corrected, 2),
        (scores.ssim, 4),
        (scores.lpips, 4),
    ];
    for (value, decimals) in values {
        match value {
            Some(value) => write!(f, " {value:9.decimals$}")?,
            None => write!(f, " {:>9}", "-")?,
        }
    }
    writeln!(f)
}
