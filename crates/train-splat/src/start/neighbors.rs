//! Which photos may show the same surface, from poses alone.

use glam::DVec3;
use motes_math::median::median;
use motes_scene::Pose;
use rayon::prelude::*;

use super::view::View;

/// Angle between two lines of sight that a match gains most from, radians: less and the depth is
/// uncertain, more and the surface looks different.
const BEST_ANGLE: f64 = 0.17;
/// Cameras nearer than this are in one place; the cameras of a capture span about 1.
const ONE_PLACE: f64 = 1e-6;
/// Pixels per side of a photo whose rays are looked along.
const RAYS: usize = 5;
/// Distances along each ray, in distances to the nearest cameras.
const DISTANCES: [f64; 9] = [2.0, 3.5, 6.0, 10.0, 17.0, 30.0, 50.0, 90.0, 160.0];

/// For every photo the up to `most` others that see most of the places it may show, under useful
/// angles.
///
/// How far away things are is not known: places are taken at all distances between twice and 160
/// times the distance to the nearest cameras, and at the point that all cameras look at.
pub(super) fn neighbors(views: &[View], most: usize) -> Vec<Vec<usize>> {
    let spacing = camera_spacing(views);
    let poses: Vec<Pose> = views.iter().map(|view| view.camera_from_world).collect();
    let focus = motes_scene::camera_path::common_point(&poses).ok();
    let near = |i: usize| {
        let places = places(&views[i], spacing, focus);
        let mut scores: Vec<(f64, usize)> = (0..views.len())
            .filter(|&k| k != i)
            .map(|k| (score(&views[i], &views[k], &places), k))
            .filter(|(score, _)| *score > 0.0)
            .collect();
        scores.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        scores.truncate(most);
        scores.into_iter().map(|(_, k)| k).collect()
    };
    (0..views.len()).into_par_iter().map(near).collect()
}

/// Whether no two cameras are apart.
pub(super) fn in_one_place(views: &[View]) -> bool {
    let first = views.first().map_or(DVec3::ZERO, |view| view.center);
    views.iter().all(|view| view.center.distance(first) <= ONE_PLACE)
}

/// Median distance of a camera to the nearest others; 1 when all are in one place.
pub(super) fn camera_spacing(views: &[View]) -> f64 {
    let nearest = |i: usize| {
        let mut distances: Vec<f64> = (0..views.len())
            .filter(|&k| k != i)
            .map(|k| views[i].center.distance(views[k].center))
            .filter(|d| *d > 0.0)
            .collect();
        distances.sort_by(f64::total_cmp);
        // The third nearest: photos come in bursts.
        distances.get(2.min(distances.len().saturating_sub(1))).copied()
    };
    median((0..views.len()).filter_map(nearest)).filter(|d| *d > 0.0).unwrap_or(1.0)
}

fn places(view: &View, spacing: f64, focus: Option<DVec3>) -> Vec<DVec3> {
    let (w, h) = (view.camera.width as f64, view.camera.height as f64);
    let step = |i: usize| (i as f64 + 0.5) / RAYS as f64;
    let to_focus = focus.map(|f| view.camera_from_world.transform_point(f).z).filter(|z| *z > 0.0);
    let mut places = Vec::new();
    for i in 0..RAYS * RAYS {
        let ray = view.ray(w * step(i % RAYS), h * step(i / RAYS));
        // What most cameras look at counts as much as all other distances.
        let known =
            to_focus.iter().flat_map(|z| [0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3].map(|f| f * z));
        places.extend(
            DISTANCES.iter().map(|d| d * spacing).chain(known).map(|z| view.center + ray * z),
        );
    }
    places
}

fn score(view: &View, other: &View, places: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    for &place in places {
        let Some((_, depth)) = other.project(place) else { continue };
        let here = place - view.center;
        let angle = here.angle_between(place - other.center);
        let by_angle = (-(angle / BEST_ANGLE).max(1e-3).ln().powi(2)).exp();
        // Patches of very different size do not compare.
        let ratio = view.camera_from_world.transform_point(place).z / depth;
        sum += by_angle * (-(ratio.ln() / 0.5).powi(2)).exp();
    }
    sum
}
