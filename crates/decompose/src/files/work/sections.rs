//! The parts of the state that steps change, each with its file in the folder of a step.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::pipeline::STEPS;
use crate::{
    BaseColored, Cell, CellLight, Illumination, Lamp, LightAnchor, LocalLight, Observed, State,
    TracedSurface, Wanted,
};
use motes_formats::FormatError;
use motes_formats::documents::{Document as _, read_document, write_document};
use motes_formats::ply::{
    PlyWriteOptions, read_gaussians, read_surface, write_gaussians, write_surface,
};
use motes_scene::{ColumnValues, ExtraColumn, Gaussians, Materials, Residual};

use super::documents::{
    LampDocument, LightAnchorDocument, LightDocument, LocalLightDocument, StepDocument,
};
use super::{materials, shading};
use crate::files::errors::explained;

/// A part of the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Section {
    /// `surface.ply`.
    Surface,
    /// `light.json`.
    Light,
    /// `materials.safetensors`.
    Materials,
    /// `shading/NNNN.exr`, one per photo.
    Shading,
    /// `base_color.ply`.
    BaseColor,
    /// `refined.ply`, when Gaussians were refined.
    Refined,
    /// `attributes.ply`.
    Attributes,
    /// `residual.ply`, when there is a residual.
    Residual,
}

const OBSERVATIONS: &str = "observations";

impl Section {
    /// What a step changes.
    pub(super) fn of_step(step: usize) -> &'static [Self] {
        use Section::*;
        match STEPS[step].name {
            "surface" | "samples" => &[Surface],
            "light" => &[Light],
            "materials" | "reflected-light" => &[Light, Materials],
            "shape-from-shading" | "shape-from-reflection" => &[Surface, Materials],
            "shading" => &[Shading],
            "base-color" => &[Surface, BaseColor],
            "refinement" => &[BaseColor, Refined],
            "attributes" => &[Attributes],
            "appearance-residual" => &[Residual],
            _ => &[],
        }
    }

    fn file(self) -> &'static str {
        match self {
            Self::Surface => "surface.ply",
            Self::Light => "light.json",
            Self::Materials => "materials.safetensors",
            Self::Shading => "shading",
            Self::BaseColor => "base_color.ply",
            Self::Refined => "refined.ply",
            Self::Attributes => "attributes.ply",
            Self::Residual => "residual.ply",
        }
    }

    /// Writes the part into the folder of a step.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub(super) fn save(
        self,
        state: &State<'_>,
        folder: &Path,
        made_by: &str,
    ) -> anyhow::Result<()> {
        let path = folder.join(self.file());
        let gaussians = |gaussians: &Gaussians| {
            let comments = vec![format!("made by {made_by}")];
            write_gaussians(&path, gaussians, &PlyWriteOptions { comments, ..Default::default() })
        };
        let bare = || Gaussians { extra: Vec::new(), ..state.gaussians().clone() };
        match self {
            Self::Surface => write_surface(&path, state.surface())?,
            Self::Light => write_document(&path, &light_document(state, made_by))?,
            Self::Materials => materials::write(&path, &state.illumination.materials, made_by)?,
            Self::Shading => shading::write(&path, state, made_by)?,
            Self::BaseColor => {
                let BaseColored { gaussians: mut of, observations } = state.base_colored.clone();
                let values = ColumnValues::U16(observations);
                of.extra = vec![ExtraColumn { name: OBSERVATIONS.into(), values }];
                gaussians(&of)?;
            }
            Self::Refined => {
                if let Some(refined) = &state.refined {
                    gaussians(refined)?;
                }
            }
            Self::Attributes => {
                let mut of = bare();
                state.attributes.attach(&mut of);
                gaussians(&of)?;
            }
            Self::Residual => {
                if let Some(residual) = &state.residual {
                    let mut of = bare();
                    residual.attach(&mut of);
                    gaussians(&of)?;
                }
            }
        }
        Ok(())
    }
}

fn light_document(state: &State<'_>, made_by: &str) -> LightDocument {
    let light = &state.illumination;
    let cells = light.cells.first().map_or(&[][..], |l| &l.cells);
    LightDocument {
        format: LightDocument::FORMAT.into(),
        version: LightDocument::version(),
        made_by: made_by.into(),
        anchor: light.anchor,
        base_color_factor: light.base_color_factor.to_array(),
        cells: cells.iter().map(|cell| (*cell).into()).collect(),
        radiance: light
            .cells
            .iter()
            .map(|l| l.radiance.iter().map(|e| e.to_array()).collect())
            .collect(),
        lamps: lamp_documents(light),
        local_light: state.observed.local_light.as_deref().map(local_light_document),
    }
}

