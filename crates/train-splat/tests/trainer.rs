//! The whole loop on scenes made in memory.

use motes_math::metrics::psnr_f32;
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, ImageU8, SparsePoints};
use motes_testkit::{orbit_pose, random_gaussians, small_camera};
use train_splat::{
    AdamRule, Densify, ExposureModel, FitOptions, FitState, FreezeGroup, Trainer, TrainingImage,
};

fn photos(truth: &Gaussians, views: usize) -> Vec<TrainingImage> {
    (0..views)
        .map(|i| {
            let camera = small_camera(72, 56);
            let camera_from_world = orbit_pose(0.7 * i as f64);
            let picture = render(truth, &camera, &camera_from_world, &RenderOptions::default());
            TrainingImage {
                name: format!("view {i}"),
                camera,
                camera_from_world,
                image: picture.color.to_u8().into(),
                mask: None,
                exposure_gain: 1.0,
            }
        })
        .collect()
}

/// The centers of the truth, as structure from motion would give them.
fn points(truth: &Gaussians) -> SparsePoints {
    SparsePoints { positions: truth.means.clone(), colors: vec![[128; 3]; truth.len()] }
}

fn options(iterations: u32) -> FitOptions {
    FitOptions {
        iterations: Some(iterations),
        max_gaussians: Some(400),
        refine_every: Some(40),
        resolution_schedule: Some("0.5:0.5,1:0.5".into()),
        ..FitOptions::default()
    }
}

fn mean_psnr(model: &Gaussians, images: &[TrainingImage]) -> f64 {
    let score = |image: &TrainingImage| {
        let got = render(model, &image.camera, &image.camera_from_world, &RenderOptions::default());
        psnr_f32(&got.color.data, &image.image.to_f32().data)
    };
    images.iter().map(score).sum::<f64>() / images.len() as f64
}

fn run(mut trainer: Trainer, steps: u32) -> Trainer {
    for _ in 0..steps {
        trainer.step();
    }
    trainer
}

#[test]
fn a_known_scene_is_recovered_in_held_out_views() {
    let truth = random_gaussians(1, 60, 1);
    let images = photos(&truth, 9);
    let (held_out, train) = images.split_first().unwrap();
    let start = Trainer::new(train, &points(&truth), None, &options(400), 0).unwrap();
    let before = mean_psnr(&start.model(), std::slice::from_ref(held_out));
    let fitted = run(start, 400);
    assert!(fitted.is_done());
    let after = mean_psnr(&fitted.model(), std::slice::from_ref(held_out));
    assert!(after > 24.0 && after > before + 8.0, "held out: {before:.2} -> {after:.2} dB");
}

#[test]
fn one_two_and_three_threads_give_the_same_bits() {
    let truth = random_gaussians(2, 50, 0);
    let images = photos(&truth, 5);
    let fit = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let dropping =
            FitOptions { dropout: Some(0.3), exposure: ExposureModel::Affine, ..options(120) };
        let start = Trainer::new(&images, &points(&truth), None, &dropping, 5).unwrap();
        pool.install(|| run(start, 120).state)
    };
    let one = fit(1);
    assert!(one.gaussians.len() > 60, "densification took part");
    assert!(fit(2) == one && fit(3) == one);
}

/// Every parameter of the speed of a step, away from its default.
fn fast(iterations: u32) -> FitOptions {
    FitOptions {
        batch_views: 2,
        sh_every: 3,
        adam: AdamRule::Visible,
        skip_backward: 0.5,
        ..options(iterations)
    }
}

#[test]
fn parameters_of_speed_keep_the_bits_over_threads_and_resume() {
    let truth = random_gaussians(2, 50, 0);
    let images = photos(&truth, 5);
    let new = || Trainer::new(&images, &points(&truth), None, &fast(120), 5).unwrap();
    let whole = run(new(), 120);
    assert!(whole.state.skip.skipped > 5, "{:?}", whole.state.skip);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    assert!(pool.install(|| run(new(), 120).state) == whole.state);
    // In the middle of the time in which views are skipped.
    let state = run(new(), 103).state;
    let resumed = Trainer::resume(&images, &points(&truth), state, &fast(120), 5).unwrap();
    assert!(run(resumed, 17).state == whole.state);
}

