//! Runs that are killed at random moments, and run again.

use std::path::Path;
use std::time::{Duration, Instant};

use motes_formats::decomposition::read_decomposition;
use motes_formats::{capture, ply, tensors};
use motes_math::rng::keyed_rng;
use rand::RngExt as _;

use crate::bench::{Bench, say};
use crate::judge::{first_line, leftovers};

/// Stages with products of several kinds; each takes a part of a second.
const LINES: &[&[&str]] = &[
    &["edit", "--scene", "{scene}", "--scale", "2", "--no-reshade", "-w", "-o", "run/scene"],
    &["export", "--gaussians", "{scene}/gaussians.ply", "-w", "-o", "run/product.sog"],
    &[
        "train-splat",
        "--capture",
        "capture.json",
        "-n",
        "12",
        "--save-every",
        "1",
        "-w",
        "-o",
        "run/product.ply",
    ],
    &[
        "render",
        "--capture",
        "capture.json",
        "--gaussians",
        "true.ply",
        "--split",
        "all",
        "-w",
        "-o",
        "run/pictures",
    ],
    &["import-colmap", "colmap", "-w", "-o", "run/capture"],
];

pub(crate) fn run(bench: &mut Bench, minutes: f64) -> anyhow::Result<()> {
    let began = Instant::now();
    crate::cases::prepare(bench)?;
    let run = bench.clear()?;
    // How long a run takes that nobody disturbs; its product is the old one of the first kill.
    let mut usual = Vec::new();
    for line in LINES {
        let one = Instant::now();
        again(bench, line, &run)?;
        usual.push(one.elapsed());
    }
    let mut kills = 0u64;
    while kills < LINES.len() as u64 || began.elapsed().as_secs_f64() < 60.0 * minutes {
        let at = (kills % LINES.len() as u64) as usize;
        let moment = keyed_rng(bench.seed, 0x6b11, kills).random::<f64>();
        let mut child = bench.start(LINES[at])?;
        bench.count();
        std::thread::sleep(Duration::from_secs_f64(moment * usual[at].as_secs_f64()));
        child.kill()?;
        child.wait()?;
        if let Some(what) = broken(&run) {
            bench.fail(LINES[at], &format!("after a kill: {what}"), None);
        }
        again(bench, LINES[at], &run)?;
        kills += 1;
    }
    say(&format!("kills: {kills}"));
    Ok(())
}

/// A run that nobody disturbs works, and takes away what the killed one left.
fn again(bench: &mut Bench, line: &[&str], run: &Path) -> anyhow::Result<()> {
    let ended = bench.run(line)?;
    if !ended.status.is_some_and(|status| status.success()) {
        let what = format!("{:?} after a kill: {}", ended.status, first_line(&ended.stderr));
        bench.fail(line, &what, None);
    }
    if let Some(left) = leftovers(run) {
        bench.fail(line, &left, None);
    }
    Ok(())
}

/// A product that is there and not whole.
fn broken(run: &Path) -> Option<String> {
    let scene = run.join("scene");
    if let Ok(document) = read_decomposition(&scene) {
        let found = ply::read_gaussians(&document.gaussians).map(|g| g.len() as u64);
        let wanted = document.document.counts.gaussians;
        if found.as_ref().ok() != Some(&wanted) {
            return Some(format!("the scene has {found:?} Gaussians, its document says {wanted}"));
        }
    }
    let product = run.join("product.ply");
    if product.exists()
        && let Err(error) = ply::read_gaussians(&product)
    {
        return Some(error.to_string());
    }
    let checkpoint = run.join("product.checkpoint.safetensors");
    if checkpoint.exists()
        && let Err(error) = tensors::read_tensors(&checkpoint)
    {
        return Some(error.to_string());
    }
    let document = run.join("capture/capture.json");
    if document.exists() {
        match capture::read_capture(&document) {
            Err(error) => return Some(error.to_string()),
            Ok(found) => {
                let missing =
                    found.views.iter().find(|v| !run.join("capture").join(&v.image).is_file());
                return missing.map(|view| format!("{} has no picture", view.name));
            }
        }
    }
    None
}
