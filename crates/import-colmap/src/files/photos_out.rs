//! Turning photos and masks into the images of the capture.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec2;
use motes_formats::FormatError;
use motes_formats::images::{read_image, read_image_upright, read_mask, write_png};
use motes_math::resample::Filter;
use motes_scene::{ImageU8, told_apart};
use rayon::prelude::*;

use crate::error::{IngestError, Result};
use crate::exposure_response::log_brightness;
use crate::gathered::Photo;
use crate::panorama;
use crate::plan::{Kind, Plan};
use crate::progress::Progress;
use crate::warp;

/// One photo to process.
pub(crate) struct Job<'a> {
    pub(crate) photo: &'a Photo,
    pub(crate) plan: &'a Plan,
    pub(crate) mask: Option<PathBuf>,
    /// Output names without folder and suffix, one per image (panoramas have several).
    pub(crate) stems: Vec<String>,
}

/// What became of it.
pub(crate) struct Done {
    /// Image files, relative to the capture, one per stem.
    pub(crate) images: Vec<PathBuf>,
    /// Mask files where some pixels are to be ignored.
    pub(crate) masks: Vec<Option<PathBuf>>,
    /// Point and log brightness around it, where the photo shows one.
    pub(crate) brightness: Vec<(usize, f64)>,
    /// Of the angles between these points and the optical axis.
    pub(crate) log_cosines: Vec<f64>,
}

/// A photo that was processed, or why it could not be.
pub(crate) enum Outcome {
    Done(Done),
    LeftOut(String),
}

/// What is wrong with a photo, when it is the photo.
///
/// # Errors
/// The same error, when it is something else: a disk that is full, a file that may not be read.
pub(crate) fn broken_photo(error: IngestError) -> Result<String> {
    match error {
        IngestError::Format(FormatError::Invalid { .. } | FormatError::NotSupported { .. })
        | IngestError::BadInput { .. } => {
            Ok(error.to_string().lines().next().unwrap_or_default().to_owned())
        }
        other => Err(other),
    }
}

