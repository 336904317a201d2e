//! `provider check`: whether a program keeps the protocol.

use std::fmt;
use std::path::PathBuf;

use clap::Parser;
use motes_formats::documents::to_pretty_json;
use motes_formats::provider::{ProviderDescription, ProviderKind};
use motes_protocol::ProviderCommand;
use motes_protocol::conformance::{Finding, Outcome, conformance};
use motes_stage::{CommonArgs, Context, HasCommon, StageError};
use serde::Serialize;

const EXAMPLES: &str = "\
Examples:
  A program of your own that edits pictures:
    provider check 'python3 my-provider.py' --kind instruct-edit
  SAM, with the findings for a program:
    provider check 'sam --model mobile_sam/' --kind segment --json";

/// Check that a program keeps the protocol of providers
#[derive(Parser, Debug, Serialize)]
#[command(name = "provider check", after_help = EXAMPLES)]
pub struct Args {
    /// Program with its arguments in one word, or NAME of motes-provider-NAME
    #[arg(value_name = "COMMAND")]
    command: String,

    /// What to ask it for
    #[arg(long, value_name = "KIND", value_enum)]
    kind: ProviderKind,

    /// Longest that one answer may take, seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    time_limit: f64,

    /// File for the findings (JSON)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    #[command(flatten)]
    #[serde(flatten)]
    common: CommonArgs,
}

impl HasCommon for Args {
    const BASIC: &'static [&'static str] = &["kind", "time-limit", "output"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }
}

/// What was found.
#[derive(Debug, Serialize)]
pub struct Report {
    /// What the provider says about itself, when it does.
    provider: Option<ProviderDescription>,
    /// One per check.
    findings: Vec<Finding>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(provider) = &self.provider {
            writeln!(f, "{} {}", provider.name, provider.program_version)?;
            for model in &provider.models {
                writeln!(f, "model {}, license {}", model.id, model.license)?;
            }
        }
        for finding in &self.findings {
            match &finding.outcome {
                Outcome::Passed => writeln!(f, "passed   {}", finding.check)?,
                Outcome::Failed(cause) => writeln!(f, "FAILED   {}: {cause}", finding.check)?,
                Outcome::Skipped(cause) => writeln!(f, "skipped  {}: {cause}", finding.check)?,
            }
        }
        Ok(())
    }
}

/// Runs the checks.
///
/// # Errors
/// There is no such program, or the product cannot be written. What the provider does wrong misses a gate (exit code 4).
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Report> {
    if !(args.time_limit > 0.0 && args.time_limit.is_finite()) {
        return Err(StageError::usage("--time-limit must be above 0").into());
    }
    if context.is_from_config("command") {
        let text = "a file of --config may not name a program to start: command";
        return Err(StageError::usage(text).help("type the command on the command line").into());
    }
    let output = args.output.as_ref().map(|path| context.json_output(path)).transpose()?;
    let command = ProviderCommand::new(&args.command).map_err(StageError::from)?;
    context.stop_if_dry_run()?;
    let stopped = || context.interrupted();
    let found = conformance(&command, args.kind, args.time_limit, &stopped);
    let (provider, findings) = found.map_err(StageError::from)?;
    let failed = findings.iter().filter(|f| matches!(f.outcome, Outcome::Failed(_))).count();
    if failed > 0 {
        context.gate_not_met(format!("{failed} of {} checks failed", findings.len()));
    }
    let report = Report { provider, findings };
    if let Some(output) = &output {
        let text = to_pretty_json(&report);
        motes_formats::atomic::write_atomic(output, |writer| writer.write_all(text.as_bytes()))?;
    }
    Ok(report)
}
