//! Running a plan, as `edit` does.

use std::path::Path;

use edit::files::{EditAnswer, EditJob, OpFlags, ReshadeFlags, run_edit};
use edit::plan::EditPlanDocument;
use edit::run::ShadowMode;
use motes_protocol::ProviderFlags;
use motes_stage::Context;

use super::inputs::Inputs;

/// Runs a plan whose files are named relative to the working folder. No program is started: a plan of an instruction has none.
///
/// # Errors
/// As `edit`.
pub(super) fn apply(
    inputs: &Inputs,
    plan: &EditPlanDocument,
    output: &Path,
    thumbnails: Option<&Path>,
    context: &Context,
) -> anyhow::Result<EditAnswer> {
    let mut flags = OpFlags::default();
    flags.ops.clone_from(&plan.ops);
    let shadow = (plan.shadow != ShadowMode::None).then_some(plan.shadow);
    let reshade = ReshadeFlags {
        no_reshade: false,
        shadow,
        refit_steps: plan.refit_steps,
        reshade_samples: plan.reshade_samples.filter(|samples| *samples > 0),
    };
    let provider = ProviderFlags { provider: None, provider_time_limit: 1.0, provider_cache: None };
    let job = EditJob {
        scene: inputs.scene.as_deref(),
        gaussians: inputs.splat.as_deref(),
        capture: inputs.capture_file.as_deref(),
        plan: None,
        assets: &[],
        flags: &flags,
        reshade: &reshade,
        seed: Some(plan.seed),
        provider: &provider,
        thumbnails,
        photos: &[],
        output,
    };
    run_edit(&job, context)
}
