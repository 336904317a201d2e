//! What is looked at, read.

use std::path::{Path, PathBuf};
use std::time::Duration;

use edit::EditState;
use edit::files::Input;
use edit::ops::OpDocument;
use edit::plan::EditPlanDocument;
use motes_formats::capture::read_capture;
use motes_formats::selection::BoundGaussians;
use motes_scene::{Capture, View};
use motes_stage::{Context, StageError};
use segment_select::files::usual_folder;

use super::maps::maps;
use super::named::{Named, absolute};
use super::reopen::reopened;
use super::snapshots::{Version, is_checkpoint, newest};
use crate::session::{OwnLight, Scene};

/// Between looks for a file that is waited for.
const WAIT_STEP: Duration = Duration::from_millis(500);
/// A view that is prepared for clicks: its planes, and what covers each pixel.
const VIEW_BYTES_PER_PIXEL: u64 = 72;

/// What was read.
pub(super) struct Loaded {
    pub(super) scene: Scene,
    pub(super) state: EditState,
    /// Of a splat: the file that is shown, to see when there is a newer one.
    pub(super) version: Option<Version>,
    /// Words of the command line that makes the same edit.
    pub(super) command: Vec<String>,
    /// Operations of the plan to go on with.
    pub(super) ops: Vec<OpDocument>,
}

impl Loaded {
    /// Reads it.
    ///
    /// # Errors
    /// When something is missing or malformed, or there are no Gaussians.
    pub(super) fn load(named: &Named<'_>, context: &Context) -> anyhow::Result<Self> {
        let capture = named.capture.map(|path| capture(path, context)).transpose()?;
        let views = capture.as_ref().map(|(capture, _)| capture);
        let (input, version) = match (named.scene, named.gaussians) {
            (Some(folder), _) => (Input::scene(folder, context)?, None),
            (None, Some(path)) => {
                let version = first_version(path, named.wait, context)?;
                let path = version.as_ref().map_or(path, |version| version.path.as_path());
                (Input::splat(path, views, context)?, version)
            }
            (None, None) => {
                let text = "there is nothing to look at";
                let help = "give a scene folder or Gaussians";
                return Err(StageError::usage(text).help(help).into());
            }
        };
        let count = input.state.len();
        if count == 0 {
            let text = format!("there are no Gaussians: {}", input.gaussians.display());
            return Err(StageError::bad_input(text).into());
        }
        let bound = match (&input.decomposition, context.sha256_of_input(&input.gaussians)) {
            (Some(decomposition), _) => decomposition.bound_gaussians(count)?,
            (None, Some(sha256)) => BoundGaussians::new(&input.gaussians, sha256, count),
            (None, None) => BoundGaussians::of_file(&input.gaussians, count)?,
        };
        let shown = named.scene.or(named.gaussians).unwrap_or(Path::new(""));
        let title = shown.file_stem().or(shown.file_name());
        let title = title.map_or_else(|| "scene".into(), |name| name.to_string_lossy().into());
        let (mut template, ops) = match named.plan {
            Some(path) => reopened(path, named, context)?,
            None => (EditPlanDocument::new(0, Vec::new()), Vec::new()),
        };
        template.seed = named.seed.unwrap_or(template.seed);
        let scene = Scene {
            title,
            maps: maps(named.assets, context)?,
            template,
            antialias: input.antialias,
            own_light: own_light(&input),
            write_options: input.write_options,
            plan_name: PathBuf::from("the page"),
            cache: named.cache.then(usual_folder).flatten(),
            bound,
            capture,
        };
        let command = command(named, version.as_ref());
        Ok(Self { scene, state: input.state, version, command, ops })
    }
}

/// What is shown first of a splat; `None` for standard input and what is no file, which reading it tells.
fn first_version(path: &Path, wait: bool, context: &Context) -> anyhow::Result<Option<Version>> {
    let mut version = newest(path);
    if version.is_none() && wait {
        tracing::info!("waiting for {} or a snapshot of it", path.display());
    }
    while version.is_none() && wait {
        std::thread::sleep(WAIT_STEP);
        context.check_interrupted()?;
        version = newest(path);
    }
    if version.is_none() && is_checkpoint(path) {
        let text = format!("there is no snapshot beside the checkpoint: {}", path.display());
        let help = "train-splat --export-every 500 writes snapshots; --wait waits for the first";
        return Err(StageError::bad_input(text).help(help).into());
    }
    Ok(version)
}

/// Gaussians of a file that was written anew.
///
/// # Errors
/// When it is broken.
pub(super) fn reload(
    version: &Version,
    capture: Option<&Capture>,
    context: &Context,
) -> anyhow::Result<EditState> {
    let state = Input::splat(&version.path, capture, context)?.state;
    match state.len() {
        0 => Err(StageError::bad_input("there are no Gaussians").into()),
        _ => Ok(state),
    }
}

fn capture(path: &Path, context: &Context) -> anyhow::Result<(Capture, PathBuf)> {
    context.input("capture", path)?;
    let capture = read_capture(path)?;
    let camera = |view: &View| &capture.cameras[view.camera];
    let sizes = capture.views.iter().map(camera).map(|c| (c.width, c.height));
    context.need_memory_for_pictures(sizes, VIEW_BYTES_PER_PIXEL)?;
    Ok((capture, path.to_owned()))
}

fn own_light(input: &Input) -> Option<OwnLight> {
    let (decomposition, parts) = (input.decomposition.as_ref()?, input.state.parts.as_ref()?);
    Some(OwnLight {
        file: absolute(&decomposition.environment),
        convention: parts.axes.convention,
        zenith: parts.axes.zenith_in_world.to_array(),
    })
}

/// The command line that makes the same edit; the page adds the plan.
pub(super) fn command(named: &Named<'_>, version: Option<&Version>) -> Vec<String> {
    let mut words: Vec<String> = vec!["motes".into(), "edit".into()];
    let gaussians = version.map(|version| version.path.as_path()).or(named.gaussians);
    let mut add = |flag: &str, path: Option<&Path>| {
        words.extend(path.into_iter().flat_map(|path| [flag.to_owned(), absolute(path)]));
    };
    add("--scene", named.scene);
    add("--gaussians", gaussians.filter(|_| named.scene.is_none()));
    add("--capture", named.capture);
    named.assets.iter().for_each(|folder| add("--assets", Some(folder)));
    words.extend(["--plan".into(), "edit-plan.json".into(), "-o".into()]);
    words.push(if named.scene.is_some() { "edited".into() } else { "edited.ply".into() });
    words
}