fn local_light_document(light: &LocalLight) -> LocalLightDocument {
    let anchor = |a: &LightAnchor| LightAnchorDocument {
        position: a.position.to_array(),
        normal: a.normal.to_array(),
        log_factor: a.log_factor.to_array(),
    };
    LocalLightDocument {
        reach: light.reach(),
        anchors: light.anchors().iter().map(anchor).collect(),
    }
}

fn local_light(document: &LocalLightDocument, path: &Path) -> anyhow::Result<LocalLight> {
    let anchor = |a: &LightAnchorDocument| LightAnchor {
        position: a.position.into(),
        normal: a.normal.into(),
        log_factor: a.log_factor.into(),
    };
    let anchors = document.anchors.iter().map(anchor).collect();
    let cause = "no anchors, a value that is not finite, or a reach that is not above 0";
    let found = LocalLight::new(anchors, document.reach);
    Ok(found.ok_or_else(|| FormatError::invalid(path, "local_light", cause))?)
}

fn lamp_documents(light: &Illumination) -> Vec<LampDocument> {
    let lamps = light.cells.first().map_or(&[][..], |cells| &cells.lamps);
    let of = |(k, lamp): (usize, &Lamp)| LampDocument {
        radiance: lamp.radiance.to_array(),
        seen: lamp.seen.to_array(),
        vertices: (0..light.lamp_of_vertex.len() as u32)
            .filter(|&v| light.lamp_of_vertex[v as usize] as usize == k + 1)
            .collect(),
    };
    lamps.iter().enumerate().map(of).collect()
}

/// Which vertices are part of which lamp, from 1.
fn lamp_of_vertex(
    lamps: &[LampDocument],
    vertices: usize,
    path: &Path,
) -> anyhow::Result<Vec<u32>> {
    if lamps.is_empty() {
        return Ok(Vec::new());
    }
    let mut of_vertex = vec![0; vertices];
    for (k, lamp) in lamps.iter().enumerate() {
        let finite = |c: &[f32; 3]| c.iter().all(|v| v.is_finite() && *v >= 0.0);
        if !(finite(&lamp.radiance) && finite(&lamp.seen)) {
            let (place, cause) = (format!("lamps/{k}"), "a radiance is below 0 or not a number");
            return Err(FormatError::invalid(path, place, cause).into());
        }
        for &v in &lamp.vertices {
            let Some(slot) = of_vertex.get_mut(v as usize) else {
                let cause = format!("vertex {v}, but the surface has {vertices}");
                return Err(FormatError::invalid(path, format!("lamps/{k}/vertices"), cause).into());
            };
            *slot = k as u32 + 1;
        }
    }
    Ok(of_vertex)
}

/// The state after the step of `last`; `latest` names the folder that holds the latest of a part.
///
/// # Errors
/// When a file is missing or malformed, or does not go with the others.
pub(super) fn restore(
    state: &mut State<'_>,
    last: &StepDocument,
    latest: &dyn Fn(Section) -> Option<PathBuf>,
) -> anyhow::Result<()> {
    let find = |section: Section| latest(section).map(|folder| folder.join(section.file()));
    state.up_in_world = last.up_in_world.into();
    state.camera_distance = last.camera_distance;
    state.light_cells.clone_from(&last.light_cells);
    state.illumination = Illumination::known(state.known_lights());
    if let Some(path) = find(Section::Surface) {
        restore_surface(state, last, &path)?;
    }
    if let Some(path) = find(Section::Light) {
        restore_light(state, &path)?;
    }
    if let Some(path) = find(Section::Materials) {
        let found = materials::read(&path)?;
        let (is, wanted) = (found.of_sample.len(), state.observed.samples.len());
        if is != wanted {
            let cause = format!("{is} samples, but the surface before it has {wanted}");
            return Err(FormatError::invalid(&path, "part_of_sample", cause).into());
        }
        state.illumination.materials = found;
    }
    if let Some(path) = find(Section::Shading) {
        state.shading = shading::read(&path, state)?;
    }
    if let Some(path) = find(Section::BaseColor) {
        let mut gaussians = rows_of(&path, state)?;
        let extra = std::mem::take(&mut gaussians.extra);
        let column = extra.into_iter().find(|column| column.name == OBSERVATIONS);
        let Some(ColumnValues::U16(observations)) = column.map(|column| column.values) else {
            return Err(missing(&path, OBSERVATIONS).into());
        };
        state.base_colored = BaseColored { gaussians, observations };
    }
    if let Some(path) = find(Section::Refined).filter(|path| path.exists()) {
        state.refined = Some(rows_of(&path, state)?);
    }
    if let Some(path) = find(Section::Attributes) {
        let of = rows_of(&path, state)?;
        state.attributes = Materials::of(&of).map_err(|column| missing(&path, column))?;
    }
    if let Some(path) = find(Section::Residual).filter(|path| path.exists()) {
        let of = rows_of(&path, state)?;
        state.residual = Residual::of(&of).map_err(|column| missing(&path, &column))?;
    }
    Ok(())
}

