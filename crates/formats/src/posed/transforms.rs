//! nerfstudio's `transforms.json`.

use std::path::Path;

use glam::{DMat3, DVec3};
use motes_scene::{Camera, CameraModel, Split};
use serde_json::{Map, Value, json};

use super::{PosedView, PosedViews};
use crate::atomic::write_atomic;
use crate::error::{FormatError, Result};

/// Writes `transforms.json`. Poses are camera to world with y up and z back; image names are relative to
/// the folder of the file, which should be that of the capture. `points` is the name of a PLY of points there.
///
/// # Errors
/// Writing fails, or a camera has a model that the format does not know.
pub fn write_transforms(path: &Path, views: &PosedViews, points: Option<&str>) -> Result<()> {
    let intrinsics: Vec<Map<String, Value>> =
        views.cameras.iter().map(|camera| intrinsics(camera, path)).collect::<Result<_>>()?;
    let mut document = match intrinsics.as_slice() {
        [one] => one.clone(),
        _ => Map::new(),
    };
    let shared = intrinsics.len() == 1;
    if let Some(points) = points {
        document.insert("ply_file_path".into(), points.into());
    }
    let frame = |view: &PosedView| {
        let mut frame = if shared { Map::new() } else { intrinsics[view.camera].clone() };
        frame.insert("file_path".into(), view.image.as_str().into());
        if let Some(mask) = &view.mask {
            frame.insert("mask_path".into(), mask.as_str().into());
        }
        frame.insert("transform_matrix".into(), matrix(view));
        Value::Object(frame)
    };
    document.insert("frames".into(), views.views.iter().map(frame).collect());
    for (key, split) in [("train_filenames", Split::Train), ("test_filenames", Split::Test)] {
        let names: Vec<&str> =
            views.views.iter().filter(|v| v.split == split).map(|v| v.image.as_str()).collect();
        document.insert(key.into(), json!(names));
    }
    let text = crate::documents::to_pretty_json(&document);
    write_atomic(path, |writer| writer.write_all(text.as_bytes()))
}

/// Camera to world, x right, y up, z back.
fn matrix(view: &PosedView) -> Value {
    let world_from_camera = view.camera_from_world.inverse();
    let turn = DMat3::from_quat(world_from_camera.rotation)
        * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let t = world_from_camera.translation;
    let row = |i: usize| json!([turn.row(i).x, turn.row(i).y, turn.row(i).z, t[i]]);
    json!([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
}

fn intrinsics(camera: &Camera, path: &Path) -> Result<Map<String, Value>> {
    let (model, keys): (&str, &[&str]) = match camera.model {
        CameraModel::SimplePinhole | CameraModel::Pinhole => ("PINHOLE", &[]),
        CameraModel::SimpleRadial => ("OPENCV", &["k1"]),
        CameraModel::Radial => ("OPENCV", &["k1", "k2"]),
        CameraModel::Opencv => ("OPENCV", &["k1", "k2", "p1", "p2"]),
        CameraModel::OpencvFisheye => ("OPENCV_FISHEYE", &["k1", "k2", "k3", "k4"]),
        other => {
            let cause = format!("transforms.json has no camera model like {}", other.name());
            return Err(FormatError::not_supported(path, "cameras", cause)
                .with_remedy("import the photos with import-colmap, which undistorts them"));
        }
    };
    let mut map = Map::new();
    map.insert("camera_model".into(), model.into());
    map.insert("w".into(), camera.width.into());
    map.insert("h".into(), camera.height.into());
    let affine = camera.affine().unwrap_or_default();
    for (key, value) in ["fl_x", "fl_y", "cx", "cy"].into_iter().zip(affine) {
        map.insert(key.into(), value.into());
    }
    for (key, value) in keys.iter().zip(camera.distortion_params()) {
        map.insert((*key).into(), (*value).into());
    }
    Ok(map)
}
