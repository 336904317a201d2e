//! The programs of motes under hostile files, kills and rivals: `cargo xtask fuzz --minutes 2`.
//!
//! Four suites. Bombs: small files and cameras that stand for very much. Rivals: two runs with one output. Kills: runs that
//! are killed at random moments and then run again. Mutations: damaged files of every kind for every stage, for as long as
//! asked. A run may fail, but in one way: by itself, soon, in little memory, with one short message, and nothing left behind.

mod bench;
mod bombs;
mod cases;
mod judge;
mod kills;
#[path = "../../../crates/codecs/tests/common/mutate.rs"]
mod mutate;
mod mutations;
mod rivals;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;

use bench::Bench;

/// Programs of motes under hostile files, kills and rivals
#[derive(Parser)]
#[command(name = "cargo xtask fuzz")]
struct Args {
    /// How long the suites of kills and of mutations take together
    #[arg(long, default_value_t = 2.0, value_name = "N")]
    minutes: f64,
    /// Seed of what is damaged, and when programs are killed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder of the programs
    #[arg(long, default_value = "target/release", value_name = "DIR")]
    programs: PathBuf,
    /// Copy the input of each failure here
    #[arg(long, default_value = "target/fuzz", value_name = "DIR")]
    keep: PathBuf,
}

fn main() -> ExitCode {
    let args = Args::parse();
    match run(&args) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::from(4),
        Err(error) => {
            bench::say(&format!("fuzz: {error:#}"));
            ExitCode::FAILURE
        }
    }
}

/// The number of failures.
fn run(args: &Args) -> anyhow::Result<usize> {
    let mut bench = Bench::new(&args.programs, &args.keep, args.seed)?;
    bombs::run(&mut bench)?;
    rivals::run(&mut bench)?;
    kills::run(&mut bench, 0.25 * args.minutes)?;
    mutations::run(&mut bench, 0.75 * args.minutes)?;
    Ok(bench.finish())
}
