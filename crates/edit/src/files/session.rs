//! One edit: plan in, files and an answer out.

use std::path::{Path, PathBuf};

use super::{Reach, prepare, read_edit_plan};
use crate::EditState;
use crate::plan::{
    EditPlanDocument, EditRecord, Edited, MAX_RESHADE_SAMPLES, SkipRecord, check_plan, run_plan,
};
use crate::refit::{Fills, RefitOptions, RefitReport, Refitted, refit};
use crate::reshade::{ReshadeOptions, ReshadeReport, Settled, settle};
use crate::run::{
    EditError, Editors, MAX_FIT_STEPS, Preview, Resources, ShadowMode, orbit_camera, picture,
    whole_extent,
};
use crate::stylize::PictureEditor;
use clap::Args;
use motes_formats::FormatError;
use motes_formats::capture::read_capture;
use motes_formats::documents::Document as _;
use motes_formats::provider::ProviderKind;
use motes_protocol::ProviderFlags;
use motes_scene::{Capture, Pinhole, Pose, Split, Surface, View};
use motes_stage::{Context, OrBadInput as _, StageError};
use serde::Serialize;

use super::answer::EditAnswer;
use super::flags::OpFlags;
use super::input::Input;
use super::output::write_previews;
use super::outputs::Outputs;
use super::photos::Photos;
use super::provider_editor::ProviderEditor;
use super::source::Source;
use train_splat::files::load_training_images;

/// A view that is drawn.
const VIEW_BYTES_PER_PIXEL: u64 = 72;
/// Longer side of thumbnails, pixels.
const THUMBNAIL: usize = 480;

/// How light follows an edit of a decomposed scene.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Light")]
pub struct ReshadeFlags {
    /// Do not update shadows and light of a decomposed scene
    #[arg(long)]
    pub no_reshade: bool,

    /// Shadows of a plain splat: none, or ratio (approximate shadows that move with the object)
    /// [default: the plan's]
    #[arg(long, value_enum, value_name = "HOW", conflicts_with = "scene")]
    pub shadow: Option<ShadowMode>,

    /// Steps of the fit of what fills holes to the photos of --capture, 0 to 100000; 0: none
    /// [default: the plan's, else 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_FIT_STEPS)))]
    pub refit_steps: Option<u32>,

    /// Light samples per Gaussian for updating the light, 1 to 65536 [default: the plan's, else 64]
    #[arg(long, value_name = "N", conflicts_with = "no_reshade", help_heading = "Sampling (expert)",
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_RESHADE_SAMPLES)))]
    pub reshade_samples: Option<u32>,
}

/// What is to be edited, and how.
pub struct EditJob<'a> {
    /// A scene folder, or
    pub scene: Option<&'a Path>,
    /// a splat.
    pub gaussians: Option<&'a Path>,
    /// Cameras and photos.
    pub capture: Option<&'a Path>,
    /// A plan; operations of flags follow it.
    pub plan: Option<&'a Path>,
    /// Folders that the plan may read from, beside its own and that of the scene.
    pub assets: &'a [PathBuf],
    /// Operations of flags.
    pub flags: &'a OpFlags,
    /// How light follows.
    pub reshade: &'a ReshadeFlags,
    /// In place of the plan's.
    pub seed: Option<u64>,
    /// Who edits pictures.
    pub provider: &'a ProviderFlags,
    /// Folder of pictures.
    pub thumbnails: Option<&'a Path>,
    /// Views of the capture whose photos get the edit, into that folder.
    pub photos: &'a [String],
    /// The splat or scene folder to write.
    pub output: &'a Path,
}

impl<'a> EditJob<'a> {
    /// What its plan may reach.
    fn reach(&self, folder: &'a Path, written: &'a [&'a Path], editors: Editors<'a>) -> Reach<'a> {
        let named = self.assets.iter().map(PathBuf::as_path).chain(self.scene).collect();
        Reach { folder, named, typed: self.flags.ops.len(), written, editors }
    }
}

fn load_input(
    job: &EditJob<'_>,
    capture: Option<&Capture>,
    context: &Context,
) -> anyhow::Result<Input> {
    match (job.scene, job.gaussians) {
        (Some(scene), _) => Input::scene(scene, context),
        (None, Some(gaussians)) => Input::splat(gaussians, capture, context),
        (None, None) => Err(StageError::usage("--scene or --gaussians is needed").into()),
    }
}

