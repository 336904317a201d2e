//! Reading the folders of the lab's runs.
//!
//! A run is a folder with `capture/capture.json`, `metrics.json` (test and train scores),
//! `train.json` (what train-splat measured), `renders/` (held-out views) and `halfway/` (one
//! made-up viewpoint).

use std::path::{Path, PathBuf};

use motes_formats::capture::read_capture;
use motes_formats::documents::read_document;
use motes_formats::images::read_image;
use motes_formats::metrics::MetricsDocument;
use motes_formats::{FormatError, Result};
use motes_scene::{Capture, ImageU8, Split};

use crate::pages::{LabPage, LabRun, LabView};
use evaluate::files::photos::load_photo;
use render::frames::view_stems;

/// Reads the runs, most training photos first, and lines up what they render.
///
/// `halfway` names the made-up viewpoint; without it, `halfway/` is not read.
///
/// # Errors
/// When a file is missing or malformed, or the runs have different held-out views.
pub(super) fn load_lab(folders: &[PathBuf], halfway: Option<&str>) -> Result<LabPage> {
    let runs: Vec<RunFiles> = folders.iter().map(|f| RunFiles::load(f)).collect::<Result<_>>()?;
    let mut views = Vec::new();
    if let Some(first) = runs.first() {
        for view in first.capture.views_of(Split::Test) {
            views.push(held_out_view(&runs, &first.capture.views[view].name)?);
        }
    }
    if let Some(name) = halfway {
        let render = |run: &RunFiles| only_picture(&run.folder.join("halfway")).map(Some);
        let renders = runs.iter().map(render).collect::<Result<_>>()?;
        views.push(LabView { name: name.to_owned(), photo: None, renders, psnr: Vec::new() });
    }
    let runs = runs.iter().map(RunFiles::summary).collect();
    Ok(LabPage { runs, views, ..LabPage::default() })
}

/// What the files of one run hold.
struct RunFiles {
    folder: PathBuf,
    document: PathBuf,
    capture: Capture,
    metrics: MetricsDocument,
    seconds: Option<f64>,
}

impl RunFiles {
    fn load(folder: &Path) -> Result<Self> {
        let document = folder.join("capture/capture.json");
        let metrics = folder.join("metrics.json");
        Ok(Self {
            folder: folder.to_owned(),
            capture: read_capture(&document)?,
            document,
            metrics: read_document(&metrics)?.document,
            seconds: training_seconds(&folder.join("train.json"))?,
        })
    }

    fn summary(&self) -> LabRun {
        LabRun {
            photos: self.capture.views_of(Split::Train).len(),
            train: self.metrics.train.unwrap_or_default(),
            test: self.metrics.test.unwrap_or_default(),
            gaussians: self.metrics.gaussians.map(|n| n as usize),
            seconds: self.seconds,
        }
    }

    fn psnr_of(&self, name: &str) -> Option<f64> {
        let is_it =
            |v: &&motes_formats::metrics::ViewMetrics| v.name == name && v.split == Split::Test;
        self.metrics.views.iter().find(is_it)?.scores.psnr
    }
}

fn held_out_view(runs: &[RunFiles], name: &str) -> Result<LabView> {
    let mut view = LabView { name: name.to_owned(), ..LabView::default() };
    for run in runs {
        let index = run.capture.view_named(name).ok_or_else(|| {
            let cause = format!("the first run holds out \"{name}\", which this one does not have");
            FormatError::invalid(&run.document, "views", cause)
                .with_remedy("give all runs the same --test-list")
        })?;
        if view.photo.is_none() {
            let photo = load_photo(&run.document, &run.capture, index, [0.0; 3])?;
            view.photo = Some(photo.rgb);
        }
        let stem = &view_stems(&run.capture)[index];
        view.renders.push(Some(read_image(&run.folder.join(format!("renders/{stem}.png")))?));
        view.psnr.push(run.psnr_of(name));
    }
    Ok(view)
}

fn only_picture(folder: &Path) -> Result<ImageU8> {
    let entries = std::fs::read_dir(folder).map_err(|error| FormatError::io(folder, error))?;
    let mut pictures: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|suffix| suffix == "png"))
        .collect();
    pictures.sort();
    match pictures.as_slice() {
        [picture] => read_image(picture),
        found => {
            let cause = format!("expected one PNG file, found {}", found.len());
            Err(FormatError::invalid(folder, "", cause))
        }
    }
}

/// Wall-clock seconds of the training loop; `None` where the file does not say.
fn training_seconds(path: &Path) -> Result<Option<f64>> {
    let text = std::fs::read_to_string(path).map_err(|error| FormatError::io(path, error))?;
    let value: serde_json::Value = serde_json::from_str(&text).map_err(|error| {
        FormatError::invalid(path, format!("line {}", error.line()), format!("not JSON: {error}"))
    })?;
    Ok(value.get("seconds").and_then(serde_json::Value::as_f64))
}

/// Sentences about the poses from what `scripts/sfm-pose-error.py` printed.
///
/// # Errors
/// When the file is not its JSON.
pub(super) fn pose_error_sentences(path: &Path) -> Result<Vec<String>> {
    let text = std::fs::read_to_string(path).map_err(|error| FormatError::io(path, error))?;
    let value: serde_json::Value = serde_json::from_str(&text)
        .map_err(|error| FormatError::invalid(path, "", format!("not JSON: {error}")))?;
    let number = |pointer: &str| {
        value.pointer(pointer).and_then(serde_json::Value::as_f64).ok_or_else(|| {
            FormatError::invalid(path, pointer, "this number is missing")
                .with_remedy("write the file with scripts/sfm-pose-error.py")
        })
    };
    let (cameras, center) = (number("/cameras")?, number("/center_error_percent/max")?);
    let rotation = number("/rotation_error_deg/max")?;
    let missing = value.pointer("/missing").and_then(|m| m.as_array()).map_or(0, Vec::len);
    let missing = if missing == 0 { String::new() } else { format!(" {missing} were not found.") };
    Ok(vec![format!(
        "Yes: the photos were rendered, so the true cameras are known. Structure from motion placed \
         {cameras} cameras with at most {center:.3} % of the camera distance of error and \
         {rotation:.3} degrees of turn.{missing} What goes wrong with few photos is not the poses."
    )])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pose_errors_become_a_sentence() {
        let dir = std::env::temp_dir().join(format!("motes-pose-error-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let path = dir.join("pose-error.json");
        let json = r#"{"cameras": 24, "missing": [], "center_error_percent": {"max": 0.043},
            "rotation_error_deg": {"max": 0.025}}"#;
        std::fs::write(&path, json).unwrap();
        let sentence = pose_error_sentences(&path).unwrap().remove(0);
        assert!(sentence.contains("24 cameras") && sentence.contains("0.043 %"), "{sentence}");
        std::fs::write(&path, "{}").unwrap();
        assert!(pose_error_sentences(&path).unwrap_err().to_string().contains("/cameras"));
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
