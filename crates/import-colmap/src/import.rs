//! The import itself: gather, split, rebase, resample, write.

use std::path::{Path, PathBuf};

use glam::DVec3;
use motes_formats::atomic::{FolderDraft, ScratchFolder};
use motes_formats::capture::write_capture;
use motes_formats::images::{exposure_stops, image_dimensions, image_dimensions_upright};
use motes_math::median::median;
use motes_scene::{
    Camera, Capture, Pose, SparsePoints, Split, Switch, UnitWorld, View, told_apart,
};

use crate::error::{IngestError, Result};
use crate::exposure_response::{self, PhotoBrightness};
use crate::gathered::{Gathered, Photo, Point};
use crate::locate_image::find_mask;
use crate::options::ImportOptions;
use crate::photos_out::{Done, Job, Outcome, broken_photo, run, unique_stems};
use crate::plan::{Kind, Plan, Plans};
use crate::progress::Progress;
use crate::report::ImportReport;
use crate::sfm::{self, SfmOptions};
use crate::source::Source;
use crate::{from_colmap, from_transforms, geometry, origin, panorama, split};

/// How images are made, as the report says it.
const RESAMPLING: &str = "Lanczos-3 on sRGB-encoded 8-bit values, widened by the downscale factor, undistortion and downscale in one pass";

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
    let temporary;
    let workspace = match &sfm_options.sfm_workspace {
        Some(folder) => folder.as_path(),
        None => {
            temporary = ScratchFolder::new().map_err(|error| IngestError::Failed {
                cause: format!("cannot make a temporary folder ({error})"),
                remedy: "give a folder with --sfm-workspace".into(),
            })?;
            temporary.path()
        }
    };
    // Inverted masks would hide the subject from the solver; it does without masks then.
    let masks = options.masks.as_deref().filter(|_| !options.invert_masks);
    let is_scratch = sfm_options.sfm_workspace.is_none();
    let (gathered, sfm_report) =
        sfm::gather(photos, workspace, is_scratch, masks, sfm_options, progress)?;
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
    let mut plans = Plans::new(options.keep_border, options.max_resolution);
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
    let (kept, names, done) = without_broken(kept, names, done, crops_of, &mut splits, &mut broken);
    some_train(&splits, &broken)?;
    gathered.warnings.extend(left_out(&broken));

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

/// The plan of every photo, and what is wrong with those that cannot be read, which lose their split.
fn plan_photos(
    gathered: &mut Gathered,
    splits: &mut [Option<Split>],
    plans: &mut Plans,
) -> Result<(Vec<usize>, Vec<String>)> {
    let mut plan_of = Vec::with_capacity(gathered.photos.len());
    let mut broken = Vec::new();
    for (photo, split) in gathered.photos.iter_mut().zip(splits) {
        let plan = match dimensions(&photo.path) {
            Ok(sizes) => plan_for(photo, sizes, plans, &mut gathered.warnings)?,
            Err(error) => {
                broken.push(broken_photo(error.into())?);
                *split = None;
                usize::MAX
            }
        };
        plan_of.push(plan);
    }
    Ok((plan_of, broken))
}

/// Checks that there is a photo to train on.
fn some_train(splits: &[Option<Split>], broken: &[String]) -> Result<()> {
    if splits.contains(&Some(Split::Train)) {
        return Ok(());
    }
    match broken.first() {
        None => Err(IngestError::bad_input(
            "no photo is left to train on",
            "give more photos, or hold out fewer of them",
        )),
        Some(first) => Err(IngestError::bad_input(
            format!("no photo that can be read is left to train on: {first}"),
            "copy the photos again: files that end early were not copied to their end",
        )),
    }
}

/// A sentence about photos that cannot be read.
fn left_out(broken: &[String]) -> Option<String> {
    let first = broken.iter().take(3).cloned().collect::<Vec<_>>().join("; ");
    let more = if broken.len() > 3 { "; ..." } else { "" };
    let count = broken.len();
    (count > 0).then(|| {
        format!("{count} photos cannot be read and were left out: {first}{more}; copy them again")
    })
}

/// Size of a photo as stored, and upright.
fn dimensions(path: &Path) -> motes_formats::Result<[(usize, usize); 2]> {
    Ok([image_dimensions(path)?, image_dimensions_upright(path)?])
}

