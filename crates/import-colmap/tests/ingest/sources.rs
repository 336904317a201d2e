//! Models, panoramas and transforms as sources; odd names and numbers in them.

use std::path::Path;

use crate::common::{NAMES, Project, bad_input, capture_of, import_path, pinhole, ring_pose};
use glam::DVec3;
use import_colmap::{ImportInput, ImportOptions, IngestError, SfmOptions, Silent, Source, import};
use motes_formats::capture::read_capture;
use motes_formats::images::{read_image, write_png};
use motes_scene::{Camera, CameraModel, ImageU8, Pose};

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
