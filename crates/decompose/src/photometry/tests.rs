use glam::{DVec3, Vec3};
use motes_scene::{ImageF32, Pinhole, Pose};

use super::*;

const SIZE: [usize; 2] = [80, 60];
const LOG_GAINS: [f64; 8] = [-0.4, 0.3, 0.1, -0.2, 0.5, -0.3, 0.25, -0.25];

/// Linear radiance of a plane, from dark to bright along x, in a color of its own along y.
fn radiance([x, y]: [f64; 2]) -> Vec3 {
    let level = (-2.6 + 1.9 * x).exp() as f32;
    level * Vec3::new(1.0 + 0.2 * y as f32, 1.0, 1.0 - 0.2 * y as f32)
}

/// Opaque Gaussians on the plane z = 0.
fn plane() -> Gaussians {
    const SIDE: usize = 56;
    let mut g = Gaussians::empty(0);
    for k in 0..SIDE * SIDE {
        let at = |i: usize| 3.0 * (i as f32 / (SIDE - 1) as f32 - 0.5);
        g.means.push([at(k % SIDE), at(k / SIDE), 0.0]);
        g.rotations.push([1.0, 0.0, 0.0, 0.0]);
        g.log_scales.push([0.04f32.ln(), 0.04f32.ln(), 0.004f32.ln()]);
        g.opacity_logits.push(5.0);
        g.sh.extend([0.0; 3]);
    }
    g
}

/// Photos of the plane, in what a camera shows of `shown_of(photo, place, radiance)`, linear.
fn photos(
    count: usize,
    curve: impl Fn(f32) -> f32,
    shown_of: impl Fn(usize, [f64; 2], Vec3) -> Vec3,
) -> Vec<Photo> {
    let (width, height) = (SIZE[0], SIZE[1]);
    let focal = 87.0;
    let camera = Pinhole { fx: focal, fy: focal, cx: 40.0, cy: 30.0, width, height };
    let photo = |k: usize| {
        let angle = k as f64 * 0.8;
        let eye = DVec3::new(0.7 * angle.cos(), 0.7 * angle.sin(), 2.6);
        let pose = Pose::look_at(eye, DVec3::ZERO, DVec3::Y).unwrap();
        let from_camera = pose.inverse();
        let (mut data, mut usable, mut clipped) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..width * height {
            let pixel = [(i % width) as f64 + 0.5 - 40.0, (i / width) as f64 + 0.5 - 30.0];
            let ray = DVec3::new(pixel[0] / focal, pixel[1] / focal, 1.0);
            let through = from_camera.transform_point(ray) - eye;
            let at = eye - through * (eye.z / through.z);
            let place = [at.x, at.y];
            let bytes = shown_of(k, place, radiance(place))
                .to_array()
                .map(|v| (255.0 * curve(srgb::encode_clipped(v))).round().min(255.0));
            let is_clipped = bytes.iter().any(|b| *b >= 254.0);
            clipped.push(is_clipped);
            usable.push(!is_clipped);
            data.extend(bytes.map(|b| srgb::decode(b / 255.0)));
        }
        Photo {
            gain: [1.0; 3],
            name: format!("{k}"),
            camera,
            camera_from_world: pose,
            radiance_linear: ImageF32::from_data(width, height, 3, data).into(),
            light: 0,
            usable,
            clipped,
        }
    };
    (0..count).map(photo).collect()
}

fn exposed(k: usize, _: [f64; 2], radiance: Vec3) -> Vec3 {
    radiance * LOG_GAINS[k].exp() as f32
}

fn found(photos: &[Photo]) -> Photometry {
    let options = Options { exposure: Switch::Auto, tone_curve: Switch::Auto };
    calibrate(photos, &plane(), &RenderOptions::default(), &options)
}

/// Mean over pixels that are told of what `of` says about found and true radiance.
fn mean_log_ratio(photos: &[Photo], shown_of: impl Fn(f32, f32) -> f32) -> f32 {
    let truth = super::tests::photos(photos.len(), |v| v, |_, _, l| l);
    let (mut sum, mut count) = (0.0, 0.0);
    for (photo, truth) in photos.iter().zip(&truth) {
        for i in (0..photo.usable.len()).filter(|&i| photo.usable[i]) {
            let (a, b) = (photo.radiance_linear.at(i).x, truth.radiance_linear.at(i).x);
            if b > 0.01 && b < 0.9 {
                sum += shown_of(a, b);
                count += 1.0;
            }
        }
    }
    sum / count
}

#[test]
fn gains_and_tone_curve_are_found_and_undone() {
    let curve = ToneCurve::new(0.4);
    let mut photos = photos(8, |v| curve.apply(v), exposed);
    let photometry = found(&photos);
    let contrast = photometry.tone_curve.contrast();
    assert!((contrast - 0.4).abs() < 0.1, "{contrast} {:?}", photometry.terms);
    for (found, truth) in photometry.log_gains.iter().zip(LOG_GAINS) {
        assert!(found.iter().all(|g| (g - truth).abs() < 0.04), "{found:?} for {truth}");
    }
    photometry.develop(&mut photos);
    let error = mean_log_ratio(&photos, |a, b| (a / b).ln().abs());
    assert!(error < 0.05, "{error}");
}

