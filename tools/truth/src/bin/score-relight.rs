//! Scores results of inverse rendering against a ground-truth folder.

#![allow(clippy::print_stderr, clippy::print_stdout, reason = "a tool for developers")]

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Parser;
use motes_formats::atomic::write_atomic;
use motes_formats::images::write_png;
use motes_truth::score::truth_folder::TruthFolder;
use motes_truth::score::{Results, markdown, score, sheet};

/// Score results of inverse rendering against a ground-truth folder
#[derive(Parser, Debug)]
#[command(name = "score-relight")]
struct Args {
    /// Folder of ground truth (`scene.json`, `transforms_test.json`, `aov/`, `test/`)
    truth: PathBuf,
    /// Pictures of the test views by the splat
    #[arg(long, value_name = "DIR")]
    splat: Option<PathBuf>,
    /// Pictures of the test views by the decomposed scene under its own light
    #[arg(long, value_name = "DIR")]
    capture: Option<PathBuf>,
    /// Pictures of the test views under a light of the truth; may repeat
    #[arg(long, value_name = "LIGHT=DIR", value_parser = pair)]
    relit: Vec<(String, PathBuf)>,
    /// EXR buffers of the test views: base_color.R .. B, roughness, metallic, normal.X .. Z
    #[arg(long, value_name = "DIR")]
    buffers: Option<PathBuf>,
    /// Scores as JSON
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    /// Scores as a Markdown page, also printed
    #[arg(long, value_name = "FILE.md")]
    page: Option<PathBuf>,
    /// Contact sheet of truth, ours, error
    #[arg(long, value_name = "FILE.png")]
    sheet: Option<PathBuf>,
    /// Contact sheet of components
    #[arg(long, value_name = "FILE.png", requires = "buffers")]
    components: Option<PathBuf>,
}

fn pair(text: &str) -> Result<(String, PathBuf), String> {
    let (name, folder) = text.split_once('=').ok_or("LIGHT=DIR")?;
    Ok((name.into(), folder.into()))
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let truth = TruthFolder::open(&args.truth)?;
    for (light, _) in &args.relit {
        let known = truth.root.join(format!("test/relight_{light}")).is_dir();
        anyhow::ensure!(known, "there is no light {light}, but {}", truth.lights.join(", "));
    }
    let results = Results {
        splat: args.splat,
        capture: args.capture,
        relit: args.relit.into_iter().collect(),
        buffers: args.buffers,
    };
    let scores = score(&truth, &results)?;
    if let Some(path) = &args.output {
        let text = serde_json::to_string_pretty(&scores)? + "\n";
        write_atomic(path, |w| w.write_all(text.as_bytes())).context("scores")?;
    }
    if let Some(path) = &args.sheet {
        write_png(path, &sheet::relit(&truth, &results, &scores)?)?;
    }
    if let (Some(path), Some(folder)) = (&args.components, &results.buffers) {
        write_png(path, &sheet::components(&truth, folder)?)?;
    }
    let page = markdown::page(&scores);
    if let Some(path) = &args.page {
        write_atomic(path, |w| w.write_all(page.as_bytes()))?;
    }
    print!("{page}");
    Ok(())
}
