//! The light of a decomposed scene: its environment, or what arrives at a point of it.

use std::path::Path;

use glam::DVec3;
use motes_stage::{Context, StageError};
use relight::files::LoadedScene;
use relight::{
    Background, Exposure, LightSource, Place, QualityOptions, Relighter, environment_image,
};

use super::arguments::{Args, Estimate};
use super::frame::{axes_of, up_of};
use super::values::At;
use crate::cube::map_of_faces;

/// The light of `--scene`.
pub(super) fn of_scene(args: &Args, folder: &Path, context: &Context) -> anyhow::Result<Estimate> {
    let loaded = LoadedScene::load(folder, context)?;
    let up = loaded.scene.up_in_world;
    let axes = axes_of(args, up_of(args, None, Some(up.as_dvec3())));
    let source = LightSource::Map { image: loaded.own_light.clone(), axes: loaded.own_axes };
    let light = source.light(0.0, Exposure::Factor(1.0), &Place::with_up(up), &|| None);
    let environment = light
        .map_err(|error| {
            let shown = loaded.decomposition.environment.display();
            StageError::bad_input(format!("{error}: {shown}"))
        })?
        .environment;
    let Some(at) = &args.at else {
        context.stop_if_dry_run()?;
        let map = environment_image(&environment, axes, args.rows);
        return Ok(Estimate { coverage: 1.0, ..Estimate::new("scene", map, axes) });
    };
    let At::Point(at) = at else {
        let text = "--at of a scene folder takes X,Y,Z";
        return Err(StageError::usage(text).into());
    };
    let at: DVec3 = *at + up.as_dvec3() * args.lift.unwrap_or(0.0);
    context.stop_if_dry_run()?;
    let options = QualityOptions::default();
    let relighter = Relighter::new(&loaded.scene, &environment, &options, args.seed);
    let progress = context.progress("looking around", 6);
    let map = map_of_faces(at, &axes.orientation(), args.rows, |camera, pose| {
        context.check_interrupted()?;
        let picture = relighter.picture(camera, pose, Background::Environment, true);
        progress.inc(1);
        picture
            .components
            .map(|components| components.color_linear)
            .ok_or_else(|| StageError::bad_input("the scene cannot be shown"))
    })?;
    Ok(Estimate { coverage: 1.0, at: Some(at.to_array()), ..Estimate::new("scene", map, axes) })
}
