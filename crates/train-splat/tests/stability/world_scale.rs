//! The unit of length and the origin are the source's business: no result depends on them.

use glam::DVec3;
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, Pose, SparsePoints, UnitWorld};
use motes_testkit::small_camera;
use train_splat::{Trainer, TrainingImage};

use super::captures::{mean_psnr, options, photographed, ring, truth};

/// The capture in a world where `p` is `scale p + shift`: photos, poses there, points there.
fn moved(scale: f64, shift: DVec3) -> (Vec<TrainingImage>, Vec<Pose>, Vec<DVec3>) {
    let truth = truth();
    let images = photographed(&truth, small_camera(72, 56), &ring(9));
    let pose = |image: &TrainingImage| {
        let center = image.camera_from_world.center_in_world() * scale + shift;
        let rotation = image.camera_from_world.rotation;
        Pose { rotation, translation: -(rotation * center) }
    };
    let poses = images.iter().map(pose).collect();
    let point = |m: &[f32; 3]| glam::Vec3::from(*m).as_dvec3() * scale + shift;
    (images, poses, truth.means.iter().map(point).collect())
}

/// Fits in the unit world, as `train-splat` does; the model in the unit world and held-out PSNR.
fn fitted(scale: f64, shift: DVec3, with_points: bool) -> (Gaussians, f64) {
    let (mut images, poses, positions) = moved(scale, shift);
    let centers: Vec<DVec3> = poses.iter().map(Pose::center_in_world).collect();
    let unit = UnitWorld::of(&centers, positions.iter().copied());
    for (image, pose) in images.iter_mut().zip(&poses) {
        image.camera_from_world = unit.pose(pose);
    }
    let mut points = SparsePoints::default();
    if with_points {
        points.positions = positions.iter().map(|p| unit.point(*p).as_vec3().to_array()).collect();
        points.colors = vec![[128; 3]; positions.len()];
    }
    let (held_out, train) = images.split_first().unwrap();
    let mut trainer = Trainer::new(train, &points, None, &options(400), 0).unwrap();
    while !trainer.is_done() {
        trainer.step();
    }
    let model = trainer.model();
    let psnr = mean_psnr(&model, std::slice::from_ref::<TrainingImage>(held_out));
    (model, psnr)
}

#[test]
fn the_size_and_place_of_the_world_do_not_change_a_bit_of_the_fit() {
    for with_points in [true, false] {
        let (one, psnr) = fitted(1.0, DVec3::ZERO, with_points);
        for (scale, shift) in [
            (1e-6, DVec3::ZERO),
            (1e-3, DVec3::ZERO),
            (0.3048, DVec3::new(1.0, 2.0, 3.0)),
            (1e6, DVec3::ZERO),
            (10.0, DVec3::new(5e5, 5.4e6, 300.0)),
        ] {
            let (other, other_psnr) = fitted(scale, shift, with_points);
            let moved = (other_psnr - psnr).abs();
            assert!(moved < 0.01, "{scale:e} {shift}: {psnr:.4} dB, now {other_psnr:.4} dB");
            assert!(other == one, "{scale:e} {shift}: bits differ");
        }
    }
}

#[test]
fn a_scaled_model_renders_the_same_picture() {
    let truth = truth();
    let camera = small_camera(72, 56);
    let pose = ring(1)[0];
    let options = RenderOptions { aovs: true, ..RenderOptions::default() };
    let one = render(&truth, &camera, &pose, &options);
    for exponent in [-6, -3, 3, 6] {
        let unit = UnitWorld { origin: DVec3::ZERO, length: 10f64.powi(exponent) };
        let scaled = unit.gaussians_in_world(truth.clone());
        let moved = Pose { translation: pose.translation * unit.length, ..pose };
        let other = render(&scaled, &camera, &moved, &options);
        for (a, b) in one.color.data.iter().zip(&other.color.data) {
            assert!((a - b).abs() < 1e-4, "1e{exponent}: {a} {b}");
        }
        let depth =
            |r: &motes_raster::Rendering| r.aovs.as_ref().unwrap().depth_expected.data[2000];
        let ratio = f64::from(depth(&other)) / f64::from(depth(&one)) / unit.length;
        assert!((ratio - 1.0).abs() < 1e-4, "1e{exponent}: depth {ratio}");
    }
}
