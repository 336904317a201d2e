//! Gaussians as columns with the names and order of a PLY: CSV, and statistics of each column.

use std::fmt::Write as _;
use std::io::Write;
use std::ops::Range;
use std::path::Path;

use motes_scene::{ColumnValues, Gaussians};
use rayon::prelude::*;

use super::options::SplatWriteOptions;
use super::registry::Codec;
use super::rows::write_blocks;
use motes_formats::atomic::write_error;
use motes_formats::documents::{Document as _, to_pretty_json};
use motes_formats::error::Result;
use motes_formats::statistics::{ColumnStatistics, StatisticsDocument};

pub(super) static CSV: Codec = Codec {
    name: "csv",
    about: "A table with a line per Gaussian",
    suffixes: &[".csv"],
    max_sh_degree: 4,
    lossless: true,
    keeps_extra_columns: true,
    loses: "nothing",
    write: Some(write_csv),
    ..Codec::DEFAULT
};

pub(super) static STATISTICS: Codec = Codec {
    name: "statistics",
    about: "Statistics of each column as JSON",
    suffixes: &[".json"],
    max_sh_degree: 4,
    keeps_extra_columns: true,
    loses: "all but the [statistics](statistics.md)",
    write: Some(write_statistics),
    ..Codec::DEFAULT
};

/// A column by name, and its values.
struct Column<'g> {
    name: String,
    value: Box<dyn Fn(usize) -> f64 + Sync + 'g>,
}

fn columns(gaussians: &Gaussians) -> Vec<Column<'_>> {
    let mut columns = Vec::new();
    let mut push = |name: String, value: Box<dyn Fn(usize) -> f64 + Sync>| {
        columns.push(Column { name, value });
    };
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        push(name.into(), Box::new(move |i| f64::from(gaussians.means[i][axis])));
    }
    let stride = 3 * gaussians.sh_coefficients();
    for channel in 0..3 {
        push(
            format!("f_dc_{channel}"),
            Box::new(move |i| f64::from(gaussians.sh[i * stride + channel])),
        );
    }
    let per_channel = gaussians.sh_coefficients() - 1;
    for rest in 0..3 * per_channel {
        let at = 3 * (1 + rest % per_channel) + rest / per_channel;
        push(format!("f_rest_{rest}"), Box::new(move |i| f64::from(gaussians.sh[i * stride + at])));
    }
    push("opacity".into(), Box::new(|i| f64::from(gaussians.opacity_logits[i])));
    for axis in 0..3 {
        push(format!("scale_{axis}"), Box::new(move |i| f64::from(gaussians.log_scales[i][axis])));
    }
    for k in 0..4 {
        push(format!("rot_{k}"), Box::new(move |i| f64::from(gaussians.rotations[i][k])));
    }
    for column in &gaussians.extra {
        let value: Box<dyn Fn(usize) -> f64 + Sync> = match &column.values {
            ColumnValues::I8(v) => Box::new(|i| f64::from(v[i])),
            ColumnValues::U8(v) => Box::new(|i| f64::from(v[i])),
            ColumnValues::I16(v) => Box::new(|i| f64::from(v[i])),
            ColumnValues::U16(v) => Box::new(|i| f64::from(v[i])),
            ColumnValues::I32(v) => Box::new(|i| f64::from(v[i])),
            ColumnValues::U32(v) => Box::new(|i| f64::from(v[i])),
            ColumnValues::F32(v) => Box::new(|i| f64::from(v[i])),
            ColumnValues::F64(v) => Box::new(|i| v[i]),
        };
        push(column.name.clone(), value);
    }
    columns
}

/// A header line and a line per Gaussian, each value with the digits that give it back.
fn write_csv(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    _: &SplatWriteOptions,
    path: &Path,
) -> Result<()> {
    let refused = |error| write_error(path, error);
    let columns = columns(gaussians);
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    writeln!(writer, "{}", names.join(",")).map_err(refused)?;
    let wide: Vec<bool> = columns.iter().map(|column| is_wide(gaussians, &column.name)).collect();
    let encode = |rows: Range<usize>, bytes: &mut Vec<u8>| {
        let mut text = String::new();
        for i in rows {
            for (k, column) in columns.iter().enumerate() {
                let value = (column.value)(i);
                // An f32 has fewer digits than the f64 it became.
                let _ = if wide[k] {
                    write!(text, "{value}")
                } else {
                    write!(text, "{}", value as f32)
                };
                text.push(if k + 1 < columns.len() { ',' } else { '\n' });
            }
        }
        bytes.extend(text.into_bytes());
    };
    write_blocks(writer, gaussians.len(), encode).map_err(refused)
}

/// Whether a column has more digits than an f32.
fn is_wide(gaussians: &Gaussians, name: &str) -> bool {
    let found = gaussians.extra.iter().find(|column| column.name == name);
    found.is_some_and(|c| {
        matches!(c.values, ColumnValues::F64(_) | ColumnValues::U32(_) | ColumnValues::I32(_))
    })
}

/// The statistics of each column.
fn write_statistics(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    _: &SplatWriteOptions,
    path: &Path,
) -> Result<()> {
    let rows = gaussians.len();
    let columns: Vec<ColumnStatistics> = columns(gaussians)
        .par_iter()
        .map(|column| {
            statistics(column.name.clone(), (0..rows).map(|i| (column.value)(i)).collect())
        })
        .collect();
    let document = StatisticsDocument {
        format: StatisticsDocument::FORMAT.into(),
        version: StatisticsDocument::version(),
        gaussians: rows as u64,
        sh_degree: gaussians.sh_degree,
        columns,
    };
    let text = to_pretty_json(&document);
    writer.write_all(text.as_bytes()).map_err(|error| write_error(path, error))
}

fn statistics(name: String, mut values: Vec<f64>) -> ColumnStatistics {
    let nan_count = values.iter().filter(|v| v.is_nan()).count() as u64;
    let inf_count = values.iter().filter(|v| v.is_infinite()).count() as u64;
    values.retain(|v| v.is_finite());
    let n = values.len();
    if n == 0 {
        return ColumnStatistics { name, nan_count, inf_count, ..ColumnStatistics::default() };
    }
    let mean = values.iter().sum::<f64>() / n as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
    let (lower, middle, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    let middle = *middle;
    let below = lower.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let median = if n.is_multiple_of(2) { (below + middle) / 2.0 } else { middle };
    ColumnStatistics {
        name,
        min: values.iter().copied().reduce(f64::min),
        max: values.iter().copied().reduce(f64::max),
        median: Some(median),
        mean: Some(mean),
        std_dev: Some(variance.sqrt()),
        nan_count,
        inf_count,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_leave_out_what_is_not_finite() {
        let values = vec![1.0, f64::NAN, 4.0, 2.0, f64::INFINITY, 3.0];
        let found = statistics("a".into(), values);
        assert_eq!((found.min, found.max, found.median), (Some(1.0), Some(4.0), Some(2.5)));
        assert_eq!((found.mean, found.nan_count, found.inf_count), (Some(2.5), 1, 1));
        assert!((found.std_dev.unwrap() - 1.25f64.sqrt()).abs() < 1e-12);
        let nothing = statistics("b".into(), vec![f64::NAN]);
        assert_eq!((nothing.median, nothing.nan_count), (None, 1));
    }
}
