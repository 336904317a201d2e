//! The plane that pieces of all photos together tell.
//!
//! What explains most is flat about its maximum: the plane of a wall comes out turned by several degrees, although its place in the
//! middle is right. Most of what is built is a Manhattan world (Coughlan & Yuille 1999; stereo by Furukawa et al. 2009), so a plane
//! that is nearly at right angles to another is put at right angles, where the photos have next to nothing against it.

use glam::Vec3;

use super::sweep::descend;
use super::vote::{Vote, spaced};
use super::{HELD, Region};
use crate::steps::surface::planes::{Plane, least_squares};

/// Pieces that may come to show a plane when it moves leave at most this share of what their depth leaves.
pub(super) const NEARLY: f32 = 1.2;
/// Pieces that a plane is fitted to at most.
const MOST_PIECES: usize = 256;
/// Rounds of the fit, steps of a round, scale of the first and what the next ones have of it.
const FITS: u64 = 3;
const FIT_STEPS: u64 = 100;
const FIRST: f32 = 0.1;
const NARROWER: f32 = 0.4;
/// Fits to the depth of the pieces, one after the other, and share of the distance from the camera within which depth lies near a plane.
const DEPTH_FITS: usize = 10;
const NEAR_DEPTH: f32 = 0.015;
/// Cosine of the angle from which a plane is nearly at right angles to another (80 degrees), and share of what it explains that it may
/// lose for a right angle.
const SKEW: f32 = 0.17;
const MOST_LOSS: f32 = 0.15;

/// The plane near one that explains most.
pub(super) fn fitted(vote: &Vote<'_>, mut plane: Plane, key: u64) -> Plane {
    let mut scale = FIRST;
    for round in 0..FITS {
        let among = nearly_showing(vote, &plane);
        plane = improved(vote, plane, &among, [key, 1 + round], scale, &[]);
        scale *= NARROWER;
    }
    plane
}

/// The plane near one that the depth of the pieces lies on, where a good part of it does and it explains as much: what explains most
/// is flat about its maximum, and Gaussians have the right depth where they are on some texture.
pub(super) fn on_depth(vote: &Vote<'_>, plane: Plane) -> Plane {
    let among = nearly_showing(vote, &plane);
    let regions = || among.iter().map(|&i| &vote.pieces[i].region);
    let held = |plane: &Plane| -> Vec<Vec3> {
        let of = |region: &Region| {
            let near = NEAR_DEPTH * plane.height(vote.photos.views[region.view].center);
            let places = region.samples.iter().map(|s| s.at);
            places.filter(|at| plane.height(*at).abs() <= near).collect::<Vec<_>>()
        };
        regions().flat_map(of).collect()
    };
    let mut by_depth = plane;
    for _ in 0..DEPTH_FITS {
        by_depth = least_squares(&held(&by_depth), by_depth).unwrap_or(by_depth);
    }
    let samples: usize = regions().map(|r| r.samples.len()).sum();
    let is_held = held(&by_depth).len() as f32 >= HELD * samples as f32;
    // Either may be shown by other pieces than it starts with.
    let all: Vec<usize> = (0..vote.pieces.len()).collect();
    if is_held && vote.gain(&all, &by_depth) >= vote.gain(&all, &plane) { by_depth } else { plane }
}

/// The plane near one at right angles to up to two of `others`, where it is nearly so and that explains about as much.
pub(super) fn at_right_angles(
    vote: &Vote<'_>,
    mut plane: Plane,
    others: &[Plane],
    key: u64,
) -> Plane {
    let among = nearly_showing(vote, &plane);
    let least = (1.0 - MOST_LOSS) * vote.gain(&among, &plane);
    let mut left: Vec<Vec3> = others.iter().map(|other| other.normal).collect();
    let mut fixed: Vec<Vec3> = Vec::new();
    while fixed.len() < 2 {
        // Of two tables, one is enough.
        let is_square = |other: &Vec3, normal: &Vec3| normal.dot(*other).abs() <= SKEW;
        left.retain(|other| fixed.iter().chain([&plane.normal]).all(|n| is_square(other, n)));
        let skew = |normal: &Vec3| plane.normal.dot(*normal).abs();
        left.sort_by(|a, b| skew(b).total_cmp(&skew(a)));
        let Some(other) = left.pop() else { break };
        fixed.push(other);
        let round = 1 + FITS + left.len() as u64;
        let square = improved(vote, plane, &among, [key, round], FIRST * NARROWER, &fixed);
        if vote.gain(&among, &square) >= least {
            plane = square;
        } else {
            fixed.pop();
        }
    }
    plane
}

/// Pieces that may come to show a plane when it moves.
fn nearly_showing(vote: &Vote<'_>, plane: &Plane) -> Vec<usize> {
    spaced(vote.showing(plane, NEARLY), MOST_PIECES)
}

/// The plane near one, at right angles to the directions `fixed`, that explains most of some pieces.
fn improved(
    vote: &Vote<'_>,
    plane: Plane,
    among: &[usize],
    key: [u64; 2],
    scale: f32,
    fixed: &[Vec3],
) -> Plane {
    let regions = || among.iter().map(|&i| &vote.pieces[i].region);
    let places = regions().flat_map(|r| vote.photos.on_plane(r, &plane));
    let (sum, count) =
        places.fold((Vec3::ZERO, 0.0), |(sum, count), (_, at)| (sum + at, count + 1.0));
    if count == 0.0 {
        return plane;
    }
    let middle = sum / count;
    let heights = regions().map(|r| plane.height(vote.photos.views[r.view].center));
    let half = 0.5 * heights.sum::<f32>() / among.len() as f32;
    // Turned about the middle of what shows it, and moved.
    let step = |p: Plane, scale: f32, [a, b, c, d]: [f32; 4]| {
        let normal = square(p.normal + scale * Vec3::new(a, b, c), fixed);
        let offset = normal.dot(middle) - p.height(middle) + scale * d * half;
        Plane { normal, offset }
    };
    let cost = |p: Plane| -vote.gain(among, &p);
    descend(step(plane, 0.0, [0.0; 4]), key, FIT_STEPS, scale, cost, step).1
}

/// The direction nearest to one at right angles to those of `fixed`, two at most.
fn square(direction: Vec3, fixed: &[Vec3]) -> Vec3 {
    let square = match *fixed {
        [a, b] => a.cross(b) * a.cross(b).dot(direction).signum(),
        [a] => direction - a * a.dot(direction),
        _ => direction,
    };
    square.normalize()
}

#[cfg(test)]
mod tests;
