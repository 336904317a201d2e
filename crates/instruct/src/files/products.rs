//! What becomes of the plans of an instruction: files, or edited scenes.

use std::path::{Path, PathBuf};

use edit::plan::EditPlanDocument;
use motes_formats::atomic::write_atomic;
use motes_formats::documents::to_pretty_json;
use motes_formats::scene_card::SceneCardDocument;
use motes_stage::Context;

use super::apply::apply;
use super::inputs::Inputs;
use super::names::Names;
use super::report::{PlanReport, Report};
use crate::explain::explain;
use crate::language::NamedPlan;

/// What the command line says about products.
pub(super) struct Products<'a> {
    /// A plan file, claimed; an edited scene; or nothing to write.
    pub(super) output: Option<&'a Path>,
    /// Whether the plans run.
    pub(super) is_applied: bool,
    pub(super) thumbnails: Option<&'a Path>,
    pub(super) seed: u64,
}

impl Products<'_> {
    /// Writes plans, or runs them; what came of it goes into `report`.
    ///
    /// # Errors
    /// An output exists or cannot be written; as `edit` where plans run.
    pub(super) fn make(
        &self,
        inputs: &Inputs,
        card: &SceneCardDocument,
        plans: Vec<NamedPlan>,
        report: &mut Report,
        context: &Context,
    ) -> anyhow::Result<()> {
        let mut planned = Vec::new();
        for NamedPlan { name, plan } in plans {
            planned.push(PlanReport {
                output: self.output_of(name.as_deref(), context)?,
                explanation: explain(&plan.ops, card),
                plan: EditPlanDocument { seed: self.seed, ..plan },
                name,
                edited: None,
            });
        }
        if self.is_applied {
            // `edit` stops a dry run itself, after its checks.
            for plan in &mut planned {
                self.run(inputs, plan, context)?;
            }
            report.plans = planned;
            return Ok(());
        }
        report.plans = planned;
        // A dry run shows what would be done.
        context.stop_if_dry_run_with(report)?;
        report.plans.iter_mut().try_for_each(|plan| write_plan(inputs, plan))
    }

    fn output_of(&self, name: Option<&str>, context: &Context) -> anyhow::Result<Option<PathBuf>> {
        match (self.output, name) {
            (Some(path), Some(name)) => {
                let path = of_variant(path, name, self.is_applied);
                let claimed = if self.is_applied { path } else { context.json_output(&path)? };
                Ok(Some(claimed))
            }
            (path, _) => Ok(path.map(Path::to_owned)),
        }
    }

    fn run(
        &self,
        inputs: &Inputs,
        planned: &mut PlanReport,
        context: &Context,
    ) -> anyhow::Result<()> {
        let Some(output) = &planned.output else { return Ok(()) };
        let plan = Names { inputs }.resolved(&planned.plan, Path::new("."))?;
        let thumbnails = self.thumbnails.map(|folder| match &planned.name {
            Some(name) => folder.join(name),
            None => folder.to_owned(),
        });
        planned.edited = Some(apply(inputs, &plan, output, thumbnails.as_deref(), context)?);
        Ok(())
    }
}

/// Writes a plan whose files are named relative to it.
fn write_plan(inputs: &Inputs, planned: &mut PlanReport) -> anyhow::Result<()> {
    let Some(output) = &planned.output else { return Ok(()) };
    let folder = output.parent().filter(|p| !p.as_os_str().is_empty());
    planned.plan = Names { inputs }.resolved(&planned.plan, folder.unwrap_or(Path::new(".")))?;
    let text = to_pretty_json(&planned.plan);
    Ok(write_atomic(output, |writer| writer.write_all(text.as_bytes()))?)
}

/// `plan.json` becomes `plan-sunrise.json`; an edited scene is a folder, or a splat with the name before its suffix.
fn of_variant(path: &Path, name: &str, is_applied: bool) -> PathBuf {
    match (path.extension(), path.file_stem()) {
        (Some(suffix), Some(stem)) => {
            let (stem, suffix) = (stem.to_string_lossy(), suffix.to_string_lossy());
            path.with_file_name(format!("{stem}-{name}.{suffix}"))
        }
        _ if is_applied => path.join(name),
        _ => {
            let stem = path.file_name().unwrap_or_default().to_string_lossy();
            path.with_file_name(format!("{stem}-{name}"))
        }
    }
}
