//! The flags that every stage has, defined once.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::Serialize;

use crate::Habit;

/// Flags that mean the same in every stage. Flatten into a stage's arguments with
/// `#[command(flatten)] #[serde(flatten)] common: CommonArgs`.
#[derive(Args, Clone, Debug, Default, Serialize)]
#[command(next_help_heading = "Common options")]
pub struct CommonArgs {
    /// Replace existing outputs; without it they are an error (exit code 2)
    #[arg(short = 'w', long)]
    pub overwrite: bool,

    /// Worker threads, at most one per core; 0 uses every core. The result does not depend on it
    #[arg(short = 'j', long, value_name = "N", default_value_t = 0, env = "MOTES_THREADS")]
    pub threads: usize,

    /// Memory limit, such as 8GiB or 500MiB: a run that would need more stops with an error before
    /// it starts [default: what the machine, the control group and the shell leave]
    #[arg(long, alias = "memory-budget", value_name = "SIZE", value_parser = crate::memory::parse_size)]
    pub max_memory: Option<u64>,

    /// Print only errors on stderr: no progress, report or warnings
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,

    /// Print more detail on stderr; twice for everything (the filter MOTES_LOG takes precedence)
    #[arg(short, long, action = clap::ArgAction::Count)]
    pub verbose: u8,

    /// Also write the detailed log to this file
    #[arg(long, value_name = "FILE")]
    pub log_file: Option<PathBuf>,

    /// Style of the progress on stderr
    #[arg(long, value_name = "MODE", value_enum, default_value_t = ProgressMode::Auto)]
    pub progress: ProgressMode,

    /// Print the report as one JSON object on stdout
    #[arg(long)]
    pub json: bool,

    /// Check inputs and options and print the planned outputs, without doing the work
    #[arg(long)]
    pub dry_run: bool,

    /// Do not write `<output>.run.json` beside the product
    #[arg(long)]
    pub no_provenance: bool,

    /// Read options from a JSON file as `--dump-config` writes it; flags take precedence
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    pub config: Option<PathBuf>,

    /// Print the options in effect as JSON and exit
    #[arg(long)]
    #[serde(skip)]
    pub dump_config: bool,

    /// Print the manual page or a shell completion script and exit
    #[arg(long, value_name = "WHAT", value_enum)]
    #[serde(skip)]
    pub generate: Option<Generate>,

    /// Print the one-line summary and exit (asked by `motes help`)
    #[arg(long, hide = true)]
    #[serde(skip)]
    pub summary: bool,
}

/// Common flags that `-h` shows.
pub const COMMON_BASIC: [&str; 5] = ["overwrite", "threads", "quiet", "json", "help"];

/// Gives [`crate::main`] the shared part of a stage's arguments.
pub trait HasCommon {
    /// Flags that `-h` shows, by long name, beside [`COMMON_BASIC`]; empty shows all. `--help`
    /// always shows all.
    const BASIC: &'static [&'static str] = &[];

    /// What `--preset` sets: its values, each with long flags and theirs. What the user or `--config` gives wins.
    const PRESETS: &'static [Preset] = &[];

    /// Flags of other programs that stand for one of ours with a value. Plain other names are clap aliases.
    const HABITS: &'static [Habit] = &[];

    /// The flattened common arguments.
    fn common(&self) -> &CommonArgs;
}

/// A value of `--preset`, and the long flags that it sets.
pub type Preset = (&'static str, &'static [(&'static str, &'static str)]);

/// How progress is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProgressMode {
    /// A bar on a terminal, plain lines otherwise
    #[default]
    Auto,
    /// A bar that redraws itself
    Bar,
    /// Lines of text, at most one per second
    Plain,
    /// One JSON object per line, for programs that drive the stage
    Json,
    /// Nothing
    None,
}

/// What `--generate` prints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Generate {
    /// Manual page (troff)
    Man,
    /// Completions for bash
    Bash,
    /// Completions for zsh
    Zsh,
    /// Completions for fish
    Fish,
}
