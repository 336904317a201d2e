use motes_math::rng::keyed_rng;
use rand::RngExt as _;

use super::*;

const GAMMA: f64 = 2.2;

/// Radiance over five decades, smooth, with a patch that shines.
fn radiance(x: usize, y: usize) -> [f64; 3] {
    let base = (x as f64 / 12.0).exp2() * 0.002 * (1.0 + 0.5 * (y as f64 / 9.0).sin());
    [base, 0.8 * base, 0.5 * base + 0.01]
}

/// What a camera of gamma 2.2 with noise sees of it for `t`; `ghost` puts a bright square into it.
fn photo(stops: f64, seed: u64, ghost: bool) -> Exposed {
    let (w, h) = (160, 60);
    let mut random = keyed_rng(seed, 7, 0);
    let mut image = ImageF32::filled(w, h, 3, 0.0);
    for y in 0..h {
        for x in 0..w {
            let inside = ghost && (60..90).contains(&x) && (20..40).contains(&y);
            for c in 0..3 {
                let e = if inside { 0.3 } else { radiance(x, y)[c] };
                let noise = 0.003 * (random.random::<f64>() - 0.5);
                let v = ((e * stops.exp2()).powf(1.0 / GAMMA) + noise).clamp(0.0, 1.0);
                image.pixel_mut(x, y)[c] = ((v * 255.0).round() / 255.0) as f32;
            }
        }
    }
    Exposed { image, stops }
}

fn series(ghost: Option<usize>) -> Vec<Exposed> {
    let stops = [-5.0, -3.0, -1.0, 1.0, 3.0];
    stops.iter().enumerate().map(|(j, s)| photo(*s, j as u64, ghost == Some(j))).collect()
}

#[test]
fn the_curve_of_a_known_camera_is_found() {
    let Response::Curve(curves) = Response::find(&series(None)).unwrap() else { panic!() };
    for curve in curves.iter() {
        for z in [16, 32, 64, 96, 160, 192, 224, 240] {
            let expected = GAMMA * (z as f64 / 128.0).ln();
            assert!((curve[z] - expected).abs() < 0.08, "{z}: {} {expected}", curve[z]);
        }
        assert!(curve.windows(2).all(|pair| pair[1] >= pair[0]));
    }
}

#[test]
fn merged_radiance_is_true_where_one_picture_is_well_exposed() {
    let series = series(None);
    let merged = merge(&series, &Response::find(&series).unwrap(), &MergeOptions::default());
    let merged = merged.unwrap();
    // One factor for all: the unit of the reference.
    let scale = f64::from(merged.radiance.pixel(80, 30)[0]) / radiance(80, 30)[0];
    let mut worst = 0.0f64;
    for y in 0..60 {
        for x in 24..150 {
            let ratio = f64::from(merged.radiance.pixel(x, y)[0]) / (scale * radiance(x, y)[0]);
            worst = worst.max(ratio.ln().abs());
        }
    }
    assert!(worst < 0.15, "{worst}");
    // Chance alone calls a few neighborhoods of black pixels inconsistent.
    assert!(merged.ghosts < 0.01, "{}", merged.ghosts);
}

#[test]
fn what_moved_is_left_out_and_stays_without_the_test() {
    let series = series(Some(3));
    assert_ne!(reference(&series), 3);
    let response = Response::find(&series).unwrap();
    let with = merge(&series, &response, &MergeOptions { deghost: true }).unwrap();
    let without = merge(&series, &response, &MergeOptions { deghost: false }).unwrap();
    let scale = f64::from(with.radiance.pixel(120, 30)[0]) / radiance(120, 30)[0];
    let off = |merged: &Merged| {
        let at = f64::from(merged.radiance.pixel(75, 30)[0]);
        (at / (scale * radiance(75, 30)[0])).ln().abs()
    };
    assert!(off(&with) < 0.1, "{}", off(&with));
    assert!(off(&without) > 0.15, "the square shows without the test: {}", off(&without));
    let share = 30.0 * 20.0 / (160.0 * 60.0) / 4.0;
    assert!((0.7 * share..1.5 * share).contains(&with.ghosts), "{} {share}", with.ghosts);
}

#[test]
fn what_saturates_in_all_pictures_is_a_lower_bound() {
    let mut series = series(None);
    for e in &mut series {
        e.image.pixel_mut(10, 10).fill(1.0);
    }
    let merged =
        merge(&series, &Response::find(&series).unwrap(), &MergeOptions { deghost: false });
    let merged = merged.unwrap();
    assert!(merged.clipped[10 * 160 + 10]);
    assert!(!merged.clipped[30 * 160 + 30]);
    assert!(merged.radiance.data.iter().all(|v| v.is_finite() && *v >= 0.0));
}

#[test]
fn linear_pictures_need_no_curve() {
    let linear = |stops: f64| {
        let mut e = photo(stops, 0, false);
        for y in 0..60 {
            for x in 0..160 {
                let l = radiance(x, y).map(|v| (v * stops.exp2()).min(1.0) as f32);
                e.image.pixel_mut(x, y).copy_from_slice(&l);
            }
        }
        e
    };
    let series: Vec<Exposed> = [-4.0, -1.0, 2.0].map(linear).into();
    let merged = merge(&series, &Response::Linear, &MergeOptions::default()).unwrap();
    let unit = series[merged.reference].stops.exp2();
    for (x, y) in [(20, 10), (80, 50), (140, 3)] {
        let ratio = f64::from(merged.radiance.pixel(x, y)[1]) / (unit * radiance(x, y)[1]);
        assert!((ratio - 1.0).abs() < 1e-4, "{x} {y} {ratio}");
    }
}

#[test]
fn what_is_no_series_is_refused() {
    let one = photo(0.0, 0, false);
    assert_eq!(check(std::slice::from_ref(&one)), Err(BracketError::TooFew(1)));
    assert_eq!(check(&[one.clone(), one.clone()]), Err(BracketError::SameExposure));
    let small = Exposed { image: ImageF32::filled(2, 2, 3, 0.5), stops: 1.0 };
    assert!(matches!(check(&[one.clone(), small]), Err(BracketError::Size { index: 1, .. })));
    let black = |stops| Exposed { image: ImageF32::filled(20, 20, 3, 0.0), stops };
    assert_eq!(Response::find(&[black(0.0), black(2.0)]), Err(BracketError::NoOverlap));
}
