//! Micro-benchmarks of what `fit` does beside rasterizing: loss, Adam, 3D filter, refinement.
//!
//! `cargo run --release -p train-splat --example fit-kernels [-- GAUSSIANS]`. One thread, best of
//! several repeats; the first line is the machine's floor for a pass over memory.

use std::time::Instant;

use motes_math::adam::{AdamOptions, adam_step, adam_step_columns};
use motes_raster::Planes;
use motes_scene::{ImageU8, SparsePoints};
use motes_testkit::{orbit_pose, random_gaussians, small_camera};
use train_splat::loss::{ColorTransform, PhotometricLoss};
use train_splat::{AlphaMode, FitOptions, Phase, Target, Trainer, TrainingImage};

/// Seconds of the fastest of several calls.
fn best(mut work: impl FnMut()) -> f64 {
    let once = |work: &mut dyn FnMut()| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..15).map(|_| once(&mut work)).fold(f64::INFINITY, f64::min)
}

#[expect(clippy::print_stdout, reason = "a program that a developer runs for its text")]
fn main() {
    let count = std::env::args().nth(1).and_then(|v| v.parse().ok()).unwrap_or(100_000usize);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let lines = match pool {
        Ok(pool) => pool.install(|| measure(count)),
        Err(error) => vec![error.to_string()],
    };
    println!("{}", lines.join("\n"));
}

fn measure(count: usize) -> Vec<String> {
    let mut lines = Vec::new();
    let a = vec![1.0f32; 32 << 20];
    let mut b = vec![0.0f32; 32 << 20];
    let copied = best(|| std::hint::black_box(&mut b).copy_from_slice(std::hint::black_box(&a)));
    let rate = 8.0 * a.len() as f64 / copied;
    lines.push(format!("copy of memory: {:.1} GB/s read and written", rate * 1e-9));
    drop((a, b));

    for (width, height) in [(96, 128), (192, 256), (384, 512), (1536, 2048)] {
        let image = photo(width, height);
        let target = Target::new(&image, width, height, AlphaMode::Ignore);
        let mut render = Planes::new(width, height, 4);
        for (i, v) in render.data.iter_mut().enumerate() {
            *v = (i * 7919 % 251) as f32 / 251.0;
        }
        let mut gradient = Planes::new(width, height, 4);
        let mut loss = PhotometricLoss::new();
        let seconds = best(|| {
            let identity = ColorTransform::IDENTITY;
            loss.evaluate(&render, &target, [0.0; 3], identity, 0.2, &mut gradient);
        });
        let ns = seconds * 1e9 / (width * height) as f64;
        // Three u8 and three f32 in, four f32 out.
        let floor = 31.0 / rate * 1e9;
        lines
            .push(format!("loss {width}x{height}: {ns:.1} ns per pixel (memory floor {floor:.1})"));
    }

    let values = 59 * count;
    let (mut x, g) = (vec![0.5f32; values], vec![1e-3f32; values]);
    let (mut m, mut v) = (vec![0.0f32; values], vec![0.0f32; values]);
    let options = AdamOptions::default();
    let seconds = best(|| adam_step(&mut x, &g, &mut m, &mut v, &[1e-3], 9, &options));
    let per = |seconds: f64| seconds * 1e9 / count as f64;
    let floor = 28.0 * 59.0 / rate * 1e9;
    lines.push(format!(
        "Adam, 59 values: {:.1} ns per Gaussian (memory floor {floor:.1})",
        per(seconds)
    ));
    let rates = vec![1e-3f32; 48];
    let n = 48 * count;
    for columns in [3, 12, 27, 48] {
        let seconds = best(|| {
            let (x, m, v) = (&mut x[..n], &mut m[..n], &mut v[..n]);
            adam_step_columns(x, &g[..n], m, v, &rates, 0..columns, 9, &options);
        });
        lines.push(format!("Adam, SH {columns} of 48: {:.1} ns per Gaussian", per(seconds)));
    }
    lines.extend(refinement(count));
    lines
}

fn photo(width: usize, height: usize) -> TrainingImage {
    let data = (0..width * height * 3).map(|i| (i * 31 % 256) as u8).collect();
    TrainingImage {
        name: String::new(),
        camera: small_camera(width, height),
        camera_from_world: orbit_pose(0.3),
        image: ImageU8::from_data(width, height, 3, data).into(),
        mask: None,
        exposure_gain: 1.0,
    }
}

/// Every step refines, on small pictures.
fn refinement(count: usize) -> Vec<String> {
    let truth = random_gaussians(1, count, 3);
    let images: Vec<TrainingImage> = (0..8)
        .map(|i| TrainingImage {
            camera_from_world: orbit_pose(0.7 * f64::from(i)),
            ..photo(64, 48)
        })
        .collect();
    let options = FitOptions {
        iterations: Some(12),
        refine_every: Some(1),
        max_gaussians: Some(count + count / 10),
        ..FitOptions::default()
    };
    let start = Trainer::new(&images, &SparsePoints::default(), Some(truth), &options, 0);
    let mut trainer = match start {
        Ok(trainer) => trainer,
        Err(error) => return vec![error.to_string()],
    };
    while !trainer.is_done() {
        trainer.step();
    }
    let profile = &trainer.profile;
    let rounds = profile.counts.refinements.max(1) as f64 * count as f64;
    let filter = profile.unit_times().filter_per_gaussian_ns.unwrap_or(0.0) / 8.0;
    vec![
        format!("refinement: {:.1} ns per Gaussian", profile.cpu_s(Phase::Refine) * 1e9 / rounds),
        format!("3D filter: {filter:.2} ns per Gaussian and view"),
    ]
}
