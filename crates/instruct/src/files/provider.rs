//! Asking a language model for the plan.

use motes_formats::FormatError;
use motes_formats::atomic::ScratchFolder;
use motes_formats::images::write_png;
use motes_formats::provider::{ChatTask, ProviderKind, ProviderRequest, Task, TaskResult};
use motes_formats::scene_card::SceneCardDocument;
use motes_protocol::{Provider, ProviderCommand, ProviderFlags, ProviderUse};
use motes_raster::{RenderOptions, render};
use motes_stage::{Context, StageError};
use serde_json::Value;

use super::inputs::Inputs;
use crate::chat::{plan_of, repair, task};
use crate::language::{Interpretation, MAX_LETTERS, NamedPlan};

/// Longer side of the picture that goes to the model, pixels.
const SIDE: usize = 512;
const PICTURE: &str = "view.png";

/// The plan of a model: asked once, and once more with what is wrong.
///
/// # Errors
/// The instruction is empty or too long; the provider fails; its second answer is no valid plan, too.
pub(super) fn ask(
    inputs: &Inputs,
    card: &SceneCardDocument,
    instruction: &str,
    command: ProviderCommand,
    flags: &ProviderFlags,
    seed: u64,
    context: &Context,
) -> anyhow::Result<(Interpretation, Option<ProviderUse>)> {
    if instruction.trim().is_empty() || instruction.chars().nth(MAX_LETTERS).is_some() {
        let cause = format!("an instruction has 1 to {MAX_LETTERS} letters");
        return Err(StageError::bad_input(cause).into());
    }
    if context.dry_run() {
        // A dry run starts no program.
        context.stop_if_dry_run()?;
    }
    let mut provider = flags.open(command, ProviderKind::Chat, context)?;
    let scratch = ScratchFolder::new()?;
    let mut pictures = Vec::new();
    if let Some(picture) = picture(inputs) {
        write_png(&scratch.path().join(PICTURE), &picture)?;
        pictures.push(PICTURE.to_owned());
    }
    let first = task(card, instruction, pictures);
    let answer = asked(&mut provider, &scratch, first.clone(), seed, context)?;
    let plan = match plan_of(&answer, card) {
        Ok(plan) => plan,
        Err(error) => {
            context.warn(format!("the provider is asked again: {}", first_line(&error)));
            let again = repair(first, &answer, &error);
            let answer = asked(&mut provider, &scratch, again, seed, context)?;
            plan_of(&answer, card)?
        }
    };
    let plans = vec![NamedPlan { name: None, plan }];
    Ok((Interpretation { plans, notes: Vec::new() }, Some(provider.used().clone())))
}

fn asked(
    provider: &mut Provider,
    scratch: &ScratchFolder,
    task: ChatTask,
    seed: u64,
    context: &Context,
) -> anyhow::Result<Value> {
    let request = ProviderRequest::new(Task::Chat(task), seed);
    let reply = provider.ask(scratch.path(), &request, &|| context.interrupted());
    let reply = reply.map_err(StageError::from)?;
    reply.warnings.iter().for_each(|warning| context.warn(warning.clone()));
    match reply.result {
        TaskResult::Chat(answer) => Ok(answer.content),
        _ => anyhow::bail!("the provider answered another kind"),
    }
}

/// The view of the frame, as the Gaussians show it.
fn picture(inputs: &Inputs) -> Option<motes_scene::ImageU8> {
    let (capture, view) = inputs.capture.as_ref()?;
    let view = &capture.views[*view];
    let full = capture.cameras[view.camera].as_pinhole()?;
    let factor = (SIDE as f64 / full.width.max(full.height) as f64).min(1.0);
    let side = |n: usize| ((n as f64 * factor).round() as usize).max(1);
    let camera = full.resized(side(full.width), side(full.height));
    let options = RenderOptions { antialias: inputs.antialias, ..RenderOptions::default() };
    Some(render(&inputs.gaussians, &camera, &view.camera_from_world, &options).color.to_u8())
}

fn first_line(error: &FormatError) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}
