//! Splits, origins, masks, missing and odd photos, panoramas, transforms.

use std::path::Path;

use crate::common::{Project, import_path, ring_pose};
use glam::DVec3;
use import_colmap::{ImportInput, ImportOptions, IngestError, SfmOptions, Silent, Source, import};
use motes_formats::capture::read_capture;
use motes_formats::images::{encode_png, read_image, read_mask, write_png};
use motes_scene::{Camera, CameraModel, Capture, ImageU8, Pose, Split};

const NAMES: [&str; 10] = [
    "p0.png", "p1.png", "p2.png", "p3.png", "p4.png", "p5.png", "p6.png", "p7.png", "p8.png",
    "p9.png",
];

fn pinhole() -> Camera {
    Camera {
        model: CameraModel::Pinhole,
        width: 64,
        height: 48,
        params: vec![60.0, 60.0, 32.0, 24.0],
    }
}

fn capture_of(project: &Project) -> Capture {
    read_capture(&project.output().join("capture.json")).unwrap()
}

fn names_of(capture: &Capture, split: Split) -> Vec<&str> {
    capture.views_of(split).into_iter().map(|i| capture.views[i].name.as_str()).collect()
}

fn bad_input(error: IngestError) -> (String, String) {
    match error {
        IngestError::BadInput { cause, remedy } => (cause, remedy),
        other => panic!("not bad input: {other:?}"),
    }
}

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
    assert_eq!((capture.views[0].camera, capture.views[1].camera), (0, 1));
}

#[test]
fn the_largest_of_several_models_wins_and_says_so() {
    let mut project = Project::new(pinhole(), &NAMES[..5]);
    project.write_photos();
    project.write_model_to("sparse/1");
    project.images.truncate(2);
    project.write_model_to("sparse/0");
    let report = project.import_written(&ImportOptions::default()).unwrap();
    assert_eq!(report.registered, 5);
    assert!(
        report.notes[0].contains("2 models") && report.notes[0].contains("sparse/1"),
        "{:?}",
        report.notes
    );
}

#[test]
fn sources_are_never_overwritten() {
    let project = Project::new(pinhole(), &NAMES[..2]);
    project.write_photos();
    project.write_model();
    let error = import_path(project.path(), project.path(), &ImportOptions::default()).unwrap_err();
    assert!(
        matches!(&error, IngestError::Usage { cause, .. } if cause.contains("would overwrite"))
    );
}

#[test]
fn model_and_images_may_lie_apart() {
    let project = Project::new(pinhole(), &NAMES[..2]);
    project.write_photos();
    project.write_model_to("elsewhere/model");
    let output = project.output();
    std::fs::create_dir_all(&output).unwrap();
    let mut input = ImportInput {
        model: Some(project.path().join("elsewhere/model")),
        images: Some(project.path().join("images")),
        ..ImportInput::default()
    };
    let (options, sfm) = (ImportOptions::default(), SfmOptions::default());
    let source = Source::recognize(&input).unwrap();
    let report = import(&source, &output, &options, &sfm, &Silent);
    assert_eq!(report.unwrap().registered, 2);
    input.images = None;
    assert!(matches!(Source::recognize(&input), Err(IngestError::Usage { .. })));
}

#[test]
fn a_panorama_becomes_eight_pinhole_views() {
    let pano = Camera {
        model: CameraModel::Equirectangular,
        width: 128,
        height: 64,
        params: vec![128.0, 64.0],
    };
    let mut project = Project::new(pano, &["hall.png"]);
    project.points.clear();
    project.write_model();
    // Longitude as brightness: 0 at the left edge, 254 at the right one.
    let data = (0..64 * 128).flat_map(|i| [2 * (i % 128) as u8; 3]).collect();
    let image = ImageU8::from_data(128, 64, 3, data);
    std::fs::create_dir_all(project.path().join("images")).unwrap();
    write_png(&project.path().join("images/hall.png"), &image).unwrap();
    let report = project.import_written(&ImportOptions::default()).unwrap();
    assert_eq!((report.views, report.cameras, report.image_size), (8, 1, [32, 32]));
    let capture = capture_of(&project);
    let right = capture.view_named("hall_yaw090.png").unwrap();
    let ahead = capture.views[right].camera_from_world.inverse().rotation * DVec3::Z;
    let sideways = project.images[0].2.inverse().rotation * DVec3::X;
    assert!((ahead - sideways).length() < 1e-9, "a quarter turn to the right");
    let crop = read_image(&project.output().join(&capture.views[right].image)).unwrap();
    // The center of that crop is at three quarters of the panorama's width.
    assert!(crop.pixel(16, 16)[0].abs_diff(192) <= 3, "{:?}", crop.pixel(16, 16));
    let back = capture.view_named("hall_yaw180.png").unwrap();
    let seam = read_image(&project.output().join(&capture.views[back].image)).unwrap();
    assert!(seam.pixel(13, 16)[0] > 230 && seam.pixel(18, 16)[0] < 25, "it looks over the seam");
}