/// Processes all photos in parallel; the results are in the order of the jobs.
pub(crate) fn run(
    jobs: &[Job<'_>],
    output: &Path,
    invert_masks: bool,
    progress: &dyn Progress,
) -> Result<Vec<Outcome>> {
    progress.begin("images", jobs.len());
    let finished = AtomicUsize::new(0);
    jobs.par_iter()
        .map(|job| {
            if progress.interrupted() {
                return Err(IngestError::Interrupted);
            }
            let done = match process(job, output, invert_masks) {
                Ok(done) => Outcome::Done(done),
                Err(error) => Outcome::LeftOut(broken_photo(error)?),
            };
            progress.advance_to(finished.fetch_add(1, Ordering::Relaxed) + 1);
            Ok(done)
        })
        .collect()
}

/// `name` without what a file name or a document cannot have: other systems' separators, control characters.
pub(crate) fn printable(name: &str) -> String {
    name.replace(|c: char| c.is_control() || c == '\\', "_")
}

/// File stems for images named `names`: the name without its suffix, or with it where two names
/// differ only there.
pub(crate) fn unique_stems(names: &[String]) -> Vec<String> {
    let stem = |name: &str| match name.rsplit_once('.') {
        Some((stem, suffix)) if !suffix.contains('/') && !stem.is_empty() => stem.to_string(),
        _ => name.to_string(),
    };
    // Letter case alone does not tell files apart on every disk.
    let mut used = HashSet::new();
    let mut twice = HashSet::new();
    for name in names {
        let key = stem(name).to_lowercase();
        if !used.insert(key.clone()) {
            twice.insert(key);
        }
    }
    let pick = |name: &String| {
        let short = stem(name);
        if twice.contains(&short.to_lowercase()) { name.clone() } else { short }
    };
    told_apart(names.iter().map(|name| printable(&pick(name))).collect())
}

fn process(job: &Job<'_>, output: &Path, invert_masks: bool) -> Result<Done> {
    let photo = job.photo;
    let mut image =
        if photo.upright { read_image_upright(&photo.path)? } else { read_image(&photo.path)? };
    let source = &job.plan.source;
    if (image.width, image.height) != (source.width, source.height) {
        return Err(IngestError::bad_input(
            format!(
                "the photo decodes to {} x {} pixels, its header says {} x {}: {}",
                image.width,
                image.height,
                source.width,
                source.height,
                photo.path.display()
            ),
            "the file is damaged: export it again",
        ));
    }
    drop_opaque_alpha(&mut image);
    let mut mask = match &job.mask {
        Some(path) => Some(mask_like(read_mask(path)?, &image, path)?),
        None => None,
    };
    if invert_masks && let Some(mask) = &mut mask {
        mask.data.iter_mut().for_each(|v| *v = 255 - *v);
    }
    let (brightness, log_cosines) = brightness_of(photo, &image).into_iter().unzip();
    let is_panorama = job.plan.kind == Kind::Panorama;
    if is_panorama {
        image = panorama::with_seam(&image);
        mask = mask.map(|mask| panorama::with_seam(&mask));
    }
    let mut done = Done { images: Vec::new(), masks: Vec::new(), brightness, log_cosines };
    for (crop, stem) in job.stems.iter().enumerate() {
        let (pixels, content) = apply(job.plan, crop, &image, Filter::Lanczos3);
        let mut out_mask = mask.as_ref().map(|mask| {
            let (mut mask, _) = apply(job.plan, crop, mask, Filter::Triangle);
            mask.data.iter_mut().for_each(|v| *v = if *v >= 128 { 255 } else { 0 });
            mask
        });
        if let Some(content) = content {
            let (width, height) = (pixels.width, pixels.height);
            let mask = out_mask.get_or_insert_with(|| ImageU8::filled(width, height, 1, 255));
            for (value, has_content) in mask.data.iter_mut().zip(content) {
                *value *= u8::from(has_content);
            }
        }
        let image_path = Path::new("images").join(format!("{stem}.png"));
        write_png(&output.join(&image_path), &pixels)?;
        done.images.push(image_path);
        // A mask that ignores nothing only costs time later.
        let out_mask = out_mask.filter(|mask| mask.data.contains(&0));
        done.masks.push(match out_mask {
            Some(mask) => {
                let path = Path::new("masks").join(format!("{stem}.png"));
                write_png(&output.join(&path), &mask)?;
                Some(path)
            }
            None => None,
        });
    }
    Ok(done)
}

/// Brightness around the points that a photo shows, and the log cosines of their angles to the optical axis; keypoints lie in the lens'
/// own pixel grid.
fn brightness_of(photo: &Photo, image: &ImageU8) -> Vec<((usize, f64), f64)> {
    let lens = photo.lens.camera(image.width, image.height);
    let scale = [
        image.width as f64 / lens.width.max(1) as f64,
        image.height as f64 / lens.height.max(1) as f64,
    ];
    let sample = |&([x, y], point): &([f64; 2], usize)| {
        let direction = lens.direction_from_pixel(DVec2::new(x, y))?;
        let log_cosine = (direction.z / direction.length()).max(f64::MIN_POSITIVE).ln();
        let brightness = log_brightness(image, [x * scale[0], y * scale[1]])?;
        Some(((point, brightness), log_cosine))
    };
    photo.observations.iter().filter_map(sample).collect()
}

/// Brings one image of the photo through the plan.
fn apply(
    plan: &Plan,
    crop: usize,
    image: &ImageU8,
    filter: Filter,
) -> (ImageU8, Option<Vec<bool>>) {
    let size = (plan.pinhole.width, plan.pinhole.height);
    match plan.kind {
        Kind::Copy => (image.clone(), None),
        Kind::Resize => (warp::resize(image, size.0, size.1, filter), None),
        Kind::Undistort => {
            warp::resample(image, size, filter, None, &|u, v| plan.source_pixel(crop, u, v))
        }
        Kind::Panorama => {
            let seam = panorama::SEAM.min(plan.source.width) as f64;
            let period = plan.source.width as f64;
            warp::resample(image, size, filter, Some(period), &|u, v| {
                plan.source_pixel(crop, u, v).map(|[x, y]| [x + seam, y])
            })
        }
    }
}

/// An alpha channel that is 255 everywhere says nothing.
fn drop_opaque_alpha(image: &mut ImageU8) {
    if image.channels == 4 && image.data.chunks_exact(4).all(|pixel| pixel[3] == 255) {
        let data = image.data.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        *image = ImageU8::from_data(image.width, image.height, 3, data);
    }
}

/// The mask at the size of its photo.
fn mask_like(mask: ImageU8, photo: &ImageU8, path: &Path) -> Result<ImageU8> {
    let (w, h) = (photo.width, photo.height);
    if (mask.width, mask.height) == (w, h) {
        return Ok(mask);
    }
    let scale = mask.width as f64 / w as f64;
    if (mask.height as f64 - scale * h as f64).abs() > 1.0 + scale {
        return Err(IngestError::bad_input(
            format!(
                "the mask has {} x {} pixels and its photo {w} x {h}: {}",
                mask.width,
                mask.height,
                path.display()
            ),
            "masks must show the whole photo, at any size",
        ));
    }
    Ok(warp::resize(&mask, w, h, Filter::Triangle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suffixes_stay_only_where_they_tell_files_apart() {
        let names = ["a/1.jpg", "a/1.png", "b/1.jpg", "x.y.jpg", "plain", "B/2.JPG", "b/2.jpg"];
        let names: Vec<String> = names.map(String::from).to_vec();
        let stems = unique_stems(&names);
        assert_eq!(stems, ["a/1.jpg", "a/1.png", "b/1", "x.y", "plain", "B/2.JPG", "b/2.jpg"]);
        let names = ["a\tb.jpg", "a\\b.jpg", "a_b.jpg"].map(String::from);
        assert_eq!(unique_stems(&names), ["a_b", "a_b_2", "a_b_3"]);
    }
}
