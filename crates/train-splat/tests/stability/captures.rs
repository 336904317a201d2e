//! Small captures in memory.

use glam::DVec3;
use motes_math::metrics::psnr_f32;
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, ImageU8, Pinhole, Pose};
use motes_testkit::{random_gaussians, small_camera};
use train_splat::{FitOptions, TrainingImage};

/// Cameras on a circle of radius 3 around the origin, looking at it.
pub(super) fn ring(views: usize) -> Vec<Pose> {
    let eye = |i: usize| {
        let angle = 0.7 * i as f64;
        DVec3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 0.8)
    };
    (0..views).map(|i| Pose::look_at(eye(i), DVec3::ZERO, DVec3::Z).unwrap()).collect()
}

/// Cameras in one place, looking out in all directions.
pub(super) fn turning(views: usize) -> Vec<Pose> {
    let target = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / views as f64;
        DVec3::new(angle.cos(), angle.sin(), 0.1)
    };
    (0..views).map(|i| Pose::look_at(DVec3::ZERO, target(i), DVec3::Z).unwrap()).collect()
}

pub(super) fn camera() -> Pinhole {
    small_camera(40, 30)
}

/// Photos through `poses` whose pixels `paint` makes from their number.
pub(super) fn painted(
    poses: &[Pose],
    channels: usize,
    paint: impl Fn(usize) -> u8,
) -> Vec<TrainingImage> {
    let camera = camera();
    let length = camera.width * camera.height * channels;
    let photo = |(i, pose): (usize, &Pose)| TrainingImage {
        name: format!("view {i}"),
        camera,
        camera_from_world: *pose,
        image: ImageU8::from_data(
            camera.width,
            camera.height,
            channels,
            (0..length).map(|k| paint(i * length + k)).collect(),
        )
        .into(),
        mask: None,
        exposure_gain: 1.0,
    };
    poses.iter().enumerate().map(photo).collect()
}

/// Photos of known Gaussians.
pub(super) fn photographed(
    truth: &Gaussians,
    camera: Pinhole,
    poses: &[Pose],
) -> Vec<TrainingImage> {
    let photo = |(i, pose): (usize, &Pose)| TrainingImage {
        name: format!("view {i}"),
        camera,
        camera_from_world: *pose,
        image: render(truth, &camera, pose, &RenderOptions::default()).color.to_u8().into(),
        mask: None,
        exposure_gain: 1.0,
    };
    poses.iter().enumerate().map(photo).collect()
}

pub(super) fn truth() -> Gaussians {
    random_gaussians(1, 60, 1)
}

pub(super) fn options(iterations: u32) -> FitOptions {
    FitOptions {
        iterations: Some(iterations),
        max_gaussians: Some(300),
        init_random: 200,
        refine_every: Some(50),
        resolution_schedule: Some("0.5:0.3,1:0.7".into()),
        ..FitOptions::default()
    }
}

pub(super) fn mean_psnr(model: &Gaussians, images: &[TrainingImage]) -> f64 {
    let score = |image: &TrainingImage| {
        let got = render(model, &image.camera, &image.camera_from_world, &RenderOptions::default());
        psnr_f32(&got.color.data, &image.image.to_f32().data)
    };
    images.iter().map(score).sum::<f64>() / images.len() as f64
}
