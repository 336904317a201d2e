//! Splitting Gaussians that straddle the edge of a selection, so that the edge is clean when the object moves.
//!
//! A Gaussian whose contribution lies partly inside the masks is replaced by two of half the extent along the
//! axis that crosses the edge (BEA-GS does the like during training): mean and variance of the pair are
//! those of the one. The child on the selected side belongs.

use glam::{Mat3, Quat, Vec3};
use motes_scene::{Gaussians, Selection};

use crate::neighbours::edge_directions;

/// Confidences between these are undecided: the share inside, with the threshold at one half.
const UNDECIDED: std::ops::Range<f32> = 0.15..0.85;
/// Distance of the children from the middle, standard deviations: their own is then the square root of
/// one half, and the pair has the variance of the one.
const OFFSET: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Gaussians and selection with straddling ones split.
#[derive(Clone, Debug)]
pub struct SplitBoundary {
    /// The old rows in their order, then the second children.
    pub gaussians: Gaussians,
    /// Of the new rows.
    pub selection: Selection,
    /// How many were split.
    pub split: usize,
}

/// Splits the Gaussians at the edge of a selection whose largest extent is `least_extent` world units or
/// more: smaller ones leave no visible fringe.
///
/// # Panics
/// When the numbers of Gaussians differ.
pub fn split_boundary(
    gaussians: &Gaussians,
    selection: &Selection,
    least_extent: f32,
) -> SplitBoundary {
    assert_eq!(gaussians.len(), selection.len(), "a selection of these Gaussians");
    let candidates: Vec<u32> = (0..gaussians.len())
        .filter(|&i| {
            let largest = gaussians.log_scales[i].iter().copied().fold(f32::NEG_INFINITY, f32::max);
            UNDECIDED.contains(&selection.confidence[i]) && largest.exp() >= least_extent
        })
        .map(|i| i as u32)
        .collect();
    let directions = edge_directions(gaussians, selection, &candidates);
    let split: Vec<(u32, Vec3)> = candidates
        .into_iter()
        .zip(directions)
        .filter_map(|(row, direction)| direction.map(|d| (row, d)))
        .collect();
    let rows: Vec<u32> =
        (0..gaussians.len() as u32).chain(split.iter().map(|(row, _)| *row)).collect();
    let mut out = gaussians.clone();
    out.gather(&rows);
    let mut confidence: Vec<f32> =
        rows.iter().map(|&row| selection.confidence[row as usize]).collect();
    for (k, &(row, towards)) in split.iter().enumerate() {
        let (inner, outer) = (row as usize, gaussians.len() + k);
        let [w, x, y, z] = gaussians.rotations[inner];
        let axes = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
        let scales = gaussians.log_scales[inner].map(f32::exp);
        // The axis along which most of the extent crosses the edge.
        let crossing = |k: usize| axes.col(k).dot(towards).abs() * scales[k];
        let axis = (1..3).fold(0, |best, k| if crossing(k) > crossing(best) { k } else { best });
        let side = axes.col(axis) * axes.col(axis).dot(towards).signum();
        let step = side * (OFFSET * scales[axis]);
        for (child, sign) in [(inner, 1.0), (outer, -1.0)] {
            let mean = Vec3::from(gaussians.means[inner]) + step * sign;
            out.means[child] = mean.to_array();
            out.log_scales[child][axis] += OFFSET.ln();
        }
        confidence[inner] = 1.0;
        confidence[outer] = 0.0;
    }
    SplitBoundary { gaussians: out, selection: Selection { confidence }, split: split.len() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straddling_gaussian_becomes_two_with_its_moments() {
        let mut g = motes_testkit::random_gaussians(3, 9, 1);
        for i in 0..9 {
            g.means[i] = [i as f32 - 4.0, 0.1 * (i % 2) as f32, 0.0];
            g.log_scales[i] = [0.5, -2.0, -2.0];
            g.rotations[i] = [1.0, 0.0, 0.0, 0.0];
        }
        let confidence = vec![1.0, 1.0, 1.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.0];
        let done = split_boundary(&g, &Selection { confidence }, 0.1);
        assert_eq!((done.split, done.gaussians.len()), (1, 10));
        assert!(done.gaussians.is_consistent());
        let (a, b) = (done.gaussians.means[4][0], done.gaussians.means[9][0]);
        assert!(a < b, "the selected child lies where the selection is: {a} {b}");
        assert!(done.selection.contains(4) && !done.selection.contains(9));
        let s2 = (2.0 * done.gaussians.log_scales[4][0]).exp();
        let variance = s2 + (0.5 * (b - a)).powi(2);
        assert!((0.5 * (a + b) - g.means[4][0]).abs() < 1e-6);
        assert!((variance / 1f32.exp() - 1.0).abs() < 1e-5, "{variance}");
        assert_eq!(done.gaussians.sh_of(9), g.sh_of(4));
        // Small ones stay whole.
        let again = split_boundary(&g, &Selection { confidence: vec![0.5; 9] }, 1e3);
        assert_eq!((again.split, again.gaussians), (0, g));
    }
}
