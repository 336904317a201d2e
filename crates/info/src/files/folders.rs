//! Folders: a scene, a capture, a COLMAP model, SOG files, pictures.

use std::path::Path;

use motes_codecs::open_gaussians;
use motes_formats::colmap::{find_models, read_model};
use motes_formats::decomposition::{DECOMPOSITION_FILE, read_decomposition};
use motes_formats::images::image_dimensions;
use motes_formats::ply::read_surface;
use motes_formats::{FormatError, Result};

use super::{documents, images, splats};
use crate::{Description, Kind, measure};

/// A folder of any kind.
///
/// # Errors
/// It cannot be listed, or it is of a known kind and broken.
pub(super) fn describe(path: &Path) -> Result<Description> {
    let inside = |name: &str| path.join(name).is_file();
    if inside(DECOMPOSITION_FILE) {
        return describe_scene(path);
    }
    if inside("capture.json") {
        return documents::describe(&path.join("capture.json"));
    }
    if let Some(model) = find_models(path).first() {
        return describe_colmap(model);
    }
    if inside("meta.json") {
        let mut found = splats::describe(&path.join("meta.json"))?;
        found.format = "sog".into();
        return Ok(found);
    }
    if inside("transforms.json") || inside("transforms_train.json") {
        let name =
            if inside("transforms.json") { "transforms.json" } else { "transforms_train.json" };
        return documents::describe(&path.join(name));
    }
    describe_pictures(path)
}

/// The parts of a scene folder and how well it explains its photos.
///
/// # Errors
/// The document or a part is broken.
pub(super) fn describe_scene(path: &Path) -> Result<Description> {
    let scene = read_decomposition(path)?;
    let document = &scene.document;
    let gaussians = open_gaussians(&scene.gaussians)?;
    let surface = read_surface(&scene.surface)?;
    let light = images::describe_exr(&scene.environment)?;
    let scores: Vec<f64> = document.views.iter().filter_map(|view| view.psnr_db).collect();
    let psnr = (!scores.is_empty()).then(|| scores.iter().sum::<f64>() / scores.len() as f64);
    let kept = document.terms.iter().filter(|term| term.kept).map(|term| term.name.as_str());
    let [width, height] = light.size_px.unwrap_or_default();
    let mut found = splats::of_gaussians(&gaussians, "")
        .count("vertices", surface.vertices.len())
        .count("triangles", surface.triangles.len())
        .count("views", document.views.len())
        .fact("environment", format!("{width} x {height}"))
        .fact("indirect", document.indirect)
        .fact("mean_psnr_db", psnr.map(|psnr| (psnr * 100.0).round() / 100.0))
        .fact("scale_anchor", document.scale_anchor.explanation.as_str())
        .fact("terms", kept.collect::<Vec<_>>())
        .fact("up_in_world", document.up_in_world.to_vec());
    found.kind = Kind::Scene;
    found.format = format!("{} {}", document.format, document.version);
    found.made_by = Some(document.made_by.clone()).filter(|program| !program.is_empty());
    found.warnings.extend(scene.warnings);
    found.columns = gaussians.gaussians.extra.iter().map(|column| column.name.clone()).collect();
    Ok(found)
}

/// A reconstruction in COLMAP's files.
///
/// # Errors
/// It is broken.
pub(super) fn describe_colmap(folder: &Path) -> Result<Description> {
    let model = read_model(folder)?;
    let mut models: Vec<&str> = model.cameras.values().map(|c| c.model.name()).collect();
    models.sort_unstable();
    models.dedup();
    let at = |p: &motes_formats::colmap::ColmapPoint| p.position.as_vec3().to_array();
    let positions: Vec<[f32; 3]> = model.points.iter().map(at).collect();
    let mut found = Description::new(Kind::ColmapModel, "colmap")
        .count("cameras", model.cameras.len())
        .count("views", model.images.len())
        .count("points", model.points.len())
        .fact("camera_models", models)
        .fact("folder", folder.to_string_lossy());
    found.bounds = measure::bounds(&positions);
    found.warnings = model.notes;
    Ok(found)
}

/// Pictures, by size; a folder without any is not known.
fn describe_pictures(path: &Path) -> Result<Description> {
    let entries = std::fs::read_dir(path).map_err(|error| FormatError::io(path, error))?;
    let files: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    let mut sizes: Vec<(usize, usize)> =
        files.iter().filter(|f| f.is_file()).filter_map(|f| image_dimensions(f).ok()).collect();
    if sizes.is_empty() {
        return Ok(Description::new(Kind::Unknown, "").count("files", files.len()));
    }
    let found = Description::new(Kind::Pictures, "").count("pictures", sizes.len());
    sizes.sort_unstable();
    sizes.dedup();
    let shown = sizes.iter().map(|(width, height)| format!("{width} x {height}"));
    Ok(found.fact("sizes_px", shown.take(10).collect::<Vec<_>>()))
}
