//! The import itself: gather, split, rebase, resample, write.

use std::path::Path;

use glam::DVec3;
use motes_formats::atomic::{FolderDraft, ScratchFolder};
use motes_formats::capture::write_capture;
use motes_formats::images::exposure_stops;
use motes_scene::{Camera, Capture, Pose, Split, UnitWorld, View, told_apart};

use crate::error::{IngestError, Result};
use crate::exposure_response::{self, PhotoBrightness};
use crate::files::photo_plans::{
    left_out, masks_of, plan_photos, protect_sources, some_train, without_broken,
};
use crate::files::photos_out::{Done, Job, run, unique_stems};
use crate::files::sfm::{self, SfmOptions};
use crate::files::source::Source;
use crate::files::start_points::{find_points, start_points};
use crate::files::video::{VideoOptions, take_photos};
use crate::files::vignetting::{Shown, correct};
use crate::files::{from_colmap, from_transforms, split};
use crate::gathered::Gathered;
use crate::options::ImportOptions;
use crate::plan::{Kind, Plan, Plans};
use crate::progress::Progress;
use crate::report::{ImportReport, report};
use crate::{origin, panorama};

/// Imports a source into the folder `output` (which exists) and writes `capture.json` there.
///
/// # Errors
/// The source cannot be read or is malformed, no photo is left, a photo has another shape than
/// its camera, a file cannot be written, or `progress` says the user asked to stop.
pub fn import(
    source: &Source,
    output: &Path,
    options: &ImportOptions,
    sfm_options: &SfmOptions,
    progress: &dyn Progress,
) -> Result<ImportReport> {
    let gathered = match source {
        Source::Colmap { models, images } => from_colmap::gather(models, images)?,
        Source::Transforms { train, test, val, models } => {
            from_transforms::gather(train, test.as_deref(), val.as_deref(), models)?
        }
    };
    write(gathered, output, options, sfm_options, progress)
}

/// Imports photos without poses: finds the poses by structure from motion, then imports as
/// [`import`] does.
///
/// # Errors
/// As [`import`]; the photos do not allow it ([`IngestError::BadInput`] says what to do); no
/// program for structure from motion was found, or it failed ([`IngestError::Failed`]).
pub fn import_photos(
    photos: &Path,
    output: &Path,
    options: &ImportOptions,
    sfm_options: &SfmOptions,
    progress: &dyn Progress,
) -> Result<ImportReport> {
    let workspace = Workspace::new(sfm_options)?;
    solve_and_write(photos, &workspace, output, options, sfm_options, progress)
}

/// Takes photos out of a video and imports them as [`import_photos`] does.
///
/// # Errors
/// As [`import_photos`]; there is no ffmpeg, the video cannot be decoded, or the camera does not move in it.
pub fn import_video(
    video: &VideoOptions,
    output: &Path,
    options: &ImportOptions,
    sfm_options: &SfmOptions,
    progress: &dyn Progress,
) -> Result<ImportReport> {
    let Some(file) = &video.video else {
        return Err(IngestError::usage("no video is given", "give --video FILE"));
    };
    let workspace = Workspace::new(sfm_options)?;
    let photos = workspace.folder().join("frames");
    let taken = take_photos(file, video.frames, &photos, progress)?;
    let mut report = solve_and_write(&photos, &workspace, output, options, sfm_options, progress)?;
    report.source = format!("video, {}", report.source);
    report.warnings.extend(taken.warnings.iter().cloned());
    report.video = Some(taken);
    Ok(report)
}

/// Where the solver keeps its files.
enum Workspace<'a> {
    Kept(&'a Path),
    Scratch(ScratchFolder),
}

impl<'a> Workspace<'a> {
    fn new(options: &'a SfmOptions) -> Result<Self> {
        if let Some(folder) = &options.sfm_workspace {
            return Ok(Self::Kept(folder));
        }
        ScratchFolder::new().map(Self::Scratch).map_err(|error| IngestError::Failed {
            cause: format!("cannot make a temporary folder ({error})"),
            remedy: "give a folder with --sfm-workspace".into(),
        })
    }

    fn folder(&self) -> &Path {
        match self {
            Self::Kept(folder) => folder,
            Self::Scratch(folder) => folder.path(),
        }
    }
}

fn solve_and_write(
    photos: &Path,
    workspace: &Workspace<'_>,
    output: &Path,
    options: &ImportOptions,
    sfm_options: &SfmOptions,
    progress: &dyn Progress,
) -> Result<ImportReport> {
    // Inverted masks would hide the subject from the solver; it does without masks then.
    let masks = options.masks.as_deref().filter(|_| !options.invert_masks);
    let is_scratch = matches!(workspace, Workspace::Scratch(_));
    let (gathered, sfm_report) =
        sfm::gather(photos, workspace.folder(), is_scratch, masks, sfm_options, progress)?;
    let mut report = write(gathered, output, options, sfm_options, progress)?;
    report.sfm = Some(sfm_report);
    Ok(report)
}

