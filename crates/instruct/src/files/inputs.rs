//! The scene, its labels and assets.

use std::path::{Path, PathBuf};

use glam::DVec3;
use motes_codecs::open_gaussians;
use motes_formats::FormatError;
use motes_formats::capture::read_capture;
use motes_formats::decomposition::{Decomposition, read_decomposition};
use motes_formats::environment::read_environment;
use motes_formats::labels::read_labels;
use motes_formats::ply::RenderMode;
use motes_formats::scene_card::SceneCardDocument;
use motes_formats::selection::{BoundGaussians, SelectionFile, read_selection};
use motes_raster::Antialias;
use motes_scene::camera_path::mean_up;
use motes_scene::{Capture, Gaussians, ImageF32, Materials};
use motes_shading::environment::MapAxes;
use motes_stage::{Context, StageError};

use super::assets::assets;
use crate::card::{CardInput, Labeled, scene_card};

/// A plane is a ground when the cosine of its normal to up is above.
const LEVEL: f64 = 0.9;

/// What the command line names.
pub(super) struct Paths<'a> {
    pub(super) scene: Option<&'a Path>,
    pub(super) gaussians: Option<&'a Path>,
    pub(super) capture: Option<&'a Path>,
    pub(super) view: Option<&'a str>,
    pub(super) labels: Option<&'a Path>,
    pub(super) assets: Option<&'a Path>,
    pub(super) meters_per_unit: Option<f64>,
}

/// What was read.
pub(super) struct Inputs {
    pub(super) scene: Option<PathBuf>,
    pub(super) splat: Option<PathBuf>,
    pub(super) capture_file: Option<PathBuf>,
    pub(super) capture: Option<(Capture, usize)>,
    pub(super) gaussians: Gaussians,
    pub(super) antialias: Antialias,
    pub(super) labels: Option<PathBuf>,
    pub(super) assets_folder: Option<PathBuf>,
    up: DVec3,
    decomposed: bool,
    environment: Option<(ImageF32, MapAxes)>,
    labeled: Vec<Labeled>,
    assets: Vec<String>,
    meters_per_unit: Option<f64>,
}

impl Inputs {
    /// Reads everything.
    pub(super) fn load(paths: &Paths<'_>, context: &Context) -> anyhow::Result<Self> {
        let capture = paths.capture.map(|path| view_of(path, paths.view, context)).transpose()?;
        let decomposition = paths.scene.map(|folder| scene(folder, context)).transpose()?;
        let file = match (&decomposition, paths.gaussians) {
            (Some(decomposition), _) => decomposition.gaussians.clone(),
            (None, Some(path)) => {
                context.input("gaussians", path)?;
                path.to_owned()
            }
            (None, None) => {
                return Err(StageError::usage("--scene or --gaussians is needed").into());
            }
        };
        let read = open_gaussians(&file)?;
        let poses = |c: &Capture| c.views.iter().map(|v| v.camera_from_world).collect::<Vec<_>>();
        let up = match (&decomposition, &capture) {
            (Some(decomposition), _) => DVec3::from_array(decomposition.document.up_in_world),
            (None, Some((capture, _))) => mean_up(&poses(capture)).unwrap_or(DVec3::Z),
            (None, None) => DVec3::Z,
        };
        let environment = match &decomposition {
            Some(found) => {
                let axes = relight::files::map_axes(&found.document);
                Some((read_environment(&found.environment)?, axes))
            }
            None => None,
        };
        let bound = || match &decomposition {
            Some(decomposition) => decomposition.bound_gaussians(read.gaussians.len()),
            None => BoundGaussians::of_file(&file, read.gaussians.len()),
        };
        let labeled = match paths.labels {
            Some(path) => labeled(path, &bound()?, up, context)?,
            None => Vec::new(),
        };
        Ok(Self {
            scene: paths.scene.map(Path::to_owned),
            splat: paths.gaussians.map(Path::to_owned),
            capture_file: paths.capture.map(Path::to_owned),
            capture,
            antialias: match read.render_mode {
                Some(RenderMode::Mip) => Antialias::Mip,
                _ => Antialias::Classic,
            },
            labels: paths.labels.map(Path::to_owned),
            assets: paths
                .assets
                .map(|folder| assets(folder, context))
                .transpose()?
                .unwrap_or_default(),
            assets_folder: paths.assets.map(Path::to_owned),
            up,
            decomposed: decomposition.is_some() && Materials::of(&read.gaussians).is_ok(),
            environment,
            labeled,
            meters_per_unit: paths.meters_per_unit,
            gaussians: read.gaussians,
        })
    }

    /// The card of the scene.
    pub(super) fn card(&self) -> Result<SceneCardDocument, StageError> {
        let input = CardInput {
            gaussians: &self.gaussians,
            decomposed: self.decomposed,
            up: self.up,
            antialias: self.antialias,
            capture: self.capture.as_ref().map(|(capture, view)| (capture, *view)),
            labeled: &self.labeled,
            environment: self.environment.as_ref().map(|(map, axes)| (map, *axes)),
            meters_per_unit: self.meters_per_unit,
            assets: self.assets.clone(),
        };
        scene_card(&input).map_err(|name| {
            StageError::bad_input(format!(
                "the selection of \"{name}\" has no Gaussian with a place"
            ))
            .help("select it again with segment-select")
        })
    }
}

fn view_of(path: &Path, view: Option<&str>, context: &Context) -> anyhow::Result<(Capture, usize)> {
    context.input("capture", path)?;
    let capture = read_capture(path)?;
    let index = match view {
        Some(name) => capture.view_named(name),
        None => (!capture.views.is_empty()).then_some(0),
    };
    let Some(index) = index else {
        let name = view.unwrap_or("any");
        let cause = format!("the capture has no view \"{name}\": {}", path.display());
        let known: Vec<&str> = capture.views.iter().take(8).map(|v| v.name.as_str()).collect();
        return Err(StageError::usage(cause)
            .help(format!("it has {}, ...", known.join(", ")))
            .into());
    };
    Ok((capture, index))
}

fn scene(folder: &Path, context: &Context) -> anyhow::Result<Decomposition> {
    context.input("scene", folder)?;
    let decomposition = read_decomposition(folder)?;
    decomposition.warnings.iter().for_each(|text| context.warn(text));
    Ok(decomposition)
}

/// The objects of labels, with their Gaussians.
fn labeled(
    path: &Path,
    bound: &BoundGaussians,
    up: DVec3,
    context: &Context,
) -> anyhow::Result<Vec<Labeled>> {
    context.input("labels", path)?;
    let (parsed, files) = read_labels(path)?;
    parsed.warnings.iter().for_each(|text| context.warn(text));
    let mut found = Vec::with_capacity(files.len());
    for (i, (label, file)) in parsed.document.objects.into_iter().zip(files).enumerate() {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !super::assets::is_below(&file, folder) {
            let place = format!("/objects/{i}/selection");
            let cause = match file.exists() {
                true => "a link leads out of the folder of the labels".to_owned(),
                false => format!("no such file: {}", file.display()),
            };
            return Err(FormatError::invalid(path, place, cause).into());
        }
        let SelectionFile { selection, notes, warnings } = read_selection(&file, bound)?;
        warnings.iter().for_each(|text| context.warn(text));
        let ground = notes.support_plane.and_then(|plane| {
            let cosine = DVec3::from_array(plane.normal).dot(up);
            (cosine > LEVEL).then(|| plane.offset / cosine)
        });
        found.push(Labeled { label, selection, ground });
    }
    Ok(found)
}
