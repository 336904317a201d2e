//! The `colmap` command, versions 3.x and 4.x.
//!
//! Options that moved between versions are looked up in what `colmap COMMAND --help` prints.

use std::path::{Path, PathBuf};

use motes_formats::colmap::read_model;
use motes_formats::images::image_dimensions;
use motes_math::median::median;

use super::colmap_step::Step;
use super::options::{CameraSharing, FAINT_CONTRAST, Matcher};
use super::{Request, SfmReport, Solution};
use crate::error::{IngestError, Result};
use crate::progress::Progress;

/// Pairs grow with the square of the photos: up to this many, all are compared.
const EXHAUSTIVE_UP_TO: usize = 60;

/// Runs feature extraction, matching and mapping.
pub(super) fn solve(
    command: &Path,
    version: &str,
    request: &Request<'_>,
    progress: &dyn Progress,
) -> Result<Solution> {
    let started = std::time::Instant::now();
    let names = photo_names(request.photos)?;
    if names.len() < 2 {
        return Err(IngestError::bad_input(
            format!("fewer than two photos are here: {}", request.photos.display()),
            "take at least 3 photos, better 20, from different places around the subject",
        ));
    }
    let workspace = Workspace::make(request.workspace)?;
    let Extracted { exif_prior, keypoints } =
        extract(command, request, &workspace, &names, progress)?;
    let exhaustive = match request.options.matcher {
        Matcher::Auto => names.len() <= EXHAUSTIVE_UP_TO,
        Matcher::Exhaustive => true,
        Matcher::Sequential => false,
    };
    match_pairs(command, request, &workspace, exhaustive, progress)?;
    map(command, request, &workspace, names.len(), progress)?;
    let models = workspace.models()?;
    if models.is_empty() {
        return Err(IngestError::bad_input(
            format!("no camera positions could be worked out from the {} photos", names.len()),
            "take more photos from more places with more overlap: step sideways about 15 degrees between photos \
             instead of turning on the spot, keep the subject in view, avoid blur and blank, shiny or moving subjects",
        ));
    }
    let mut solution = describe(version, request, models, names.len())?;
    if solution.report.focal_prior_px.is_none() && exif_prior.is_some() {
        solution.report.focal_prior_px = exif_prior;
        solution.report.focal_prior_source = "exif".into();
    }
    solution.keypoints = Some(keypoints);
    solution.report.seconds = started.elapsed().as_secs_f64();
    Ok(solution)
}

struct Workspace {
    folder: PathBuf,
    database: PathBuf,
    sparse: PathBuf,
}

impl Workspace {
    fn make(folder: &Path) -> Result<Self> {
        let failed =
            |path: &Path, error: &std::io::Error| super::pycolmap::cannot_write(path, error);
        let (database, sparse) = (folder.join("database.db"), folder.join("sparse"));
        for suffix in ["", "-wal", "-shm"] {
            let file = folder.join(format!("database.db{suffix}"));
            if file.exists() {
                std::fs::remove_file(&file).map_err(|e| failed(&file, &e))?;
            }
        }
        if sparse.exists() {
            std::fs::remove_dir_all(&sparse).map_err(|e| failed(&sparse, &e))?;
        }
        std::fs::create_dir_all(&sparse).map_err(|e| failed(&sparse, &e))?;
        Ok(Self { folder: folder.to_path_buf(), database, sparse })
    }

    fn models(&self) -> Result<Vec<PathBuf>> {
        let mut models = Vec::new();
        for folder in motes_formats::colmap::find_models(&self.folder) {
            let model = read_model(&folder)?;
            if model.images.len() >= 2 && !model.points.is_empty() {
                models.push((model.images.len(), model.points.len(), folder));
            }
        }
        models.sort_by(|a, b| (b.0, b.1).cmp(&(a.0, a.1)).then_with(|| a.2.cmp(&b.2)));
        Ok(models.into_iter().map(|(_, _, folder)| folder).collect())
    }
}

fn photo_names(folder: &Path) -> Result<Vec<(String, (usize, usize))>> {
    let mut names = Vec::new();
    super::staged_photos::list(folder, "", &mut names)?;
    names.sort();
    let sized = names.into_iter().filter_map(|name| {
        let size = image_dimensions(&folder.join(&name)).ok()?;
        Some((name, size))
    });
    Ok(sized.collect())
}

/// What the feature extractor says of the photos.
struct Extracted {
    /// Focal length from EXIF, pixels.
    exif_prior: Option<f64>,
    /// Keypoints per photo.
    keypoints: f64,
}

