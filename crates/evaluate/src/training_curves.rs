//! Curves and decisions from what train-splat measured while it ran.

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

impl Training {
    /// The curves and tables of a report.
    pub fn of(report: &TrainReportDocument) -> Self {
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
        Self {
            plots: plots.into_iter().flatten().collect(),
            tables: tables.into_iter().filter(|table| !table.rows.is_empty()).collect(),
        }
    }
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
