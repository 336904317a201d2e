//! Scores pictures of composed scenes against path-traced truth.

#![allow(clippy::print_stderr, clippy::print_stdout, reason = "a tool for developers")]

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Parser;
use motes_truth::score::composed::score;
use motes_truth::score::truth_folder::TruthFolder;

/// Score pictures of composed scenes against path-traced truth
#[derive(Parser, Debug)]
#[command(name = "score-composed")]
struct Args {
    /// Folder of ground truth with the asset
    #[arg(long, value_name = "DIR")]
    with: PathBuf,
    /// Folder of ground truth of the same views, light and exposure without it
    #[arg(long, value_name = "DIR")]
    without: PathBuf,
    /// Name of the asset in the ground truth
    #[arg(long, value_name = "OBJECT")]
    object: String,
    /// Folders with pictures of the test views (PNG)
    #[arg(required = true)]
    pictures: Vec<PathBuf>,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let (with, without) = (TruthFolder::open(&args.with)?, TruthFolder::open(&args.without)?);
    let object = with.objects.iter().find(|o| o.name == args.object);
    let id = object.with_context(|| format!("there is no object {}", args.object))?.id;
    println!("| pictures | asset, dB | shadow, dB | whole, dB |\n|---|---|---|---|");
    for folder in &args.pictures {
        let s = score(&with, &without, id, folder)?;
        let db = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.2}"));
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        println!("| {name} | {} | {} | {} |", db(s.asset_db), db(s.shadow_db), db(s.whole_db));
        eprintln!("{:.1} % asset, {:.1} % shadow", 100.0 * s.asset_share, 100.0 * s.shadow_share);
    }
    Ok(())
}
