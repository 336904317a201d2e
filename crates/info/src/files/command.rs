//! The command line of `info`.

use std::fmt;
use std::io::Write as _;
use std::path::PathBuf;

use clap::Parser;
use motes_formats::atomic::write_atomic;
use motes_formats::documents::to_pretty_json;
use motes_formats::standard_stream::is_standard_stream;
use motes_stage::{CommonArgs, Context, HasCommon};
use serde::Serialize;

use super::recognize::describe;
use crate::Description;

/// Say what files and folders are, and what they hold
#[derive(Parser, Debug, Serialize)]
#[command(
    name = "info",
    after_help = "Examples:\n  \
    A splat, and a folder that decompose made:\n    \
    info gaussians.ply scene/\n  \
    For programs, one object with a list of files:\n    \
    info capture/capture.json --json\n    \
    info a.spz b.sog -o info.json"
)]
pub struct Args {
    /// Files and folders: splats, points and meshes, glTF, pictures, OpenEXR, captures, scene
    /// folders, COLMAP models, checkpoints, documents of motes
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,

    /// File to write, - for standard output; the suffix .json writes what --json prints
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &["output"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// A description per file.
#[derive(Debug, Serialize)]
pub struct Report {
    /// In the order given.
    files: Vec<Description>,
    #[serde(skip)]
    output: PathBuf,
}

impl Report {
    fn text(&self) -> String {
        self.files.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if is_standard_stream(&self.output) {
            return Ok(()); // Said on standard output.
        }
        writeln!(f, "{} described: {}", self.files.len(), self.output.display())
    }
}

/// Describes the files.
///
/// # Errors
/// When one is missing or broken, or the product cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Report> {
    let to_stdout = is_standard_stream(&args.output);
    let output = match to_stdout && args.common.json {
        true => args.output.clone(), // The report is the description.
        false => context.output(&args.output)?,
    };
    if !to_stdout {
        args.files.iter().try_for_each(|path| context.input("file", path))?;
    }
    context.stop_if_dry_run()?;
    let files = args.files.iter().map(|path| describe(path));
    let report = Report { files: files.collect::<motes_formats::Result<_>>()?, output };
    let suffix = report.output.extension();
    let text = match suffix.is_some_and(|suffix| suffix.eq_ignore_ascii_case("json")) {
        true => to_pretty_json(&report),
        false => report.text(),
    };
    if !to_stdout {
        write_atomic(&report.output, |writer| writer.write_all(text.as_bytes()))?;
    } else if !args.common.json {
        context.stdout().write_all(text.as_bytes())?;
    }
    Ok(report)
}
