use motes_scene::ImageU8;

use super::*;

/// A value in [0, 1) that looks random.
fn scatter(a: usize, b: usize) -> f64 {
    let key = a as u64 * 2_654_435_761 + b as u64 * 40_503 + 12_345;
    let bits = key.wrapping_mul(2_862_933_555_777_941_757);
    (bits >> 40) as f64 / (1u64 << 24) as f64
}

/// `count` photos on a ring, each sharing points with its neighbors; every tenth sample is wrong.
fn photos(count: usize, slope: f64) -> (Vec<PhotoBrightness>, usize) {
    photos_with_noise(count, slope, 0.04)
}

/// The same with noise of this width on each sample.
fn photos_with_noise(count: usize, slope: f64, width: f64) -> (Vec<PhotoBrightness>, usize) {
    let points = count * 40;
    let photos = (0..count)
        .map(|i| {
            let stops = -8.0 + (i * 3 % 7) as f64 / 3.0;
            let gain = slope * stops + 0.03 * (scatter(i, 0) - 0.5);
            let samples = (0..120)
                .map(|k| {
                    let point = (i * 40 + k) % points;
                    let outlier = if k % 10 == 0 { 0.8 * scatter(i, k) } else { 0.0 };
                    let noise = width * (scatter(point, i) - 0.5);
                    (point, -1.0 + 0.5 * scatter(point, 7) + gain + noise + outlier)
                })
                .collect();
            PhotoBrightness { stops: Some(stops), samples }
        })
        .collect();
    (photos, points)
}

#[test]
fn the_slope_is_found_between_surfaces_of_different_brightness() {
    let (photos, points) = photos(20, 0.26);
    let fitted = fit(&photos, points).unwrap();
    assert!((fitted.response.slope_per_stop - 0.26).abs() < 0.02, "{fitted:?}");
    assert!(fitted.evidence > 20.0 && fitted.photos == 20, "{fitted:?}");
}

#[test]
fn noise_as_wide_as_the_gains_does_not_move_the_slope() {
    let (photos, points) = photos_with_noise(40, 0.15, 0.3);
    let fitted = fit(&photos, points).unwrap();
    assert!((fitted.response.slope_per_stop - 0.15).abs() < 0.02, "{fitted:?}");
}

#[test]
fn photos_that_were_evened_out_have_no_response() {
    let (photos, points) = photos(20, 0.0);
    let fitted = fit(&photos, points).unwrap();
    assert!(fitted.evidence < 0.0, "{fitted:?}");
    let (photos, points) = self::photos(20, -0.2);
    assert!(fit(&photos, points).unwrap().evidence < 0.0, "more light is never darker");
}

#[test]
fn too_little_to_fit_is_none() {
    let (mut photos, points) = photos(4, 0.26);
    assert!(fit(&photos, points).is_none());
    (photos, _) = self::photos(20, 0.26);
    photos.iter_mut().for_each(|photo| photo.stops = Some(-8.0));
    assert!(fit(&photos, points.max(800)).is_none());
    photos.iter_mut().for_each(|photo| photo.stops = None);
    assert!(fit(&photos, 800).is_none());
    assert!(fit(&[], 0).is_none());
}

#[test]
fn brightness_is_the_mean_around_a_pixel_and_skips_what_is_clipped() {
    let mut image = ImageU8::filled(400, 100, 3, 100);
    assert!((log_brightness(&image, [10.0, 10.0]).unwrap() - (100f64 / 255.0).ln()).abs() < 1e-9);
    assert!(log_brightness(&image, [0.0, 99.9]).is_some());
    for outside in [[-0.1, 3.0], [400.0, 3.0], [3.0, 100.0], [f64::NAN, 0.0]] {
        assert_eq!(log_brightness(&image, outside), None);
    }
    image.data.fill(255);
    assert_eq!(log_brightness(&image, [10.0, 10.0]), None);
    image.data.fill(3);
    assert_eq!(log_brightness(&image, [10.0, 10.0]), None);
}
