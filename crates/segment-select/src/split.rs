//! Splitting Gaussians that straddle the edge of a selection, so that the edge is clean when the object moves.
//!
//! A Gaussian whose contribution lies partly inside the masks is replaced by two along the axis that crosses the
//! edge (BEA-GS does the like during training). The one on the selected side belongs; it has the share of the
//! contribution that lies inside, the other one the rest. Mean and variance of the pair, and what the two absorb
//! where they lie behind each other, are those of the one, so that the picture stays.

use glam::{Mat3, Quat, Vec3};
use motes_math::sigmoid::{logit, sigmoid};
use motes_scene::{Gaussians, Selection};

use crate::neighbors::edge_directions;

/// Confidences between these are undecided: the share inside, with the threshold at one half.
const UNDECIDED: std::ops::Range<f32> = 0.35..0.65;
/// Distance between the children, standard deviations of the one: farther apart the edge is cleaner and the
/// picture changes more.
const APART: f32 = 0.7;
/// Most opaque children, and least.
const OPACITIES: [f32; 2] = [1e-4, 0.999];

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
    for (k, &(row, toward)) in split.iter().enumerate() {
        let (inner, outer) = (row as usize, gaussians.len() + k);
        let [w, x, y, z] = gaussians.rotations[inner];
        let axes = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
        let scales = gaussians.log_scales[inner].map(f32::exp);
        // The axis along which most of the extent crosses the edge.
        let crossing = |k: usize| axes.col(k).dot(toward).abs() * scales[k];
        let axis = (1..3).fold(0, |best, k| if crossing(k) > crossing(best) { k } else { best });
        let side = axes.col(axis) * axes.col(axis).dot(toward).signum();
        let share = selection.confidence[inner];
        let pair = Pair::new(sigmoid(gaussians.opacity_logits[inner]), share);
        for (child, at, opacity) in [
            (inner, (1.0 - share) * APART, pair.opacities[0]),
            (outer, -share * APART, pair.opacities[1]),
        ] {
            let mean = Vec3::from(gaussians.means[inner]) + side * (at * scales[axis]);
            out.means[child] = mean.to_array();
            out.log_scales[child][axis] += pair.width.ln();
            out.opacity_logits[child] = logit(opacity);
        }
        confidence[inner] = 1.0;
        confidence[outer] = 0.0;
    }
    SplitBoundary { gaussians: out, selection: Selection { confidence }, split: split.len() }
}

/// What two Gaussians are that look like one.
struct Pair {
    /// Extent along the axis over that of the one.
    width: f32,
    opacities: [f32; 2],
}

impl Pair {
    /// The first has `share` of the whole.
    fn new(opacity: f32, share: f32) -> Self {
        let shares = [share, 1.0 - share];
        let width = (1.0 - shares[0] * shares[1] * APART * APART).sqrt();
        let alone = shares.map(|s| opacity * s / width);
        // Light that one takes the other cannot: over the plane, k (a + b) w - k^2 a b w / 2 exp(-d^2 / 4 w^2) is
        // what both absorb together, and the opacity what the one does, in units of its footprint.
        let sum = (alone[0] + alone[1]) * width;
        let both = 0.5 * alone[0] * alone[1] * width * (-(APART / (2.0 * width)).powi(2)).exp();
        let root = (sum * sum - 4.0 * both * opacity).max(0.0).sqrt();
        let factor = 2.0 * opacity / (sum + root).max(1e-12);
        let opacities = alone.map(|a| (a * factor).clamp(OPACITIES[0], OPACITIES[1]));
        Self { width, opacities }
    }
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
        let confidence = vec![1.0, 1.0, 1.0, 1.0, 0.4, 0.0, 0.0, 0.0, 0.0];
        let done = split_boundary(&g, &Selection { confidence }, 0.1);
        assert_eq!((done.split, done.gaussians.len()), (1, 10));
        assert!(done.gaussians.is_consistent());
        let (a, b) = (done.gaussians.means[4][0], done.gaussians.means[9][0]);
        assert!(a < b, "the selected child lies where the selection is: {a} {b}");
        assert!(done.selection.contains(4) && !done.selection.contains(9));
        let [s, t] = [4, 9].map(|i| done.gaussians.log_scales[i][0].exp());
        let (inside, outside) = (0.4, 0.6);
        let mean = inside * a + outside * b;
        assert!((mean - g.means[4][0]).abs() < 1e-6, "{mean}");
        let variance =
            inside * (s * s + (a - mean).powi(2)) + outside * (t * t + (b - mean).powi(2));
        assert!((variance / 1f32.exp() - 1.0).abs() < 1e-5, "{variance}");
        let [o, p] = [4, 9].map(|i| sigmoid(done.gaussians.opacity_logits[i]));
        assert!((o / p - inside / outside).abs() < 1e-4, "{o} {p}");
        assert_eq!(done.gaussians.sh_of(9), g.sh_of(4));
        // Small ones stay whole.
        let again = split_boundary(&g, &Selection { confidence: vec![0.5; 9] }, 1e3);
        assert_eq!((again.split, again.gaussians), (0, g));
    }

    #[test]
    fn the_picture_stays() {
        use motes_raster::{RenderOptions, render};
        use motes_scene::{Pinhole, Pose};
        let camera = Pinhole { fx: 60.0, fy: 60.0, cx: 32.0, cy: 32.0, width: 64, height: 64 };
        for (logit, share) in [(-1.0, 0.5), (1.0, 0.6), (4.0, 0.4), (6.0, 0.5)] {
            // One that is a quarter of the picture wide, and others out of view.
            let mut g = motes_testkit::random_gaussians(4, 9, 1);
            for i in 0..9 {
                g.means[i] = [40.0 * (i as f32 - 4.0), 0.0, 4.0];
                g.log_scales[i] = [-1.3, -2.0, -4.0];
                g.rotations[i] = [1.0, 0.0, 0.0, 0.0];
                g.opacity_logits[i] = logit;
            }
            let confidence = vec![1.0, 1.0, 1.0, 1.0, share, 0.0, 0.0, 0.0, 0.0];
            let done = split_boundary(&g, &Selection { confidence }, 0.1);
            assert_eq!(done.split, 1);
            let picture = |g| render(g, &camera, &Pose::IDENTITY, &RenderOptions::default()).alpha;
            let (before, after) = (picture(&g), picture(&done.gaussians));
            let squares =
                before.data.iter().zip(&after.data).map(|(a, b)| f64::from(a - b).powi(2));
            let psnr = -10.0 * (squares.sum::<f64>() / before.data.len() as f64).log10();
            // Twins that keep its opacity cover more than it does.
            assert!(psnr > 40.0, "opacity logit {logit}, share {share}: {psnr} dB");
        }
    }
}