/// What is left when photos that could not be processed lose their split and their names.
fn without_broken(
    kept: Vec<usize>,
    names: Vec<String>,
    outcomes: Vec<Outcome>,
    crops_of: impl Fn(usize) -> usize,
    splits: &mut [Option<Split>],
    broken: &mut Vec<String>,
) -> (Vec<usize>, Vec<String>, Vec<Done>) {
    let mut left = (Vec::new(), Vec::new(), Vec::new());
    let mut names = names.into_iter();
    for (i, outcome) in kept.into_iter().zip(outcomes) {
        let own: Vec<String> = names.by_ref().take(crops_of(i)).collect();
        match outcome {
            Outcome::Done(done) => {
                left.0.push(i);
                left.1.extend(own);
                left.2.push(done);
            }
            Outcome::LeftOut(why) => {
                broken.push(why);
                splits[i] = None;
            }
        }
    }
    left
}

/// Triangulates start points for a capture that has none, as far as the options say.
fn find_points(
    capture: &mut Capture,
    output: &Path,
    options: &ImportOptions,
    sfm_options: &SfmOptions,
    gathered: &mut Gathered,
    progress: &dyn Progress,
) -> Result<()> {
    const WITHOUT: &str = "there are no start points: train-splat finds its own in the photos";
    if sfm_options.triangulate == Switch::Off {
        gathered.notes.push(WITHOUT.into());
        return Ok(());
    }
    let (folder, train_only) = (output.join("images"), options.points_from_train);
    let found = sfm::triangulate(capture, &folder, train_only, sfm_options, progress);
    match (found, sfm_options.triangulate) {
        (Ok(Some(found)), _) => {
            capture.points = found.points;
            gathered.notes.push(found.note);
        }
        (Ok(None), Switch::On) => {
            return Err(IngestError::Failed {
                cause: "--triangulate on: no Python with pycolmap was found".into(),
                remedy: "make setup installs it; or name one with --python".into(),
            });
        }
        (Ok(None), _) => gathered.notes.push(format!(
            "{WITHOUT} (with pycolmap, which make setup installs, they are triangulated here)"
        )),
        (Err(IngestError::Interrupted), _) => return Err(IngestError::Interrupted),
        (Err(error), Switch::On) => return Err(error),
        (Err(error), _) => {
            gathered
                .warnings
                .push(format!("no start points were triangulated ({error}); {WITHOUT}"));
        }
    }
    Ok(())
}

/// The plan of a photo; decides whether its pixels must be turned upright.
///
/// COLMAP ignores EXIF orientation, so poses belong to the pixels as stored. Only when those do
/// not fit the camera and the upright ones do, the poses were made from upright copies.
fn plan_for(
    photo: &mut Photo,
    [stored, upright]: [(usize, usize); 2],
    plans: &mut Plans,
    warnings: &mut Vec<String>,
) -> Result<usize> {
    let (width, height) = if photo.upright { upright } else { stored };
    let cause = match plans.plan_for(&photo.lens.camera(width, height), width, height) {
        Ok(plan) => return Ok(plan),
        Err(cause) => cause,
    };
    if !photo.upright && upright != stored {
        let camera = photo.lens.camera(upright.0, upright.1);
        if let Ok(plan) = plans.plan_for(&camera, upright.0, upright.1) {
            photo.upright = true;
            warnings.push(format!(
                "{} was turned by its EXIF orientation: only so it fits its camera",
                photo.name
            ));
            return Ok(plan);
        }
    }
    Err(IngestError::bad_input(
        format!("{cause}: {}", photo.path.display()),
        "give the photos that the poses were made from (any size, but not cropped or turned)",
    ))
}

/// Refuses an output whose `images` or `masks` folder holds a source file: writing there would
/// destroy it.
fn protect_sources(gathered: &Gathered, masks: &[Option<PathBuf>], output: &Path) -> Result<()> {
    let targets: Vec<PathBuf> = ["images", "masks"]
        .iter()
        .filter_map(|name| output.join(name).canonicalize().ok())
        .collect();
    let sources = gathered.photos.iter().map(|photo| &photo.path).chain(masks.iter().flatten());
    for source in sources.filter_map(|path| path.canonicalize().ok()) {
        if targets.iter().any(|target| source.starts_with(target)) {
            let cause =
                format!("the output would overwrite this photo or mask: {}", source.display());
            return Err(IngestError::usage(cause, "write the capture to another folder with -o"));
        }
    }
    Ok(())
}

