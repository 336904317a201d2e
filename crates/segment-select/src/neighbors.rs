//! Neighbors in space: what is connected, what is near, and what no view decides.

use motes_math::median::upper_median;
use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use motes_scene::{Gaussians, Selection};
use rayon::prelude::*;

use crate::color::difference;
use crate::error::SelectError;
use crate::max_flow::MaxFlow;
use crate::property::base_lab;

/// Centers that can be searched, and where they come from.
pub(crate) struct Cloud {
    pub(crate) rows: Vec<u32>,
    pub(crate) points: Vec<[f32; 3]>,
    tree: Option<ImmutableKdTree<f32, 3>>,
}

impl Cloud {
    pub(crate) fn new(gaussians: &Gaussians, of: impl Fn(usize) -> bool) -> Self {
        let finite = |i: &usize| gaussians.means[*i].iter().all(|v| v.is_finite());
        let rows: Vec<u32> =
            (0..gaussians.len()).filter(finite).filter(|&i| of(i)).map(|i| i as u32).collect();
        let points: Vec<[f32; 3]> = rows.iter().map(|&i| gaussians.means[i as usize]).collect();
        let tree = ImmutableKdTree::new_from_slice(&points).ok();
        Self { rows, points, tree }
    }

    /// Squared distance to the nearest one; infinite where there is none.
    pub(crate) fn nearest2(&self, point: [f32; 3]) -> f32 {
        let Some(tree) = &self.tree else { return f32::INFINITY };
        if !point.iter().all(|v| v.is_finite()) {
            return f32::INFINITY;
        }
        let found =
            tree.query(&point).nearest_n::<SquaredEuclidean<f32>>(NonZero::<usize>::MIN).execute();
        found.first().map_or(f32::INFINITY, |n| n.distance)
    }

    /// The `count` nearest, as positions in `rows` with squared distances.
    pub(crate) fn nearest(&self, point: [f32; 3], count: usize) -> Vec<(usize, f32)> {
        let (Some(tree), Some(count)) = (&self.tree, NonZero::new(count)) else {
            return Vec::new();
        };
        let found = tree.query(&point).nearest_n::<SquaredEuclidean<f32>>(count).execute();
        found.iter().map(|n| (n.item as usize, n.distance)).collect()
    }
}

/// Adds what is within a distance of the selection.
pub(crate) fn grown(gaussians: &Gaussians, selection: &Selection, distance: f64) -> Selection {
    let cloud = Cloud::new(gaussians, |i| selection.contains(i));
    let limit = (distance * distance) as f32;
    let confidence = (0..gaussians.len())
        .into_par_iter()
        .map(|i| match selection.contains(i) {
            true => selection.confidence[i],
            false if cloud.nearest2(gaussians.means[i]) <= limit => 1.0,
            false => selection.confidence[i],
        })
        .collect();
    Selection { confidence }
}

/// Takes away what is within a distance of the rest.
pub(crate) fn shrunk(gaussians: &Gaussians, selection: &Selection, distance: f64) -> Selection {
    grown(gaussians, &selection.inverted(), distance).inverted()
}

/// Everything that is connected to the Gaussian nearest to a seed.
pub(crate) fn connected(
    gaussians: &Gaussians,
    seed: [f64; 3],
    distance: Option<f64>,
    tolerance: Option<f64>,
) -> Result<Selection, SelectError> {
    /// Neighbors that are looked at: enough to leave a dense clump.
    const NEIGHBORS: usize = 24;
    let cloud = Cloud::new(gaussians, |_| true);
    let Some(&(start, _)) = cloud.nearest(seed.map(|v| v as f32), 1).first() else {
        return Err(SelectError::BadValue("there are no Gaussians to be connected".into()));
    };
    let limit2 = match distance {
        Some(d) => (d * d) as f32,
        None => {
            let mut usual = motes_math::knn::rms_neighbor_distance(&cloud.points, 3);
            (3.0 * upper_median(&mut usual, f32::total_cmp).unwrap_or(0.0)).powi(2)
        }
    };
    let lab: Vec<[f32; 3]> = match tolerance {
        Some(_) => cloud.rows.iter().map(|&i| base_lab(gaussians, i as usize)).collect(),
        None => Vec::new(),
    };
    let alike =
        |a: usize, b: usize| tolerance.is_none_or(|t| f64::from(difference(lab[a], lab[b])) <= t);
    let mut inside = vec![false; cloud.rows.len()];
    let mut front = vec![start];
    inside[start] = true;
    while !front.is_empty() {
        // Found together, entered in order: the same at any number of threads.
        let found: Vec<Vec<(usize, f32)>> =
            front.par_iter().map(|&k| cloud.nearest(cloud.points[k], NEIGHBORS)).collect();
        let mut next = Vec::new();
        for (&k, found) in front.iter().zip(found) {
            for (j, d2) in found {
                if d2 <= limit2 && !inside[j] && alike(k, j) {
                    inside[j] = true;
                    next.push(j);
                }
            }
        }
        front = next;
    }
    let mut selection = Selection::none(gaussians.len());
    for (k, _) in inside.iter().enumerate().filter(|(_, inside)| **inside) {
        selection.confidence[cloud.rows[k] as usize] = 1.0;
    }
    Ok(selection)
}

