//! A learned model that guesses the light around a picture.

use std::path::Path;

use motes_formats::atomic::ScratchFolder;
use motes_formats::environment::read_environment;
use motes_formats::images::{read_image_upright, write_png};
use motes_formats::provider::{
    EnvironmentResult, EnvironmentTask, ProviderKind, ProviderRequest, Task, TaskResult,
};
use motes_math::resample::{Filter, resize};
use motes_protocol::ProviderCommand;
use motes_scene::ImageF32;
use motes_stage::{Context, StageError};

use super::arguments::{Args, Estimate};
use super::frame::{axes_of, axes_without_pose, capture, pose_of_view, turn, up_of};

const PICTURE: &str = "picture.png";

/// The light that the provider sees around `--picture`.
pub(super) fn of_picture(
    args: &Args,
    path: &Path,
    command: ProviderCommand,
    context: &Context,
) -> anyhow::Result<Estimate> {
    let capture = capture(args, context)?;
    let pose = pose_of_view(args, capture.as_ref())?;
    context.input("picture", path)?;
    let mut picture = read_image_upright(path)?;
    if picture.channels == 4 {
        let rgb = picture.data.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        picture = motes_scene::ImageU8::from_data(picture.width, picture.height, 3, rgb);
    }
    context.stop_if_dry_run()?;
    let mut provider = args.provider.open(command, ProviderKind::Environment, context)?;
    let scratch = ScratchFolder::new()?;
    write_png(&scratch.path().join(PICTURE), &picture)?;
    let task = EnvironmentTask { picture: PICTURE.into() };
    let request = ProviderRequest::new(Task::Environment(task), args.seed);
    let reply = provider.ask(scratch.path(), &request, &|| context.interrupted());
    let reply = reply.map_err(StageError::from)?;
    reply.warnings.iter().for_each(|warning| context.warn(warning.clone()));
    let TaskResult::Environment(EnvironmentResult { environment }) = reply.result else {
        anyhow::bail!("the provider answered another kind");
    };
    let map = read_environment(&scratch.path().join(environment))?;
    let rows = args.rows.min(map.height);
    let small = resize(&map.data, (map.width, map.height, 3), (2 * rows, rows), Filter::Box);
    let small = ImageF32::from_data(2 * rows, rows, 3, small);
    let axes = match &pose {
        Some(_) => axes_of(args, up_of(args, capture.as_ref(), None)),
        None => axes_without_pose(args.convention),
    };
    let (map, _) = turn(&small, &vec![1.0; 2 * rows * rows], pose.as_ref(), &axes);
    Ok(Estimate { provider: Some(provider.used().clone()), ..Estimate::new("provider", map, axes) })
}
