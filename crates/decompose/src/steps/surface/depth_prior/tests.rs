//! A textured frame around a wall of one color.

use glam::Vec3;
use motes_math::rng::keyed_rng;
use motes_scene::UnitWorld;
use rand::RngExt as _;

use super::super::extract::tests::photos;
use super::*;

/// A view whose photo has texture where `textured` says so, and noise of 1/255 all over.
fn view(textured: impl Fn(usize, usize) -> bool) -> View {
    let mut photo = photos(1, 1.0, glam::DVec3::ZERO).remove(0);
    let mut random = keyed_rng(5, 0, 0);
    let width = photo.camera.width;
    for (k, pixel) in photo.radiance_linear.floats_mut().iter_mut().enumerate() {
        let (x, y) = (k % width, k / width);
        let noise = (random.random::<f32>() - 0.5) * 2.0 / 255.0;
        let pattern = if textured(x, y) { 0.2 * (random.random::<f32>() - 0.5) } else { 0.0 };
        pixel.fill((0.7 + pattern + noise).powf(2.2));
    }
    let unit = UnitWorld::of(
        &[photo.camera_from_world.center_in_world()],
        [glam::DVec3::ZERO].into_iter(),
    );
    View::new(&photo, &unit)
}

/// Depth of a plane before the camera.
fn plane(view: &View, normal: Vec3, distance: f32) -> Vec<f32> {
    let of = |k: usize| {
        let x = (k % view.width) as f32 + 0.5;
        let y = (k / view.width) as f32 + 0.5;
        let d = ((glam::Vec2::new(x, y) - view.principal) / view.focal).extend(1.0);
        distance / normal.dot(d)
    };
    (0..view.width * view.height).map(of).collect()
}

/// Largest and mean error over `inside`, voxels.
fn errors(found: &[f32], truth: &[f32], voxel: f32, inside: impl Fn(usize) -> bool) -> (f32, f32) {
    let off: Vec<f32> = (0..truth.len())
        .filter(|&k| inside(k))
        .map(|k| (found[k] - truth[k]).abs() / voxel)
        .collect();
    (off.iter().fold(0.0, |a, &b| a.max(b)), off.iter().sum::<f32>() / off.len() as f32)
}

#[test]
fn a_wall_without_texture_becomes_the_plane_of_its_frame() {
    let framed = |x: usize, y: usize| !(30..130).contains(&x) || !(25..95).contains(&y);
    let view = view(framed);
    let truth = plane(&view, Vec3::new(0.4, -0.2, 1.0).normalize(), 1.0);
    let voxel = 1.5 * view.footprint();
    // Bumps as wide as large Gaussians, twelve voxels high.
    let bump = |k: usize| {
        let (x, y) = (k % view.width, k / view.width);
        if framed(x, y) {
            0.0
        } else {
            12.0 * voxel * (0.21 * x as f32).sin() * (0.17 * y as f32).cos()
        }
    };
    let bumpy: Vec<f32> = truth.iter().enumerate().map(|(k, z)| z + bump(k)).collect();
    let mut maps = [DepthMap { depth: bumpy.clone() }];
    let mut front = maps.clone();
    let share = smooth_untextured(std::slice::from_ref(&view), &mut maps, &mut front, voxel, 0.2);
    let inside =
        |k: usize| (40..120).contains(&(k % view.width)) && (35..85).contains(&(k / view.width));
    let (_, before) = errors(&bumpy, &truth, voxel, inside);
    let (worst, mean) = errors(&maps[0].depth, &truth, voxel, inside);
    println!("{share} of the pixels, mean {before} to {mean} voxels, worst {worst}");
    assert!((0.25..0.45).contains(&share), "{share}");
    assert!(mean < 0.7 && worst < 4.0 && before > 4.5, "{before} to {mean}, worst {worst}");
    let outside =
        |k: usize| framed((k % view.width).max(3) - 3, k / view.width) && k % view.width > 140;
    let (worst, _) = errors(&maps[0].depth, &truth, voxel, outside);
    assert!(worst < 0.1, "what has texture stays: {worst}");
}

#[test]
fn two_walls_keep_their_corner_and_a_step_stays_a_step() {
    let framed = |x: usize, y: usize| !(20..140).contains(&x) || !(20..100).contains(&y);
    // The line where they meet is seen.
    let view = view(|x, y| framed(x, y) || (78..83).contains(&x));
    let voxel = 1.5 * view.footprint();
    let left = plane(&view, Vec3::new(-0.6, 0.0, 1.0).normalize(), 1.0);
    let right = plane(&view, Vec3::new(0.6, 0.0, 1.0).normalize(), 1.0);
    let corner: Vec<f32> = left.iter().zip(&right).map(|(a, b)| a.min(*b)).collect();
    let step: Vec<f32> = (0..corner.len()).map(|k| if k % 160 < 80 { 1.0 } else { 1.3 }).collect();
    for truth in [corner, step] {
        let mut maps = [DepthMap { depth: truth.clone() }];
        let mut front = maps.clone();
        smooth_untextured(std::slice::from_ref(&view), &mut maps, &mut front, voxel, 0.2);
        let far = |k: usize| (k % 160).abs_diff(80) > 4;
        let (worst, mean) = errors(&maps[0].depth, &truth, voxel, far);
        println!("mean {mean}, worst {worst} voxels");
        assert!(mean < 0.2 && worst < 3.0, "mean {mean}, worst {worst}");
    }
}

#[test]
fn weight_zero_and_depth_zero_change_nothing() {
    let view = view(|_, _| false);
    let mut maps = [DepthMap { depth: vec![0.0; view.width * view.height] }];
    let mut front = maps.clone();
    assert_eq!(
        smooth_untextured(std::slice::from_ref(&view), &mut maps, &mut front, 0.01, 0.2),
        0.0
    );
    assert!(maps[0].depth.iter().all(|z| *z == 0.0));
    let depth: Vec<f32> = (0..maps[0].depth.len()).map(|k| 1.0 + 0.1 * (k % 7) as f32).collect();
    let mut maps = [DepthMap { depth: depth.clone() }];
    smooth_untextured(std::slice::from_ref(&view), &mut maps, &mut front, 0.01, 0.0);
    assert_eq!(maps[0].depth, depth);
}