/// Rows of a pose as an OpenGL `world_from_camera` matrix.
fn matrix(camera_from_world: &Pose) -> String {
    let pose = camera_from_world.inverse();
    let m = pose.rotation_matrix();
    let (x, y, z, t) = (m.x_axis, -m.y_axis, -m.z_axis, pose.translation);
    let row = |i: usize| format!("[{:?},{:?},{:?},{:?}]", x[i], y[i], z[i], t[i]);
    format!("[{},{},{},[0,0,0,1]]", row(0), row(1), row(2))
}

#[test]
fn a_nerf_synthetic_folder_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut image = ImageU8::filled(40, 40, 4, 120);
    image.pixel_mut(0, 0)[3] = 0;
    for (split, count) in [("train", 3), ("test", 2), ("val", 1)] {
        std::fs::create_dir_all(folder.path().join(split)).unwrap();
        let mut frames = Vec::new();
        for i in 0..count {
            write_png(&folder.path().join(format!("{split}/r_{i}.png")), &image).unwrap();
            let pose = ring_pose(i, 7, DVec3::ZERO);
            frames.push(format!(
                r#"{{"file_path": "./{split}/r_{i}", "rotation": 0.01, "transform_matrix": {}}}"#,
                matrix(&pose)
            ));
        }
        let text = format!(r#"{{"camera_angle_x": 0.9, "frames": [{}]}}"#, frames.join(","));
        std::fs::write(folder.path().join(format!("transforms_{split}.json")), text).unwrap();
    }
    let output = folder.path().join("out");
    let report = import_path(folder.path(), &output, &ImportOptions::default()).unwrap();
    assert_eq!((report.train_views, report.test_views, report.points), (3, 2, 0));
    assert!(report.notes.iter().any(|note| note.contains("transforms_val.json was not used")));
    assert!(report.notes.iter().any(|note| note.contains("no start points")));
    let capture = read_capture(&output.join("capture.json")).unwrap();
    let focal = 0.5 * 40.0 / 0.45f64.tan();
    assert!((capture.cameras[0].params[0] - focal).abs() < 1e-9);
    let expected = ring_pose(1, 7, DVec3::ZERO);
    let view = &capture.views[capture.view_named("train/r_1").unwrap()];
    assert!((view.camera_from_world.translation - expected.translation).length() < 1e-9);
    assert!(view.camera_from_world.rotation.dot(expected.rotation).abs() > 1.0 - 1e-9);
}

