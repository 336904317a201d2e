//! Numbers that say how well the poses are tied down.

use glam::DVec3;
use motes_math::median::median;
use rayon::prelude::*;

use crate::gathered::{Gathered, Photo};

/// Cells per side of the grid on which coverage is counted.
const GRID: usize = 8;
/// Track entries looked at per point: the widest angle hardly changes past this many.
const TRACK_LIMIT: usize = 32;

/// Mean over points of the mean distance, in pixels, between where the photos saw the point and
/// where the cameras say it is: COLMAP's statistic, computed anew with our cameras. Pixels are
/// those of the source's model. Falls back to the source's own numbers when it has no keypoints;
/// `None` when it has neither.
pub(crate) fn mean_reprojection_error(gathered: &Gathered) -> Option<f64> {
    let per_photo: Vec<Vec<(usize, f64)>> =
        gathered.photos.par_iter().map(|photo| reprojection_errors(photo, gathered)).collect();
    let mut sums = vec![(0.0, 0u32); gathered.points.len()];
    for (point, error) in per_photo.into_iter().flatten() {
        sums[point].0 += error;
        sums[point].1 += 1;
    }
    let mut means: Vec<f64> =
        sums.iter().filter(|(_, n)| *n > 0).map(|(sum, n)| sum / f64::from(*n)).collect();
    if means.is_empty() {
        means = gathered.points.iter().filter_map(|point| point.error).collect();
    }
    (!means.is_empty()).then(|| means.iter().sum::<f64>() / means.len() as f64)
}

fn reprojection_errors(photo: &Photo, gathered: &Gathered) -> Vec<(usize, f64)> {
    let camera = photo.lens.camera(0, 0);
    if camera.width == 0 {
        return Vec::new();
    }
    let error = |(pixel, point): &([f64; 2], usize)| {
        let in_camera = photo.camera_from_world.transform_point(gathered.points[*point].position);
        let projected = camera.pixel_from_direction(in_camera)?;
        Some((*point, projected.distance(glam::DVec2::from_array(*pixel))))
    };
    photo.observations.iter().filter_map(error).collect()
}

/// Median over points of the widest angle, degrees, between two rays that see the point; `None`
/// without tracks.
pub(crate) fn median_parallax_degrees(gathered: &Gathered) -> Option<f64> {
    let centers: Vec<DVec3> =
        gathered.photos.iter().map(|photo| photo.camera_from_world.center_in_world()).collect();
    let angle = |point: &crate::gathered::Point| {
        let rays: Vec<DVec3> = point
            .track
            .iter()
            .take(TRACK_LIMIT)
            .filter_map(|&photo| (centers[photo] - point.position).try_normalize())
            .collect();
        let pairs =
            rays.iter().enumerate().flat_map(|(i, a)| rays[i + 1..].iter().map(move |b| a.dot(*b)));
        pairs.reduce(f64::min).map(|cosine| cosine.clamp(-1.0, 1.0).acos().to_degrees())
    };
    let angles: Vec<f64> = gathered.points.par_iter().filter_map(angle).collect();
    median(angles)
}

/// The widest angle between two of some unit vectors, degrees; `None` for fewer than two.
pub(crate) fn widest_angle_degrees(rays: &[DVec3]) -> Option<f64> {
    let pairs = rays.iter().enumerate().flat_map(|(i, a)| rays[i + 1..].iter().map(|b| a.dot(*b)));
    pairs.reduce(f64::min).map(|cosine| cosine.clamp(-1.0, 1.0).acos().to_degrees())
}

/// Share of the cells of an 8 x 8 grid over a photo that hold a keypoint with a 3D point.
pub(crate) fn grid_coverage(photo: &Photo) -> f64 {
    let camera = photo.lens.camera(0, 0);
    let cell = |value: f64, size: usize| {
        let cell = value / size.max(1) as f64 * GRID as f64;
        (cell.max(0.0) as usize).min(GRID - 1)
    };
    let mut seen = [false; GRID * GRID];
    for (pixel, _) in &photo.observations {
        seen[cell(pixel[1], camera.height) * GRID + cell(pixel[0], camera.width)] = true;
    }
    seen.iter().filter(|&&s| s).count() as f64 / (GRID * GRID) as f64
}

/// Lowest and highest coordinate of points per axis, without the outermost 2 % on each side.
pub(crate) fn robust_bounds(points: impl Iterator<Item = DVec3>) -> Option<[[f64; 3]; 2]> {
    let points: Vec<DVec3> = points.collect();
    if points.is_empty() {
        return None;
    }
    let cut = points.len() / 50;
    let mut bounds = [[0.0; 3]; 2];
    for axis in 0..3 {
        let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        values.sort_by(f64::total_cmp);
        bounds[0][axis] = values[cut];
        bounds[1][axis] = values[values.len() - 1 - cut];
    }
    Some(bounds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gathered::{Lens, Point};
    use motes_scene::{Camera, Pinhole, Pose};

    fn photo(eye: DVec3, observations: Vec<([f64; 2], usize)>) -> Photo {
        let pinhole = Pinhole { fx: 100.0, fy: 100.0, cx: 50.0, cy: 40.0, width: 100, height: 80 };
        Photo {
            name: "a".into(),
            path: "a".into(),
            mask: None,
            lens: Lens::Camera(Camera::from_pinhole(pinhole)),
            camera_from_world: Pose::look_at(eye, DVec3::ZERO, DVec3::Z).unwrap(),
            split: None,
            upright: false,
            observations,
        }
    }

    fn two_photos() -> Gathered {
        let point =
            Point { position: DVec3::ZERO, color: [0; 3], error: Some(9.0), track: vec![0, 1] };
        Gathered {
            photos: vec![
                photo(DVec3::new(2.0, 0.0, 0.0), vec![([50.0, 43.0], 0)]),
                photo(DVec3::new(0.0, 2.0, 0.0), vec![([51.0, 40.0], 0)]),
            ],
            points: vec![point],
            ..Gathered::default()
        }
    }

    #[test]
    fn errors_and_angles_of_a_known_scene() {
        let mut gathered = two_photos();
        assert!((mean_reprojection_error(&gathered).unwrap() - 2.0).abs() < 1e-9);
        assert!((median_parallax_degrees(&gathered).unwrap() - 90.0).abs() < 1e-9);
        assert_eq!(grid_coverage(&gathered.photos[0]), 1.0 / 64.0);
        gathered.photos.iter_mut().for_each(|photo| photo.observations.clear());
        assert_eq!(
            mean_reprojection_error(&gathered),
            Some(9.0),
            "falls back to the file's errors"
        );
    }

    #[test]
    fn bounds_leave_the_outermost_out() {
        let line = (0..100).map(|i| DVec3::new(i as f64, 0.0, -(i as f64)));
        assert_eq!(robust_bounds(line), Some([[2.0, 0.0, -97.0], [97.0, 0.0, -2.0]]));
    }
}