/// The mask file of every photo.
fn masks_of(gathered: &Gathered, options: &ImportOptions) -> Result<Vec<Option<PathBuf>>> {
    let Some(folder) = &options.masks else {
        return Ok(gathered.photos.iter().map(|photo| photo.mask.clone()).collect());
    };
    let masks: Vec<_> =
        gathered.photos.iter().map(|photo| find_mask(folder, &photo.name)).collect();
    if masks.iter().all(Option::is_none) {
        return Err(IngestError::bad_input(
            format!("no mask of any photo is here: {}", folder.display()),
            "the mask of sub/IMG_1.jpg is sub/IMG_1.png, sub/IMG_1.jpg.png or sub/IMG_1.mask.png",
        ));
    }
    Ok(masks)
}

/// The pose in the world whose origin was moved.
fn rebased(camera_from_world: &Pose, origin: DVec3) -> Pose {
    let Pose { rotation, translation } = *camera_from_world;
    Pose { rotation, translation: translation + rotation * origin }
}

fn start_points(
    gathered: &Gathered,
    splits: &[Option<Split>],
    options: &ImportOptions,
    origin: DVec3,
    unit: &UnitWorld,
) -> (SparsePoints, usize) {
    let seen_in_training = |point: &&Point| {
        let training = point.track.iter().filter(|&&photo| splits[photo] == Some(Split::Train));
        !options.points_from_train || training.count() >= 2
    };
    let (mut points, mut too_far) = (SparsePoints::default(), 0);
    for point in gathered.points.iter().filter(seen_in_training) {
        // On the grid of the fit while all digits are there: after single precision, points of
        // the same scene in another unit would not snap to the same places.
        let position = unit.point_in_world(unit.point(point.position));
        let position = (position - origin).as_vec3();
        if position.is_finite() {
            points.positions.push(position.to_array());
            points.colors.push(point.color);
        } else {
            too_far += 1;
        }
    }
    (points, too_far)
}

fn report(gathered: &Gathered, capture: &Capture) -> ImportReport {
    let count = |split| capture.views_of(split).len();
    let seen: Vec<&Photo> = gathered.photos.iter().filter(|p| !p.observations.is_empty()).collect();
    let mut coverage = seen.iter().map(|photo| geometry::grid_coverage(photo)).collect::<Vec<_>>();
    let mean_coverage =
        (!coverage.is_empty()).then(|| coverage.iter().sum::<f64>() / coverage.len() as f64);
    coverage.clear();
    let image_size =
        capture.cameras.iter().map(|c| [c.width, c.height]).max_by_key(|s| s[0] * s[1]);
    ImportReport {
        source: gathered.description.clone(),
        photos: gathered.photos_offered,
        registered: gathered.photos.len(),
        views: capture.views.len(),
        train_views: count(Split::Train),
        test_views: count(Split::Test),
        cameras: capture.cameras.len(),
        image_size: image_size.unwrap_or_default(),
        points: capture.points.len(),
        mean_reprojection_error_px: geometry::mean_reprojection_error(gathered),
        median_parallax_degrees: geometry::median_parallax_degrees(gathered),
        median_points_per_photo: median(seen.iter().map(|photo| photo.observations.len() as f64)),
        mean_grid_coverage: mean_coverage,
        world_origin: capture.world_origin.to_array(),
        camera_bounds: bounds(capture),
        point_bounds: geometry::robust_bounds(
            capture.points.positions.iter().map(|p| glam::Vec3::from_array(*p).as_dvec3()),
        ),
        sfm: None,
        resampling: RESAMPLING.into(),
        notes: gathered.notes.clone(),
        warnings: gathered.warnings.clone(),
    }
}

fn bounds(capture: &Capture) -> Option<[[f64; 3]; 2]> {
    let centers = || capture.views.iter().map(|view| view.camera_from_world.center_in_world());
    let low = centers().reduce(DVec3::min)?;
    let high = centers().reduce(DVec3::max)?;
    Some([low.to_array(), high.to_array()])
}
