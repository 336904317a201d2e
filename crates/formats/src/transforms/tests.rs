use super::*;
use motes_scene::CameraModel;

const MATRIX: &str = "[[1,0,0,2],[0,1,0,3],[0,0,1,4],[0,0,0,1]]";

fn parse_text(text: &str) -> Result<Transforms> {
    parse(text.as_bytes(), Path::new("t.json"))
}

fn with(keys: &str) -> Result<Transforms> {
    parse_text(&format!(
        r#"{{{keys}, "frames": [{{"file_path": "./images/a.png", "transform_matrix": {MATRIX}}}]}}"#
    ))
}

#[test]
fn opengl_axes_become_ours() {
    let frame = with(r#""fl_x": 100, "w": 64, "h": 48"#).unwrap().frames.remove(0);
    assert_eq!(frame.file_path, "images/a.png");
    // The OpenGL camera at (2, 3, 4) looks along -z with y up.
    let pose = frame.camera_from_world;
    assert!((pose.center_in_world() - DVec3::new(2.0, 3.0, 4.0)).length() < 1e-12);
    let ahead = pose.transform_point(DVec3::new(2.0, 3.0, 0.0));
    assert!((ahead - DVec3::new(0.0, 0.0, 4.0)).length() < 1e-12, "{ahead}");
    let above = pose.transform_point(DVec3::new(2.0, 4.0, 0.0));
    assert!(above.y < 0.0, "up in the world is up in the image: {above}");
}

#[test]
fn intrinsics_take_every_form() {
    let camera = |keys: &str| with(keys).unwrap().frames[0].intrinsics.camera(640, 480);
    let c = camera(r#""camera_angle_x": 1.5707963267948966"#);
    assert_eq!((c.model, c.width, c.height), (CameraModel::Pinhole, 640, 480));
    assert!((c.params[0] - 320.0).abs() < 1e-9 && c.params[1] == c.params[0]);
    assert_eq!(c.params[2..], [320.0, 240.0]);
    let c = camera(
        r#""camera_model": "OPENCV", "fl_x": 9, "fl_y": 8, "cx": 3, "cy": 2, "w": 10, "h": 6, "k1": 0.1, "p2": 0.2"#,
    );
    assert_eq!((c.model, c.width, c.height), (CameraModel::Opencv, 10, 6));
    assert_eq!(c.params, [9.0, 8.0, 3.0, 2.0, 0.1, 0.0, 0.0, 0.2]);
    let c = camera(r#""camera_model": "OPENCV", "fl_x": 9, "k1": 0.1, "k3": 0.01"#);
    assert_eq!((c.model, c.params[8]), (CameraModel::FullOpencv, 0.01));
    let c = camera(r#""camera_model": "OPENCV", "fl_x": 9, "k1": 0.0"#);
    assert_eq!(c.model, CameraModel::Pinhole);
    let c = camera(r#""camera_model": "OPENCV_FISHEYE", "fl_x": 9, "k4": 0.5"#);
    assert_eq!((c.model, c.params[7]), (CameraModel::OpencvFisheye, 0.5));
    let c = camera(r#""camera_model": "EQUIRECTANGULAR""#);
    assert_eq!((c.model, c.params), (CameraModel::Equirectangular, vec![640.0, 480.0]));
}

#[test]
fn a_frame_overrules_the_file() {
    let text = format!(
        r#"{{"fl_x": 100, "w": 64, "h": 48, "unknown": [1], "applied_transform": [[1,0,0,0]],
            "train_filenames": ["./a"], "test_filenames": ["b"], "ply_file_path": "p.ply",
            "frames": [{{"file_path": "a", "fl_x": 50, "w": 32, "h": 24, "mask_path": "m/a.png", "transform_matrix": {MATRIX}}},
                       {{"file_path": "b", "transform_matrix": {MATRIX}}}]}}"#
    );
    let transforms = parse_text(&text).unwrap();
    let params = |i: usize| transforms.frames[i].intrinsics.camera(1, 1).params;
    assert_eq!(params(0), [50.0, 50.0, 16.0, 12.0]);
    assert_eq!(params(1), [100.0, 100.0, 32.0, 24.0]);
    assert_eq!(transforms.frames[0].mask_path.as_deref(), Some("m/a.png"));
    assert_eq!(transforms.train_filenames.as_deref(), Some(&["a".to_string()][..]));
    assert_eq!(transforms.ply_file_path.as_deref(), Some("p.ply"));
}

#[test]
fn bad_files_are_refused_for_their_reason() {
    let matrix = |m: &str| {
        parse_text(&format!(
            r#"{{"fl_x": 1, "frames": [{{"file_path": "a", "transform_matrix": {m}}}]}}"#
        ))
    };
    let path = |p: &str| {
        parse_text(&format!(
            r#"{{"fl_x": 1, "frames": [{{"file_path": "{p}", "transform_matrix": {MATRIX}}}]}}"#
        ))
    };
    for (result, expected) in [
        (parse_text("{"), "line 1"),
        (parse_text("[]"), "not a transforms.json"),
        (parse_text(r#"{"fl_x": 1}"#), "missing field `frames`"),
        (parse_text(r#"{"fl_x": 1, "frames": []}"#), "there are no frames"),
        (matrix("[[1,0,0,0]]"), "not 4 x 4"),
        (matrix("[[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]"), "is not a rotation"),
        (matrix("[[0,0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,1]]"), "is not a rotation"),
        (matrix("[[1,0.5,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), "is not a rotation"),
        (matrix("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,2]]"), "last row"),
        (matrix("[[1,0,0,1e999],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), "number out of range"),
        (path("../a.png"), "leads out of the image folder"),
        (path("/a.png"), "absolute path"),
        (with(r#""w": 64, "h": 48"#), "there is no focal length"),
        (with(r#""fl_x": 0"#), "not a length in pixels"),
        (with(r#""camera_angle_x": 3.2"#), "not a field of view"),
        (with(r#""fl_x": 9, "w": 1e6, "h": 4"#), "not a plausible image size"),
        (with(r#""fl_x": 9, "w": 64"#), "only one of w and h"),
        (with(r#""fl_x": 9, "camera_model": "LIDAR""#), "camera_model \"LIDAR\" is unknown"),
        (with(r#""fl_x": 9, "k4": 0.1"#), "k4 of a perspective camera"),
    ] {
        let error = result.unwrap_err().to_string();
        assert!(error.contains(expected), "{expected}: {error}");
    }
}
