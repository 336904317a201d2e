//! Rows of a table of scores.

use serde::Serialize;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Column {
    /// PSNR of the 8-bit render, dB.
    Psnr,
    /// PSNR after the color correction of the protocol, dB.
    PsnrColorCorrected,
    /// Structural similarity.
    Ssim,
    /// Perceptual distance.
    Lpips,
    /// Training PSNR minus test PSNR, dB.
    Gap,
    /// Number of Gaussians.
    Gaussians,
}

impl Column {
    /// Every column, in the order of the table.
    pub const ALL: [Self; 6] =
        [Self::Psnr, Self::PsnrColorCorrected, Self::Ssim, Self::Lpips, Self::Gap, Self::Gaussians];

    /// Its heading.
    pub fn heading(self) -> &'static str {
        match self {
            Self::Psnr => "PSNR (dB)",
            Self::PsnrColorCorrected => "PSNR, color-corrected (dB)",
            Self::Ssim => "SSIM",
            Self::Lpips => "LPIPS",
            Self::Gap => "Gap (dB)",
            Self::Gaussians => "Gaussians",
        }
    }

    /// Its name in a CSV file.
    pub fn key(self) -> &'static str {
        match self {
            Self::Psnr => "psnr_db",
            Self::PsnrColorCorrected => "psnr_color_corrected_db",
            Self::Ssim => "ssim",
            Self::Lpips => "lpips",
            Self::Gap => "gap_db",
            Self::Gaussians => "gaussians",
        }
    }

    /// Digits after the point.
    pub fn digits(self) -> usize {
        match self {
            Self::Psnr | Self::PsnrColorCorrected | Self::Gap => 2,
            Self::Ssim | Self::Lpips => 3,
            Self::Gaussians => 0,
        }
    }

    /// +1 where more is better, -1 where less is, 0 where neither.
    fn better(self) -> i8 {
        match self {
            Self::Psnr | Self::PsnrColorCorrected | Self::Ssim => 1,
            Self::Lpips => -1,
            Self::Gap | Self::Gaussians => 0,
        }
    }
}

/// The scores of one model.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Samples of one label share a row.
    pub label: String,
    /// A score per column of [`Column::ALL`]; none where it was not measured.
    pub scores: [Option<f64>; Column::ALL.len()],
}

/// Mean and spread over the samples of a row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// Arithmetic mean.
    pub mean: f64,
    /// Sample standard deviation (n - 1); none for one sample.
    pub deviation: Option<f64>,
    /// Whether no row has a better mean, as far as the table shows digits.
    pub is_best: bool,
}

impl Cell {
    /// Mean, between `best` where it is the best one, and the deviation after the sign `plus_minus`.
    pub(super) fn text(&self, column: Column, best: [&str; 2], plus_minus: &str) -> String {
        let digits = column.digits();
        let [before, after] = if self.is_best { best } else { [""; 2] };
        let mean = format!("{before}{:.digits$}{after}", self.mean);
        match self.deviation {
            Some(deviation) => format!("{mean} {plus_minus} {deviation:.digits$}"),
            None => mean,
        }
    }
}

/// The row of a label.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What it is called.
    pub label: String,
    /// Number of samples.
    pub samples: usize,
    /// A cell per column of the table; none unless every sample has the score.
    pub cells: Vec<Option<Cell>>,
}

/// Rows in the order in which their labels first came.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScoreTable {
    /// The columns that at least one row has.
    pub columns: Vec<Column>,
    /// One row per label.
    pub rows: Vec<Row>,
    /// How the numbers were measured: sentences below the table.
    pub notes: Vec<String>,
}

impl ScoreTable {
    /// Collects samples into rows. Columns that no sample has are left out.
    pub fn new(samples: &[Sample], notes: Vec<String>) -> Self {
        let mut labels: Vec<&str> = Vec::new();
        for sample in samples {
            if !labels.contains(&sample.label.as_str()) {
                labels.push(&sample.label);
            }
        }
        let has = |c: usize| samples.iter().any(|sample| sample.scores[c].is_some());
        let shown: Vec<usize> = (0..Column::ALL.len()).filter(|&c| has(c)).collect();
        let mut rows: Vec<Row> = labels.iter().map(|label| row(label, samples, &shown)).collect();
        let columns: Vec<Column> = shown.iter().map(|&c| Column::ALL[c]).collect();
        for (i, column) in columns.iter().enumerate() {
            mark_best(&mut rows, i, *column);
        }
        Self { columns, rows, notes }
    }

    /// Whether any row is a mean over several samples.
    pub fn has_spread(&self) -> bool {
        self.rows.iter().any(|row| row.samples > 1)
    }
}

fn row(label: &str, samples: &[Sample], shown: &[usize]) -> Row {
    let own: Vec<&Sample> = samples.iter().filter(|sample| sample.label == label).collect();
    let cell = |&c: &usize| {
        let values: Option<Vec<f64>> = own.iter().map(|sample| sample.scores[c]).collect();
        let values = values.filter(|values| values.iter().all(|v| v.is_finite()))?;
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        let deviation = (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt());
        Some(Cell { mean, deviation, is_best: false })
    };
    Row { label: label.to_owned(), samples: own.len(), cells: shown.iter().map(cell).collect() }
}

/// Marks the best means of a column, ties as the printed digits have them.
fn mark_best(rows: &mut [Row], i: usize, column: Column) {
    let sign = f64::from(column.better());
    if sign == 0.0 || rows.len() < 2 {
        return;
    }
    let unit = 10f64.powi(column.digits() as i32);
    let rank = |cell: &Cell| sign * (cell.mean * unit).round();
    let best = rows.iter().filter_map(|row| row.cells[i].as_ref().map(rank)).max_by(f64::total_cmp);
    for cell in rows.iter_mut().filter_map(|row| row.cells[i].as_mut()) {
        cell.is_best = best == Some(rank(cell));
    }
}
