//! Whether the poses agree with the photos.
//!
//! Photos that look alike match by their keypoints, whatever the poses say. Matches whose neighbors
//! in the photo move along with them show the same surface: chance does not move neighbors alike.
//! Where the poses are right, nearly all of these lie on their epipolar lines; where photos and poses
//! were mixed up, a few percent do.

use glam::{DVec2, Vec2};
use motes_math::resample::{Filter, resize};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::keypoints::Keypoint;
use super::matching::free;
use super::neighbors::camera_spacing;
use super::view::{TwoViews, View};

/// Photos that are looked at, evenly chosen.
const PHOTOS: usize = 24;
/// Keypoints per photo.
const KEYPOINTS: usize = 700;
/// Distance from the epipolar line up to which a match agrees, as a share of the long side.
const TOLERANCE: f64 = 0.006;
/// Centers closer than this share of the spacing of the cameras are in one place.
const ONE_PLACE: f64 = 1e-3;
/// Matches that it takes to judge all poses, and those of one photo.
const NEEDED: usize = 40;
const NEEDED_PER_PHOTO: usize = 20;
/// Share of agreeing matches below which the poses are wrong: right ones have 0.9 and more, mixed-up
/// ones 0.02 to 0.1.
const WRONG_BELOW: f64 = 0.4;
/// Nearest other matches of a photo that are looked at, and how many must move along.
const NEIGHBORS: usize = 6;
const SUPPORT: usize = 3;
/// How far a neighbor may end from where the turn and the scale of a match take it, over its
/// distance; those of keypoints are known to about 10 degrees and 20 %.
const STRAY: f32 = 0.35;
/// Side of the reduced photos that are compared by looks.
const THUMBNAIL: usize = 16;

/// What matches say about the poses.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseCheck {
    /// Photos looked at.
    pub photos: usize,
    /// Matches between them.
    pub matches: usize,
    /// Matches on their epipolar lines.
    pub agreeing: usize,
    /// Photos looked at whose own matches contradict their pose.
    pub contradicting: Vec<String>,
}

impl PoseCheck {
    /// Share of the matches that agree with the poses; `None` when there are too few to tell.
    pub fn agreement(&self) -> Option<f64> {
        (self.matches >= NEEDED).then(|| self.agreeing as f64 / self.matches as f64)
    }

    /// Whether the poses as a whole are wrong.
    pub fn is_contradiction(&self) -> bool {
        self.agreement().is_some_and(|share| share < WRONG_BELOW)
    }
}

/// Matches photos with those that look most alike, and with those that the poses put next to them.
pub(super) fn check_poses(views: &[View], near: &[Vec<usize>], names: &[&str]) -> PoseCheck {
    let n = views.len();
    let take = n.min(PHOTOS);
    let looked: Vec<usize> = (0..take).map(|i| i * n / take.max(1)).collect();
    let thumbnails: Vec<Vec<f32>> = views.par_iter().map(thumbnail).collect();
    let mut pairs: Vec<(usize, usize)> = looked
        .iter()
        .flat_map(|&i| {
            let alike = most_alike(&thumbnails, i);
            alike.into_iter().chain(near[i].first().copied()).map(move |k| (i, k))
        })
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    let one_place = ONE_PLACE * camera_spacing(views);
    let counts: Vec<(usize, usize)> = pairs
        .par_iter()
        .with_max_len(1)
        .map(|&(a, b)| count(&views[a], &views[b], one_place))
        .collect();
    let mut check = PoseCheck { photos: take, ..PoseCheck::default() };
    let mut per_photo = vec![(0, 0); n];
    for (&(a, _), &(matches, agreeing)) in pairs.iter().zip(&counts) {
        check.matches += matches;
        check.agreeing += agreeing;
        per_photo[a].0 += matches;
        per_photo[a].1 += agreeing;
    }
    for &i in &looked {
        let (matches, agreeing) = per_photo[i];
        if matches >= NEEDED_PER_PHOTO && (agreeing as f64) < WRONG_BELOW * matches as f64 {
            check.contradicting.push(names[i].to_owned());
        }
    }
    check
}

/// Matches of two photos and how many agree with their poses.
fn count(a: &View, b: &View, one_place: f64) -> (usize, usize) {
    let geometry = TwoViews::new(a, b, one_place);
    let tolerance = TOLERANCE * a.camera.width.max(a.camera.height) as f64;
    let matches = supported(a, b, &free(a, b, KEYPOINTS));
    let agreeing = matches.iter().filter(|&&(i, j)| {
        let (p, q) = (&a.keypoints[i as usize], &b.keypoints[j as usize]);
        let pixel = |x: f32, y: f32| DVec2::new(f64::from(x), f64::from(y));
        geometry.distance(pixel(p.x, p.y), pixel(q.x, q.y)) <= tolerance
    });
    (matches.len(), agreeing.count())
}

/// The matches whose neighbors move along with them.
fn supported(a: &View, b: &View, matches: &[(u32, u32)]) -> Vec<(u32, u32)> {
    let place = |k: &Keypoint| Vec2::new(k.x, k.y);
    let ends: Vec<[Vec2; 2]> = matches
        .iter()
        .map(|&(i, j)| [place(&a.keypoints[i as usize]), place(&b.keypoints[j as usize])])
        .collect();
    let is_supported = |m: usize| {
        let (p, q) = (&a.keypoints[matches[m].0 as usize], &b.keypoints[matches[m].1 as usize]);
        let turn = Vec2::from_angle(q.angle - p.angle) * (q.scale / p.scale);
        let mut near: Vec<(f32, usize)> = (0..ends.len())
            .map(|k| (ends[k][0].distance(ends[m][0]), k))
            .filter(|(distance, _)| *distance > 2.0)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let along = near.iter().take(NEIGHBORS).filter(|&&(distance, k)| {
            let expected = turn.rotate(ends[k][0] - ends[m][0]);
            (ends[k][1] - ends[m][1]).distance(expected) < STRAY * distance
        });
        along.count() >= SUPPORT
    };
    (0..matches.len()).filter(|&m| is_supported(m)).map(|m| matches[m]).collect()
}

/// A small picture with zero mean and unit norm.
fn thumbnail(view: &View) -> Vec<f32> {
    let luma = &view.luma;
    let size = (luma.width, luma.height, 1);
    let mut small = resize(&luma.data, size, (THUMBNAIL, THUMBNAIL), Filter::Lanczos3);
    let mean = small.iter().sum::<f32>() / small.len() as f32;
    small.iter_mut().for_each(|v| *v -= mean);
    let norm = small.iter().map(|v| v * v).sum::<f32>().sqrt().max(1e-6);
    small.iter_mut().for_each(|v| *v /= norm);
    small
}

/// The two photos that look most like photo `i`.
fn most_alike(thumbnails: &[Vec<f32>], i: usize) -> Vec<usize> {
    let likeness =
        |k: usize| -> f32 { thumbnails[i].iter().zip(&thumbnails[k]).map(|(a, b)| a * b).sum() };
    let mut others: Vec<(f32, usize)> =
        (0..thumbnails.len()).filter(|&k| k != i).map(|k| (likeness(k), k)).collect();
    others.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    others.into_iter().take(2).map(|(_, k)| k).collect()
}