fn missing(path: &Path, column: &str) -> FormatError {
    FormatError::invalid(path, column, "the column is missing or has another type")
}

/// Gaussians in the rows of the input.
fn rows_of(path: &Path, state: &State<'_>) -> anyhow::Result<Gaussians> {
    let gaussians = read_gaussians(path)?;
    let (is, wanted) = (gaussians.len(), state.inputs.gaussians.len());
    if is != wanted {
        let cause = format!("{is} Gaussians, but --gaussians has {wanted}");
        return Err(FormatError::invalid(path, "element vertex", cause).into());
    }
    Ok(gaussians)
}

fn restore_surface(state: &mut State<'_>, last: &StepDocument, path: &Path) -> anyhow::Result<()> {
    let surface = read_surface(path)?;
    let observed = if last.wanted_samples > 0 {
        let wanted = Wanted { points: last.wanted_samples, observations: last.wanted_observations };
        let lights = last.indirect_lights;
        Observed::of(surface, state.inputs.photos, wanted, lights)
    } else {
        TracedSurface::new(surface).map(Observed::unseen).map_err(Into::into)
    };
    state.observed = observed.map_err(|error| explained(&error))?;
    Ok(())
}

fn restore_light(state: &mut State<'_>, path: &Path) -> anyhow::Result<()> {
    let light = read_document::<LightDocument>(path)?.document;
    let cells: Vec<Cell> = light.cells.iter().map(|cell| (*cell).into()).collect();
    let wrong = |cause: String| FormatError::invalid(path, "radiance", cause);
    let known = state.known_lights();
    let captures = if known.is_empty() { state.inputs.light_count() } else { 0 };
    if light.radiance.len() != captures {
        let cause = format!("{} lights where {captures} are to be found", light.radiance.len());
        return Err(wrong(cause).into());
    }
    let finite = |e: &[f32; 3]| e.iter().all(|v| v.is_finite() && *v >= 0.0);
    let whole = |of: &Vec<[f32; 3]>| of.len() == cells.len() && of.iter().all(finite);
    if !light.radiance.iter().all(whole) {
        let cause = format!("not {} radiances, 0 or more, for every light", cells.len());
        return Err(wrong(cause).into());
    }
    let orientation = state.orientation();
    let of = |radiance: &Vec<[f32; 3]>| CellLight {
        cells: cells.clone(),
        radiance: radiance.iter().map(|e| (*e).into()).collect(),
        lamps: light
            .lamps
            .iter()
            .map(|lamp| Lamp { radiance: lamp.radiance.into(), seen: lamp.seen.into() })
            .collect(),
        orientation,
    };
    let lamp_of_vertex = lamp_of_vertex(&light.lamps, state.surface().vertices.len(), path)?;
    let found = if known.is_empty() {
        Illumination::of_cells(light.radiance.iter().map(of).collect())
    } else {
        Illumination::known(known)
    };
    state.illumination = Illumination {
        anchor: light.anchor,
        base_color_factor: light.base_color_factor.into(),
        lamp_of_vertex,
        ..found
    };
    if let Some(document) = &light.local_light {
        state.observed.light_evenly(Arc::new(local_light(document, path)?));
    }
    Ok(())
}
