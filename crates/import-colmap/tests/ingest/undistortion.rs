//! Undistorted pixels against the analytic pattern that the lens photographed.

use crate::common::{Project, pattern};
use glam::DVec3;
use import_colmap::ImportOptions;
use motes_formats::capture::read_capture;
use motes_formats::images::{read_image, read_mask};
use motes_scene::{Camera, CameraModel};

fn camera(model: CameraModel, params: &[f64]) -> Camera {
    Camera { model, width: 240, height: 180, params: params.to_vec() }
}

/// Mean and worst difference of an imported image to the pattern, over pixels with content, and
/// the share of pixels without.
fn compare(project: &Project) -> (f64, f64, f64) {
    let output = project.output();
    let capture = read_capture(&output.join("capture.json")).unwrap();
    let view = &capture.views[0];
    let pinhole = capture.cameras[view.camera].as_pinhole().unwrap();
    let image = read_image(&output.join(&view.image)).unwrap();
    assert_eq!((image.width, image.height), (pinhole.width, pinhole.height));
    let mask = view.mask.as_ref().map(|mask| read_mask(&output.join(mask)).unwrap());
    let (mut sum, mut worst, mut count, mut without) = (0.0, 0.0f64, 0, 0);
    for y in 0..image.height {
        for x in 0..image.width {
            if mask.as_ref().is_some_and(|mask| mask.pixel(x, y)[0] == 0) {
                without += 1;
                continue;
            }
            let (u, v) = (x as f64 + 0.5, y as f64 + 0.5);
            let ray = DVec3::new((u - pinhole.cx) / pinhole.fx, (v - pinhole.cy) / pinhole.fy, 1.0);
            for (got, expected) in image.pixel(x, y).iter().zip(pattern(ray)) {
                let difference = (f64::from(*got) - expected).abs();
                sum += difference;
                worst = worst.max(difference);
                count += 1;
            }
        }
    }
    (sum / f64::from(count), worst, without as f64 / image.pixel_count() as f64)
}

fn lenses() -> Vec<Camera> {
    use CameraModel as M;
    vec![
        camera(M::Pinhole, &[200.0, 205.0, 121.0, 88.0]),
        camera(M::SimpleRadial, &[200.0, 120.0, 90.0, -0.12]),
        camera(M::Radial, &[200.0, 118.0, 93.0, 0.1, 0.02]),
        camera(M::Opencv, &[200.0, 204.0, 121.0, 88.0, -0.1, 0.03, 0.002, -0.003]),
        camera(
            M::FullOpencv,
            &[200.0, 204.0, 121.0, 88.0, 0.2, 0.05, 0.001, -0.002, 0.01, 0.3, 0.06, 0.01],
        ),
        camera(M::Fov, &[160.0, 160.0, 120.0, 90.0, 0.9]),
        camera(M::OpencvFisheye, &[150.0, 152.0, 120.0, 90.0, 0.03, -0.01, 0.004, -0.001]),
        camera(
            M::ThinPrismFisheye,
            &[
                150.0, 152.0, 120.0, 90.0, 0.03, -0.01, 0.001, -0.002, 0.003, -0.0005, 0.001,
                -0.0015,
            ],
        ),
        camera(M::Division, &[200.0, 204.0, 121.0, 88.0, -0.1]),
        camera(M::Eucm, &[150.0, 152.0, 120.0, 90.0, 0.6, 1.1]),
    ]
}

#[test]
fn every_lens_becomes_the_pinhole_view_of_the_pattern() {
    for lens in lenses() {
        let name = lens.model.name();
        let project = Project::new(lens, &["a.png", "b.png"]);
        project.import(&ImportOptions::default()).unwrap();
        let (mean, worst, without) = compare(&project);
        // 8-bit rounding twice makes a mean of 0.4; a shift of a tenth of a pixel would make 0.7.
        assert!(mean < 0.6 && worst < 4.0, "{name}: mean {mean}, worst {worst}");
        assert_eq!(without, 0.0, "{name}: cropped so that every pixel has content");
    }
}

#[test]
fn downscaling_in_the_same_pass_keeps_positions() {
    for lens in lenses() {
        let name = lens.model.name();
        let project = Project::new(lens, &["a.png", "b.png"]);
        let options = ImportOptions { max_resolution: Some(96), ..ImportOptions::default() };
        let report = project.import(&options).unwrap();
        assert_eq!(report.image_size, [96, 72]);
        let (mean, worst, _) = compare(&project);
        assert!(mean < 1.5 && worst < 12.0, "{name}: mean {mean}, worst {worst}");
    }
}

#[test]
fn keeping_the_border_masks_what_has_no_content() {
    let lens = camera(CameraModel::SimpleRadial, &[200.0, 120.0, 90.0, -0.2]);
    let project = Project::new(lens, &["a.png", "b.png"]);
    let options = ImportOptions { keep_border: true, ..ImportOptions::default() };
    project.import(&options).unwrap();
    let (mean, _, without) = compare(&project);
    assert!(mean < 0.8, "{mean}");
    assert!(without > 0.01 && without < 0.3, "{without} of the pixels are masked");
}

#[test]
fn a_pinhole_photo_is_passed_on_bit_for_bit() {
    let lens = camera(CameraModel::Pinhole, &[200.0, 205.0, 121.0, 88.0]);
    let project = Project::new(lens, &["a.png", "b.png"]);
    project.import(&ImportOptions::default()).unwrap();
    let before = read_image(&project.path().join("images/a.png")).unwrap();
    let after = read_image(&project.output().join("images/a.png")).unwrap();
    assert_eq!(before, after);
}
