//! JSON documents of motes, and `transforms.json`.

use std::path::Path;

use motes_formats::camera_path::read_camera_path;
use motes_formats::capture::read_capture_with_warnings;
use motes_formats::decomposition::DecompositionDocument;
use motes_formats::documents::{Document, read_document, syntax_error};
use motes_formats::metrics::MetricsDocument;
use motes_formats::run_record::RunRecord;
use motes_formats::selection::SelectionDocument;
use motes_formats::transforms::read_transforms;
use motes_formats::{FormatError, Result, camera_path, capture};
use motes_scene::Split;
use serde_json::Value;

use super::{folders, gltf, made_by};
use crate::{Bounds, Description, Kind, measure};

/// Whether a JSON file has the key that documents of motes start with.
///
/// # Errors
/// It is not JSON.
pub(super) fn has_format(path: &Path) -> Result<bool> {
    Ok(read_json(path)?.get("format").is_some())
}

/// A JSON file of any kind.
///
/// # Errors
/// It is of a known kind and broken, or not JSON.
pub(super) fn describe(path: &Path) -> Result<Description> {
    let json = read_json(path)?;
    let Some(format) = json.get("format").and_then(Value::as_str) else {
        return match (json.get("frames"), json.get("asset")) {
            (Some(_), _) => of_transforms(path),
            (_, Some(_)) => gltf::describe(path),
            _ => Ok(Description::new(Kind::Unknown, "json")),
        };
    };
    let mut found = match format {
        capture::CaptureDocument::FORMAT => of_capture(path)?,
        DecompositionDocument::FORMAT => return folders::describe_scene(path),
        SelectionDocument::FORMAT => of_selection(path)?,
        camera_path::CameraPathDocument::FORMAT => of_camera_path(path)?,
        MetricsDocument::FORMAT => of_metrics(path)?,
        RunRecord::FORMAT => of_run_record(path)?,
        "motes/edit-plan" => lists(Kind::EditPlan, &json),
        _ => lists(Kind::Document, &json),
    };
    let version = json.get("version").and_then(Value::as_str).unwrap_or_default();
    found.format = format!("{format} {version}").trim_end().to_owned();
    let text = |key: &str| json.get(key).and_then(Value::as_str).filter(|text| !text.is_empty());
    found.made_by = found.made_by.or(text("made_by").map(str::to_owned));
    found.seed = found.seed.or(json.get("seed").and_then(Value::as_u64));
    Ok(found)
}

fn read_json(path: &Path) -> Result<Value> {
    let bytes = std::fs::read(path).map_err(|error| FormatError::io(path, error))?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    serde_json::from_slice(bytes).map_err(|error| syntax_error(bytes, path, &error))
}

/// A document of which no more is known here than how long its lists are.
fn lists(kind: Kind, json: &Value) -> Description {
    let keys = json.as_object().into_iter().flatten();
    keys.fold(Description::new(kind, ""), |found, (key, value)| match value.as_array() {
        Some(items) if items.iter().any(Value::is_object) => found.count(key, items.len()),
        _ => found,
    })
}

fn of_capture(path: &Path) -> Result<Description> {
    let (capture, warnings) = read_capture_with_warnings(path)?;
    let mut models: Vec<&str> = capture.cameras.iter().map(|c| c.model.name()).collect();
    models.sort_unstable();
    models.dedup();
    let mut sizes: Vec<String> =
        capture.cameras.iter().map(|c| format!("{} x {}", c.width, c.height)).collect();
    sizes.sort();
    sizes.dedup();
    sizes.truncate(10);
    let lost = |view: &&motes_scene::View| !capture::resolve(path, &view.image).is_file();
    let mut found = Description::new(Kind::Capture, "")
        .count("views", capture.views.len())
        .count("train_views", capture.views_of(Split::Train).len())
        .count("test_views", capture.views_of(Split::Test).len())
        .count("masks", capture.views.iter().filter(|view| view.mask.is_some()).count())
        .count("cameras", capture.cameras.len())
        .count("points", capture.points.len())
        .fact("camera_models", models)
        .fact("sizes_px", sizes);
    found.bounds = measure::bounds(&capture.points.positions);
    found.warnings = warnings;
    match capture.views.iter().filter(lost).count() {
        0 => {}
        n => found.warnings.push(format!("the pictures of {n} views are missing")),
    }
    Ok(found)
}

fn of_selection(path: &Path) -> Result<Description> {
    let document = read_document::<SelectionDocument>(path)?.document;
    let mut found = Description::new(Kind::Selection, "")
        .count("selected", document.count as usize)
        .count("gaussians", document.gaussians.count as usize)
        .fact("of_file", document.gaussians.name)
        .fact("of_sha256", document.gaussians.sha256);
    found.bounds = document
        .object_box
        .map(|b| Bounds { min: b.min.map(|v| v as f32), max: b.max.map(|v| v as f32) });
    Ok(found)
}

fn of_camera_path(path: &Path) -> Result<Description> {
    let cameras = read_camera_path(path)?;
    let seconds = cameras.frames.len() as f64 / cameras.fps;
    let mut found = Description::new(Kind::CameraPath, "")
        .count("poses", cameras.frames.len())
        .fact("fps", cameras.fps)
        .fact("seconds", (seconds * 1000.0).round() / 1000.0);
    found.size_px = cameras.frames.first().map(|(camera, _)| [camera.width, camera.height]);
    let centers =
        cameras.frames.iter().map(|(_, pose)| pose.center_in_world().as_vec3().to_array());
    found.bounds = measure::bounds(&centers.collect::<Vec<_>>());
    Ok(found)
}

fn of_metrics(path: &Path) -> Result<Description> {
    let document = read_document::<MetricsDocument>(path)?.document;
    let mut found = Description::new(Kind::Metrics, "")
        .count("views", document.views.len())
        .fact("psnr_db", document.mean.psnr)
        .fact("ssim", document.mean.ssim)
        .fact("lpips", document.mean.lpips)
        .fact("split", document.split.name());
    if let Some(gaussians) = document.gaussians {
        found = found.count("gaussians", gaussians as usize);
    }
    Ok(found)
}

fn of_run_record(path: &Path) -> Result<Description> {
    let record = read_document::<RunRecord>(path)?.document;
    let mut found = Description::new(Kind::RunRecord, "")
        .count("inputs", record.inputs.len())
        .count("threads", record.threads as usize)
        .fact("outputs", record.outputs.clone())
        .fact("command", record.argv.join(" "))
        .fact("start", record.start.as_str())
        .fact("wall_s", record.wall_s)
        .fact("cpu_s", record.cpu_s);
    found.made_by = Some(made_by::program(&record));
    found.seed = record.seed;
    found.warnings = record.warnings;
    Ok(found)
}

fn of_transforms(path: &Path) -> Result<Description> {
    let transforms = read_transforms(path)?;
    let masks = transforms.frames.iter().filter(|frame| frame.mask_path.is_some()).count();
    let found = Description::new(Kind::Transforms, "transforms.json")
        .count("views", transforms.frames.len())
        .count("masks", masks)
        .fact("start_points", transforms.ply_file_path);
    let centers = transforms.frames.iter().map(|f| f.camera_from_world.center_in_world());
    let centers: Vec<[f32; 3]> = centers.map(|center| center.as_vec3().to_array()).collect();
    Ok(Description { bounds: measure::bounds(&centers), ..found })
}
