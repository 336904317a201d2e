//! Makes predictions of known quality for the photos of a ground-truth folder.

#![allow(clippy::print_stderr, reason = "a tool for developers")]

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Parser;
use glam::Vec3;
use motes_formats::exr_aov::{AovChannel, write_exr};
use motes_truth::predictions::{Grade, Prediction, SurfaceCloud, View, views};
use motes_truth::score::pictures::decoded;
use motes_truth::score::truth_folder::TruthFolder;

/// Make predictions of known quality for the photos of a ground-truth folder, for `decompose --prior-images`
#[derive(Parser, Debug)]
#[command(name = "truth-predictions")]
struct Args {
    /// Folder of ground truth (docs/formats/ground-truth.md)
    truth: PathBuf,
    /// How good they are
    #[arg(long, value_enum)]
    grade: Grade,
    /// Folder to write: VIEW_albedo.exr, VIEW_normal.exr (axes of the camera, OpenGL)
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Key of all random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let truth = TruthFolder::open(&args.truth)?;
    let cloud = SurfaceCloud::of_test_views(&truth)?;
    let extent = cloud.extent().context("the test views show nothing")?;
    std::fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
    let (photos, images) = (views(&truth, "train")?, truth.root.join("images"));
    let (mut predicted, mut pixels) = (0, 0);
    for (k, view) in photos.iter().enumerate() {
        let photo = decoded(&truth.picture(&images, &view.name)?);
        let seen = cloud.seen_from(view, &truth.ids(&view.name)?);
        let errors = (args.seed, k as u64);
        let all = args.grade.predict(&seen, &photo, truth.size.0, extent, errors);
        predicted += all.iter().flatten().count();
        pixels += all.len();
        write(&args.output, view, &all)?;
    }
    let share = 100.0 * predicted as f64 / pixels.max(1) as f64;
    eprintln!("truth-predictions: {} photos, {share:.1} % of the pixels predicted", photos.len());
    Ok(())
}

fn write(folder: &Path, view: &View, all: &[Option<Prediction>]) -> anyhow::Result<()> {
    let color = |p: &Option<Prediction>| p.map_or(Vec3::NEG_ONE, |p| p.base_color);
    let normal = |p: &Option<Prediction>| {
        p.map_or(Vec3::ZERO, |p| view.to_camera_gl(p.normal.as_dvec3()).as_vec3())
    };
    let colors: Vec<Vec3> = all.iter().map(color).collect();
    let normals: Vec<Vec3> = all.iter().map(normal).collect();
    for (what, image) in [("albedo", colors), ("normal", normals)] {
        let plane = |c: usize| image.iter().map(|v| v[c]).collect();
        let channels: Vec<AovChannel> =
            [("R", 0), ("G", 1), ("B", 2)].map(|(n, c)| AovChannel::float(n, plane(c))).into();
        let path = folder.join(format!("{}_{what}.exr", view.name));
        write_exr(&path, view.camera.width, view.camera.height, &channels, &[])?;
    }
    Ok(())
}
