//! Put the scores of several runs in one table: Markdown, LaTeX or CSV.
//!
//! Inputs: `metrics.json` documents. Output: the table on standard output, or in a file.
//!
//! ```text
//! report table ours=runs/ours-0/metrics.json ours=runs/ours-1/metrics.json base=runs/base/metrics.json -o table.tex
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input. Manual: `docs/stages/report.md`.

use std::fmt;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};
use evaluate::evaluation::protocol_words;
use motes_formats::atomic::write_atomic;
use motes_formats::documents::read_document;
use motes_formats::metrics::{MetricsDocument, Protocol, Scores};
use motes_formats::standard_stream::is_standard_stream;
use motes_stage::{CommonArgs, Context, HasCommon, StageError};
use serde::Serialize;

use crate::scores::{Sample, ScoreTable, to_csv, to_latex, to_markdown};

/// Put the scores of several runs in one table
#[derive(Parser, Debug, Serialize)]
#[command(
    name = "report table",
    after_help = "Examples:\n  \
    A table for a page, a paper and a spreadsheet:\n    \
    report table runs/*/metrics.json\n    \
    report table runs/*/metrics.json -o table.tex\n    \
    report table runs/*/metrics.json -o table.csv\n  \
    Mean and spread over seeds, one row per method:\n    \
    report table ours=seed0/metrics.json ours=seed1/metrics.json base=base/metrics.json"
)]
pub struct Args {
    /// Metrics documents of evaluate. NAME= before the path names the row; files of one name share
    /// a row with mean and standard deviation. Without a name the folder names it
    #[arg(required = true, value_name = "[NAME=]METRICS.json")]
    metrics: Vec<String>,

    /// File to write, - for standard output; the suffix .md, .tex or .csv chooses the format
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,

    /// Format of the table [default: by the suffix, markdown on standard output]
    #[arg(long, value_name = "FORMAT")]
    format: Option<Format>,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &["output", "format"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// How a table is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// A pipe table, notes below
    Markdown,
    /// A tabular with the rules of the package booktabs, notes as comments
    Latex,
    /// A header and a line per row, numbers in full, no notes
    Csv,
}

impl Format {
    fn of(path: &Path) -> Result<Self, StageError> {
        match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
            Some("md") => Ok(Self::Markdown),
            Some("tex") => Ok(Self::Latex),
            Some("csv") => Ok(Self::Csv),
            _ => Err(StageError::usage(format!("not a suffix of a table: {}", path.display()))
                .help("end the name in .md, .tex or .csv, or give --format")),
        }
    }

    fn write(self, table: &ScoreTable) -> String {
        match self {
            Self::Markdown => to_markdown(table),
            Self::Latex => to_latex(table),
            Self::Csv => to_csv(table),
        }
    }
}

/// The table, and where it was written.
#[derive(Serialize)]
pub struct Report {
    output: PathBuf,
    #[serde(flatten)]
    table: ScoreTable,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} rows: {}", self.table.rows.len(), self.output.display())
    }
}

/// Makes the table.
///
/// # Errors
/// When a document cannot be read, or the product cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Report> {
    let to_stdout = is_standard_stream(&args.output);
    let format = match args.format {
        Some(format) => format,
        None if to_stdout => Format::Markdown,
        None => Format::of(&args.output)?,
    };
    let output = match to_stdout && args.common.json {
        true => args.output.clone(), // The report holds the table.
        false => context.output(&args.output)?,
    };
    let mut samples = Vec::new();
    let mut protocols: Vec<(Protocol, Vec<String>)> = Vec::new();
    for given in &args.metrics {
        let (label, path) = label_and_path(given);
        context.input("metrics", &path)?;
        let document = read_document::<MetricsDocument>(&path)?.document;
        samples.extend(samples_of(&label, &document));
        match protocols.iter_mut().find(|(protocol, _)| *protocol == document.protocol) {
            Some((_, labels)) if labels.contains(&label) => {}
            Some((_, labels)) => labels.push(label),
            None => protocols.push((document.protocol, vec![label])),
        }
    }
    if protocols.len() > 1 {
        context.warn(format!(
            "the scores were measured by {} protocols and compare only as far as these agree; \
             they are named below the table",
            protocols.len()
        ));
    }
    context.stop_if_dry_run()?;
    let several = protocols.len() > 1;
    let notes = protocols.iter().map(|(p, labels)| note(p, several.then_some(labels))).collect();
    let table = ScoreTable::new(&samples, notes);
    let text = format.write(&table);
    match (to_stdout, args.common.json) {
        (false, _) => write_atomic(&output, |writer| writer.write_all(text.as_bytes()))?,
        (true, false) => context.stdout().write_all(text.as_bytes())?,
        (true, true) => {}
    }
    Ok(Report { output, table })
}

/// `NAME=PATH`, or a path that names itself: by its folder when every run calls the file
/// `metrics.json`, else by its stem. A path that exists as given is never split.
fn label_and_path(given: &str) -> (String, PathBuf) {
    if let (false, Some((label, path))) = (Path::new(given).exists(), given.split_once('='))
        && !label.is_empty()
    {
        return (label.to_owned(), path.into());
    }
    let path = PathBuf::from(given);
    let words = |part: Option<&std::ffi::OsStr>| part.map(|p| p.to_string_lossy().into_owned());
    let folder = words(path.parent().and_then(Path::file_name));
    let stem = words(path.file_stem());
    let label = if stem.as_deref() == Some("metrics") { folder.or(stem) } else { stem };
    (label.unwrap_or_else(|| given.to_owned()), path)
}

/// One sample per seed, or one of the whole document.
fn samples_of(label: &str, document: &MetricsDocument) -> Vec<Sample> {
    let sample = |scores: &Scores, gap: Option<f64>, gaussians: Option<u64>| Sample {
        label: label.to_owned(),
        scores: [
            scores.psnr,
            scores.psnr_color_corrected,
            scores.ssim,
            scores.lpips,
            gap,
            gaussians.map(|n| n as f64),
        ],
    };
    match &document.seeds {
        Some(seeds) => seeds.rows.iter().map(|row| sample(&row.scores, row.gap, None)).collect(),
        None => vec![sample(&document.mean, document.gap, document.gaussians)],
    }
}

/// The protocol in a sentence.
fn note(protocol: &Protocol, labels: Option<&Vec<String>>) -> String {
    let whose = labels.map(|labels| format!(" of {}", labels.join(", "))).unwrap_or_default();
    let parts: Vec<String> =
        protocol_words(protocol).iter().map(|(name, value)| format!("{name}: {value}")).collect();
    format!("Protocol{whose}: {}.", parts.join("; "))
}
