//! A whole stage on one page, and the subject of `tests/`.
//!
//! Joins text files. Inputs: text. Output: text, or `-` for stdout.
//! Example: `demo-stage a.txt b.txt -o joined.txt`. Exit codes: see `motes_stage::ExitStatus`.

use std::fmt;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use motes_stage::{CommonArgs, Context, HasCommon, OrBadInput as _, StageError};

/// Join text files
#[derive(clap::Parser, serde::Serialize)]
#[command(name = "demo-stage")]
struct Args {
    /// Text files, in order
    #[arg(required = true)]
    inputs: Vec<PathBuf>,

    /// Joined file
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Repeat the whole text this often
    #[arg(long, default_value_t = 1)]
    repeat: u64,

    /// Recorded, unused: joining is not random
    #[arg(long, default_value_t = 0)]
    seed: u64,

    /// Wait this long after each repetition, milliseconds
    #[arg(long, default_value_t = 0, value_name = "MS")]
    wait: u64,

    /// Fail (exit code 4) when the product has fewer bytes
    #[arg(long, value_name = "BYTES")]
    require: Option<usize>,

    /// Meet a bug
    #[arg(long, hide = true)]
    panic: bool,

    /// Do not look for Ctrl-C
    #[arg(long, hide = true)]
    deaf: bool,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

#[derive(serde::Serialize)]
struct Report {
    files: usize,
    bytes: usize,
    threads: usize,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} files, {} bytes", self.files, self.bytes)
    }
}

fn main() -> ExitCode {
    motes_stage::main(run)
}

fn run(args: &Args, context: &Context) -> anyhow::Result<Report> {
    let output = context.output(&args.output)?;
    let mut texts = Vec::new();
    for input in &args.inputs {
        context.input("input", input)?;
        texts.push(std::fs::read_to_string(input).or_bad_input()?);
    }
    context.stop_if_dry_run()?;
    if texts.concat().is_empty() {
        context.warn("all inputs are empty");
    }
    let joined = repeat(&texts.concat(), args, context)?;
    save(&joined, &output, context)?;
    if let Some(bound) = args.require.filter(|&bound| joined.len() < bound) {
        context.gate_not_met(format!("{} bytes is less than the {bound} required", joined.len()));
    }
    let threads = context.threads();
    Ok(Report { files: texts.len(), bytes: joined.len(), threads })
}

fn repeat(text: &str, args: &Args, context: &Context) -> anyhow::Result<String> {
    let progress = context.progress("joining", args.repeat);
    let mut joined = String::new();
    for round in 0..args.repeat {
        assert!(!args.panic, "the join\nbroke");
        if !args.deaf && context.interrupted() {
            let text = format!("interrupted after {round} of {}", args.repeat);
            return Err(StageError::interrupted(text).into());
        }
        joined.push_str(text);
        std::thread::sleep(Duration::from_millis(args.wait));
        progress.inc(1);
        progress.event("joined", &serde_json::json!({ "bytes": joined.len() }));
    }
    Ok(joined)
}

fn save(text: &str, output: &Path, context: &Context) -> anyhow::Result<()> {
    if output == Path::new("-") {
        context.stdout().write_all(text.as_bytes())?;
    } else {
        motes_formats::atomic::write_atomic(output, |writer| writer.write_all(text.as_bytes()))?;
    }
    Ok(())
}