fn extract(
    command: &Path,
    request: &Request<'_>,
    workspace: &Workspace,
    names: &[(String, (usize, usize))],
    progress: &dyn Progress,
) -> Result<Extracted> {
    // COLMAP refuses one camera for photos of two sizes, so every size is a run of its own.
    let mut groups: Vec<((usize, usize), Vec<&str>)> = Vec::new();
    let one = request.options.share_camera == CameraSharing::One;
    for (name, size) in names {
        let key = if one { *size } else { (0, 0) };
        match groups.iter_mut().find(|(other, _)| *other == key) {
            Some((_, members)) => members.push(name),
            None => groups.push((key, vec![name])),
        }
    }
    progress.begin("features", names.len());
    let (mut done, mut exif_focals, mut keypoints) = (0, Vec::new(), 0.0);
    for (index, (size, members)) in groups.iter().enumerate() {
        let list = workspace.folder.join(format!("photos-{index}.txt"));
        std::fs::write(&list, members.join("\n") + "\n")
            .map_err(|e| super::pycolmap::cannot_write(&list, &e))?;
        let mut step = Step::new(command, "feature_extractor");
        step.set(&["database_path"], workspace.database.display());
        step.set(&["image_path"], request.photos.display());
        step.set(&["image_list_path"], list.display());
        step.set(&["random_seed", "default_random_seed"], request.options.seed);
        step.set(&["ImageReader.camera_model"], &request.options.camera_model);
        match request.options.share_camera {
            CameraSharing::One => step.set(&["ImageReader.single_camera"], 1),
            CameraSharing::Each => step.set(&["ImageReader.single_camera_per_image"], 1),
            CameraSharing::Exif => {}
        }
        if let (Some(focal), true) = (request.focal_prior.pixels(), one) {
            step.set(&["ImageReader.camera_params"], camera_params(request, focal, *size)?);
        }
        if let Some(masks) = request.masks {
            step.set(&["ImageReader.mask_path"], masks.display());
        }
        if request.faint {
            step.set(&["SiftExtraction.peak_threshold"], FAINT_CONTRAST);
        }
        step.set(&["SiftExtraction.num_threads", "FeatureExtraction.num_threads"], request.threads);
        step.set(&["SiftExtraction.use_gpu", "FeatureExtraction.use_gpu"], 0);
        step.run(progress, &mut |line| {
            if line.contains("Processed file [") {
                done += 1;
                progress.advance_to(done);
            }
            exif_focals.extend(exif_focal(line));
            keypoints += keypoint_count(line).unwrap_or(0.0);
        })?;
    }
    let keypoints = keypoints / names.len() as f64;
    Ok(Extracted { exif_prior: median(exif_focals), keypoints })
}

/// Number of a line such as `  Features:        1234`.
fn keypoint_count(line: &str) -> Option<f64> {
    line.split_once(" Features:")?.1.split_whitespace().next()?.parse().ok()
}

/// Focal length of a line such as `Focal Length: 661.28px (Prior)`: COLMAP marks what it took
/// from EXIF (or was told).
fn exif_focal(line: &str) -> Option<f64> {
    let value = line.split_once("Focal Length:")?.1.strip_suffix("(Prior)")?;
    value.trim().strip_suffix("px")?.parse().ok()
}

/// Initial parameters that say the focal length: COLMAP then takes it for a prior.
fn camera_params(
    request: &Request<'_>,
    focal: f64,
    (width, height): (usize, usize),
) -> Result<String> {
    let name = &request.options.camera_model;
    let model = motes_scene::CameraModel::from_name(name).filter(|model| model.focal_count() > 0);
    let model = model.ok_or_else(|| {
        IngestError::usage(
            format!("{name} is not a camera model with a focal length"),
            "use SIMPLE_RADIAL (phones, cameras), OPENCV (wide lenses), OPENCV_FISHEYE or PINHOLE",
        )
    })?;
    let mut params = vec![focal; model.focal_count()];
    params.extend([0.5 * width as f64, 0.5 * height as f64]);
    params.resize(model.parameter_count(), 0.0);
    Ok(params.iter().map(f64::to_string).collect::<Vec<_>>().join(","))
}

fn match_pairs(
    command: &Path,
    request: &Request<'_>,
    workspace: &Workspace,
    exhaustive: bool,
    progress: &dyn Progress,
) -> Result<()> {
    let name = if exhaustive { "exhaustive_matcher" } else { "sequential_matcher" };
    let mut step = Step::new(command, name);
    step.set(&["database_path"], workspace.database.display());
    step.set(&["random_seed", "default_random_seed"], request.options.seed);
    step.set(&["SiftMatching.num_threads", "FeatureMatching.num_threads"], request.threads);
    step.set(&["SiftMatching.use_gpu", "FeatureMatching.use_gpu"], 0);
    if request.faint {
        step.set(&["SiftMatching.guided_matching", "FeatureMatching.guided_matching"], 1);
    }
    let mut total = 0;
    progress.begin("matching", 0);
    step.run(progress, &mut |line| {
        // "Matching block [1/3, 2/3]" or "Matching image [5/90]".
        if let Some((done, of)) = counters(line, "Matching ") {
            if of != total {
                total = of;
                progress.begin("matching", total);
            }
            progress.advance_to(done.saturating_sub(1));
        }
    })?;
    Ok(())
}

