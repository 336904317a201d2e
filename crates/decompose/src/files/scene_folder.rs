//! The scene folder that `decompose` writes.

use std::path::Path;

use crate::observation::Photo;
use crate::{Pipeline, RenderedView, State, Term};
use motes_formats::decomposition::{
    DecomposedViewDocument, DecompositionCounts, DecompositionDocument, ScaleAnchorDocument,
    StepTimeDocument, TermDocument, scene_draft, write_decomposition,
};
use motes_formats::documents::Document as _;
use motes_formats::environment::write_environment;
use motes_formats::ply::{PlyWriteOptions, write_gaussians, write_surface};
use motes_formats::selection::BoundGaussians;
use motes_math::tone_curve::ToneCurve;
use motes_scene::{
    Gaussians, ImageF32, Lobes, Split, attach_confidence, attach_local_light, attach_sky,
};
use relight::files::note_map_axes;

use super::previews::previews;

/// What is written beside the decomposition itself.
#[derive(Debug)]
pub(super) struct SceneFolder<'a> {
    /// The folder.
    pub path: &'a Path,
    /// How the Gaussians are written.
    pub ply: PlyWriteOptions,
    /// How many views get previews.
    pub previews: usize,
    /// Tone curve of the camera.
    pub tone_curve: ToneCurve,
    /// The Gaussians that were taken apart.
    pub source: BoundGaussians,
    /// Elapsed seconds; none leaves all times out, so that equal scenes have equal bytes.
    pub seconds: Option<f64>,
    /// Program and version.
    pub made_by: &'a str,
}

/// Writes everything; the files appear together.
///
/// # Errors
/// When a file cannot be written.
pub(super) fn write_scene(
    folder: &SceneFolder<'_>,
    pipeline: &Pipeline<'_>,
) -> anyhow::Result<DecompositionDocument> {
    let draft = scene_draft(folder.path)?;
    let (path, state) = (draft.path(), &pipeline.state);
    let gaussians = gaussians_of(state);
    write_gaussians(&path.join("gaussians.ply"), &gaussians, &folder.ply)?;
    write_surface(&path.join("surface.ply"), &state.shining_surface())?;
    let attributes = [("motes made by".to_owned(), folder.made_by.to_owned())];
    let maps: Vec<ImageF32> = (0..).map_while(|light| state.light_map(light)).collect();
    for (k, map) in maps.iter().enumerate() {
        let name = if k == 0 { "environment.exr".into() } else { format!("environment_{k}.exr") };
        write_environment(&path.join(name), map, &attributes)?;
    }
    previews(path, folder.previews, state, &gaussians, maps.first())?;
    let document = document(folder, pipeline);
    write_decomposition(path, &document)?;
    draft.publish()?;
    Ok(document)
}

/// The Gaussians with their materials and their residual.
fn gaussians_of(state: &State<'_>) -> Gaussians {
    let mut gaussians = state.gaussians().clone();
    state.attributes.attach(&mut gaussians);
    if let Some(residual) = &state.residual {
        residual.attach(&mut gaussians);
    }
    if let Some(log_factors) = local_light(state) {
        attach_local_light(&log_factors, &mut gaussians);
    }
    if !state.confidence.is_empty() {
        attach_confidence(state.confidence.clone(), &mut gaussians);
    }
    if !state.sky.is_empty() {
        attach_sky(state.sky.clone(), &mut gaussians);
    }
    gaussians
}

/// Logarithm of the local light at every Gaussian, with the normal that it has.
fn local_light(state: &State<'_>) -> Option<Vec<[f32; 3]>> {
    let local_light = state.observed.local_light.as_ref()?;
    let places = state.gaussians().means.iter().zip(&state.attributes.normals);
    let of = |(mean, normal): (&[f32; 3], &[f32; 3])| {
        local_light.log_factor((*mean).into(), (*normal).into()).to_array()
    };
    Some(places.map(of).collect())
}

fn document(folder: &SceneFolder<'_>, pipeline: &Pipeline<'_>) -> DecompositionDocument {
    let (state, report) = (&pipeline.state, &pipeline.report);
    let unobserved = state.attributes.observations.iter().filter(|&&n| n == 0).count();
    let time = |step: &crate::StepRecord| StepTimeDocument {
        step: step.name.clone(),
        seconds: step.seconds,
    };
    let mut document = DecompositionDocument {
        format: DecompositionDocument::FORMAT.into(),
        version: DecompositionDocument::version(),
        made_by: folder.made_by.into(),
        gaussians: "gaussians.ply".into(),
        surface: "surface.ply".into(),
        environment: "environment.exr".into(),
        environment_convention: state.convention(),
        environment_up_in_world: None,
        up_in_world: state.up_in_world.as_dvec3().to_array(),
        lobes: if state.is_specular() { state.inputs.model.lobes } else { Lobes::Lambert },
        indirect: state.has_indirect(),
        tone_curve_contrast: contrast(folder.tone_curve),
        fills_photos: Some(state.inputs.photos.iter().all(Photo::is_whole)),
        scale_anchor: scale_anchor(state),
        terms: report.terms(state).into_iter().map(term_document).collect(),
        views: state.views.iter().map(|view| view_document(state, view)).collect(),
        counts: DecompositionCounts {
            gaussians: state.gaussians().len() as u64,
            unobserved_gaussians: unobserved as u64,
            vertices: state.surface().vertices.len() as u64,
            triangles: state.surface().triangles.len() as u64,
        },
        source_gaussians: Some(folder.source.clone()),
        seconds: folder.seconds,
        step_times: match folder.seconds {
            Some(_) => report.steps.iter().map(time).collect(),
            None => Vec::new(),
        },
    };
    note_map_axes(state.map_axes(), &mut document);
    document
}

/// None where the photos are sRGB.
fn contrast(curve: ToneCurve) -> Option<f64> {
    (!curve.is_identity()).then(|| f64::from(curve.contrast()))
}

fn view_document(state: &State<'_>, view: &RenderedView) -> DecomposedViewDocument {
    let inputs = state.inputs;
    let held_out = view.photo.checked_sub(inputs.photos.len()).map(|k| &inputs.held_out[k]);
    DecomposedViewDocument {
        name: held_out.unwrap_or_else(|| &inputs.photos[view.photo]).name.clone(),
        split: if held_out.is_some() { Split::Test } else { Split::Train },
        psnr_db: Some(view.psnr_db).filter(|v| v.is_finite()),
    }
}

fn term_document(term: Term) -> TermDocument {
    let Term { name, kept, evidence, numbers } = term;
    TermDocument { name, kept, evidence, numbers }
}

fn scale_anchor(state: &State<'_>) -> ScaleAnchorDocument {
    ScaleAnchorDocument {
        kind: state.illumination.anchor,
        explanation: crate::steps::materials::scale_explanation(&state.illumination),
        factor_rgb: state.illumination.base_color_factor.as_dvec3().to_array(),
    }
}
