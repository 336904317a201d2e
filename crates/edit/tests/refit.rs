//! A filling is fitted to what photos show of it, and nothing else changes.

mod box_on_ground;

use std::sync::Arc;

use box_on_ground::{BOX, environment, rows_of_box, state};
use edit::refit::{Fills, RefitOptions, RefitReport, Refitted, refit};
use edit::reshade::{ReshadeOptions, reshade};
use edit::{EditState, Fill};
use glam::{DMat3, DQuat, DVec3};
use motes_math::tone_curve::ToneCurve;
use motes_raster::{Antialias, RenderOptions, render};
use motes_scene::{Gaussians, ImageU8, Pinhole, Pose};
use train_splat::TrainingImage;

const OPTIONS: RefitOptions = RefitOptions { steps: 250, seed: 1, antialias: Antialias::Classic };

/// Photos of Gaussians from around, by cameras of differing exposure.
fn photos(gaussians: &Gaussians) -> Vec<TrainingImage> {
    let camera = Pinhole { fx: 300.0, fy: 300.0, cx: 64.0, cy: 48.0, width: 128, height: 96 };
    let look = |k: usize| {
        let (sin, cos) = (k as f64 * std::f64::consts::TAU / 6.0).sin_cos();
        let eye = DVec3::new(1.6 * cos, 1.6 * sin, 1.7);
        let forward = -eye.normalize();
        let right = forward.cross(DVec3::Z).normalize();
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        Pose::new(DQuat::from_mat3(&rotation), rotation * -eye).expect("a pose")
    };
    let photo = |k: usize| {
        let camera_from_world = look(k);
        let image = render(gaussians, &camera, &camera_from_world, &RenderOptions::default()).color;
        TrainingImage {
            name: format!("view {k}"),
            camera,
            camera_from_world,
            image: Arc::new(image.to_u8()),
            mask: None,
            exposure_gain: 1.0,
        }
    };
    (0..6).map(photo).collect()
}

/// A scene without its box, its filling spotted, and the photos of before.
fn spotted() -> (EditState, Fills, Vec<TrainingImage>) {
    let (mut state, fills, photos) = filled();
    // Two stripes per side of the box: coarse enough to be seen, finer than the filling.
    for row in &fills.filled {
        let [x, y, _] = state.gaussians.means[*row as usize];
        let stripe = (((x + y) / (0.7 * BOX)).floor() as i32).rem_euclid(2);
        state.gaussians.sh[3 * *row as usize] += if stripe == 0 { 0.7 } else { -0.7 };
    }
    (state, fills, photos)
}

/// The same without spots.
fn filled() -> (EditState, Fills, Vec<TrainingImage>) {
    let mut state = state(&[[0.0, 0.0]]);
    let photos = photos(&state.gaussians);
    // With ground around it, as a loose selection has: photos see that, but not what is under the box.
    let is_near = |m: &[f32; 3]| m[2] < 0.01 && m[0].abs().max(m[1].abs()) < 1.2 * BOX;
    let near = (0..state.len() as u32).filter(|i| is_near(&state.gaussians.means[*i as usize]));
    let mut rows: Vec<u32> = rows_of_box(&state, [0.0, 0.0]).into_iter().chain(near).collect();
    rows.sort_unstable();
    state.remove(&rows, Fill::Plane);
    let (_, report) = reshade(&mut state, &ReshadeOptions::default()).expect("light follows");
    let fills = report.fills;
    assert!(fills.filled.len() > 20 && fills.rim.len() > 20, "{fills:?}");
    (state, fills, photos)
}

fn done(refitted: Refitted) -> RefitReport {
    match refitted {
        Refitted::Done(report) => report,
        other => panic!("{other:?}"),
    }
}

/// Root mean square difference of pictures of the ground beside the place of the box, where the photos of before show what is wanted:
/// not the box, nor its shadow.
fn error_beside(gaussians: &Gaussians, wanted: &Gaussians, before: &[TrainingImage]) -> f64 {
    let (shown, wanted) = (photos(gaussians), photos(wanted));
    let (mut squares, mut count) = (0.0, 0);
    for ((a, b), photo) in shown.iter().zip(&wanted).zip(before) {
        let [x, y, z] = [a, b, photo].map(|image| image.image.data.chunks(3));
        for (p, ((x, y), z)) in x.zip(y).zip(z).enumerate() {
            let is_told = y.iter().zip(z).all(|(y, z)| y.abs_diff(*z) < 16);
            if is_told && is_beside(a, p) {
                let square = |(x, y): (&u8, &u8)| (f64::from(*x) - f64::from(*y)).powi(2);
                squares += x.iter().zip(y).map(square).sum::<f64>();
                count += 3;
            }
        }
    }
    assert!(count > 1000, "{count}");
    (squares / f64::from(count)).sqrt()
}

