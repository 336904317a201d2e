//! Thousands of steps on captures that determine little or nothing.

use glam::DVec3;
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, SparsePoints};
use train_splat::{ExposureModel, FitOptions, Trainer, TrainingImage};

use super::captures::{mean_psnr, options, painted, photographed, ring, truth, turning};

/// Runs to the end and returns the model; every number on the way and in it is finite.
#[track_caller]
fn fit(images: &[TrainingImage], points: &SparsePoints, options: &FitOptions) -> Gaussians {
    let mut trainer = Trainer::new(images, points, None, options, 0).unwrap();
    while !trainer.is_done() {
        let loss = trainer.step().loss;
        let step = trainer.state.step;
        assert!(loss.loss.is_finite() && loss.ssim.is_finite(), "step {step}: {loss:?}");
    }
    let model = trainer.model();
    assert!(model.is_consistent() && model.invalid_rows().is_empty(), "a Gaussian is not finite");
    let second = &trainer.state.moments.second;
    assert!(second.means.as_flattened().iter().all(|v| v.is_finite()), "Adam's memory");
    for image in images {
        let got =
            render(&model, &image.camera, &image.camera_from_world, &RenderOptions::default());
        assert!(got.color.data.iter().all(|v| v.is_finite()), "the rendering of {}", image.name);
    }
    model
}

fn coincident(count: usize) -> SparsePoints {
    SparsePoints { positions: vec![[0.1, 0.2, 0.0]; count], colors: vec![[90, 120, 40]; count] }
}

fn noise(i: usize) -> u8 {
    ((i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 56) as u8
}

#[test]
fn single_color_photos_are_reproduced() {
    for value in [0u8, 255, 77] {
        let images = painted(&ring(5), 3, |_| value);
        let model = fit(&images, &SparsePoints::default(), &options(1500));
        let psnr = mean_psnr(&model, &images);
        assert!(psnr > 20.0, "photos of {value}: {psnr:.2} dB");
    }
}

#[test]
fn noise_is_fitted_without_harm() {
    let images = painted(&ring(5), 3, noise);
    fit(&images, &SparsePoints::default(), &options(1500));
}

#[test]
fn transparent_photos_leave_nothing_opaque() {
    let images = painted(&ring(5), 4, |i| if i % 4 == 3 { 0 } else { noise(i) });
    let model = fit(&images, &SparsePoints::default(), &options(1500));
    for image in &images {
        let options = RenderOptions::default();
        let got = render(&model, &image.camera, &image.camera_from_world, &options);
        let mean = got.alpha.data.iter().sum::<f32>() / got.alpha.data.len() as f32;
        assert!(mean < 0.05, "alpha {mean}");
    }
}

#[test]
fn one_view_is_fitted() {
    let images = photographed(&truth(), super::captures::camera(), &ring(1));
    for points in [SparsePoints::default(), coincident(1), coincident(300)] {
        let model = fit(&images, &points, &options(1500));
        assert!(!model.is_empty(), "{} points", points.len());
    }
}

#[test]
fn cameras_in_one_place_that_look_out_are_fitted() {
    let images = painted(&turning(8), 3, |i| (i / 40 % 256) as u8);
    let model = fit(&images, &SparsePoints::default(), &options(1500));
    let psnr = mean_psnr(&model, &images);
    assert!(psnr > 15.0, "{psnr:.2} dB");
}

#[test]
fn the_same_photo_twice_is_one_view() {
    let mut images = photographed(&truth(), super::captures::camera(), &ring(1));
    images.push(images[0].clone());
    fit(&images, &SparsePoints::default(), &options(500));
}

#[test]
fn points_that_are_not_numbers_are_left_out() {
    let images = photographed(&truth(), super::captures::camera(), &ring(4));
    let mut points = coincident(5);
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE] {
        points.positions.push([value, 0.0, 1.0]);
        points.colors.push([0; 3]);
    }
    fit(&images, &points, &options(300));
}

#[test]
fn every_switch_survives_a_fit_without_information() {
    let images = painted(&ring(3), 3, |_| 128);
    let every = FitOptions {
        exposure: ExposureModel::Affine,
        dropout: Some(0.9),
        opacity_weight: Some(1e3),
        scale_weight: Some(1e3),
        ssim_weight: 1.0,
        max_anisotropy: Some(1.0),
        ..options(1500)
    };
    fit(&images, &coincident(50), &every);
}

#[test]
fn a_start_from_broken_gaussians_recovers() {
    let images = photographed(&truth(), super::captures::camera(), &ring(5));
    let mut start = truth();
    let n = start.len();
    for (i, value) in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, -1e30].into_iter().enumerate()
    {
        start.means[i][0] = value;
        start.rotations[5 + i] = [value; 4];
        start.log_scales[10 + i][1] = value;
        start.opacity_logits[15 + i] = value;
        start.sh[12 * (20 + i)] = value;
    }
    start.rotations[25] = [0.0; 4];
    start.log_scales[26] = [-1e4; 3];
    start.log_scales[27] = [1e4; 3];
    let mut trainer =
        Trainer::new(&images, &SparsePoints::default(), Some(start), &options(600), 0).unwrap();
    while !trainer.is_done() {
        let loss = trainer.step().loss.loss;
        assert!(loss.is_finite(), "{loss}");
    }
    let model = trainer.model();
    assert!(model.invalid_rows().is_empty(), "{:?}", model.invalid_rows());
    assert!(model.len() > n / 2 && mean_psnr(&model, &images) > 20.0);
}

#[test]
fn a_camera_inside_the_points_is_fitted() {
    let mut poses = ring(4);
    poses[0].translation = DVec3::new(0.0, 0.0, 1e-9);
    let truth = truth();
    let images = photographed(&truth, super::captures::camera(), &poses);
    let points =
        SparsePoints { positions: truth.means.clone(), colors: vec![[128; 3]; truth.len()] };
    fit(&images, &points, &options(1000));
}
