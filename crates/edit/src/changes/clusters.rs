//! The largest cluster of Gaussians that touch.

use motes_math::disjoint_sets::DisjointSets;
use motes_math::median::upper_median;
use std::collections::BTreeMap;

use glam::DVec3;
use motes_math::knn::rms_neighbor_distance;
use motes_math::sigmoid::sigmoid;

use crate::EditState;

/// Neighbors that say how far apart Gaussians usually are.
const NEIGHBORS: usize = 6;

/// Rows among `rows` outside the largest cluster (by opacity), ascending. Two Gaussians touch when their centers are closer
/// than `reach` times the median distance to the nearest neighbors.
pub fn outside_largest(state: &EditState, rows: &[u32], reach: f64) -> Vec<u32> {
    let means: Vec<[f32; 3]> = rows.iter().map(|r| state.gaussians.means[*r as usize]).collect();
    let mut distances = rms_neighbor_distance(&means, NEIGHBORS);
    distances.retain(|d| d.is_finite());
    let Some(usual) = upper_median(&mut distances, f32::total_cmp) else {
        return Vec::new();
    };
    let link = (reach * f64::from(usual)).max(f64::MIN_POSITIVE);
    let cluster = clusters(&means, link);
    let mut weights: BTreeMap<u32, f64> = BTreeMap::new();
    for (row, c) in rows.iter().zip(&cluster) {
        let opacity = f64::from(sigmoid(state.gaussians.opacity_logits[*row as usize]));
        *weights.entry(*c).or_default() += if opacity > 0.0 { opacity } else { 0.0 };
    }
    // The lower number wins a tie.
    let by_weight = |a: &(&u32, &f64), b: &(&u32, &f64)| a.1.total_cmp(b.1).then(b.0.cmp(a.0));
    let largest = weights.iter().max_by(by_weight).map(|(c, _)| *c);
    let outside = rows.iter().zip(&cluster).filter(|(_, c)| Some(**c) != largest);
    outside.map(|(row, _)| *row).collect()
}

/// Number of the cluster of every point: the smallest index in it. Points closer than `link` are in one.
fn clusters(points: &[[f32; 3]], link: f64) -> Vec<u32> {
    // All points of a cell with this side touch, so that crowds cost nothing; partners are up to two cells away.
    let side = link / 3f64.sqrt();
    let point = |i: u32| DVec3::from_array(points[i as usize].map(f64::from));
    let mut cells: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    for i in 0..points.len() as u32 {
        if point(i).is_finite() {
            cells
                .entry((point(i) / side).floor().to_array().map(|v| v as i64))
                .or_default()
                .push(i);
        }
    }
    let mut sets = DisjointSets::new(points.len());
    for members in cells.values() {
        members.iter().for_each(|i| sets.join(members[0], *i));
    }
    for (cell, members) in &cells {
        // One of two neighbors looks at the other.
        for k in 63..125i64 {
            let step = [k / 25 - 2, k / 5 % 5 - 2, k % 5 - 2];
            let near = [0, 1, 2].map(|a| cell[a].saturating_add(step[a]));
            let Some(others) = cells.get(&near) else { continue };
            if sets.root(members[0]) == sets.root(others[0]) {
                continue;
            }
            let touch = |i: &u32| {
                others.iter().any(|k| point(*k).distance_squared(point(*i)) <= link * link)
            };
            if members.iter().any(touch) {
                sets.join(members[0], others[0]);
            }
        }
    }
    sets.labels()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smaller_of_two_clouds_is_outside() {
        let mut gaussians = motes_testkit::random_gaussians(3, 900, 0);
        for (i, mean) in gaussians.means.iter_mut().enumerate() {
            if i % 3 == 0 {
                mean[0] += 50.0;
            }
        }
        gaussians.opacity_logits.fill(1.0);
        gaussians.means[1] = [f32::NAN; 3];
        let state = EditState::new("t", gaussians, None, None, DVec3::Z);
        let rows: Vec<u32> = (0..900).collect();
        let outside = outside_largest(&state, &rows, 6.0);
        let small = outside.iter().filter(|r| *r % 3 == 0).count();
        assert_eq!(small, 300, "all of the smaller cloud");
        assert!(outside.contains(&1) && outside.len() < 330, "{}", outside.len());
    }
}
