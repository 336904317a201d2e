//! The relightable mesh, and its light beside it.

use std::path::Path;

use crate::mesh::environment::environment_for;
use crate::mesh::target::GltfFrame;
use crate::mesh::{MeshError, MeshSource, write_glb};
use motes_formats::atomic::write_atomic;
use motes_formats::environment::{write_environment, write_radiance};
use motes_shading::brdf::Lobes;
use motes_stage::{Context, StageError};

use super::report::{AssetDetails, AssetReport};
use super::{Asset, AssetJob, beside};
use relight::files::NewLight;

/// Rows of a map that is the sky, not a picture.
const LEAST_ROWS: usize = 256;

pub(super) fn write(
    job: &AssetJob<'_>,
    output: &Path,
    context: &Context,
) -> anyhow::Result<AssetReport> {
    let exr = beside(output, "environment.exr", context)?;
    let hdr = beside(output, "environment.hdr", context)?;
    let loaded = job.scene(context)?;
    let light = NewLight::load(&job.options.light, &loaded, context)?;
    let environment = light.turned(0.0)?;
    light.report(&environment, context);
    context.stop_if_dry_run()?;
    let start = context.cpu_seconds();
    let scene = &loaded.scene;
    let source = MeshSource {
        surface: scene.surface(),
        gaussians: Some((&scene.gaussians, &scene.materials)),
        is_lambert: scene.lobes == Lobes::Lambert,
    };
    let mesh = source
        .mesh(&job.options.mesh)
        .map_err(|error| mesh_error(&error, &loaded.decomposition.surface))?;
    let frame = GltfFrame::new(scene.up_in_world.as_dvec3(), job.options.unit);
    let rows = environment.environment.map().map_or(LEAST_ROWS, |map| map.size().1);
    let map = environment_for(&environment.environment, &frame, job.options.target, rows);
    let attributes = [
        ("colorSpace", "linear Rec.709 / sRGB primaries, photo units"),
        ("generator", concat!("motes ", env!("CARGO_PKG_VERSION"))),
    ]
    .map(|(k, v)| (k.to_owned(), v.to_owned()));
    write_environment(&exr, &map, &attributes)?;
    write_radiance(&hdr, &map)?;
    write_atomic(output, |writer| write_glb(&mesh, &frame, writer))?;
    let cpu_seconds = start.zip(context.cpu_seconds()).map(|(a, b)| b - a);
    let details = Some(AssetDetails::Mesh(mesh.summary));
    Ok(AssetReport::new(Asset::Mesh, vec![output.to_owned(), exr, hdr], details, cpu_seconds))
}

fn mesh_error(error: &MeshError, surface: &Path) -> StageError {
    let help = match error {
        MeshError::Empty => "decompose found no surface; export a splat instead",
        MeshError::Inconsistent | MeshError::NoMaterials => {
            "the stage decompose makes scene folders with all columns"
        }
        MeshError::Atlas(_) => "take --no-atlas, fewer --triangles or a larger --texture-size",
    };
    StageError::bad_input(format!("{error}: {}", surface.display())).help(help)
}
