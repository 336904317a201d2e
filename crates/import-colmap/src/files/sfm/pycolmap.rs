//! pycolmap through the driver script that this program carries.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;

use super::events::listen;
use super::options::{CameraSharing, FAINT_CONTRAST, Matcher};
use super::{Request, SfmReport, Solution};
use crate::error::{IngestError, Result};
use crate::progress::Progress;

/// Files for pycolmap, name and text; these lie beside every script.
pub(super) const SHARED: [[&str; 2]; 2] = [
    ["pycolmap_events.py", include_str!("pycolmap_events.py")],
    ["pycolmap_match.py", include_str!("pycolmap_match.py")],
];
const PHOTOS: [&str; 2] = ["pycolmap_photos.py", include_str!("pycolmap_photos.py")];
const CONTRADICTED: [&str; 2] =
    ["pycolmap_contradicted.py", include_str!("pycolmap_contradicted.py")];
const DRIVER: [&str; 2] = ["pycolmap_driver.py", include_str!("pycolmap_driver.py")];

/// Warnings of the driver that this program words itself.
const RESTATED: [&str; 4] =
    ["exif_orientation", "not_all_registered", "several_models", "focal_moved"];

#[derive(Deserialize)]
struct Outcome {
    models: Vec<Model>,
    photos: usize,
    focal_prior_px: Option<f64>,
    focal_prior_source: String,
    focal_px: f64,
    contradicted: usize,
    verified_pairs: u64,
    features: u64,
    pycolmap: String,
    seconds: f64,
}

#[derive(Deserialize)]
struct Model {
    path: PathBuf,
    registered: usize,
    mean_reprojection_error_px: Option<f64>,
    median_triangulation_angle_deg: Option<f64>,
    cameras: Vec<ModelCamera>,
}

#[derive(Deserialize)]
struct ModelCamera {
    width: u64,
    height: u64,
    photos: u64,
}

/// Runs the driver.
pub(super) fn solve(
    python: &Path,
    request: &Request<'_>,
    progress: &dyn Progress,
) -> Result<Solution> {
    std::fs::create_dir_all(request.workspace).map_err(|e| cannot_write(request.workspace, &e))?;
    for file in SHARED.into_iter().chain([PHOTOS, CONTRADICTED]) {
        write(request.workspace, file)?;
    }
    let script = write(request.workspace, DRIVER)?;
    let mut command = Command::new(python);
    command.arg(&script).args(arguments(request)).env("PYTHONDONTWRITEBYTECODE", "1");
    // COLMAP writes a log of every run into the folder for temporary files.
    for variable in ["TMPDIR", "TEST_TMPDIR", "GLOG_log_dir"] {
        command.env(variable, request.workspace);
    }
    let remedy = "run again with -v to see its log, or use --sfm colmap";
    let (outcome, warnings) = listen::<Outcome>(&mut command, progress, remedy)?;
    let warnings = warnings.into_iter().filter(|w| !RESTATED.contains(&w.code.as_str()));
    Ok(solution(outcome, warnings.map(|warning| warning.message).collect()))
}

fn arguments(request: &Request<'_>) -> Vec<std::ffi::OsString> {
    let options = request.options;
    let mut list: Vec<std::ffi::OsString> = Vec::new();
    let camera_model = format!("--camera-model={}", options.camera_model);
    let mut add = |flag: &str, value: &dyn AsRef<std::ffi::OsStr>| {
        list.push(flag.into());
        list.push(value.as_ref().into());
    };
    // Absolute: a folder may be named like an option.
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    add("--photos", &absolute(request.photos));
    add("--workspace", &absolute(request.workspace));
    add("--seed", &options.seed.to_string());
    add("--threads", &request.threads.max(1).to_string());
    match options.share_camera {
        CameraSharing::One => add("--single-camera", &"true"),
        CameraSharing::Each => add("--single-camera", &"false"),
        CameraSharing::Exif => {}
    }
    match options.matcher {
        Matcher::Auto => {}
        Matcher::Exhaustive => add("--matcher", &"exhaustive"),
        Matcher::Sequential => add("--matcher", &"sequential"),
    }
    if let Some(masks) = request.masks {
        add("--masks", &absolute(masks));
    }
    if let Some(scratch) = request.scratch {
        add("--scratch", &absolute(scratch));
    }
    if request.faint {
        add("--peak-threshold", &FAINT_CONTRAST.to_string());
        add("--guided-matching", &"true");
    }
    match request.focal_prior.pixels() {
        Some(focal) => add("--focal-px", &focal.to_string()),
        None => list.push("--focal-from-exif".into()),
    }
    list.extend([camera_model.into(), "--end-with-parent".into()]);
    list
}

fn solution(outcome: Outcome, warnings: Vec<String>) -> Solution {
    let best = &outcome.models[0];
    let main = best.cameras.iter().max_by_key(|camera| camera.photos);
    let report = SfmReport {
        tool: format!("pycolmap {}", outcome.pycolmap),
        focal_prior_px: outcome.focal_prior_px,
        focal_prior_source: outcome.focal_prior_source,
        focal_px: outcome.focal_px,
        mean_reprojection_error_px: best.mean_reprojection_error_px,
        verified_pairs: Some(outcome.verified_pairs),
        seconds: outcome.seconds,
        attempts: Vec::new(),
    };
    Solution {
        registered: best.registered,
        photos: outcome.photos,
        contradicted: outcome.contradicted,
        keypoints: Some(outcome.features as f64 / outcome.photos.max(1) as f64),
        long_side: main.map_or(0.0, |camera| camera.width.max(camera.height) as f64),
        median_parallax_degrees: best.median_triangulation_angle_deg,
        models: outcome.models.into_iter().map(|model| model.path).collect(),
        report,
        warnings,
        ..Solution::default()
    }
}

/// Puts a file, name and text, into a folder; where it is.
pub(super) fn write(folder: &Path, [name, text]: [&str; 2]) -> Result<PathBuf> {
    let file = folder.join(name);
    std::fs::write(&file, text).map_err(|e| cannot_write(&file, &e))?;
    Ok(file)
}

pub(super) fn cannot_write(path: &Path, error: &std::io::Error) -> IngestError {
    IngestError::Failed {
        cause: format!("cannot write ({error}): {}", path.display()),
        remedy: "choose a folder on a disk with free space".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::events::Event;
    use super::*;

    #[test]
    fn a_result_line_is_understood() {
        let line = r#"{"event":"result","models":[{"path":"/w/sparse/0","registered":3,"points":9,
            "mean_reprojection_error_px":0.5,"mean_track_length":2.5,"median_triangulation_angle_deg":12.0,
            "cameras":[{"id":1,"model":"SIMPLE_RADIAL","width":640,"height":480,"params":[1.0],"focal_px":512.0,
            "focal_prior_px":null,"focal_prior_source":"none","photos":3}]}],"photos":4,"failed":["d.jpg"],
            "focal_prior_px":null,"focal_prior_source":"none","focal_px":512.0,"matcher":"exhaustive",
            "contradicted":0,"verified_pairs":5,"features":9,"pycolmap":"4.2.1","seed":0,"seconds":1.5,"cpu_seconds":2.0}"#;
        let Ok(Event::Result(outcome)) = serde_json::from_str(line) else { panic!() };
        let solution = solution(*outcome, vec!["x".into()]);
        assert_eq!((solution.registered, solution.photos, solution.long_side), (3, 4, 640.0));
        assert_eq!(solution.report.tool, "pycolmap 4.2.1");
        assert_eq!(solution.models, [PathBuf::from("/w/sparse/0")]);
    }
}