/// Done and total of `LABEL [1/3, 2/3]` (rows, columns) or `LABEL [5/90]`.
fn counters(line: &str, label: &str) -> Option<(usize, usize)> {
    let rest = &line[line.find(label)?..];
    let inside = rest.split_once('[')?.1.split_once(']')?.0;
    let mut pairs = inside.split(',').map(|part| {
        let (a, b) = part.trim().split_once('/')?;
        Some((a.trim().parse::<usize>().ok()?, b.trim().parse::<usize>().ok()?))
    });
    let (i, n) = pairs.next()??;
    match pairs.next() {
        Some(pair) => {
            let (j, m) = pair?;
            Some(((i.max(1) - 1) * m + j, n * m))
        }
        None => Some((i, n)),
    }
}

fn map(
    command: &Path,
    request: &Request<'_>,
    workspace: &Workspace,
    photos: usize,
    progress: &dyn Progress,
) -> Result<()> {
    let mut step = Step::new(command, "mapper");
    step.set(&["database_path"], workspace.database.display());
    step.set(&["image_path"], request.photos.display());
    step.set(&["output_path"], workspace.sparse.display());
    step.set(&["random_seed", "default_random_seed", "Mapper.random_seed"], request.options.seed);
    // Sums of several threads come in any order; one thread makes a run repeatable.
    step.set(&["Mapper.num_threads"], 1);
    step.set(&["Mapper.min_model_size"], (photos / 2).clamp(3, 10));
    progress.begin("mapping", photos);
    let mut placed = 0;
    let ended = step.run(progress, &mut |line| {
        if line.contains("Initializing with image pair") {
            placed = 2;
        } else if line.contains("Registering image #") {
            placed = (placed + 1).min(photos);
        }
        progress.advance_to(placed);
    });
    match ended {
        // The mapper ends with an error when it finds no model; the caller words that.
        Err(IngestError::Failed { cause, .. }) => {
            tracing::debug!("{cause}");
            Ok(())
        }
        other => other.map(|_| ()),
    }
}

fn describe(
    version: &str,
    request: &Request<'_>,
    models: Vec<PathBuf>,
    photos: usize,
) -> Result<Solution> {
    let best = read_model(&models[0])?;
    let uses = |id: u32| best.images.iter().filter(|image| image.camera_id == id).count();
    let main = best.cameras.iter().max_by_key(|(id, _)| uses(**id)).map(|(_, camera)| camera);
    let (focal, long_side) = main.map_or((0.0, 0.0), |camera| {
        (camera.affine().map_or(0.0, |a| a[0]), camera.width.max(camera.height) as f64)
    });
    let errors: Vec<f64> = best.points.iter().filter_map(|point| point.error).collect();
    let mean = (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64);
    let prior = request.focal_prior.pixels();
    Ok(Solution {
        registered: best.images.len(),
        photos,
        long_side,
        median_parallax_degrees: parallax(&best),
        models,
        report: SfmReport {
            tool: version.to_string(),
            focal_prior_px: prior,
            focal_prior_source: if prior.is_some() { "flag" } else { "none" }.into(),
            focal_px: focal,
            mean_reprojection_error_px: mean,
            verified_pairs: None,
            seconds: 0.0,
            attempts: Vec::new(),
        },
        ..Solution::default()
    })
}

fn parallax(model: &motes_formats::colmap::ColmapModel) -> Option<f64> {
    let centers: std::collections::HashMap<u32, glam::DVec3> =
        model.images.iter().map(|i| (i.id, i.camera_from_world.center_in_world())).collect();
    let angles = model.points.iter().filter_map(|point| {
        let rays: Vec<_> = point
            .track
            .iter()
            .filter_map(|id| (*centers.get(id)? - point.position).try_normalize())
            .collect();
        crate::geometry::widest_angle_degrees(&rays)
    });
    median(angles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_lines_are_read() {
        assert_eq!(counters("Matching block [2/3, 1/3] in 0.5s", "Matching "), Some((4, 9)));
        assert_eq!(counters("I2026 Matching image [5/90]", "Matching "), Some((5, 90)));
        assert_eq!(counters("Matching nonsense [a/b]", "Matching "), None);
        assert_eq!(counters("nothing", "Matching "), None);
        assert_eq!(exif_focal("  Focal Length:    661.28px (Prior)"), Some(661.28));
        assert_eq!(exif_focal("  Focal Length:    960.00px"), None);
        assert_eq!(keypoint_count("I2026   Features:        1234"), Some(1234.0));
        assert_eq!(keypoint_count("Features per photo: many"), None);
    }
}