#[test]
fn an_s_curve_of_another_kind_is_undone_in_part() {
    let logistic = |v: f32| v.powf(1.4) / (v.powf(1.4) + (1.0 - v).powf(1.4));
    let mut shown = photos(8, logistic, exposed);
    let photometry = found(&shown);
    assert!(photometry.tone_curve.contrast() > 0.2, "{:?}", photometry.terms);
    let error = |photos: &[Photo]| mean_log_ratio(photos, |a, b| (a / b).ln().abs());
    let gains_alone = Photometry { tone_curve: ToneCurve::default(), ..photometry.clone() };
    let mut without = shown.clone();
    gains_alone.develop(&mut without);
    photometry.develop(&mut shown);
    assert!(error(&shown) < 0.6 * error(&without), "{} for {}", error(&shown), error(&without));
}

#[test]
fn photos_of_one_exposure_are_left_alone() {
    let curve = ToneCurve::new(0.5);
    let mut shown = photos(8, |v| curve.apply(v), |_, _, l| l);
    let before = shown.clone();
    let photometry = found(&shown);
    assert!(photometry.tone_curve.is_identity() && photometry.terms.iter().all(|t| !t.kept));
    photometry.develop(&mut shown);
    for (a, b) in shown.iter().zip(&before) {
        assert_eq!(a.radiance_linear, b.radiance_linear);
        assert_eq!(a.usable, b.usable);
    }
    let mut gaussians = plane();
    photometry.develop_gaussians(&mut gaussians);
    assert_eq!(gaussians, plane());
}

#[test]
fn light_that_changes_in_one_place_is_no_exposure() {
    let shaded = |k: usize, [x, _]: [f64; 2], l: Vec3| {
        if x > 0.0 { l * (1.5 * LOG_GAINS[k]).exp() as f32 } else { l }
    };
    let photometry = found(&photos(8, |v| v, shaded));
    assert!(photometry.terms.iter().all(|t| !t.kept), "{:?}", photometry.terms);
    assert_eq!(photometry.log_gains, vec![[0.0; 3]; 8]);
}

#[test]
fn what_a_photo_shows_beyond_white_is_clipped_at_the_exposure_of_the_model() {
    let mut shown = photos(1, |v| v, |_, _, l| l);
    let low = 0.7;
    shown[0].radiance_linear.floats_mut()[0] = [low, 0.2, 0.1];
    let photometry = Photometry { log_gains: vec![[-0.5; 3]], ..Photometry::default() };
    photometry.develop(&mut shown);
    assert_eq!(shown[0].radiance_linear.at(0).x, 1.0);
    assert!(shown[0].clipped[0] && !shown[0].usable[0]);
}

#[test]
fn switches_and_extremes() {
    let shown = photos(8, |v| v, exposed);
    let with = |exposure, tone_curve| {
        let options = Options { exposure, tone_curve };
        calibrate(&shown, &plane(), &RenderOptions::default(), &options)
    };
    assert_eq!(with(Switch::Off, Switch::Off).terms, Vec::new());
    let off = with(Switch::Off, Switch::Auto);
    assert!(off.tone_curve.is_identity() && off.log_gains == vec![[0.0; 3]; 8]);
    let on = with(Switch::On, Switch::On);
    assert!(on.terms[0].kept);
    for value in [0.0, 1.0, 1e-30, 1e30, f32::NAN] {
        for usable in [false, true] {
            let mut shown = photos(6, |v| v, |_, _, l| l);
            for photo in &mut shown {
                photo.radiance_linear.floats_mut().fill([value; 3]);
                photo.usable.fill(usable);
            }
            let photometry = found(&shown);
            assert!(photometry.log_gains.iter().flatten().all(|g| g.is_finite()));
            photometry.develop(&mut shown);
        }
    }
    for count in 0..3 {
        let photometry = found(&photos(count, |v| v, exposed));
        assert_eq!(photometry.log_gains, vec![[0.0; 3]; count]);
    }
    let nothing = Gaussians::empty(0);
    calibrate(&shown, &nothing, &RenderOptions::default(), &Options::default());
}

#[test]
fn an_exposure_is_the_same_for_dark_and_bright_points() {
    let kept = |share: f64| {
        let shown = |k: usize, at: [f64; 2], radiance: Vec3| {
            let share = if at[0] > 0.0 { share } else { 1.0 };
            radiance * (share * LOG_GAINS[k]).exp() as f32
        };
        let options = Options { exposure: Switch::Auto, tone_curve: Switch::Off };
        let photos = photos(8, |v| v, shown);
        let found = calibrate(&photos, &plane(), &RenderOptions::default(), &options);
        found.log_gains.iter().any(|g| *g != [0.0; 3])
    };
    assert!(kept(1.0) && kept(0.8) && !kept(0.35));
}
