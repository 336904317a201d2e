//! The first Gaussians of a fit: from the capture's points, or from what the posed photos show.
//!
//! A capture without points is looked at by itself, in this order:
//! 1. Keypoints that match over three photos are triangulated with the known poses
//!    ([`triangulation`]), and a search around their depths adds points between them ([`crate::dense`]).
//! 2. Where photos show an object on nothing, the surface of its visual hull ([`hull`]) fills what
//!    has no keypoints.
//! 3. Cameras in one place see no depth: the photos are laid on a sphere ([`sphere`]).
//! 4. With none of these, thin random Gaussians fill the space that the cameras look at.

mod fill;
mod hull;
mod keypoints;
mod matching;
mod neighbors;
pub(crate) mod options;
mod pose_check;
mod scale_space;
mod sphere;
mod triangulation;
mod view;

use motes_scene::{Gaussians, SparsePoints};
use rayon::prelude::*;

pub use self::options::StartFrom;
pub use self::pose_check::PoseCheck;
use self::view::View;
use crate::init;
use crate::options::FitOptions;
use crate::plan::Plan;
use crate::target::TrainingImage;

/// Photos are matched at this long side, pixels.
const LONG_SIDE: usize = 800;
/// Keypoints per photo.
const KEYPOINTS: usize = 2500;
/// Fewer found points than this say nothing about the scene.
const FEWEST_POINTS: usize = 100;
/// Pixels that the dense search looks at per point that is wanted.
const SEARCHED_PER_POINT: usize = 8;
/// Finest spacing of the dense search, pixels at a long side of 512.
const FINEST_STEP: usize = 3;
/// Points of a capture are searched around, too, when there are fewer than so many per photo, and fewer than one in
/// [`FEW_OF_WANTED`] of those wanted (docs/benchmarks/2026-11-26-few-points.md).
const FEW_PER_PHOTO: usize = 400;
const FEW_OF_WANTED: usize = 2;
/// Share of the largest number of Gaussians that points of the hull or the sphere may take.
const FILL_SHARE: f64 = 0.35;

impl StartFrom {
    /// The value of the flag.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Points => "points",
            Self::Photos => "photos",
            Self::Random => "random",
        }
    }

    /// What to begin with, with so many points in the capture.
    pub fn first(self, points: usize) -> Self {
        match self {
            Self::Auto if points > 0 => Self::Points,
            Self::Auto => Self::Photos,
            chosen => chosen,
        }
    }

    /// What to begin with after fits that began with `failed` came to nothing.
    pub(crate) fn following(self, failed: &[Self], points: usize) -> Self {
        match failed.last() {
            Some(&last) => self.after(last).unwrap_or(last),
            None => self.first(points),
        }
    }

    /// What to try when a fit that began with `failed` came to nothing; `self` is what was asked for.
    pub fn after(self, failed: Self) -> Option<Self> {
        match (self, failed) {
            (Self::Auto, Self::Points) => Some(Self::Photos),
            (Self::Auto, Self::Photos) => Some(Self::Random),
            _ => None,
        }
    }
}

/// What a fit starts with, and what was learned on the way.
pub(crate) struct Start {
    pub(crate) gaussians: Gaussians,
    /// The points behind them: they bound the scene.
    pub(crate) points: SparsePoints,
    /// One sentence with the numbers.
    pub(crate) reason: String,
    /// Whether the poses agree with the photos, where it was looked at.
    pub(crate) poses: Option<PoseCheck>,
}

impl Start {
    /// A model that is there already.
    pub(crate) fn given(gaussians: Gaussians, points: &SparsePoints) -> Self {
        let gaussians = init::usable(gaussians);
        let reason = format!("{} Gaussians of a given model", gaussians.len());
        Self { gaussians, points: points.clone(), reason, poses: None }
    }
}