/// Turns what a source delivered into a capture on disk.
pub(crate) fn write(
    mut gathered: Gathered,
    output: &Path,
    options: &ImportOptions,
    sfm_options: &SfmOptions,
    progress: &dyn Progress,
) -> Result<ImportReport> {
    let mut splits = split::assign(&gathered.photos, options, &mut gathered.notes)?;
    some_train(&splits, &[])?;
    let mut plans = Plans::new(options.keep_border, options.photo_size());
    let (plan_of, mut broken) = plan_photos(&mut gathered, &mut splits, &mut plans)?;
    some_train(&splits, &broken)?;
    gathered.warnings.append(&mut plans.warnings);
    let masks = masks_of(&gathered, options)?;
    protect_sources(&gathered, &masks, output)?;

    let kept: Vec<usize> = (0..gathered.photos.len()).filter(|&i| splits[i].is_some()).collect();
    let names = view_names(&gathered, &kept, &plans, &plan_of);
    let mut stems = unique_stems(&names).into_iter();
    // A document has no control characters, a file name on a disk may.
    let clean = |name: String| name.replace(char::is_control, "_");
    let names = told_apart(names.into_iter().map(clean).collect());
    let jobs: Vec<Job<'_>> = kept
        .iter()
        .map(|&i| {
            let plan = &plans.plans[plan_of[i]];
            let stems = stems.by_ref().take(crops(plan)).collect();
            Job { photo: &gathered.photos[i], plan, mask: masks[i].clone(), stems }
        })
        .collect();
    let draft = FolderDraft::new(output, "capture.json")?;
    let done = run(&jobs, draft.path(), options.invert_masks, progress)?;
    let crops_of = |i: usize| crops(&plans.plans[plan_of[i]]);
    let (kept, names, mut done) =
        without_broken(kept, names, done, crops_of, &mut splits, &mut broken);
    some_train(&splits, &broken)?;
    gathered.warnings.extend(left_out(&broken));
    let shown: Vec<Shown<'_>> = kept
        .iter()
        .map(|&i| Shown {
            photo: &gathered.photos[i],
            plan: &plans.plans[plan_of[i]],
            split: splits[i],
        })
        .collect();
    let (count, folder) = (gathered.points.len(), draft.path());
    let note = correct(options.vignetting, &shown, &mut done, count, folder, progress)?;
    gathered.notes.extend(note);

    let centers: Vec<DVec3> =
        kept.iter().map(|&i| gathered.photos[i].camera_from_world.center_in_world()).collect();
    let world_origin = origin::choose(&centers);
    let (views, brightness) =
        views_of(&gathered, &kept, &splits, (&plans, &plan_of), world_origin, names, done);
    let unit = UnitWorld::of(&centers, gathered.points.iter().map(|point| point.position));
    let (points, too_far) = start_points(&gathered, &splits, options, world_origin, &unit);
    if too_far > 0 {
        gathered.warnings.push(format!(
            "{too_far} points are so far away that single precision cannot hold them, and were left out"
        ));
    }
    let fitted = exposure_response::fit(&brightness, gathered.points.len());
    if let Some(note) = exposure_response::note(fitted) {
        gathered.notes.push(note);
    }
    let mut capture = Capture {
        cameras: plans.plans.iter().map(|plan| Camera::from_pinhole(plan.pinhole)).collect(),
        views,
        points,
        world_origin,
        exposure_response: fitted.filter(|fit| fit.evidence > 0.0).map(|fit| fit.response),
    };
    if capture.points.is_empty() {
        let folder = draft.path();
        find_points(&mut capture, folder, options, sfm_options, &mut gathered, progress)?;
    }
    write_capture(&draft.path().join("capture.json"), &capture)?;
    draft.publish()?;
    Ok(report(&gathered, &capture))
}

/// Names of the views that the kept photos become: a panorama becomes several.
fn view_names(
    gathered: &Gathered,
    kept: &[usize],
    plans: &Plans,
    plan_of: &[usize],
) -> Vec<String> {
    let mut names = Vec::new();
    for &i in kept {
        let name = &gathered.photos[i].name;
        match plans.plans[plan_of[i]].kind {
            Kind::Panorama => {
                names.extend((0..panorama::CROPS).map(|c| panorama::crop_name(name, c)));
            }
            _ => names.push(name.clone()),
        }
    }
    names
}

/// Views in the order of their names, and the brightness of the training photos.
fn views_of(
    gathered: &Gathered,
    kept: &[usize],
    splits: &[Option<Split>],
    (plans, plan_of): (&Plans, &[usize]),
    world_origin: DVec3,
    names: Vec<String>,
    done: Vec<Done>,
) -> (Vec<View>, Vec<PhotoBrightness>) {
    let mut views = Vec::new();
    let mut brightness = Vec::new();
    let mut view_names = names.into_iter();
    for (&i, done) in kept.iter().zip(done) {
        let (photo, plan) = (&gathered.photos[i], &plans.plans[plan_of[i]]);
        let exposure_stops = exposure_stops(&photo.path);
        if splits[i] == Some(Split::Train) {
            brightness.push(PhotoBrightness { stops: exposure_stops, samples: done.brightness });
        }
        for (crop, (image, mask)) in done.images.into_iter().zip(done.masks).enumerate() {
            let pose = rebased(&photo.camera_from_world, world_origin);
            let camera_from_world =
                if plan.kind == Kind::Panorama { panorama::crop_pose(&pose, crop) } else { pose };
            let split = splits[i].unwrap_or(Split::Train);
            let name = view_names.next().unwrap_or_default();
            views.push(View {
                name,
                camera: plan_of[i],
                camera_from_world,
                image,
                mask,
                split,
                exposure_stops,
            });
        }
    }
    views.sort_by(|a, b| a.name.cmp(&b.name));
    (views, brightness)
}

/// Pictures that a photo becomes.
fn crops(plan: &Plan) -> usize {
    if plan.kind == Kind::Panorama { panorama::CROPS } else { 1 }
}

/// The pose in the world whose origin was moved.
fn rebased(camera_from_world: &Pose, origin: DVec3) -> Pose {
    let Pose { rotation, translation } = *camera_from_world;
    Pose { rotation, translation: translation + rotation * origin }
}
