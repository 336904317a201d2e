//! Put the runs of the lab on one page and one contact sheet.
//!
//! Inputs: run folders as `pipelines/lab/Makefile` makes them (`capture/capture.json`,
//! `metrics.json`, `train.json`, `renders/`, `halfway/`). Outputs: an HTML page that needs nothing
//! else, a PNG.
//!
//! ```text
//! report lab out/lab/20 out/lab/10 out/lab/5 -o out/lab/report.html
//! ```
//!
//! Exit codes: 0 done, 1 failed, 2 usage or would overwrite, 3 bad input. Manual: `docs/tutorial.md`.

use std::fmt;
use std::path::PathBuf;

use super::lab_folders::{load_lab, pose_error_sentences};
use super::page_flags::{links, notes};
use crate::pages::LabRun;
use clap::Parser;
use motes_formats::atomic::write_atomic;
use motes_formats::images::write_png;
use motes_stage::{CommonArgs, Context, HasCommon};
use serde::Serialize;

/// Report the runs of the lab as an HTML page and a contact sheet
#[derive(Parser, Debug, Serialize)]
#[command(
    name = "report lab",
    after_help = "Examples:\n  \
    The runs of `make lab` with 24 and 6 photos:\n    \
    report lab out/lab/n24 out/lab/n6 -o lab.html\n    \
    report lab out/lab/n24 out/lab/n6 -o lab.html --contact-sheet contact-sheet.png"
)]
pub struct Args {
    /// Folders of the runs, most training photos first
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,

    /// HTML page to write
    #[arg(short, long, value_name = "FILE.html")]
    output: PathBuf,

    /// Contact sheet to write
    #[arg(long, value_name = "FILE.png")]
    contact_sheet: Option<PathBuf>,

    /// Width of an image on the contact sheet in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 360,
        value_parser = clap::value_parser!(u32).range(32..=2048))]
    cell_width: u32,

    /// Name of the interpolated view in `halfway/` of every run
    #[arg(long, value_name = "NAME")]
    halfway: Option<String>,

    /// Pose errors as scripts/sfm-pose-error.py prints them
    #[arg(long, value_name = "FILE.json")]
    pose_error: Option<PathBuf>,

    /// File that the page links to, such as an interactive page of the model; repeatable
    #[arg(long, value_name = "NAME=FILE")]
    link: Vec<String>,

    /// Line for the end of the page; repeatable
    #[arg(long, value_name = "NAME=VALUE")]
    note: Vec<String>,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] =
        &["output", "contact-sheet", "halfway", "pose-error", "note"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// The table of the page.
#[derive(Serialize)]
pub struct Report {
    output: PathBuf,
    runs: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    photos: usize,
    train_psnr: Option<f64>,
    test_psnr: Option<f64>,
    gap: Option<f64>,
    gaussians: Option<usize>,
    seconds: Option<f64>,
}

impl From<&LabRun> for Row {
    fn from(run: &LabRun) -> Self {
        Self {
            photos: run.photos,
            train_psnr: run.train.psnr,
            test_psnr: run.test.psnr,
            gap: run.gap(),
            gaussians: run.gaussians,
            seconds: run.seconds,
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "photos  train dB  test dB  gap dB  Gaussians  seconds")?;
        for row in &self.runs {
            write!(f, "{:6}", row.photos)?;
            for (value, width) in [(row.train_psnr, 9), (row.test_psnr, 8), (row.gap, 7)] {
                write!(f, " {:>width$}", value.map_or("-".into(), |v| format!("{v:.2}")))?;
            }
            write!(f, " {:>10}", row.gaussians.map_or("-".into(), |n| n.to_string()))?;
            writeln!(f, " {:>8}", row.seconds.map_or("-".into(), |s| format!("{s:.0}")))?;
        }
        writeln!(f, "report: {}", self.output.display())
    }
}

/// Makes the page.
///
/// # Errors
/// When a folder of the run is not what the page needs, or a product cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Report> {
    let output = context.output(&args.output)?;
    let sheet = args.contact_sheet.as_ref().map(|path| context.output(path)).transpose()?;
    for folder in &args.runs {
        context.input("run", folder.join("metrics.json"))?;
    }
    let mut page = load_lab(&args.runs, args.halfway.as_deref())?;
    if let Some(path) = &args.pose_error {
        context.input("pose-error", path)?;
        page.poses = pose_error_sentences(path)?;
    }
    page.links = links(&args.link, &output, context)?;
    page.protocol = notes(&args.note);
    context.stop_if_dry_run()?;

    write_atomic(&output, |writer| writer.write_all(page.to_html().as_bytes()))?;
    if let Some(path) = &sheet {
        write_png(path, &page.to_contact_sheet().draw(args.cell_width as usize))?;
    }
    Ok(Report { output, runs: page.runs.iter().map(Row::from).collect() })
}
