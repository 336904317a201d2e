//! What a prompt finds elsewhere than the thing that it points at.
//!
//! A thing is in one place. Masks of single views also catch what shows behind it, through gaps between leaves and beside its
//! outline, and views that do not show the thing join in: a pot across the garden has the color of a vase.

use glam::Vec3;
use motes_math::disjoint_sets::DisjointSets;
use motes_math::median::upper_median;
use motes_scene::{Gaussians, Selection};
use rayon::prelude::*;

use crate::neighbors::Cloud;

/// Neighbors of a Gaussian that may be of one piece with it,
const NEIGHBORS: usize = 8;
/// up to so many usual distances between neighbors, beside the sizes of both (two standard deviations).
const REACH: f32 = 8.0;
const SIGMAS: f32 = 2.0;
/// Distance from a thing, over the diagonal of its box, from which on a piece is elsewhere.
const ELSEWHERE: f32 = 1.0;

/// The selection without pieces that are far from its largest one and from those that hold one of the `clicked` points.
pub(crate) fn without_islands(
    gaussians: &Gaussians,
    selection: &Selection,
    clicked: &[Vec3],
) -> Selection {
    let cloud = Cloud::new(gaussians, |i| selection.contains(i));
    let piece = pieces(gaussians, &cloud);
    let mut counts = vec![0usize; piece.len()];
    piece.iter().for_each(|&p| counts[p] += 1);
    let Some(largest) = (0..counts.len()).max_by_key(|&p| (counts[p], std::cmp::Reverse(p))) else {
        return selection.clone();
    };
    let mut is_thing = vec![false; piece.len()];
    is_thing[largest] = true;
    for point in clicked {
        let nearest = cloud.nearest(point.to_array(), 1);
        nearest.iter().for_each(|&(k, _)| is_thing[piece[k]] = true);
    }
    let mut belongs = vec![false; gaussians.len()];
    cloud.rows.iter().zip(&piece).for_each(|(&row, &p)| belongs[row as usize] = is_thing[p]);
    let thing = Cloud::new(gaussians, |i| belongs[i]);
    let (low, high) = thing
        .points
        .iter()
        .map(|&p| Vec3::from(p))
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let far2 = (ELSEWHERE * low.distance(high)).powi(2);
    let mut is_near = is_thing;
    let near: Vec<bool> = cloud.points.par_iter().map(|&p| thing.nearest2(p) <= far2).collect();
    near.iter().zip(&piece).filter(|(near, _)| **near).for_each(|(_, &p)| is_near[p] = true);
    let mut out = selection.clone();
    for (&row, _) in cloud.rows.iter().zip(&piece).filter(|(_, p)| !is_near[**p]) {
        out.confidence[row as usize] = 0.0;
    }
    out
}

/// Per Gaussian of a cloud the first one of its piece: what is linked by neighbors within reach.
fn pieces(gaussians: &Gaussians, cloud: &Cloud) -> Vec<usize> {
    let links: Vec<Vec<(usize, f32)>> =
        cloud.points.par_iter().map(|&p| cloud.nearest(p, NEIGHBORS + 1)).collect();
    let mut usual: Vec<f32> = links.iter().filter_map(|l| l.last().map(|n| n.1.sqrt())).collect();
    let reach = REACH * upper_median(&mut usual, f32::total_cmp).unwrap_or(0.0);
    let size = |k: usize| {
        let log_scales = gaussians.log_scales[cloud.rows[k] as usize];
        SIGMAS * log_scales.into_iter().fold(f32::NEG_INFINITY, f32::max).exp()
    };
    let mut sets = DisjointSets::new(cloud.rows.len());
    for (k, links) in links.iter().enumerate() {
        for (other, _) in links.iter().filter(|l| l.1.sqrt() <= reach + size(k) + size(l.0)) {
            sets.join(k as u32, *other as u32);
        }
    }
    sets.labels().into_iter().map(|first| first as usize).collect()
}

#[cfg(test)]
mod tests;
