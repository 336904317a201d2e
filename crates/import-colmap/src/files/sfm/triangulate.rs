//! Start points for a capture that has poses and none: pycolmap with the poses held.

use std::path::Path;
use std::process::Command;

use glam::Vec3;
use motes_formats::atomic::ScratchFolder;
use motes_formats::colmap::read_model;
use motes_scene::{Capture, Pose, SparsePoints, Split, View};
use serde::Deserialize;
use serde_json::json;

use super::choose::python_with_pycolmap;
use super::events::listen;
use super::options::SfmOptions;
use super::pycolmap::{SHARED, write};
use crate::error::{IngestError, Result};
use crate::progress::Progress;

const SCRIPT: [&str; 2] = ["pycolmap_triangulate.py", include_str!("pycolmap_triangulate.py")];
/// Photos that a photo is matched with.
const NEIGHBORS: usize = 12;
/// Angle between two optical axes, radians, that counts like twice the distance.
const TURN: f64 = 0.35;

#[derive(Deserialize)]
struct Outcome {
    pycolmap: String,
    mean_reprojection_error_px: Option<f64>,
}

/// Points and one sentence about them.
pub(crate) struct Triangulated {
    pub(crate) points: SparsePoints,
    pub(crate) note: String,
}

/// Triangulates what the photos of `capture`, which lie in `folder`, show; `None` without a Python
/// that has pycolmap. `train_only` leaves held-out photos out.
pub(crate) fn triangulate(
    capture: &Capture,
    folder: &Path,
    train_only: bool,
    options: &SfmOptions,
    progress: &dyn Progress,
) -> Result<Option<Triangulated>> {
    let Some(python) = python_with_pycolmap(options) else { return Ok(None) };
    let used: Vec<&View> = capture
        .views
        .iter()
        .filter(|view| !train_only || view.split == Split::Train)
        .filter(|view| capture.cameras[view.camera].as_pinhole().is_some())
        .collect();
    let workspace = ScratchFolder::new().map_err(|error| IngestError::Failed {
        cause: format!("cannot make a temporary folder ({error})"),
        remedy: "free some space, or leave it out with --triangulate off".into(),
    })?;
    let workspace = workspace.path();
    for file in SHARED {
        write(workspace, file)?;
    }
    let script = write(workspace, SCRIPT)?;
    let request = write(workspace, ["request.json", &request(capture, &used).to_string()])?;
    let mut command = Command::new(&python);
    command.arg(&script).arg("--photos").arg(folder).arg("--workspace").arg(workspace);
    command.arg("--request").arg(&request).env("PYTHONDONTWRITEBYTECODE", "1");
    command.args(["--threads", &rayon::current_num_threads().to_string()]);
    command.args(["--seed", &options.seed.to_string()]);
    // COLMAP writes a log of every run into the folder for temporary files.
    for variable in ["TMPDIR", "TEST_TMPDIR", "GLOG_log_dir"] {
        command.env(variable, workspace);
    }
    let (outcome, _): (Outcome, _) = listen(
        &mut command,
        progress,
        "leave it out with --triangulate off: train-splat finds start points itself",
    )?;
    let model = read_model(&workspace.join("sparse/0"))?;
    let mut points = SparsePoints::default();
    for point in &model.points {
        points.positions.push(point.position.as_vec3().to_array());
        points.colors.push(point.color);
    }
    points_are_finite(&mut points);
    let error = outcome.mean_reprojection_error_px;
    let error = error.map_or(String::new(), |e| format!(", mean reprojection error {e:.2} px"));
    let note = format!(
        "{} start points triangulated with pycolmap {} from the poses as given{error}",
        points.len(),
        outcome.pycolmap
    );
    Ok(Some(Triangulated { points, note }))
}

fn points_are_finite(points: &mut SparsePoints) {
    let finite: Vec<bool> = points.positions.iter().map(|p| Vec3::from(*p).is_finite()).collect();
    let mut keep = finite.iter();
    points.positions.retain(|_| keep.next().copied().unwrap_or(false));
    let mut keep = finite.iter();
    points.colors.retain(|_| keep.next().copied().unwrap_or(false));
}

/// Names are those of the files: what COLMAP reads.
fn file_name(view: &View) -> String {
    view.image.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

fn request(capture: &Capture, used: &[&View]) -> serde_json::Value {
    let photos: Vec<_> = used
        .iter()
        .filter_map(|view| {
            let camera = capture.cameras[view.camera].as_pinhole()?;
            let Pose { rotation: q, translation } = view.camera_from_world;
            Some(json!({
                "name": file_name(view),
                "width": camera.width,
                "height": camera.height,
                "params": [camera.fx, camera.fy, camera.cx, camera.cy],
                "rotation_wxyz": [q.w, q.x, q.y, q.z],
                "translation": translation.to_array(),
            }))
        })
        .collect();
    let pairs: Vec<_> =
        pairs(used).into_iter().map(|(a, b)| [file_name(used[a]), file_name(used[b])]).collect();
    json!({ "photos": photos, "pairs": pairs })
}

/// Every photo with those nearest to it that look about the same way.
fn pairs(used: &[&View]) -> Vec<(usize, usize)> {
    let place = |view: &View| {
        let pose = &view.camera_from_world;
        (pose.center_in_world(), pose.rotation.conjugate() * glam::DVec3::Z)
    };
    let places: Vec<_> = used.iter().map(|view| place(view)).collect();
    let mut pairs = Vec::new();
    for (i, (center, axis)) in places.iter().enumerate() {
        let mut others: Vec<(f64, usize)> = places
            .iter()
            .enumerate()
            .filter(|(k, _)| *k != i)
            .map(|(k, other)| {
                let turn = axis.dot(other.1).clamp(-1.0, 1.0).acos();
                (center.distance(other.0) * (1.0 + turn / TURN), k)
            })
            .collect();
        others.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        pairs.extend(others.iter().take(NEIGHBORS).map(|&(_, k)| (i.min(k), i.max(k))));
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}
