use motes_scene::{ImageF32, Pinhole};
use motes_testkit::orbit_pose;

use super::*;
use crate::observation::{Photo, ViewRays};

#[test]
fn slopes_are_those_of_finite_differences() {
    let cost = |p: &Pixel, e: f64| {
        let decode = |v: f64| {
            if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        let encode = |v: f64| {
            if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
        };
        let shown = encode(f64::from(p.slope) * decode(e) + f64::from(p.offset));
        (shown - f64::from(p.seen)).hypot(f64::from(NOISE))
    };
    for slope in [1e-3, 0.2, 1.0, 30.0] {
        for offset in [0.0, 1e-4, 0.3] {
            for (encoded, seen) in [(0.02, 0.3), (0.1, 0.9), (0.5, 0.4), (0.9, 0.0)] {
                let pixel = Pixel { slope, offset, seen };
                let (e, h) = (f64::from(encoded), 1e-6);
                let numeric = (cost(&pixel, e + h) - cost(&pixel, e - h)) / (2.0 * h);
                let found = f64::from(pixel.slope_at(encoded));
                let off = (found - numeric).abs();
                assert!(off < 1e-3 * numeric.abs().max(1e-2), "{numeric} {found}");
            }
        }
    }
}

#[test]
fn slopes_are_finite_at_the_extremes() {
    for slope in [0.0, 1e-30, 1e30] {
        for offset in [0.0, -1.0, 1e30] {
            for e in [0.0, -1.0, 1.0, 5.0] {
                let found = Pixel { slope, offset, seen: 0.5 }.slope_at(e);
                assert!(found.is_finite(), "{slope} {offset} {e}: {found}");
            }
        }
    }
}

#[test]
fn rows_that_are_not_finite_are_taken_back() {
    let start = motes_testkit::random_gaussians(3, 4, 1);
    let base = start.colored(|_| [0.4; 3]);
    let (mut model, mut other) = (start.clone(), base.clone());
    model.means[1][2] = f32::NAN;
    other.sh[9] = f32::INFINITY;
    (model.sh[5], other.sh[2]) = (0.25, 0.125);
    keep_finite([&mut model, &mut other], [&start, &base]);
    assert_eq!((model.sh[5], other.sh[2]), (0.25, 0.125), "a finite row keeps what it has");
    assert_eq!(model, Gaussians { sh: model.sh.clone(), ..start });
    assert_eq!(other.sh[9], base.sh[9]);
}

/// A photo of `gaussians` whose linear values are what they show times `factor`.
fn photo(gaussians: &Gaussians, options: &RenderOptions, factor: f32, gain: f32) -> Photo {
    let camera = Pinhole { fx: 24.0, fy: 24.0, cx: 12.0, cy: 10.0, width: 24, height: 20 };
    let pose = orbit_pose(0.2);
    let shown = render(gaussians, &camera, &pose, options).color;
    let radiance = shown.data.iter().map(|&v| factor * srgb::decode(v)).collect();
    Photo {
        name: "photo".into(),
        camera,
        camera_from_world: pose,
        radiance_linear: ImageF32::from_data(24, 20, 3, radiance).into(),
        gain: [gain; 3],
        light: 0,
        usable: vec![true; 24 * 20],
        clipped: Vec::new(),
    }
}

#[test]
fn photos_keep_their_exposures_where_training_did() {
    let (start, render) = (motes_testkit::random_gaussians(3, 20, 0), RenderOptions::default());
    let of = |factor: f32, gain: f32| {
        let photo = photo(&start, &render, factor, gain);
        let view = SeenView { photo: &photo, rays: ViewRays::new(&photo), hits: Vec::new() };
        PhotoFit { views: &[view], shadings: &[], render: &render, seed: 0 }.captured_gains(&start)
    };
    // The Gaussians show what was taken at half the exposure: the developed photo is twice as bright.
    assert_eq!(of(2.0, 0.5), [[0.5; 3]]);
    assert_eq!(of(1.0, 0.5), [[1.0; 3]], "the Gaussians have the mean exposure");
    assert_eq!(of(1.0, 1.0), [[1.0; 3]]);
}
