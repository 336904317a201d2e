//! What was edited, in files: all of them after all work, the document of a scene last.

use std::path::{Path, PathBuf};

use crate::plan::EditPlanDocument;
use crate::run::Preview;
use crate::{EditState, SceneParts};
use motes_formats::decomposition::EDIT_LOG_FILE;
use motes_formats::decomposition::{
    DecompositionCounts, DecompositionDocument, scene_draft, write_decomposition,
};
use motes_formats::documents::write_document;
use motes_formats::environment::write_environment;
use motes_formats::images::write_png;
use motes_formats::ply::{PlyWriteOptions, write_gaussians, write_surface};
use motes_scene::Surface;
use relight::files::note_map_axes;

/// Where the log of an edited splat lies.
pub(super) fn log_path(output: &Path, is_scene: bool) -> PathBuf {
    if is_scene {
        return output.join(EDIT_LOG_FILE);
    }
    let mut name = output.as_os_str().to_owned();
    name.push(format!(".{EDIT_LOG_FILE}"));
    name.into()
}

/// The pictures.
pub(super) fn write_previews(folder: &Path, previews: &[Preview]) -> anyhow::Result<Vec<PathBuf>> {
    let write = |preview: &Preview| -> anyhow::Result<PathBuf> {
        let path = folder.join(&preview.file);
        write_png(&path, &preview.image)?;
        Ok(path)
    };
    previews.iter().map(write).collect()
}

/// The log.
pub(super) fn write_log(path: &Path, log: &EditPlanDocument) -> anyhow::Result<()> {
    Ok(write_document(path, log)?)
}

/// An edited scene folder.
pub(super) fn write_scene(
    folder: &Path,
    state: &EditState,
    parts: &SceneParts,
    surface: &Surface,
    document: &DecompositionDocument,
    options: &PlyWriteOptions,
    log: &EditPlanDocument,
) -> anyhow::Result<()> {
    let mut document = document.clone();
    // Rows may be other ones now.
    document.source_gaussians = None;
    (document.gaussians, document.surface) = ("gaussians.ply".into(), "surface.ply".into());
    document.environment = "environment.exr".into();
    note_map_axes(parts.axes, &mut document);
    document.up_in_world = state.up_in_world.to_array();
    // They are about photos of what was there before.
    document.views.clear();
    let observations = state.gaussians.extra.iter().find(|c| c.name == "observations");
    let unobserved = observations.map_or(0, |column| match &column.values {
        motes_scene::ColumnValues::U16(v) => v.iter().filter(|n| **n == 0).count(),
        _ => 0,
    });
    document.counts = DecompositionCounts {
        gaussians: state.len() as u64,
        unobserved_gaussians: unobserved as u64,
        vertices: surface.vertices.len() as u64,
        triangles: surface.triangles.len() as u64,
    };
    let draft = scene_draft(folder)?;
    let folder = draft.path();
    write_gaussians(&folder.join(&document.gaussians), &state.gaussians, options)?;
    write_surface(&folder.join(&document.surface), surface)?;
    let attributes = [
        ("colorSpace", "linear Rec.709 / sRGB primaries, photo units: radiance times exposure"),
        ("generator", concat!("motes ", env!("CARGO_PKG_VERSION"))),
    ]
    .map(|(k, v)| (k.to_owned(), v.to_owned()));
    write_environment(&folder.join(&document.environment), &parts.environment, &attributes)?;
    write_log(&folder.join(EDIT_LOG_FILE), log)?;
    write_decomposition(folder, &document)?;
    Ok(draft.publish()?)
}