/// Edits and writes. Everything is computed before the first file is written.
///
/// # Errors
/// When a plan does not fit, a file is missing or malformed, a file cannot be written, or the user interrupts.
pub fn run_edit(job: &EditJob<'_>, context: &Context) -> anyhow::Result<EditAnswer> {
    // Without either there is an error below.
    let is_scene = job.scene.is_some() || job.gaussians.is_none();
    let outputs = Outputs::claim(job.output, job.thumbnails, is_scene, context)?;
    let (plan, name) = plan_of(job, context)?;
    let folder = name.parent().filter(|p| job.plan.is_some() && !p.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let failed = |error| stage_error(error, &name);
    let editors = job.flags.typed_editors(context);
    let provider = open_provider(job, context)?;
    let by_provider = provider.as_ref().map(|provider| provider as &dyn PictureEditor);
    let editors = Editors { named: &editors, provider: by_provider, start: !context.dry_run() };
    let prepared = prepare(&plan, &job.reach(folder, &outputs.paths(), editors)).map_err(failed)?;
    let capture = job.capture.map(|path| load_capture(path, context)).transpose()?;
    let mut input = load_input(job, capture.as_ref(), context)?;
    let photos = Photos::load(job, capture.as_ref(), &input.state.gaussians)?;
    let count = input.state.len();
    let sha256 = context.sha256_of_input(&input.gaussians);
    let source = Source::new(input.decomposition.as_ref(), &input.gaussians, count, sha256);
    let resources = Resources {
        plan: &name,
        folder,
        bound: &|| source.bound(),
        capture: capture.as_ref().zip(job.capture),
        antialias: input.antialias,
        editors,
        stopped: &|| context.interrupted(),
    };
    let thumbnails = outputs.thumbnails.as_ref();
    let camera = thumbnails.and_then(|_| thumbnail_camera(&input.state, capture.as_ref()));
    let snap = |state: &EditState, file: &str| {
        let (camera, pose) = camera?;
        let image = picture(state, resources.antialias, &camera, &pose);
        Some(Preview { file: file.into(), image })
    };
    let before = snap(&input.state, "before.png");
    let Edited { executed, mut record, mut previews } =
        run_plan(&plan, &prepared, &mut input.state, &resources).map_err(failed)?;
    context.check_interrupted()?;
    let samples = plan.reshade_samples.unwrap_or(ReshadeOptions::default().samples);
    let (surface, light) = follow_light(&mut input.state, samples, plan.seed, &mut record)?;
    let refit = match &light {
        Some(light) => {
            let refitted = refit_fills(&mut input.state, &light.fills, &plan, &resources, context)?;
            refit_report(refitted, &mut record)?
        }
        None => None,
    };
    previews.extend(before.into_iter().chain(snap(&input.state, "after.png")));
    previews.extend(photos.after(&input.state, resources.antialias));
    if thumbnails.is_none() && !previews.is_empty() {
        context.warn("pictures were not written: give --thumbnails");
    }
    record.warnings.iter().for_each(|text| context.warn(text));
    record.made_by = concat!("motes edit ", env!("CARGO_PKG_VERSION")).into();
    if !context.skips_provenance() && source.is_file() {
        record.gaussians_sha256 = source.bound()?.sha256;
    }
    let mut answer = EditAnswer::new(
        &outputs.output,
        outputs.log.as_deref(),
        [count, input.state.len()],
        &record,
    );
    let used = provider.as_ref().map(ProviderEditor::used);
    (answer.light, answer.refit, answer.provider) = (light, refit, used);
    context.stop_if_dry_run_with(&answer)?;
    context.check_interrupted()?;
    let refit_steps = answer.refit.as_ref().map(|refit| refit.steps).or(plan.refit_steps);
    // A replay shall not depend on what is usual then.
    let reshade_samples = input.state.parts.as_ref().map(|_| samples).or(plan.reshade_samples);
    let record = Some(record);
    let executed = EditPlanDocument { ops: executed, refit_steps, reshade_samples, record, ..plan };
    if let Some(folder) = thumbnails {
        answer.thumbnails = write_previews(folder, &previews)?;
    }
    outputs.write(&input, &surface, &executed, context)?;
    answer.cpu_seconds = context.cpu_seconds();
    Ok(answer)
}

/// The provider of the command line; a dry run starts none.
fn open_provider(job: &EditJob<'_>, context: &Context) -> anyhow::Result<Option<ProviderEditor>> {
    let command = job.provider.command(context)?.filter(|_| !context.dry_run());
    let Some(command) = command else { return Ok(None) };
    let provider = job.provider.open(command, ProviderKind::InstructEdit, context)?;
    Ok(Some(ProviderEditor::new(provider)))
}

/// What a fit of fillings came to; one that was skipped is noted in the record.
fn refit_report(
    refitted: Option<Refitted>,
    record: &mut EditRecord,
) -> Result<Option<RefitReport>, StageError> {
    match refitted {
        Some(Refitted::Done(report)) => return Ok(Some(report)),
        Some(Refitted::Skipped(why)) => {
            let (at, op, why) = ("/refit_steps".into(), "refit".into(), why.into());
            record.skipped.push(SkipRecord { at, op, why });
        }
        Some(Refitted::Stopped) => return Err(StageError::interrupted("interrupted")),
        None => {}
    }
    Ok(None)
}

/// Makes the light follow what was changed, and returns the surface as it is now.
fn follow_light(
    state: &mut EditState,
    samples: u32,
    seed: u64,
    record: &mut EditRecord,
) -> anyhow::Result<(Surface, Option<ReshadeReport>)> {
    let options = ReshadeOptions { samples, seed, ..Default::default() };
    let Settled { surface, report, stayed } = settle(state, &options).or_bad_input()?;
    if stayed {
        record
            .warnings
            .push("no reshading: the light does not follow, shadows stay as they were".into());
    }
    let Some(report) = report else { return Ok((surface, None)) };
    record.warnings.extend(report.warnings.iter().cloned());
    record.skipped.extend(report.unfilled.iter().map(|why| SkipRecord {
        at: "/ops".into(),
        op: "fill".into(),
        why: why.clone(),
    }));
    Ok((surface, Some(report)))
}

/// Fits what fills holes to the photos, when there are holes, photos and steps to take.
fn refit_fills(
    state: &mut EditState,
    fills: &Fills,
    plan: &EditPlanDocument,
    resources: &Resources<'_>,
    context: &Context,
) -> anyhow::Result<Option<Refitted>> {
    let steps = plan.refit_steps.unwrap_or(0);
    if steps > 0 && resources.capture.is_none() {
        let error = EditError::plan("/refit_steps", "a fit needs photos");
        return Err(stage_error(error.remedy("give --capture, or 0"), resources.plan));
    }
    let Some((capture, document)) = resources.capture.filter(|_| steps > 0) else {
        return Ok(None);
    };
    if fills.filled.is_empty() {
        return Ok(None);
    }
    let pinhole = |i: &usize| capture.cameras[capture.views[*i].camera].as_pinhole().is_some();
    let views: Vec<usize> = capture.views_of(Split::Train).into_iter().filter(pinhole).collect();
    let photos = load_training_images(document, capture, &views)?;
    let options = RefitOptions { steps, seed: plan.seed, antialias: resources.antialias };
    Ok(Some(refit(state, fills, &photos, &options, &|| context.interrupted())))
}

/// The plan of the file and of the flags, and what errors call it.
fn plan_of(job: &EditJob<'_>, context: &Context) -> anyhow::Result<(EditPlanDocument, PathBuf)> {
    let (mut plan, name) = match job.plan {
        Some(path) => {
            context.input("plan", path)?;
            let parsed = read_edit_plan(path)?;
            parsed.warnings.iter().for_each(|text| context.warn(text));
            (parsed.document, path.to_owned())
        }
        None => (EditPlanDocument::new(0, Vec::new()), PathBuf::from("the command line")),
    };
    plan.seed = job.seed.unwrap_or(plan.seed);
    plan.shadow = job.reshade.shadow.unwrap_or(plan.shadow);
    plan.refit_steps = job.reshade.refit_steps.or(plan.refit_steps);
    plan.reshade_samples = match job.reshade {
        ReshadeFlags { no_reshade: true, .. } => Some(0),
        flags => flags.reshade_samples.or(plan.reshade_samples),
    };
    plan.record = None;
    plan.version = EditPlanDocument::version();
    if !job.flags.ops.is_empty() {
        plan.ops.extend(job.flags.ops.iter().cloned());
        check_plan(&plan, &name)?;
    }
    if plan.ops.is_empty() {
        return Err(StageError::usage("there is nothing to do")
            .help("give --plan, or operations as flags: --help lists them")
            .into());
    }
    Ok((plan, name))
}

fn load_capture(path: &Path, context: &Context) -> anyhow::Result<Capture> {
    context.input("capture", path)?;
    let capture = read_capture(path)?;
    let camera = |view: &View| &capture.cameras[view.camera];
    let sizes = capture.views.iter().map(camera).map(|c| (c.width, c.height));
    context.need_memory_for_pictures(sizes, VIEW_BYTES_PER_PIXEL)?;
    Ok(capture)
}

/// The first view of the capture, or a camera beside the scene.
fn thumbnail_camera(state: &EditState, capture: Option<&Capture>) -> Option<(Pinhole, Pose)> {
    let of_view = |capture: &Capture| {
        let view = capture.views.first()?;
        let full = capture.cameras[view.camera].as_pinhole()?;
        let factor = THUMBNAIL as f64 / full.width.max(full.height) as f64;
        let side = |n: usize| ((n as f64 * factor).round() as usize).max(1);
        Some((full.resized(side(full.width), side(full.height)), view.camera_from_world))
    };
    capture.and_then(of_view).or_else(|| {
        let extent = whole_extent(&state.gaussians, state.up_in_world)?;
        orbit_camera(&extent, 30.0, 25.0, THUMBNAIL)
    })
}

/// A plan that does not fit is bad input, named with its place.
fn stage_error(error: EditError, plan: &Path) -> anyhow::Error {
    match error {
        EditError::Plan { at, cause, remedy } => {
            let error = FormatError::invalid(plan, at, cause);
            match remedy {
                Some(remedy) => error.with_remedy(remedy).into(),
                None => error.into(),
            }
        }
        EditError::File { at, source } => {
            anyhow::Error::from(*source).context(format!("{at} of {}", plan.display()))
        }
        EditError::Stopped => StageError::interrupted("interrupted").into(),
    }
}
