//! What an import measured.

use std::fmt;

use glam::DVec3;
use motes_math::median::median;
use motes_scene::{Capture, Split};
use serde::Serialize;

use crate::files::sfm::SfmReport;
use crate::files::video::VideoReport;
use crate::gathered::{Gathered, Photo};
use crate::geometry;

/// How images are made, as the report says it.
const RESAMPLING: &str = "Lanczos-3 on sRGB-encoded 8-bit values, widened by the downscale factor, undistortion and downscale in one pass";

/// Numbers and sentences about a finished import.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ImportReport {
    /// Where the poses come from.
    pub source: String,
    /// Photos that the source offers, posed or not.
    pub photos: usize,
    /// Photos with a pose and a file.
    pub registered: usize,
    /// Views of the capture (a panorama gives several).
    pub views: usize,
    /// Views to fit to.
    pub train_views: usize,
    /// Views held out.
    pub test_views: usize,
    /// Cameras of the capture, all pinhole.
    pub cameras: usize,
    /// Width and height of the largest image, pixels.
    pub image_size: [usize; 2],
    /// Start points written.
    pub points: usize,
    /// Mean reprojection error over all observations, pixels of the source photos.
    pub mean_reprojection_error_px: Option<f64>,
    /// Median over points of the widest triangulation angle, degrees.
    pub median_parallax_degrees: Option<f64>,
    /// Median number of points that a photo sees.
    pub median_points_per_photo: Option<f64>,
    /// Mean share of an 8 x 8 grid over a photo that holds a point.
    pub mean_grid_coverage: Option<f64>,
    /// What was subtracted from source positions.
    pub world_origin: [f64; 3],
    /// Lowest and highest camera center per axis, world units.
    pub camera_bounds: Option<[[f64; 3]; 2]>,
    /// Lowest and highest point per axis without the outermost 2 %, world units.
    pub point_bounds: Option<[[f64; 3]; 2]>,
    /// How poses were found, when this import found them.
    pub sfm: Option<SfmReport>,
    /// What was taken from a video, when this import read one.
    pub video: Option<VideoReport>,
    /// How pixels were made.
    pub resampling: String,
    /// Facts worth knowing.
    pub notes: Vec<String>,
    /// What may spoil the result, with remedies.
    pub warnings: Vec<String>,
}

impl fmt::Display for ImportReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "source: {}", self.source)?;
        if let Some(video) = &self.video {
            writeln!(
                f,
                "video: {} frames looked at, the picture moved by {:.1} image widths",
                video.frames_seen, video.image_motion_widths
            )?;
        }
        writeln!(f, "photos: {} of {} registered", self.registered, self.photos)?;
        let [width, height] = self.image_size;
        writeln!(
            f,
            "views: {} to train on, {} held out, {width} x {height} px, {} camera(s)",
            self.train_views, self.test_views, self.cameras
        )?;
        writeln!(f, "points: {}", self.points)?;
        if let Some(error) = self.mean_reprojection_error_px {
            writeln!(f, "mean reprojection error: {error:.3} px of the source photos")?;
        }
        if let Some(angle) = self.median_parallax_degrees {
            writeln!(f, "median parallax: {angle:.1} degrees")?;
        }
        if let (Some(points), Some(coverage)) =
            (self.median_points_per_photo, self.mean_grid_coverage)
        {
            writeln!(
                f,
                "coverage: {points:.0} points in the median photo, {:.0} % of its area",
                100.0 * coverage
            )?;
        }
        if self.world_origin != [0.0; 3] {
            let [x, y, z] = self.world_origin;
            writeln!(f, "world origin moved to: {x} {y} {z}")?;
        }
        self.notes.iter().try_for_each(|note| writeln!(f, "note: {note}"))
    }
}

/// The report of a capture that was made from `gathered`.
pub(crate) fn report(gathered: &Gathered, capture: &Capture) -> ImportReport {
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
        video: None,
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
