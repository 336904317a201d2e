//! Splits, origins, masks, missing and odd photos, panoramas, transforms.

use std::path::Path;

use crate::common::{NAMES, Project, bad_input, capture_of, names_of, pinhole};
use glam::DVec3;
use import_colmap::ImportOptions;
use motes_formats::images::{encode_png, read_image, read_mask, write_png};
use motes_scene::{Camera, CameraModel, ImageU8, Split};

#[test]
fn every_eighth_by_name_is_held_out_from_the_first() {
    let project = Project::new(pinhole(), &NAMES);
    let report =
        project.import(&ImportOptions { test_every: Some(8), ..Default::default() }).unwrap();
    assert_eq!((report.train_views, report.test_views, report.registered), (8, 2, 10));
    assert_eq!(names_of(&capture_of(&project), Split::Test), ["p0.png", "p8.png"]);
    assert_eq!(report.points, 4);
    assert!(report.mean_reprojection_error_px.unwrap() < 1e-9, "poses and pixels agree");
    assert!(report.median_parallax_degrees.unwrap() > 90.0);
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
}

#[test]
fn lists_decide_the_split_and_leave_out_the_rest() {
    let project = Project::new(pinhole(), &NAMES);
    let list = |name: &str, text: &str| {
        let path = project.path().join(name);
        std::fs::write(&path, text).unwrap();
        Some(path)
    };
    let options = ImportOptions {
        train_list: list("train.txt", "# few\np1\np2.png\n\n p4.png \n"),
        test_list: list("test.txt", "p4\np9\n"),
        points_from_train: true,
        ..Default::default()
    };
    let report = project.import(&options).unwrap();
    let capture = capture_of(&project);
    assert_eq!(names_of(&capture, Split::Train), ["p1.png", "p2.png"], "the test list wins");
    assert_eq!(names_of(&capture, Split::Test), ["p4.png", "p9.png"]);
    assert_eq!(report.points, 4, "two training photos see each point");
    let only = ImportOptions { train_list: list("one.txt", "p3\n"), ..options.clone() };
    std::fs::remove_dir_all(project.output()).unwrap();
    assert_eq!(project.import(&only).unwrap().points, 0, "one training photo is not enough");
    let unknown = ImportOptions { test_list: list("u.txt", "p1\nq7\n"), ..Default::default() };
    let (cause, remedy) = bad_input(project.import(&unknown).unwrap_err());
    assert!(cause.contains("\"q7\" (line 2)") && remedy.contains("p0.png"), "{cause} {remedy}");
}

#[test]
fn map_coordinates_move_to_the_origin_and_back() {
    let center = DVec3::new(4_512_345.678, 531_234.5, 87.25);
    let project = Project::around(pinhole(), &NAMES[..5], center);
    let report = project.import(&ImportOptions::default()).unwrap();
    let capture = capture_of(&project);
    assert!(report.world_origin[0] > 4.5e6);
    assert!(report.mean_reprojection_error_px.unwrap() < 1e-4);
    for (view, (name, _, pose)) in capture.views.iter().zip(&project.images) {
        assert_eq!(&view.name, name);
        let moved = view.camera_from_world.center_in_world();
        assert!(moved.length() < 20.0, "{moved}");
        let back = moved + capture.world_origin;
        assert!((back - pose.center_in_world()).length() < 1e-6, "{back}");
        assert!(view.camera_from_world.rotation.dot(pose.rotation).abs() > 1.0 - 1e-12);
    }
    for (moved, source) in capture.points.positions.iter().zip(&project.points) {
        let back = glam::Vec3::from_array(*moved).as_dvec3() + capture.world_origin;
        // The grid of the fit is 6e-5 of the distance of the cameras, some 10 m here.
        assert!((back - *source).length() < 1e-3, "{back} {source}");
    }
}

#[test]
fn a_scene_near_the_origin_keeps_its_frame() {
    let project = Project::new(pinhole(), &NAMES[..4]);
    let report = project.import(&ImportOptions::default()).unwrap();
    assert_eq!(report.world_origin, [0.0; 3]);
    for (view, (_, _, pose)) in capture_of(&project).views.iter().zip(&project.images) {
        assert!((view.camera_from_world.translation - pose.translation).length() < 1e-12);
    }
}

#[test]
fn subfolders_spaces_and_umlauts_survive() {
    let names = ["links/erstes Bild.png", "links/ü.png", "rechts/ü.png"];
    let project = Project::new(pinhole(), &names);
    project.import(&ImportOptions::default()).unwrap();
    let capture = capture_of(&project);
    assert_eq!(names_of(&capture, Split::Train), names);
    for view in &capture.views {
        assert!(project.output().join(&view.image).is_file(), "{:?}", view.image);
    }
    assert_eq!(capture.views[0].image, Path::new("images/links/erstes Bild.png"));
}

#[test]
fn missing_photos_are_left_out_and_named() {
    let project = Project::new(pinhole(), &NAMES[..4]);
    project.write_photos();
    project.write_model();
    std::fs::remove_file(project.path().join("images/p2.png")).unwrap();
    let report = project.import_written(&ImportOptions::default()).unwrap();
    assert_eq!((report.registered, report.photos), (3, 4));
    assert!(report.warnings[0].contains("1 of 4") && report.warnings[0].contains("p2.png"));
    std::fs::remove_dir_all(project.path().join("images")).unwrap();
    let (cause, remedy) = bad_input(project.import_written(&ImportOptions::default()).unwrap_err());
    assert!(cause.contains("none of the 4 photos") && remedy.contains("--images"), "{cause}");
}