#[test]
fn every_densification_grows_prunes_and_keeps_the_bits_over_threads() {
    let truth = random_gaussians(2, 50, 0);
    let images = photos(&truth, 6);
    let (held_out, train) = images.split_first().unwrap();
    for densify in [Densify::Pull, Densify::Error, Densify::Relocate] {
        let options = FitOptions { densify, score_views: 3, prune_views: 3, ..options(300) };
        let new = || Trainer::new(train, &points(&truth), None, &options, 5).unwrap();
        let before = mean_psnr(&new().model(), std::slice::from_ref(held_out));
        let whole = run(new(), 300);
        let after = mean_psnr(&whole.model(), std::slice::from_ref(held_out));
        assert!(whole.state.gaussians.len() > 60, "{densify:?}: densification took part");
        assert!(after > before + 5.0, "{densify:?}: {before:.2} -> {after:.2} dB");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        assert!(pool.install(|| run(new(), 300).state) == whole.state, "{densify:?}");
    }
}

#[test]
fn the_dials_of_speed_still_recover_a_scene() {
    let truth = random_gaussians(1, 60, 1);
    let images = photos(&truth, 9);
    let (held_out, train) = images.split_first().unwrap();
    let fitted = run(Trainer::new(train, &points(&truth), None, &fast(300), 0).unwrap(), 300);
    let after = mean_psnr(&fitted.model(), std::slice::from_ref(held_out));
    assert!(after > 24.0, "held out: {after:.2} dB");
}

#[test]
fn a_resumed_fit_equals_an_uninterrupted_one() {
    let truth = random_gaussians(3, 40, 0);
    let images = photos(&truth, 4);
    let new = || Trainer::new(&images, &points(&truth), None, &options(150), 7).unwrap();
    let whole = run(new(), 150);
    // Odd places: within an epoch, between refinements.
    for stop in [1, 53, 119] {
        let state: FitState = run(new(), stop).state;
        let resumed = Trainer::resume(&images, &points(&truth), state, &options(150), 7).unwrap();
        assert!(run(resumed, 150 - stop).state == whole.state, "stopped after {stop}");
    }
}

#[test]
fn frozen_parameters_do_not_move() {
    let truth = random_gaussians(4, 40, 1);
    let images = photos(&truth, 4);
    let frozen = FitOptions {
        freeze: vec![FreezeGroup::Geometry, FreezeGroup::Opacities],
        sh_degree: Some(1),
        ..options(60)
    };
    let mut start = truth.clone();
    start.sh.fill(0.0);
    let trainer = Trainer::new(&images, &points(&truth), Some(start), &frozen, 0).unwrap();
    let fitted = run(trainer, 60).state.gaussians;
    assert_eq!(fitted.means, truth.means);
    assert_eq!(fitted.rotations, truth.rotations);
    assert_eq!(fitted.log_scales, truth.log_scales);
    assert_eq!(fitted.opacity_logits, truth.opacity_logits);
    assert!(fitted.sh.iter().any(|&v| v != 0.0));
}

#[test]
fn degenerate_captures_stay_finite() {
    let truth = random_gaussians(5, 30, 0);
    let mut one = photos(&truth, 1);
    let finite = |state: &FitState| state.gaussians.invalid_rows().is_empty();
    // One view, no points.
    let trainer = Trainer::new(&one, &SparsePoints::default(), None, &options(60), 0).unwrap();
    assert!(finite(&run(trainer, 60).state));
    // All black, all white, fully transparent, everything masked.
    for (value, channels, masked) in [(0, 3, false), (255, 3, false), (0, 4, false), (90, 3, true)]
    {
        one[0].image = ImageU8::filled(72, 56, channels, value).into();
        one[0].mask = masked.then(|| ImageU8::filled(72, 56, 1, 0));
        let trainer = Trainer::new(&one, &points(&truth), None, &options(60), 0).unwrap();
        assert!(finite(&run(trainer, 60).state), "{value} {channels} {masked}");
    }
    assert!(Trainer::new(&[], &points(&truth), None, &options(10), 0).is_err());
}
