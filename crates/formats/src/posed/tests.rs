use glam::{DQuat, DVec3};
use motes_scene::{Capture, View};

use super::*;
use crate::colmap::{Layout, read_model};
use crate::transforms::read_transforms;

fn capture() -> Capture {
    let pinhole = |f: f64| {
        Camera::from_pinhole(Pinhole {
            fx: f,
            fy: f + 1.5,
            cx: 31.25,
            cy: 24.5,
            width: 64,
            height: 48,
        })
    };
    let view = |i: usize| View {
        name: format!("v {i}.png"),
        camera: i % 2,
        camera_from_world: Pose::new(
            DQuat::from_euler(glam::EulerRot::XYZ, 0.3 + i as f64, -0.4, 0.1 * i as f64),
            DVec3::new(0.1, -2.0 / 3.0, 3.0 + i as f64),
        )
        .unwrap(),
        image: format!("images/v {i}.png").into(),
        mask: (i == 1).then(|| "masks/v 1.png".into()),
        split: if i == 2 { Split::Test } else { Split::Train },
        exposure_stops: None,
    };
    Capture {
        cameras: vec![pinhole(50.0), pinhole(61.0)],
        views: (0..3).map(view).collect(),
        points: SparsePoints {
            positions: vec![[0.1, 0.2, 0.3], [-1.0, 2.0, 5.5]],
            colors: vec![[1, 2, 3], [255, 0, 128]],
        },
        world_origin: DVec3::ZERO,
        exposure_response: None,
    }
}

/// Largest difference of what two poses do to points.
fn distance(a: &Pose, b: &Pose) -> f64 {
    let points = [DVec3::ZERO, DVec3::new(1.0, -2.0, 3.0)];
    points.iter().map(|p| a.transform_point(*p).distance(b.transform_point(*p))).fold(0.0, f64::max)
}

#[test]
fn a_colmap_model_comes_back() {
    let capture = capture();
    for layout in [Layout::Binary, Layout::Text] {
        let dir = tempfile::tempdir().unwrap();
        write_colmap_model(dir.path(), &PosedViews::of_capture(&capture), layout).unwrap();
        let model = read_model(dir.path()).unwrap();
        assert_eq!((model.cameras.len(), model.images.len(), model.points.len()), (2, 3, 2));
        for (image, view) in model.images.iter().zip(&capture.views) {
            assert_eq!(image.name, view.name);
            assert_eq!(model.cameras[&image.camera_id], capture.cameras[view.camera]);
            assert!(distance(&image.camera_from_world, &view.camera_from_world) < 1e-12);
        }
        assert_eq!(model.points[1].color, [255, 0, 128]);
        assert_eq!(model.points[1].position.as_vec3().to_array(), capture.points.positions[1]);
    }
}

#[test]
fn transforms_come_back() {
    let capture = capture();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("transforms.json");
    write_transforms(&path, &PosedViews::of_capture(&capture), None).unwrap();
    let read = read_transforms(&path).unwrap();
    assert_eq!(read.frames.len(), 3);
    for (frame, view) in read.frames.iter().zip(&capture.views) {
        assert!(distance(&frame.camera_from_world, &view.camera_from_world) < 1e-12);
    }
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.contains("masks/v 1.png") && text.contains("\"test_filenames\": [\"images/v 2.png\"]"),
        "{text}"
    );
}

#[test]
fn gltf_cameras_stand_where_the_splats_are_seen() {
    let views = PosedViews::of_capture(&capture());
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("cameras.gltf");
    let moving = PosedViews { fps: Some(25.0), ..views.clone() };
    write_gltf_cameras(&path, &moving).unwrap();
    let document: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!(document["nodes"].as_array().unwrap().len(), 4);
    let floats = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
    };
    for (node, view) in document["nodes"].as_array().unwrap().iter().zip(&views.views) {
        let q = floats(&node["rotation"]);
        let rotation = DQuat::from_xyzw(q[0], q[1], q[2], q[3]);
        let position = DVec3::from_slice(&floats(&node["translation"]));
        // A point 3 units ahead and 1 to the right and below, in the world of a PLY and of a glTF.
        let ahead = view.camera_from_world.inverse().transform_point(DVec3::new(1.0, 1.0, 3.0));
        let ahead = DVec3::new(-ahead.x, -ahead.y, ahead.z);
        let seen = rotation.conjugate() * (ahead - position);
        assert!(seen.distance(DVec3::new(1.0, -1.0, -3.0)) < 1e-9, "{seen}");
    }
    let yfov = document["cameras"][0]["perspective"]["yfov"].as_f64().unwrap();
    assert!((yfov - 2.0 * (24.0f64 / 51.5).atan()).abs() < 1e-12);
}
