//! The fast agreement against one loop per equation in f64.

use fearless_simd::Level;
use glam::{DVec3, Quat, Vec2};
use motes_math::rng::keyed_rng;
use motes_scene::{Pinhole, Pose};
use rand::RngExt as _;

use super::super::view::Shown;
use super::*;

const WIDTH: usize = 40;
const HEIGHT: usize = 30;

/// Views of a plane `z = 0` from 2 units away with a smooth random picture; every third ignores its left part.
fn views(count: usize) -> Vec<View> {
    let of = |k: usize| {
        let mut rng = keyed_rng(3, 7, k as u64);
        let phase: [f32; 4] = std::array::from_fn(|_| rng.random::<f32>() * 6.0);
        let luma = (0..WIDTH * HEIGHT).map(|i| {
            let (x, y) = ((i % WIDTH) as f32, (i / WIDTH) as f32);
            let common = (0.9 * x + 0.4 * y).sin() + (0.7 * y - 0.2 * x).cos();
            let own = (1.3 * x + phase[0]).sin() * (1.1 * y + phase[1]).sin();
            0.5 + 0.1 * common + 0.02 * k as f32 * own
        });
        let mut shown = vec![Shown::Whole; WIDTH * HEIGHT];
        if k % 3 == 1 {
            shown
                .iter_mut()
                .enumerate()
                .filter(|(i, _)| i % WIDTH < 12)
                .for_each(|(_, w)| *w = Shown::Clipped);
        }
        let camera =
            Pinhole { fx: 40.0, fy: 42.0, cx: 20.0, cy: 15.0, width: WIDTH, height: HEIGHT };
        let tilt =
            Quat::from_rotation_y(0.02 * k as f32) * Quat::from_rotation_x(std::f32::consts::PI);
        View {
            rotation: glam::Mat3::from_quat(tilt),
            center: Vec3::new(0.03 * k as f32, 0.0, 2.0),
            focal: Vec2::new(40.0, 42.0),
            principal: Vec2::new(20.0, 15.0),
            width: WIDTH,
            height: HEIGHT,
            camera,
            camera_from_unit: Pose::IDENTITY,
            luma: luma.collect(),
            color: vec![[0; 3]; WIDTH * HEIGHT],
            whole: shown.iter().all(|s| *s == Shown::Whole),
            shown,
        }
    };
    (0..count).map(of).collect()
}

fn patch(center: Vec3) -> Patch {
    let (along, across) = (Vec3::new(0.05, 0.004, 0.0), Vec3::new(-0.003, 0.05, 0.0));
    Patch { center, along, across, lift: Vec3::new(0.0, 0.0, -0.002) }
}

/// The copy of a patch in a view, without its mean and of length 1.
fn slow_copy(view: &View, patch: &Patch) -> Option<Vec<f64>> {
    let (mut values, mut ignored) = (Vec::new(), 0.0);
    let half = (SIDE / 2) as i32;
    for j in -half..=half {
        for i in -half..=half {
            let lift = patch.lift * (i * i + j * j) as f32;
            let p = patch.center + patch.along * i as f32 + patch.across * j as f32 + lift;
            let q = view.project(p)?;
            let (luma, weight) = view.luma_at(q.x, q.y)?;
            values.push(f64::from(luma));
            ignored += 1.0 - f64::from(weight);
        }
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|v| *v -= mean);
    let norm = values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let flat = norm <= 7.0 * f64::from(LEAST_CONTRAST);
    (!flat && ignored <= 0.25 * 49.0).then(|| values.iter().map(|v| v / norm).collect())
}

/// Score and sum of weights: correlation of each copy with the weighted sum of the others, twice.
fn slow_agreement(views: &[View], patch: &Patch) -> Option<(f64, f64)> {
    let copies: Vec<Vec<f64>> = views.iter().filter_map(|v| slow_copy(v, patch)).collect();
    let mut weights = vec![1.0; copies.len()];
    let correlation = |k: usize, weights: &[f64]| {
        let mut others = vec![0.0; SAMPLES];
        for (copy, w) in
            copies.iter().zip(weights).enumerate().filter(|(i, _)| *i != k).map(|(_, p)| p)
        {
            others.iter_mut().zip(copy).for_each(|(o, c)| *o += w * c);
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        dot(&copies[k], &others) / dot(&others, &others).sqrt()
    };
    let first: Vec<f64> = (0..copies.len()).map(|k| correlation(k, &weights)).collect();
    weights = first.iter().map(|c| ((c + 0.2) / 0.8).clamp(0.05, 1.0)).collect();
    let total: f64 = weights.iter().sum();
    let sum: f64 = (0..copies.len()).map(|k| weights[k] * correlation(k, &weights)).sum();
    (copies.len() > 1).then_some((sum / total, total))
}

#[test]
fn agreement_is_that_of_the_slow_reference() {
    let views = views(7);
    let all: Vec<u16> = (0..7).collect();
    let mut compared = 0;
    for k in 0..60 {
        let mut rng = keyed_rng(5, 11, k);
        let mut at = || rng.random::<f32>() * 2.4 - 1.2;
        let patch = patch(Vec3::new(at(), 0.7 * at(), 0.1 * at()));
        let (fast, slow) = (agreement(&views, &all, &patch), slow_agreement(&views, &patch));
        assert_eq!(fast.is_some(), slow.is_some(), "{patch:?}");
        let (Some(fast), Some((score, photos))) = (fast, slow) else { continue };
        assert!((f64::from(fast.score) - score).abs() < 2e-4, "{fast:?} {score}");
        assert!((f64::from(fast.photos) - photos).abs() < 2e-3, "{fast:?} {photos}");
        compared += 1;
    }
    assert!((20..60).contains(&compared), "{compared}");
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let views = views(5);
    let patch = patch(Vec3::new(0.1, -0.05, 0.0));
    let all: Vec<u16> = (0..5).collect();
    let bits = |level: Level| {
        let a = dispatch!(level, simd => agreement_on(simd, &views, &all, &patch));
        a.map(|a| [a.score, a.photos, a.spread].map(f32::to_bits))
    };
    assert!(bits(Level::new()).is_some());
    assert_eq!(bits(Level::new()), bits(Level::baseline()));
}

#[test]
fn nothing_is_read_outside_of_a_picture_or_behind_a_camera() {
    let views = views(3);
    for center in [Vec3::splat(1e30), Vec3::splat(f32::NAN), Vec3::Z * 5.0, DVec3::X.as_vec3()] {
        assert!(agreement(&views, &[0, 1, 2], &patch(center)).is_none(), "{center}");
    }
}
