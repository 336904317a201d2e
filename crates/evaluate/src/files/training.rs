//! The report of a training.

use std::path::Path;

use motes_formats::Result;
use motes_formats::documents::{Parsed, read_document};
use motes_formats::train_report::TrainReportDocument;

use crate::training_curves::Training;

/// Reads what the page shows.
///
/// # Errors
/// When the file cannot be read or is not a `motes/train-report`.
pub fn read_training(path: &Path) -> Result<Parsed<Training>> {
    let remedy = "give the file that train-splat --metrics wrote";
    let Parsed { document, warnings } =
        read_document::<TrainReportDocument>(path).map_err(|error| error.with_remedy(remedy))?;
    Ok(Parsed { document: Training::of(&document), warnings })
}

#[cfg(test)]
mod tests {
    use motes_figures::html::Cell;

    use super::*;

    #[test]
    fn curves_have_the_points_that_were_measured() {
        let folder = std::env::temp_dir().join(format!("motes-curves-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("train.json");
        let history = r#"{"format": "motes/train-report", "version": "1.0", "history": [
            {"step": 0, "gaussians": 10, "loss": 0.5, "seconds": 0.1},
            {"step": 100, "gaussians": 30, "loss": 0.2, "psnr_test": 20.0, "seconds": 1.0}],
            "model": {"components": [{"component": "sh-degree", "kept": "0", "by": "probe",
            "reason": "3 against 0", "candidates": [{"value": "3", "against": "0",
            "psnr_without": 26.1, "psnr_with": 26.0, "evidence_nats": -70.0, "error_nats": 66.0,
            "cost_nats": 67.0, "parameters": 482130, "pays": false}]}]}}"#;
        std::fs::write(&path, history).unwrap();
        let Training { plots, tables } = read_training(&path).unwrap().document;
        let captions: Vec<usize> = tables.iter().map(|table| table.rows.len()).collect();
        assert_eq!(captions, [1, 1]);
        assert_eq!(tables[1].rows[0][7], Cell::text("does not pay"));
        let titles: Vec<&str> = plots.iter().map(|plot| plot.title.as_str()).collect();
        assert_eq!(titles, ["Training loss", "Gaussians"], "one PSNR is not a curve");
        assert_eq!(plots[0].series[0].points, [(0.0, 0.5), (100.0, 0.2)]);
        for (text, says) in [
            ("{}", "motes/train-report"),
            (r#"{"format": "motes/train-report", "version": "1.0"}"#, "history"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = read_training(&path).unwrap_err().to_string();
            assert!(error.contains(says) && error.contains("--metrics"), "{error}");
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
