use glam::{DQuat, DVec3};
use motes_scene::{
    Camera, CameraModel, ExposureResponse, Pinhole, Pose, SparsePoints, Split, View,
};

use super::*;

fn sample() -> Capture {
    let camera =
        |model, params: &[f64]| Camera { model, width: 640, height: 480, params: params.to_vec() };
    let view = |name: &str, camera, angle: f64, split| View {
        name: name.into(),
        camera,
        camera_from_world: Pose {
            rotation: DQuat::from_rotation_y(angle),
            translation: DVec3::new(0.1, -1e-17, 3e5),
        },
        image: PathBuf::from(format!("images/sub folder/{name}")),
        mask: (camera == 1).then(|| PathBuf::from("masks/m é.png")),
        split,
        exposure_stops: (camera == 0).then_some(-7.25),
    };
    Capture {
        cameras: vec![
            camera(CameraModel::Pinhole, &[500.1, 500.2, 320.0, 240.0]),
            camera(CameraModel::SimpleRadial, &[500.0, 320.0, 240.0, -0.01]),
        ],
        views: vec![
            view("a.jpg", 0, 0.3, Split::Train),
            view("b.jpg", 1, 2.7, Split::Test),
            view("ü c.png", 0, -1.1, Split::Train),
        ],
        points: SparsePoints {
            positions: vec![[0.1, 0.2, 0.3], [-1.0, 0.0, 1e-30]],
            colors: vec![[1, 2, 3], [255, 0, 128]],
        },
        world_origin: DVec3::new(5e6, -4e5, 0.1),
        exposure_response: Some(ExposureResponse { slope_per_stop: 0.25, reference_stops: -8.5 }),
    }
}

#[test]
fn a_capture_survives_to_the_bit() {
    let dir = tempfile::tempdir().unwrap();
    let (first, second) = (dir.path().join("capture.json"), dir.path().join("again/capture.json"));
    write_capture(&first, &sample()).unwrap();
    let (read, warnings) = read_capture_with_warnings(&first).unwrap();
    assert_eq!(read, sample());
    assert!(warnings.is_empty());
    write_capture(&second, &read).unwrap();
    for file in ["capture.json", POINTS_FILE] {
        let bytes = |document: &Path| std::fs::read(resolve(document, Path::new(file))).unwrap();
        assert_eq!(bytes(&first), bytes(&second), "{file}");
    }
}

#[test]
fn a_capture_without_points_names_none() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("capture.json");
    let capture = Capture { points: SparsePoints::default(), ..sample() };
    write_capture(&path, &capture).unwrap();
    assert!(!dir.path().join(POINTS_FILE).exists());
    assert_eq!(read_capture(&path).unwrap(), capture);
}

#[test]
fn rounded_quaternions_are_made_unit_and_others_refused() {
    let pose = |rotation_wxyz| PoseDocument { rotation_wxyz, translation: [0.0; 3] };
    let check = |p| pose_from_document(Path::new("c"), "p", &pose(p));
    let rounded = check([0.707, 0.707, 0.0, 0.0]).unwrap();
    assert!((rounded.rotation.length() - 1.0).abs() < 1e-15);
    for wrong in [[0.0; 4], [2.0, 0.0, 0.0, 0.0], [f64::NAN, 0.0, 0.0, 1.0]] {
        let text = check(wrong).unwrap_err().to_string();
        assert!(text.contains("(p/rotation_wxyz)"), "{text}");
    }
}

#[test]
fn files_outside_the_folder_are_refused() {
    for (name, expected) in [
        ("/etc/passwd", "is absolute"),
        ("../x.png", "leads out of the folder"),
        ("a/../../x.png", "leads out of the folder"),
        ("a/..", "leads out of the folder"),
        ("C:/x.png", "is absolute"),
        ("C:x.png", "is absolute"),
        ("a\\..\\x.png", "has \\ between its parts"),
        ("\\\\server\\x", "has \\ between its parts"),
        ("", "is empty"),
        ("a\0b", "control characters"),
    ] {
        let text = checked_relative_path(Path::new("c"), "image", name).unwrap_err().to_string();
        assert!(text.contains(expected), "{name:?}: {text}");
    }
    for name in ["a.png", "a/b c/ü.png", "..a/b..", "./x.png"] {
        assert!(checked_relative_path(Path::new("c"), "image", name).is_ok(), "{name}");
    }
    let mut capture = sample();
    capture.views[0].image = PathBuf::from("/abs.png");
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("capture.json");
    let text = write_capture(&path, &capture).unwrap_err().to_string();
    assert!(text.contains("(/views/0/image)"), "{text}");
    assert!(!path.exists());
}

#[test]
fn a_camera_whose_axis_is_nowhere_near_the_picture_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("capture.json");
    let mut capture = sample();
    let width = capture.cameras[0].width as f64;
    for (cx, good) in [(-2.0 * width, true), (1e300, false), (-1e9, false)] {
        capture.cameras[0] = Camera::from_pinhole(Pinhole {
            fx: 500.0,
            fy: 500.0,
            cx,
            cy: 10.0,
            width: width as usize,
            height: capture.cameras[0].height,
        });
        let read = write_capture(&path, &capture).and_then(|()| read_capture(&path));
        assert_eq!(read.is_ok(), good, "cx {cx}");
    }
}