#[test]
fn photos_of_another_size_scale_their_camera() {
    let project = Project::new(pinhole(), &NAMES[..2]);
    project.write_model();
    let half = ImageU8::filled(32, 24, 3, 90);
    std::fs::create_dir_all(project.path().join("images")).unwrap();
    for name in &NAMES[..2] {
        write_png(&project.path().join("images").join(name), &half).unwrap();
    }
    let report = project.import_written(&ImportOptions::default()).unwrap();
    assert_eq!(report.image_size, [32, 24]);
    assert!(report.warnings[0].contains("intrinsics were scaled"), "{:?}", report.warnings);
    let camera = capture_of(&project).cameras[0].clone();
    assert_eq!(camera.params, [30.0, 30.0, 16.0, 12.0]);
    let turned = ImageU8::filled(48, 64, 3, 90);
    write_png(&project.path().join("images/p0.png"), &turned).unwrap();
    let (cause, _) = bad_input(project.import_written(&ImportOptions::default()).unwrap_err());
    assert!(cause.contains("48 x 64") && cause.contains("p0.png"), "{cause}");
}

#[test]
fn gray_sixteen_bit_and_transparent_photos_are_read() {
    let project = Project::new(pinhole(), &["alpha.png", "deep.png", "gray.png"]);
    project.write_photos();
    project.write_model();
    let images = project.path().join("images");
    image::GrayImage::from_pixel(64, 48, image::Luma([77])).save(images.join("gray.png")).unwrap();
    let deep = image::ImageBuffer::from_pixel(64, 48, image::Rgb([0x4d4du16, 0x8080, 0xffff]));
    image::DynamicImage::ImageRgb16(deep).save(images.join("deep.png")).unwrap();
    let mut alpha = ImageU8::filled(64, 48, 4, 200);
    alpha.pixel_mut(3, 3)[3] = 0;
    std::fs::write(images.join("alpha.png"), encode_png(&alpha)).unwrap();
    project.import_written(&ImportOptions::default()).unwrap();
    let read = |name: &str| read_image(&project.output().join("images").join(name)).unwrap();
    assert_eq!(read("gray.png").pixel(9, 9), [77, 77, 77]);
    assert_eq!(read("deep.png").pixel(9, 9), [0x4d, 0x80, 0xff]);
    assert_eq!(read("alpha.png").pixel(3, 3), [200, 200, 200, 0], "alpha is kept");
}

#[test]
fn masks_follow_their_photos() {
    let lens = Camera {
        model: CameraModel::SimpleRadial,
        params: vec![60.0, 32.0, 24.0, -0.1],
        ..pinhole()
    };
    let project = Project::new(lens, &["a/x.png", "a/y.png"]);
    let masks = project.path().join("masks");
    std::fs::create_dir_all(masks.join("a")).unwrap();
    let mut mask = ImageU8::filled(64, 48, 1, 255);
    for y in 0..48 {
        mask.data[y * 64..y * 64 + 32].fill(0);
    }
    write_png(&masks.join("a/x.mask.png"), &mask).unwrap();
    let options = ImportOptions {
        masks: Some(masks.clone()),
        max_resolution: Some(32),
        ..Default::default()
    };
    project.import(&options).unwrap();
    let capture = capture_of(&project);
    assert_eq!(capture.views[1].mask, None);
    let path = project.output().join(capture.views[0].mask.as_ref().unwrap());
    let out = read_mask(&path).unwrap();
    assert_eq!((out.width, out.height), (32, 24));
    assert!(
        (0..24).all(|y| out.pixel(15, y) == [0] && out.pixel(16, y) == [255]),
        "the edge is at cx"
    );
    let inverted = ImportOptions { invert_masks: true, ..options };
    project.import_written(&inverted).unwrap();
    assert_eq!(read_mask(&path).unwrap().pixel(3, 3), [255]);
}

#[test]
fn two_cameras_stay_two() {
    let mut project = Project::new(pinhole(), &["a.png", "b.png"]);
    let wide = Camera { width: 80, height: 40, params: vec![50.0, 50.0, 40.0, 20.0], ..pinhole() };
    project.cameras.push(wide);
    project.images[1].1 = 1;
    let report =
        project.import(&ImportOptions { max_resolution: Some(40), ..Default::default() }).unwrap();
    assert_eq!(report.cameras, 2);
    let capture = capture_of(&project);
    let size = |i: usize| (capture.cameras[i].width, capture.cameras[i].height);
    assert_eq!((size(0), size(1)), ((40, 30), (40, 20)));
    let halved = ImportOptions { downscale_factor: Some(2.0), ..Default::default() };
    project.import_written(&halved).unwrap();
    let cameras = capture_of(&project).cameras;
    assert_eq!((cameras[0].width, cameras[1].width), (32, 40), "each by the same factor");
    assert_eq!((capture.views[0].camera, capture.views[1].camera), (0, 1));
}