/// Whether a pixel shows ground near the place of the box, not under it.
fn is_beside(photo: &TrainingImage, pixel: usize) -> bool {
    let camera = &photo.camera;
    let (x, y) = ((pixel % camera.width) as f64 + 0.5, (pixel / camera.width) as f64 + 0.5);
    let direction = DVec3::new((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
    let back = photo.camera_from_world.inverse();
    let eye = back.transform_point(DVec3::ZERO);
    let ray = back.transform_point(direction) - eye;
    let hit = eye - ray * (eye.z / ray.z);
    let distance = hit.x.abs().max(hit.y.abs()) / f64::from(BOX);
    ray.z < 0.0 && (1.1..1.45).contains(&distance)
}

#[test]
fn a_spotted_filling_becomes_what_photos_show_and_nothing_else_changes() {
    let (mut state, fills, photos) = spotted();
    let even = filled().0.gaussians;
    let before = state.gaussians.clone();
    let report = done(refit(&mut state, &fills, &photos, &OPTIONS, &|| false));
    assert!(report.views == 6 && report.photo_share > 0.2, "{report:?}");
    assert!(report.residual[1] < 0.65 * report.residual[0], "{report:?}");
    let [was, is] = [&before, &state.gaussians].map(|g| error_beside(g, &even, &photos));
    assert!(is < 0.95 * was, "{is} after {was}, {report:?}");
    let fitted = [&fills.filled[..], &fills.rim].concat();
    let mut expected = before.clone();
    let mut changed = 0;
    for row in fitted.into_iter().map(|row| row as usize) {
        changed += usize::from(before.sh_of(row) != state.gaussians.sh_of(row));
        expected.sh[3 * row..][..3].copy_from_slice(state.gaussians.sh_of(row));
        expected.means[row] = state.gaussians.means[row];
        expected.rotations[row] = state.gaussians.rotations[row];
        expected.log_scales[row] = state.gaussians.log_scales[row];
        expected.opacity_logits[row] = state.gaussians.opacity_logits[row];
    }
    assert!(changed > 20, "{changed}");
    assert!(expected == state.gaussians, "other rows keep their bytes");
}

#[test]
fn the_tone_curve_of_the_photos_is_taken_off_first() {
    let (state, fills, photos) = spotted();
    let options = RefitOptions { steps: 1, ..OPTIONS };
    let residual = |state: &EditState, photos: &[TrainingImage]| {
        let report = done(refit(&mut state.clone(), &fills, photos, &options, &|| false));
        assert!(report.photo_share > 0.2, "{report:?}");
        report.residual[0]
    };
    let curve = ToneCurve::new(0.6);
    let mut shown = photos.clone();
    for photo in &mut shown {
        let image = Arc::make_mut(&mut photo.image);
        let of = |v: u8| (curve.apply(f32::from(v) / 255.0) * 255.0).round() as u8;
        image.data.iter_mut().for_each(|v| *v = of(*v));
    }
    let mut known = state.clone();
    known.parts.as_mut().expect("a scene").tone_curve = curve;
    let linear = residual(&state, &photos);
    let [taken_off, left_on] = [residual(&known, &shown), residual(&state, &shown)];
    assert!((taken_off - linear).abs() < 0.02 * linear, "{taken_off} for {linear}");
    assert!((left_on - linear).abs() > 0.05 * linear, "{left_on} for {linear}");
}

#[test]
fn threads_and_a_second_run_do_not_matter() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let (mut state, fills, photos) = spotted();
            let options = RefitOptions { steps: 15, ..OPTIONS };
            let report = done(refit(&mut state, &fills, &photos, &options, &|| false));
            (state.gaussians, report)
        })
    };
    assert!(run(1) == run(3), "one thread or three");
}

#[test]
fn what_cannot_be_fitted_is_left_alone_and_said() {
    let (mut state, fills, mut photos) = spotted();
    let before = state.gaussians.clone();
    let stopped = refit(&mut state, &fills, &photos, &OPTIONS, &|| true);
    assert_eq!(stopped, Refitted::Stopped);
    for photo in &mut photos {
        photo.mask = Some(ImageU8::filled(128, 96, 1, 0));
    }
    let masked = refit(&mut state, &fills, &photos, &OPTIONS, &|| false);
    assert_eq!(masked, Refitted::Skipped("no photo shows what was uncovered"));
    let none = refit(&mut state, &Fills::default(), &photos, &OPTIONS, &|| false);
    assert_eq!(none, Refitted::Skipped("nothing was filled"));
    if let Some(parts) = &mut state.parts {
        (parts.environment, parts.environment_changed) = (environment(), true);
    }
    let dark = refit(&mut state, &fills, &photos, &OPTIONS, &|| false);
    assert!(matches!(dark, Refitted::Skipped(why) if why.contains("another light")), "{dark:?}");
    assert_eq!(state.gaussians, before);
}
