//! The page that shows Gaussians anywhere.

use std::path::Path;

use crate::html::{ViewerLight, ViewerPage, ViewerSplat};
use glam::DVec3;
use motes_codecs::open_gaussians;
use motes_formats::atomic::write_atomic;
use motes_formats::capture::read_capture;
use motes_formats::ply::RenderMode;
use motes_raster::Antialias;
use motes_scene::camera_path::mean_up;
use motes_scene::{Capture, Gaussians};
use motes_stage::Context;

use super::photos::photos;
use super::report::{AssetDetails, AssetReport};
use super::{Asset, AssetJob};
use relight::files::{LoadedScene, NewLight};

/// Above this a page asks much of a browser.
const MANY_GAUSSIANS: usize = 3_000_000;

pub(super) fn write(
    job: &AssetJob<'_>,
    output: &Path,
    context: &Context,
) -> anyhow::Result<AssetReport> {
    let page = &job.options.page;
    let (gaussians, mode, loaded) = load(job, context)?;
    let capture = capture(job, context)?;
    let other = match &page.compare_with {
        Some(path) => {
            context.input("compare-with", path)?;
            Some(open_gaussians(path)?)
        }
        None => None,
    };
    if gaussians.len() > MANY_GAUSSIANS {
        context.warn(format!(
            "{} Gaussians on one page ask much of a browser: reduce them first",
            gaussians.len()
        ));
    }
    let lights = match &loaded {
        Some(loaded) => lights(job, loaded, context)?,
        None => Vec::new(),
    };
    context.stop_if_dry_run()?;
    let start = context.cpu_seconds();
    let photos = match &capture {
        Some((capture, folder)) => photos(capture, folder, page, context)?,
        None => Vec::new(),
    };
    let up_in_world = match (&loaded, &capture) {
        (Some(loaded), _) => loaded.scene.up_in_world.as_dvec3(),
        (None, Some((capture, _))) => {
            let poses: Vec<_> = capture.views.iter().map(|view| view.camera_from_world).collect();
            mean_up(&poses).unwrap_or(DVec3::Z)
        }
        (None, None) => DVec3::Z,
    };
    let splat = |gaussians, mode| ViewerSplat { gaussians, antialias: antialias(mode) };
    let viewer = ViewerPage {
        title: page.title.clone().unwrap_or_else(|| title(job)),
        splat: splat(&gaussians, mode),
        other: other.as_ref().map(|file| splat(&file.gaussians, file.render_mode)),
        photos,
        lights,
        up_in_world,
        background: page.background.0,
    };
    let mut summary = None;
    write_atomic(output, |writer| {
        summary = Some(viewer.write(&page.pack, writer)?);
        Ok(())
    })?;
    let cpu_seconds = start.zip(context.cpu_seconds()).map(|(a, b)| b - a);
    let details = summary.map(AssetDetails::Html);
    Ok(AssetReport::new(Asset::Html, vec![output.to_owned()], details, cpu_seconds))
}

/// The Gaussians, and the scene around them when there is one.
fn load(
    job: &AssetJob<'_>,
    context: &Context,
) -> anyhow::Result<(Gaussians, Option<RenderMode>, Option<LoadedScene>)> {
    let source = job.input.load(context)?;
    let mode = source.file.render_mode;
    let loaded = match &job.input.scene {
        Some(folder) => Some(LoadedScene::load(folder, context)?),
        None => None,
    };
    Ok((source.file.gaussians, mode, loaded))
}

fn capture(
    job: &AssetJob<'_>,
    context: &Context,
) -> anyhow::Result<Option<(Capture, std::path::PathBuf)>> {
    let Some(path) = job.capture else { return Ok(None) };
    context.input("capture", path)?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    Ok(Some((read_capture(path)?, folder)))
}

/// The scene's own light, and the one that the flags name.
fn lights(
    job: &AssetJob<'_>,
    loaded: &LoadedScene,
    context: &Context,
) -> anyhow::Result<Vec<ViewerLight>> {
    let own = NewLight::load(&relight::LightOptions::default(), loaded, context)?;
    let given = NewLight::load(&job.options.light, loaded, context)?;
    let light = |name: &str, light: &NewLight<'_>| -> anyhow::Result<ViewerLight> {
        let harmonics = light.turned(0.0)?.environment.harmonics();
        Ok(ViewerLight { name: name.to_owned(), harmonics })
    };
    let mut lights = vec![light("as captured", &own)?];
    if job.options.light.environment.is_some() || job.options.light.sun.is_some() {
        let name = job.options.light.environment.as_deref().and_then(Path::file_stem);
        let name = name.map_or("sun".into(), |stem| stem.to_string_lossy());
        lights.push(light(&name, &given)?);
    }
    Ok(lights)
}

fn antialias(mode: Option<RenderMode>) -> Antialias {
    if mode == Some(RenderMode::Mip) { Antialias::Mip } else { Antialias::Classic }
}

fn title(job: &AssetJob<'_>) -> String {
    let input = &job.input;
    let path = input.scene.as_ref().or(input.gaussians.as_ref()).or(input.inputs.first());
    let name = path.and_then(|p| p.file_stem().or(p.file_name()));
    name.map_or_else(|| "Gaussians".into(), |name| name.to_string_lossy().into_owned())
}
