//! Curves from what train-splat measured while it ran.

use std::path::Path;

use motes_formats::{FormatError, Result};
use serde::Deserialize;

use crate::svg_plot::{LinePlot, Series};

/// The part of a `motes/train-report` that is drawn.
#[derive(Debug, Deserialize)]
struct TrainReport {
    history: Vec<Row>,
}

#[derive(Debug, Deserialize)]
struct Row {
    step: f64,
    loss: Option<f64>,
    gaussians: Option<f64>,
    psnr_test: Option<f64>,
}

/// Plots of loss, held-out PSNR and number of Gaussians over steps, those that the file has.
///
/// # Errors
/// When the file cannot be read or has no `history`.
pub fn training_plots(path: &Path) -> Result<Vec<LinePlot>> {
    let bytes = std::fs::read(path).map_err(|error| FormatError::io(path, error))?;
    let report: TrainReport = serde_json::from_slice(&bytes).map_err(|error| {
        FormatError::invalid(path, format!("line {}", error.line()), error.to_string())
            .with_remedy("give the file that train-splat --metrics wrote")
    })?;
    let plot = |title: &str, y_label: &str, value: fn(&Row) -> Option<f64>| {
        let points: Vec<(f64, f64)> =
            report.history.iter().filter_map(|row| Some((row.step, value(row)?))).collect();
        (points.len() > 1).then(|| LinePlot {
            title: title.into(),
            x_label: "step".into(),
            y_label: y_label.into(),
            series: vec![Series { name: title.into(), points }],
        })
    };
    let plots = [
        plot("Training loss", "loss", |row| row.loss),
        plot("PSNR on held-out photos", "PSNR, dB", |row| row.psnr_test),
        plot("Gaussians", "number", |row| row.gaussians),
    ];
    Ok(plots.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_have_the_points_that_were_measured() {
        let folder = std::env::temp_dir().join(format!("motes-curves-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("train.json");
        let history = r#"{"format": "motes/train-report", "history": [
            {"step": 0, "gaussians": 10, "loss": 0.5, "seconds": 0.1},
            {"step": 100, "gaussians": 30, "loss": 0.2, "psnr_test": 20.0, "seconds": 1.0}]}"#;
        std::fs::write(&path, history).unwrap();
        let plots = training_plots(&path).unwrap();
        let titles: Vec<&str> = plots.iter().map(|plot| plot.title.as_str()).collect();
        assert_eq!(titles, ["Training loss", "Gaussians"], "one PSNR is no curve");
        assert_eq!(plots[0].series[0].points, [(0.0, 0.5), (100.0, 0.2)]);
        std::fs::write(&path, "{}").unwrap();
        assert!(training_plots(&path).unwrap_err().to_string().contains("history"));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
