//! Cameras as nodes of a glTF, a path also as an animation.
//!
//! glTF cameras look along -z with y up; the world is turned as that of exported splats (half a turn about z), so
//! that both fit. A principal point off the middle has no place; it is in the extras with the other intrinsics.

use std::path::Path;

use base64::Engine as _;
use glam::{DMat3, DQuat, DVec3};
use motes_scene::Camera;
use serde_json::{Value, json};

use super::{PosedView, PosedViews};
use crate::atomic::write_atomic;
use crate::error::{FormatError, Result};

/// Nothing nearer is drawn: a share of the distance between cameras and origin would be a guess.
const NEAR: f64 = 0.01;
const FLOAT: u32 = 5126;

/// Writes a `.gltf` with a node per view; for a path one more that moves along it.
///
/// # Errors
/// Writing fails, or a camera is a panorama.
pub fn write_gltf_cameras(path: &Path, views: &PosedViews) -> Result<()> {
    let cameras: Vec<Value> =
        views.cameras.iter().map(|camera| perspective(camera, path)).collect::<Result<_>>()?;
    let mut nodes: Vec<Value> = views
        .views
        .iter()
        .map(|view| {
            let (rotation, translation) = placed(view);
            json!({
                "name": view.name, "camera": view.camera,
                "rotation": rotation.to_array(), "translation": translation.to_array(),
            })
        })
        .collect();
    let mut document = json!({
        "asset": { "version": "2.0", "generator": concat!("motes ", env!("CARGO_PKG_VERSION")) },
        "cameras": cameras,
        "scene": 0,
    });
    if let (Some(fps), Some(first)) = (views.fps, views.views.first()) {
        nodes.push(json!({ "name": "path", "camera": first.camera }));
        animate(&mut document, views, fps, nodes.len() - 1);
    }
    document["scenes"] = json!([{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }]);
    document["nodes"] = Value::Array(nodes);
    let text = crate::documents::to_pretty_json(&document);
    write_atomic(path, |writer| writer.write_all(text.as_bytes()))
}

fn perspective(camera: &Camera, path: &Path) -> Result<Value> {
    let Some([fx, fy, cx, cy]) = camera.affine() else {
        return Err(FormatError::not_supported(path, "cameras", "glTF has no panoramas"));
    };
    let (width, height) = (camera.width as f64, camera.height as f64);
    Ok(json!({
        "type": "perspective",
        "perspective": {
            "yfov": 2.0 * (height / (2.0 * fy)).atan(),
            "aspectRatio": width * fy / (height * fx),
            "znear": NEAR,
        },
        "extras": { "width": width, "height": height, "fx": fx, "fy": fy, "cx": cx, "cy": cy },
    }))
}

/// Rotation and position of the node.
fn placed(view: &PosedView) -> (DQuat, DVec3) {
    let world_from_camera = view.camera_from_world.inverse();
    let half_turn = DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0));
    let axes = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let turn = half_turn * DMat3::from_quat(world_from_camera.rotation) * axes;
    (DQuat::from_mat3(&turn).normalize(), half_turn * world_from_camera.translation)
}

/// An animation of one node, linear between the frames.
fn animate(document: &mut Value, views: &PosedViews, fps: f64, node: usize) {
    let mut bytes = Vec::new();
    let mut push = |value: f64| bytes.extend((value as f32).to_le_bytes());
    let count = views.views.len();
    (0..count).for_each(|i| push(i as f64 / fps));
    let places: Vec<(DQuat, DVec3)> = views.views.iter().map(placed).collect();
    let mut last = DQuat::IDENTITY;
    for (rotation, _) in &places {
        // The shorter way from frame to frame.
        let rotation = if rotation.dot(last) < 0.0 { -*rotation } else { *rotation };
        rotation.to_array().into_iter().for_each(&mut push);
        last = rotation;
    }
    places.iter().for_each(|(_, position)| position.to_array().into_iter().for_each(&mut push));
    let sizes = [4 * count, 16 * count, 12 * count];
    let mut offset = 0;
    let views_of = sizes.map(|size| {
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": size });
        offset += size;
        view
    });
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let last_time = (count - 1) as f32 / fps as f32;
    document["buffers"] = json!([{
        "byteLength": bytes.len(),
        "uri": format!("data:application/octet-stream;base64,{data}"),
    }]);
    document["bufferViews"] = json!(views_of);
    let accessor = |view: usize, shape: &str| json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": shape });
    let mut times = accessor(0, "SCALAR");
    times["min"] = json!([0.0f32]);
    times["max"] = json!([last_time]);
    document["accessors"] = json!([times, accessor(1, "VEC4"), accessor(2, "VEC3")]);
    let channel = |sampler: usize, path: &str| json!({ "sampler": sampler, "target": { "node": node, "path": path } });
    document["animations"] = json!([{
        "name": "path",
        "samplers": [
            { "input": 0, "output": 1, "interpolation": "LINEAR" },
            { "input": 0, "output": 2, "interpolation": "LINEAR" },
        ],
        "channels": [channel(0, "rotation"), channel(1, "translation")],
    }]);
}
