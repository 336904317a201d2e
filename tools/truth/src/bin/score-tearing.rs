//! Measures the tearing of relit pictures, without a reference.

#![allow(clippy::print_stderr, clippy::print_stdout, reason = "a tool for developers")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Parser;
use motes_formats::atomic::write_atomic;
use motes_formats::exr_aov::open_exr;
use motes_formats::images::read_image;
use motes_math::median::median;
use motes_truth::score::tearing::tearing;
use serde::Serialize;

/// Measure the tearing of relit pictures against the captured ones
#[derive(Parser, Debug)]
#[command(name = "score-tearing")]
struct Args {
    /// Pictures (PNG) of the splat, with its depth beside them (EXR with depth_median.Z): `render --format both`
    captured: PathBuf,
    /// Folders of the same views under other lights
    #[arg(required = true)]
    relit: Vec<PathBuf>,
    /// Scores as JSON
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
}

#[derive(Serialize)]
struct Tearing {
    /// Median over the lights of the mean over the views.
    tearing: f64,
    /// Mean share of the pixels that are smooth.
    smooth_share: f64,
    /// Mean over the views, by light.
    lights: BTreeMap<String, f64>,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let mut views: Vec<String> = Vec::new();
    let folder = std::fs::read_dir(&args.captured);
    for entry in folder.with_context(|| args.captured.display().to_string())? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "exr") {
            views.extend(path.file_stem().map(|stem| stem.to_string_lossy().into_owned()));
        }
    }
    views.sort();
    anyhow::ensure!(!views.is_empty(), "no EXR files: {}", args.captured.display());
    let (mut lights, mut shares) = (BTreeMap::new(), Vec::new());
    for folder in &args.relit {
        let (mut sum, mut count) = (0.0, 0.0);
        for view in &views {
            if let Some((torn, share)) = score(&args.captured, folder, view)? {
                sum += torn;
                count += 1.0;
                shares.push(share);
            }
        }
        anyhow::ensure!(count > 0.0, "no view has a smooth surface: {}", args.captured.display());
        let name = folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy().into_owned();
        println!("{name}: {:.4}", sum / count);
        lights.insert(name, sum / count);
    }
    let scores = Tearing {
        tearing: median(lights.values().copied()).unwrap_or(f64::NAN),
        smooth_share: shares.iter().sum::<f64>() / shares.len() as f64,
        lights,
    };
    println!("tearing {:.4}, {:.0} % smooth", scores.tearing, 100.0 * scores.smooth_share);
    if let Some(path) = &args.output {
        let text = serde_json::to_string_pretty(&scores)? + "\n";
        write_atomic(path, |w| w.write_all(text.as_bytes())).context("scores")?;
    }
    Ok(())
}

fn score(captured: &Path, relit: &Path, view: &str) -> anyhow::Result<Option<(f64, f64)>> {
    let (png, exr) = (format!("{view}.png"), captured.join(format!("{view}.exr")));
    let (before, after) = (read_image(&captured.join(&png))?, read_image(&relit.join(&png))?);
    let depth = open_exr(&exr)?;
    let channel = depth.channel("depth_median.Z");
    let channel = channel.with_context(|| format!("no depth_median.Z: {}", exr.display()))?;
    let size = (before.width, before.height);
    let others = [(after.width, after.height), (depth.width, depth.height)];
    anyhow::ensure!(others == [size; 2], "{view}: pictures of several sizes");
    Ok(tearing(&before, &after, &channel.to_f32()))
}
