//! Gaussians that hang far from all others: statistical outlier removal (Rusu et al. 2008).
//!
//! The distance of a Gaussian is the root mean square of that to its `k` nearest neighbors. Distances spread over decades in a
//! scene with a background, so mean and deviation are those of logarithms; they are taken from the median and the
//! median absolute deviation, which outliers do not move. A large Gaussian fills the space around it: what counts is
//! the distance over its own radius where that is larger than usual.

use motes_math::knn::rms_neighbor_distance;
use motes_math::median::median;

use crate::EditState;

/// Standard deviation of a normal distribution over its median absolute deviation.
const DEVIATION_OF_MAD: f32 = 1.4826;
/// Distances agree at least this well, so that a regular grid has no outliers by rounding.
const LEAST_DEVIATION: f32 = 0.05;

/// Rows among `rows` that hang `deviations` standard deviations farther from their `neighbors` nearest
/// than usual, ascending.
pub fn floaters(state: &EditState, rows: &[u32], neighbors: usize, deviations: f64) -> Vec<u32> {
    let means: Vec<[f32; 3]> = rows.iter().map(|r| state.gaussians.means[*r as usize]).collect();
    if means.len() <= neighbors {
        return Vec::new();
    }
    let distances = rms_neighbor_distance(&means, neighbors);
    let radius = |row: u32| {
        let scales = state.gaussians.log_scales[row as usize];
        scales.into_iter().fold(f32::NEG_INFINITY, f32::max)
    };
    let usual_radius = median_of(rows.iter().map(|r| radius(*r)));
    let apart: Vec<f32> = rows
        .iter()
        .zip(&distances)
        .map(|(row, d)| d.max(f32::MIN_POSITIVE).ln() - (radius(*row) - usual_radius).max(0.0))
        .collect();
    let middle = median_of(apart.iter().copied());
    let spread = median_of(apart.iter().map(|d| (d - middle).abs()));
    let deviation = (DEVIATION_OF_MAD * spread).max(LEAST_DEVIATION);
    let bound = middle + deviations as f32 * deviation;
    rows.iter().zip(&apart).filter(|(_, d)| **d > bound).map(|(row, _)| *row).collect()
}

/// 0 of nothing.
fn median_of(values: impl Iterator<Item = f32>) -> f32 {
    median(values.map(f64::from)).unwrap_or(0.0) as f32
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn strays_go_and_the_cloud_stays() {
        let mut gaussians = motes_testkit::random_gaussians(3, 3000, 0);
        let scales = vec![[-3.0; 3]; 3000];
        gaussians.log_scales = scales;
        for (i, row) in [5, 500, 1500].into_iter().enumerate() {
            gaussians.means[row] = [9.0 + 3.0 * i as f32, 0.0, 4.0];
        }
        let state = EditState::new("t", gaussians, None, None, DVec3::Z);
        let rows: Vec<u32> = (0..3000).collect();
        let found = floaters(&state, &rows, 16, 3.0);
        for stray in [5, 500, 1500] {
            assert!(found.contains(&stray), "{found:?}");
        }
        assert!(found.len() < 90, "{} of 3000", found.len());
    }

    #[test]
    fn a_grid_has_no_floaters() {
        let mut gaussians = motes_testkit::random_gaussians(3, 1000, 0);
        for (i, mean) in gaussians.means.iter_mut().enumerate() {
            *mean = [(i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32];
        }
        gaussians.log_scales.fill([-1.0; 3]);
        let state = EditState::new("t", gaussians, None, None, DVec3::Z);
        let rows: Vec<u32> = (0..1000).collect();
        assert!(floaters(&state, &rows, 6, 12.0).is_empty());
        assert!(floaters(&state, &rows[..3], 6, 3.0).is_empty());
    }
}