/// Contribution in pixels from which the views decide alone.
const DECIDED_PX: f32 = 4.0;
/// Neighbors of the cut.
const NEIGHBORS: usize = 6;
/// Weight of a neighbor at the usual distance, against a Gaussian that the views decide.
const SMOOTHNESS: f32 = 0.15;

/// Decides what no view shows clearly as its neighbors are: a minimum cut on the graph of nearest
/// neighbors around the selection. `seen` is the contribution of each Gaussian, pixels.
pub(crate) fn settled(gaussians: &Gaussians, selection: &Selection, seen: &[f32]) -> Selection {
    const UNIT: f32 = 1000.0;
    let Some((low, high)) = bounds_of(gaussians, selection) else {
        return selection.clone();
    };
    let near = |i: usize| (0..3).all(|k| (low[k]..=high[k]).contains(&gaussians.means[i][k]));
    let cloud = Cloud::new(gaussians, near);
    let links: Vec<Vec<(usize, f32)>> =
        cloud.points.par_iter().map(|&p| cloud.nearest(p, NEIGHBORS + 1)).collect();
    let mut usual: Vec<f32> = links.iter().filter_map(|l| l.last().map(|n| n.1.sqrt())).collect();
    usual.sort_by(f32::total_cmp);
    let usual = usual.get(usual.len() / 2).copied().unwrap_or(1.0).max(1e-12);
    let mut graph = MaxFlow::new(cloud.rows.len());
    for (k, &row) in cloud.rows.iter().enumerate() {
        let c = selection.confidence[row as usize].clamp(0.02, 0.98);
        let certainty = (seen[row as usize] / DECIDED_PX).clamp(0.0, 1.0);
        let logit = ((c / (1.0 - c)).ln() * certainty * UNIT) as i64;
        graph.add_terminal(k, logit.max(0), (-logit).max(0));
        for &(j, d2) in links[k].iter().filter(|&&(j, _)| j != k) {
            let weight = SMOOTHNESS * (-(d2.sqrt() / (2.0 * usual)).powi(2)).exp();
            // Once from each side: mutual neighbors hold twice.
            graph.add_edge(k, j, (weight * UNIT) as i64, (weight * UNIT) as i64);
        }
    }
    graph.solve();
    let mut out = selection.clone();
    for (k, &row) in cloud.rows.iter().enumerate() {
        let c = &mut out.confidence[row as usize];
        let inside = graph.is_source_side(k);
        if inside != (*c >= Selection::THRESHOLD) {
            *c = if inside { Selection::THRESHOLD } else { Selection::THRESHOLD.next_down() };
        }
    }
    out
}

/// Bounds of all but the outermost selected centers, with a margin.
fn bounds_of(gaussians: &Gaussians, selection: &Selection) -> Option<([f32; 3], [f32; 3])> {
    let (low, high) = crate::extent::robust_bounds(gaussians, selection)?;
    let margin = (0..3).map(|k| high[k] - low[k]).fold(0.0, f32::max) * 0.15;
    Some((low.map(|v| v - margin), high.map(|v| v + margin)))
}

/// Per row, the direction from the rest toward the selection among its neighbors; `None` where only
/// one of the two is near.
pub(crate) fn edge_directions(
    gaussians: &Gaussians,
    selection: &Selection,
    rows: &[u32],
) -> Vec<Option<glam::Vec3>> {
    const AROUND: usize = 24;
    let cloud = Cloud::new(gaussians, |_| true);
    rows.par_iter()
        .map(|&row| {
            let point = gaussians.means[row as usize];
            let (mut sums, mut counts) = ([glam::Vec3::ZERO; 2], [0.0f32; 2]);
            for (k, _) in cloud.nearest(point, AROUND) {
                let other = cloud.rows[k] as usize;
                if other != row as usize {
                    let inside = usize::from(selection.contains(other));
                    sums[inside] += glam::Vec3::from(gaussians.means[other]);
                    counts[inside] += 1.0;
                }
            }
            let both = counts[0] > 0.0 && counts[1] > 0.0;
            both.then(|| (sums[1] / counts[1] - sums[0] / counts[0]).try_normalize()).flatten()
        })
        .collect()
}
