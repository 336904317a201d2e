//! Curves and decisions from what train-splat measured while it ran.

use std::path::Path;

use motes_formats::Result;
use motes_formats::documents::{Parsed, read_document};
use motes_formats::train_report::{ComponentDecision, TrainReportDocument, TrainingPoint};

use motes_figures::html::{Cell, Table};
use motes_figures::svg_plot::{LinePlot, Series};

/// What a page shows of a training.
#[derive(Clone, Debug, Default)]
pub struct Training {
    /// Loss, held-out PSNR and number of Gaussians over steps, those that the file has.
    pub plots: Vec<LinePlot>,
    /// Which components of the model are in and why; empty tables are left out.
    pub tables: Vec<Table>,
}

/// Reads what the page shows.
///
/// # Errors
/// When the file cannot be read or is not a `motes/train-report`.
pub fn read_training(path: &Path) -> Result<Parsed<Training>> {
    let remedy = "give the file that train-splat --metrics wrote";
    let Parsed { document: report, warnings } =
        read_document::<TrainReportDocument>(path).map_err(|error| error.with_remedy(remedy))?;
    let plot = |title: &str, y_label: &str, value: fn(&TrainingPoint) -> Option<f64>| {
        let point = |row: &TrainingPoint| Some((f64::from(row.step), value(row)?));
        let points: Vec<(f64, f64)> = report.history.iter().filter_map(point).collect();
        (points.len() > 1).then(|| LinePlot {
            title: title.into(),
            x_label: "step".into(),
            y_label: y_label.into(),
            series: vec![Series { name: title.into(), points }],
        })
    };
    let plots = [
        plot("Training loss", "loss", |row| Some(row.loss)),
        plot("PSNR on held-out photos", "PSNR, dB", |row| row.psnr_test),
        plot("Gaussians", "number", |row| Some(row.gaussians as f64)),
    ];
    let components = &report.model.components;
    let tables = [component_table(components), evidence_table(components)];
    let document = Training {
        plots: plots.into_iter().flatten().collect(),
        tables: tables.into_iter().filter(|table| !table.rows.is_empty()).collect(),
    };
    Ok(Parsed { document, warnings })
}

fn component_table(components: &[ComponentDecision]) -> Table {
    let row =
        |c: &ComponentDecision| [&c.component, &c.kept, &c.by, &c.reason].map(Cell::text).to_vec();
    Table {
        caption: "components of the model: what is in, decided by what".into(),
        columns: ["component", "in use", "by", "reason"].map(Into::into).to_vec(),
        rows: components.iter().map(row).collect(),
    }
}

fn evidence_table(components: &[ComponentDecision]) -> Table {
    let mut rows = Vec::new();
    for component in components {
        for c in &component.candidates {
            rows.push(vec![
                Cell::text(format!("{} {}", component.component, c.value)),
                Cell::number(c.psnr_without, 2),
                Cell::number(c.psnr_with, 2),
                Cell::number(c.evidence_nats, 0),
                Cell::number(c.error_nats, 0),
                Cell::number(c.cost_nats, 0),
                Cell::count(c.parameters as usize),
                Cell::text(if c.pays { "pays" } else { "does not pay" }),
            ]);
        }
    }
    let columns =
        ["probe", "dB without", "dB with", "evidence, nats", "error", "cost", "parameters", ""];
    Table {
        caption:
            "probes: PSNR of views that no probe was fitted to, gain of log-likelihood over all \
                  photos, its standard error, what the parameters cost"
                .into(),
        columns: columns.map(Into::into).to_vec(),
        rows,
    }
}

#[cfg(test)]
mod tests {
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
