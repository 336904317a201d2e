//! The shadow of the objects on the ground.

use std::path::Path;

use crate::mesh::target::GltfFrame;
use crate::shadow::shadow_plane;
use motes_formats::atomic::write_atomic;
use motes_formats::images::write_png;
use motes_stage::{Context, StageError};

use super::report::{AssetDetails, AssetReport};
use super::{Asset, AssetJob, beside};
use relight::files::NewLight;

pub(super) fn write(
    job: &AssetJob<'_>,
    output: &Path,
    context: &Context,
) -> anyhow::Result<AssetReport> {
    let png = beside(output, "png", context)?;
    let loaded = job.scene(context)?;
    let light = NewLight::load(&job.options.light, &loaded, context)?;
    let environment = light.turned(0.0)?;
    light.report(&environment, context);
    context.stop_if_dry_run()?;
    let start = context.cpu_seconds();
    let scene = &loaded.scene;
    let up = scene.up_in_world;
    let options = &job.options.shadow;
    let light = &environment.environment;
    let plane = shadow_plane(scene.surface(), light, up, options, job.seed).map_err(|error| {
        let shown = loaded.decomposition.surface.display();
        StageError::bad_input(format!("{error}: {shown}"))
            .help("a shadow needs a surface with objects on level ground")
    })?;
    let frame = GltfFrame::new(up.as_dvec3(), job.options.unit);
    write_png(&png, &plane.picture())?;
    write_atomic(output, |writer| plane.write_glb(&frame, writer))?;
    let cpu_seconds = start.zip(context.cpu_seconds()).map(|(a, b)| b - a);
    let details = Some(AssetDetails::Shadow(plane.summary));
    Ok(AssetReport::new(Asset::ShadowPlane, vec![output.to_owned(), png], details, cpu_seconds))
}