/// The first Gaussians; `from` is not `Auto`.
pub(crate) fn first_gaussians(
    images: &[TrainingImage],
    points: &SparsePoints,
    from: StartFrom,
    plan: &Plan,
    options: &FitOptions,
    seed: u64,
) -> Start {
    let extent = |points: &SparsePoints| {
        let poses = images.iter().map(|image| &image.camera_from_world);
        init::scene_extent(poses, &points.positions)
    };
    let wanted = (options.dense_share * plan.max_gaussians as f64) as usize;
    match from {
        StartFrom::Points if !points.is_empty() => {
            let few = points.len() < FEW_PER_PHOTO * images.len()
                && FEW_OF_WANTED * points.len() < wanted;
            let step = match options.dense_step {
                None if few => dense_step(images, wanted - points.len(), options),
                _ => plan.dense_step,
            };
            let mut all = init::with_dense_points(images, points, step, wanted);
            let mut reason = format!(
                "{} points of the capture{}",
                points.len(),
                matched(all.len() - points.len())
            );
            let most = (FILL_SHARE * plan.max_gaussians as f64) as usize;
            reason += &fill_from_hull(&mut all, images, most, options);
            let gaussians = init::from_points(&all, extent(points), options);
            Start { gaussians, points: points.clone(), reason, poses: None }
        }
        StartFrom::Photos => {
            let found = find_points(images, plan, options);
            let scene_extent = extent(&found.points);
            if found.points.len() < FEWEST_POINTS {
                let random = init::random(images, seed, scene_extent, options);
                let reason = format!(
                    "{}: too few; {} random Gaussians in the space that the cameras look at",
                    found.reason,
                    random.len()
                );
                let points = SparsePoints::default();
                return Start { gaussians: random, points, reason, poses: Some(found.poses) };
            }
            let gaussians = init::from_points(&found.points, scene_extent, options);
            let Found { points, reason, poses } = found;
            Start { gaussians, points, reason, poses: Some(poses) }
        }
        _ => {
            let points = SparsePoints::default();
            let gaussians = init::random(images, seed, extent(&points), options);
            let reason = format!(
                "{} random Gaussians in the space that the cameras look at",
                gaussians.len()
            );
            Start { gaussians, points, reason, poses: None }
        }
    }
}

/// Whether the poses agree with the photos.
pub(crate) fn check_poses(images: &[TrainingImage], options: &FitOptions) -> PoseCheck {
    let views = views(images, options);
    let near = neighbors::neighbors(&views, 1);
    pose_check::check_poses(&views, &near, &names(images))
}

fn names(images: &[TrainingImage]) -> Vec<&str> {
    images.iter().map(|image| image.name.as_str()).collect()
}

fn views(images: &[TrainingImage], options: &FitOptions) -> Vec<View> {
    images
        .par_iter()
        .with_max_len(1)
        .map(|image| View::new(image, LONG_SIDE, KEYPOINTS, options.alpha_mode))
        .collect()
}

fn matched(count: usize) -> String {
    if count > 0 { format!(", {count} matched between photos") } else { String::new() }
}

/// Points that the posed photos say by themselves.
struct Found {
    points: SparsePoints,
    reason: String,
    poses: PoseCheck,
}

fn find_points(images: &[TrainingImage], plan: &Plan, options: &FitOptions) -> Found {
    let views = views(images, options);
    let near = neighbors::neighbors(&views, triangulation::NEIGHBORS);
    let poses = pose_check::check_poses(&views, &near, &names(images));
    let fill = (FILL_SHARE * plan.max_gaussians as f64) as usize;
    if neighbors::in_one_place(&views) {
        let points = sphere::sphere_points(&views, fill);
        let reason = format!("all cameras stand in one place: {} points on a sphere", points.len());
        return Found { points, reason, poses };
    }
    let triangulated = triangulation::triangulate(&views, &near);
    drop(views);
    let wanted = (options.dense_share * plan.max_gaussians as f64) as usize;
    let step = dense_step(images, wanted.saturating_sub(triangulated.len()), options);
    let mut points = init::with_dense_points(images, &triangulated, step, wanted);
    let dense = points.len() - triangulated.len();
    let mut reason = format!(
        "{} points triangulated from keypoints of the photos{}",
        triangulated.len(),
        matched(dense)
    );
    reason += &fill_from_hull(&mut points, images, fill, options);
    Found { points, reason, poses }
}

/// Adds up to `most` points of the visual hull where there are none; the words for it.
fn fill_from_hull(
    points: &mut SparsePoints,
    images: &[TrainingImage],
    most: usize,
    options: &FitOptions,
) -> String {
    let hull = hull::hull_points(images, options.alpha_mode);
    match fill::fill(points, &hull.points, hull.cell, most) {
        0 => String::new(),
        added => format!(", {added} on the visual hull of the silhouettes"),
    }
}

/// The spacing at which the dense search looks at a few pixels per point that is wanted.
fn dense_step(images: &[TrainingImage], wanted: usize, options: &FitOptions) -> usize {
    if let Some(step) = options.dense_step {
        return step;
    }
    if wanted == 0 {
        return 0;
    }
    let area = |image: &TrainingImage| {
        let (w, h) = (image.camera.width as f64, image.camera.height as f64);
        w * h * (512.0 / w.max(h)).min(1.0).powi(2)
    };
    let pixels: f64 = images.iter().map(area).sum();
    let step = (pixels / (SEARCHED_PER_POINT * wanted) as f64).sqrt().round() as usize;
    step.max(FINEST_STEP)
}