#[test]
fn transforms_take_points_from_the_model_beside_them_only_in_the_same_world() {
    let project = Project::new(pinhole(), &NAMES[..4]);
    project.write_photos();
    project.write_model();
    let write = |shift: f64| {
        let frame = |(name, _, pose): &(String, usize, Pose)| {
            let mut pose = *pose;
            pose.translation += DVec3::Z * shift;
            format!(r#"{{"file_path": "images/{name}", "transform_matrix": {}}}"#, matrix(&pose))
        };
        let frames: Vec<String> = project.images.iter().map(frame).collect();
        let keys = r#""fl_x": 60, "cx": 32, "cy": 24, "w": 64, "h": 48"#;
        let text = format!(r#"{{{keys}, "frames": [{}]}}"#, frames.join(","));
        std::fs::write(project.path().join("transforms.json"), text).unwrap();
    };
    write(0.0);
    let options = ImportOptions { test_every: Some(2), ..Default::default() };
    let report = project.import_written(&options).unwrap();
    assert_eq!((report.points, report.test_views), (4, 2));
    assert!(report.mean_reprojection_error_px.unwrap() < 1e-6, "{report:?}");
    write(0.5);
    let report = project.import_written(&options).unwrap();
    assert_eq!(report.points, 0);
    assert!(report.warnings.iter().any(|w| w.contains("another world")), "{:?}", report.warnings);
}

#[test]
fn an_input_that_is_nothing_says_what_could_be() {
    let folder = tempfile::tempdir().unwrap();
    let recognize = |path: &Path| {
        Source::recognize(&ImportInput { input: Some(path.to_path_buf()), ..Default::default() })
            .unwrap_err()
    };
    let (cause, remedy) = bad_input(recognize(folder.path()));
    assert!(
        cause.contains("neither a COLMAP model") && remedy.contains("--photos"),
        "{cause} {remedy}"
    );
    assert!(bad_input(recognize(&folder.path().join("no"))).0.contains("no such folder"));
}

#[test]
fn a_cut_photo_is_left_out_and_told() {
    let project = Project::new(pinhole(), &NAMES);
    project.write_photos();
    project.write_model();
    let cut = project.path().join("images/p3.png");
    let bytes = std::fs::read(&cut).unwrap();
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    std::fs::write(project.path().join("images/p4.png"), "no picture").unwrap();
    let report = project.import_written(&ImportOptions::default()).unwrap();
    assert_eq!(report.views, 8, "{report:?}");
    let told = |w: &String| w.contains("2 photos") && w.contains("p3.png") && w.contains("p4.png");
    assert!(report.warnings.iter().any(told), "{:?}", report.warnings);
    let capture = capture_of(&project);
    assert!(capture.view_named("p3.png").is_none() && capture.view_named("p2.png").is_some());
    for name in NAMES {
        std::fs::write(project.path().join("images").join(name), "no picture").unwrap();
    }
    let (cause, _) = bad_input(project.import_written(&ImportOptions::default()).unwrap_err());
    assert!(cause.contains("no photo that can be read"), "{cause}");
}

#[cfg(unix)]
#[test]
fn odd_names_are_imported_each_to_a_file_of_its_own() {
    let project =
        Project::new(pinhole(), &["a/b.png", "a__b.png", "a\\b.png", "a\tb.png", "a_b.png"]);
    project.write_photos();
    project.write_model();
    let report = project.import_written(&ImportOptions::default()).unwrap();
    assert_eq!(report.views, 5);
    let capture = capture_of(&project);
    let files: std::collections::BTreeSet<_> =
        capture.views.iter().map(|v| v.image.clone()).collect();
    assert_eq!(files.len(), 5, "{files:?}");
    assert!(files.iter().all(|file| project.output().join(file).is_file()));
}

#[test]
fn a_model_may_start_with_a_byte_order_mark_and_lie_in_a_numbered_folder() {
    let project = Project::new(pinhole(), &NAMES);
    project.write_photos();
    project.write_model();
    let file = project.path().join("sparse/0/cameras.txt");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, format!("\u{feff}{text}")).unwrap();
    let source = Source::recognize(&ImportInput {
        model: Some(project.path().join("sparse")),
        ..Default::default()
    })
    .unwrap();
    let (options, sfm) = (ImportOptions::default(), SfmOptions::default());
    let report = import(&source, &project.output(), &options, &sfm, &Silent).unwrap();
    assert_eq!(report.views, 10);
}

#[test]
fn points_beyond_single_precision_are_left_out_and_told() {
    let mut project = Project::new(pinhole(), &NAMES);
    project.points.push(DVec3::new(1e39, 0.0, 0.0));
    project.write_photos();
    project.write_model();
    let report = project.import_written(&ImportOptions::default()).unwrap();
    assert_eq!(report.points, 4);
    assert!(
        report.warnings.iter().any(|w| w.contains("single precision")),
        "{:?}",
        report.warnings
    );
}
