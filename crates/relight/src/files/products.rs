//! Products other than pictures: a baked splat, a scene folder with its new light.

use std::path::Path;

use crate::{Background, BakeOptions, Relighter, environment_image};
use anyhow::Context as _;
use motes_formats::decomposition::{scene_draft, write_decomposition};
use motes_formats::environment::write_environment;
use motes_formats::ply::{PlyWriteOptions, write_gaussians};
use motes_scene::{ImageF32, Residual, attach_local_light, local_light_of};
use motes_stage::Context;

use super::{PictureJob, RelightReport, note_map_axes};

/// Rows of a map that the sky or a turned map is painted into, at least.
const LEAST_ROWS: usize = 512;

/// Writes the Gaussians with baked colors.
///
/// # Errors
/// When the light is out of range or the file cannot be written.
pub fn write_baked(
    job: &PictureJob<'_>,
    bake: &BakeOptions,
    output: &Path,
    report: &mut RelightReport,
    context: &Context,
) -> anyhow::Result<()> {
    let &PictureJob { loaded, light, quality, seed, .. } = job;
    let cpu = || context.cpu_seconds().unwrap_or(f64::NAN);
    let start = cpu();
    let light = light.turned(0.0)?;
    let relighter = Relighter::new(&loaded.scene, &light.environment, quality, seed);
    report.cpu_seconds_per_light = Some(cpu() - start).filter(|s| s.is_finite());
    let mut baked = relighter.bake(bake);
    report.residual_share = relighter.residual_share();
    report.sky_replaced = relighter.replaces_sky(Background::Environment);
    if let Ok(Some(mut residual)) = Residual::of(&baked) {
        // What is left of it is about the new light.
        residual.scale(0..baked.len(), relighter.residual_share());
        residual.attach(&mut baked);
    }
    if let Some(mut local_light) = local_light_of(&baked) {
        // So is what is left of the light that is not at infinity.
        local_light.iter_mut().flatten().for_each(|l| *l *= relighter.local_share());
        attach_local_light(&local_light, &mut baked);
    }
    let options = PlyWriteOptions { render_mode: loaded.render_mode, ..PlyWriteOptions::default() };
    write_gaussians(output, &baked, &options)?;
    Ok(())
}

/// Writes a scene folder: the same surface, byte by byte, and the same Gaussians with the colors that they have
/// under the new light.
///
/// # Errors
/// When the light is out of range or a file cannot be written.
pub fn write_scene(
    job: &PictureJob<'_>,
    bake: &BakeOptions,
    folder: &Path,
    report: &mut RelightReport,
    context: &Context,
) -> anyhow::Result<()> {
    let &PictureJob { loaded, light, .. } = job;
    let exposed = light.turned(0.0)?;
    let (image, axes) = match light.unturned_map() {
        // As it was, value by value, but for what no light has.
        Some((image, axes)) => (repaired(image, exposed.exposure), axes),
        None => {
            let rows = exposed.environment.map().map_or(0, |map| map.size().1).max(LEAST_ROWS);
            let axes = loaded.own_axes;
            (environment_image(&exposed.environment, axes, rows), axes)
        }
    };
    let mut document = loaded.decomposition.document.clone();
    (document.gaussians, document.surface) = ("gaussians.ply".into(), "surface.ply".into());
    document.environment = "environment.exr".into();
    note_map_axes(axes, &mut document);
    // They are about another light.
    document.views.clear();
    let draft = scene_draft(folder)?;
    let folder = draft.path();
    write_baked(job, bake, &folder.join(&document.gaussians), report, context)?;
    copy(&loaded.decomposition.surface, &folder.join(&document.surface))?;
    let attributes = [
        ("colorSpace", "linear Rec.709 / sRGB primaries, photo units: radiance times exposure"),
        ("generator", concat!("motes ", env!("CARGO_PKG_VERSION"))),
    ]
    .map(|(k, v)| (k.to_owned(), v.to_owned()));
    write_environment(&folder.join(&document.environment), &image, &attributes)?;
    write_decomposition(folder, &document)?;
    Ok(draft.publish()?)
}

fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    let bytes = std::fs::read(from).with_context(|| format!("cannot read {}", from.display()))?;
    motes_formats::atomic::write_atomic(to, |writer| writer.write_all(&bytes))?;
    Ok(())
}

fn repaired(image: &ImageF32, exposure: f32) -> ImageF32 {
    let finite = image.data.iter().copied().filter(|v| v.is_finite());
    let largest = finite.fold(65_504.0, f32::max);
    // `max` first: it turns NaN into 0.
    let repair = |v: &f32| v.max(0.0).min(largest) * exposure;
    ImageF32 { data: image.data.iter().map(repair).collect(), ..image.clone() }
}
