//! What happens to the arguments of `estimate-environment`.

use motes_formats::environment::write_environment;
use motes_formats::images::write_png;
use motes_stage::{Context, StageError};

use super::arguments::{Args, Estimate};
use super::report::Report;
use super::{ball, brackets, frame, place, preview, provider, scene};
use crate::Summary;

/// Runs the stage.
///
/// # Errors
/// Whatever ends it: bad input, a provider that fails, a product that cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Report> {
    let output = context.output(&args.output)?;
    let shown = args.preview.as_ref().map(|path| context.output(path)).transpose()?;
    let command = args.provider.command(context)?;
    let estimate = match args {
        Args { scene: Some(folder), .. } => scene::of_scene(args, folder, context)?,
        Args { gaussians: Some(path), .. } => {
            let Some(capture) = frame::capture(args, context)? else {
                return Err(StageError::usage("--gaussians needs --capture").into());
            };
            place::of_splat(args, path, &capture, context)?
        }
        Args { brackets: Some(folder), .. } => brackets::of_brackets(args, folder, context)?,
        Args { mirror_ball: Some(path), .. } => ball::of_ball(args, path, context)?,
        Args { picture: Some(path), .. } => match command {
            Some(command) => provider::of_picture(args, path, command, context)?,
            None => return Err(StageError::usage("--picture needs --provider").into()),
        },
        _ => return Err(StageError::usage("there is nothing to estimate from").into()),
    };
    let orientation = estimate.axes.orientation();
    let zenith = estimate.axes.zenith_in_world.to_array();
    let attributes = attributes(&estimate);
    write_environment(&output, &estimate.map, &attributes)?;
    if let Some(path) = shown {
        write_png(&path, &preview::preview(&estimate.map))?;
    }
    Ok(Report {
        output,
        source: estimate.source,
        rows: estimate.map.height,
        convention: estimate.axes.convention,
        zenith_in_world: zenith,
        coverage: estimate.coverage,
        clipped_share: estimate.clipped_share,
        clipped_factor: estimate.clipped_factor,
        summary: Summary::of(&estimate.map, &orientation),
        at: estimate.at,
        place: estimate.place,
        brackets: estimate.brackets,
        ball: estimate.ball,
        provider: estimate.provider,
    })
}

/// What the values and the axes of the file mean.
fn attributes(estimate: &Estimate) -> Vec<(String, String)> {
    let convention = serde_json::to_value(estimate.axes.convention);
    let name = convention.ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
    let [x, y, z] = estimate.axes.zenith_in_world.to_array();
    [
        ("colorSpace", "linear, Rec. 709 primaries".to_owned()),
        ("environmentConvention", name),
        ("zenithInWorld", format!("{x},{y},{z}")),
        ("estimatedFrom", estimate.source.to_owned()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into()
}
