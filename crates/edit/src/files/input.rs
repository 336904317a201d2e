//! What is edited: a splat, or a scene folder.

use std::path::{Path, PathBuf};

use crate::{EditState, SceneParts};
use glam::DVec3;
use motes_codecs::open_gaussians;
use motes_formats::decomposition::{Decomposition, read_decomposition};
use motes_formats::environment::read_environment;
use motes_formats::ply::{GaussianFile, PlyWriteOptions, RenderMode, read_surface};
use motes_raster::Antialias;
use motes_scene::camera_path::mean_up;
use motes_scene::{Capture, Materials};
use motes_stage::{Context, StageError};

use relight::files::{map_axes, tone_curve};

/// What was read.
pub struct Input {
    /// What a plan works on.
    pub state: EditState,
    /// File of the Gaussians, which selections are bound to.
    pub gaussians: PathBuf,
    /// The documents of a scene folder; `None` for a splat.
    pub decomposition: Option<Decomposition>,
    /// How the Gaussians want to be drawn and what their header said.
    pub write_options: PlyWriteOptions,
    /// The footprint to draw the Gaussians with.
    pub antialias: Antialias,
}

impl Input {
    /// Reads a splat.
    ///
    /// # Errors
    /// When it is missing or malformed.
    pub fn splat(
        path: &Path,
        capture: Option<&Capture>,
        context: &Context,
    ) -> anyhow::Result<Self> {
        // The one hashes while the other reads.
        let (noted, file) = rayon::join(|| context.input("gaussians", path), || file(path));
        noted?;
        let (file, write_options, antialias) = file?;
        let name = path.display().to_string();
        let state = EditState::new(&name, file.gaussians, None, None, up_of(capture));
        Ok(Self {
            state,
            gaussians: path.to_owned(),
            decomposition: None,
            write_options,
            antialias,
        })
    }

    /// Reads a scene folder.
    ///
    /// # Errors
    /// When a part of it is missing or malformed.
    pub fn scene(folder: &Path, context: &Context) -> anyhow::Result<Self> {
        context.input("scene", folder)?;
        let decomposition = read_decomposition(folder)?;
        decomposition.warnings.iter().for_each(|text| context.warn(text));
        let (file, write_options, antialias) = file(&decomposition.gaussians)?;
        if let Err(column) = Materials::of(&file.gaussians) {
            let shown = decomposition.gaussians.display();
            let text =
                format!("the Gaussians have no column \"{column}\" of the right type: {shown}");
            return Err(StageError::bad_input(text)
                .help("the stage decompose makes scene folders with all columns")
                .into());
        }
        let surface = read_surface(&decomposition.surface)?;
        let document = &decomposition.document;
        let parts = SceneParts {
            environment: read_environment(&decomposition.environment)?,
            axes: map_axes(document),
            environment_changed: false,
            lobes: document.lobes,
            indirect: document.indirect,
            tone_curve: tone_curve(document),
        };
        let name = folder.display().to_string();
        let up = DVec3::from_array(document.up_in_world);
        let state = EditState::new(&name, file.gaussians, Some(surface), Some(parts), up);
        let gaussians = decomposition.gaussians.clone();
        Ok(Self { state, gaussians, decomposition: Some(decomposition), write_options, antialias })
    }
}

fn file(path: &Path) -> anyhow::Result<(GaussianFile, PlyWriteOptions, Antialias)> {
    let file = open_gaussians(path)?;
    let write_options = PlyWriteOptions {
        render_mode: file.render_mode,
        exposure_response: file.exposure_response,
        comments: Vec::new(),
        ..PlyWriteOptions::default()
    };
    let antialias = match file.render_mode {
        Some(RenderMode::Mip) => Antialias::Mip,
        _ => Antialias::Classic,
    };
    Ok((file, write_options, antialias))
}

/// Up in the pictures when there are any.
fn up_of(capture: Option<&Capture>) -> DVec3 {
    let poses = |c: &Capture| c.views.iter().map(|v| v.camera_from_world).collect::<Vec<_>>();
    capture.and_then(|c| mean_up(&poses(c))).unwrap_or(DVec3::Z)
}
