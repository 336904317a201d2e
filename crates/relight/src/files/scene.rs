//! A scene folder, read and made ready for light.

use std::path::Path;

use crate::{Exposure, LightSource, Place, RelightScene, SceneError};
use glam::DVec3;
use motes_formats::decomposition::{Decomposition, DecompositionDocument, read_decomposition};
use motes_formats::environment::read_environment;
use motes_formats::ply::{RenderMode, open_gaussians, read_surface};
use motes_math::tone_curve::ToneCurve;
use motes_raster::Antialias;
use motes_scene::ImageF32;
use motes_shading::environment::{Environment, MapAxes};
use motes_stage::{Context, StageError};

/// A decomposed scene and what its folder says about it.
pub struct LoadedScene {
    /// Ready for light.
    pub scene: RelightScene,
    /// The document and the files.
    pub decomposition: Decomposition,
    /// The light that was found.
    pub own_light: ImageF32,
    /// Its axes.
    pub own_axes: MapAxes,
    /// Comments of the Gaussian file and how it wants to be drawn.
    pub render_mode: Option<RenderMode>,
}

impl LoadedScene {
    /// Reads a scene folder; `own_light` is needed only when asked for.
    ///
    /// # Errors
    /// When a file is missing or malformed, or a material column is missing.
    pub fn load(folder: &Path, context: &Context) -> anyhow::Result<Self> {
        context.input("scene", folder)?;
        let decomposition = read_decomposition(folder)?;
        decomposition.warnings.iter().for_each(|text| context.warn(text));
        let file = open_gaussians(&decomposition.gaussians)?;
        let surface = read_surface(&decomposition.surface)?;
        let own_light = read_environment(&decomposition.environment)?;
        let counts = &decomposition.document.counts;
        for (what, said, found) in [
            ("Gaussians", counts.gaussians, file.gaussians.len()),
            ("vertices", counts.vertices, surface.vertices.len()),
            ("triangles", counts.triangles, surface.triangles.len()),
        ] {
            if said != 0 && said != found as u64 {
                context.warn(format!(
                    "the files have {found} {what}, decomposition.json says {said}: they may not belong together"
                ));
            }
        }
        let document = &decomposition.document;
        let up = DVec3::from_array(document.up_in_world).as_vec3();
        let mut scene =
            RelightScene::new(file.gaussians, surface, document.lobes, document.indirect, up)
                .map_err(|error| scene_error(error, &decomposition))?;
        if file.render_mode == Some(RenderMode::Mip) {
            scene.antialias = Antialias::Mip;
        }
        scene.tone_curve = tone_curve(document);
        scene.fills_photos = document.fills_photos.unwrap_or(false);
        let own_axes = map_axes(document);
        let render_mode = file.render_mode;
        let mut loaded = Self { scene, decomposition, own_light, own_axes, render_mode };
        loaded.scene.own_environment = loaded.own_environment();
        loaded.scene.own_light = loaded.scene.own_environment.as_ref().map(Environment::harmonics);
        Ok(loaded)
    }

    /// The light that was found; none where it cannot be used, of which those tell who need it.
    pub(super) fn own_environment(&self) -> Option<Environment> {
        let own = LightSource::Map { image: self.own_light.clone(), axes: self.own_axes };
        let light =
            own.light(0.0, Exposure::Factor(1.0), &Place::with_up(self.scene.up_in_world), &|| {
                None
            });
        light.ok().map(|light| light.environment)
    }
}

/// Tone curve of the camera that took the photos of a scene folder; its Gaussians are without it.
pub fn tone_curve(document: &DecompositionDocument) -> ToneCurve {
    ToneCurve::new(document.tone_curve_contrast.unwrap_or(0.0) as f32)
}

/// Axes of the environment of a scene folder.
pub fn map_axes(document: &DecompositionDocument) -> MapAxes {
    let of_world = MapAxes::of_world(document.environment_convention);
    let zenith = document.environment_up_in_world.map(DVec3::from_array);
    MapAxes { zenith_in_world: zenith.unwrap_or(of_world.zenith_in_world), ..of_world }
}

/// Writes down the axes of the environment of a scene folder.
pub fn note_map_axes(axes: MapAxes, document: &mut DecompositionDocument) {
    document.environment_convention = axes.convention;
    let is_own = axes.zenith_in_world == axes.convention.up();
    document.environment_up_in_world = (!is_own).then(|| axes.zenith_in_world.to_array());
}

fn scene_error(error: SceneError, decomposition: &Decomposition) -> StageError {
    let file = match error {
        SceneError::Column(_) | SceneError::Residual(_) => &decomposition.gaussians,
        SceneError::SurfaceMaterial | SceneError::Mesh(_) => &decomposition.surface,
    };
    StageError::bad_input(format!("{error}: {}", file.display()))
        .help("the stage decompose makes scene folders with all columns")
}
