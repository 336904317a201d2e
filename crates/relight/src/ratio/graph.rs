//! Smoothing over the Gaussians themselves: where the mesh is torn, they still lie beside each other.

use glam::Vec3;
use motes_math::knn::nearest_neighbors;
use rayon::prelude::*;

/// Neighbors of each Gaussian.
const NEIGHBORS: usize = 8;

/// Who lies beside whom.
#[derive(Debug)]
pub(super) struct Graph {
    neighbors: Vec<u32>,
}

impl Graph {
    pub(super) fn new(means: &[[f32; 3]]) -> Self {
        Self { neighbors: nearest_neighbors(means, NEIGHBORS) }
    }

    fn around(&self, i: usize) -> &[u32] {
        &self.neighbors[i * NEIGHBORS..(i + 1) * NEIGHBORS]
    }

    /// `rounds` Jacobi steps toward the minimum of
    /// `Σ a_i |x_i - v_i|² + Σ_j w_ij |x_i - x_j|²`, from `x = v`, with anchors `a` of the values.
    pub(super) fn smoothed(
        &self,
        values: &[Vec3],
        anchor: &(impl Fn(usize) -> f32 + Sync),
        weight: &(impl Fn(usize, usize) -> f32 + Sync),
        rounds: u32,
    ) -> Vec<Vec3> {
        let mut x = values.to_vec();
        for _ in 0..rounds {
            x = (0..x.len())
                .into_par_iter()
                .with_min_len(1024)
                .map(|i| {
                    let a = anchor(i);
                    let (mut sum, mut weights) = (values[i] * a, a);
                    for &j in self.around(i) {
                        let j = j as usize;
                        let w = weight(i, j);
                        sum += x[j] * w;
                        weights += w;
                    }
                    if weights > 0.0 { sum / weights } else { values[i] }
                })
                .collect();
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uncertain_values_follow_their_neighbors_and_sure_ones_stay() {
        let means: Vec<[f32; 3]> =
            (0..400u16).map(|i| [f32::from(i % 20), f32::from(i / 20), 0.0]).collect();
        let graph = Graph::new(&means);
        let torn: Vec<Vec3> =
            (0..400).map(|i| Vec3::splat(if (i * 7) % 3 == 0 { 1.0 } else { -1.0 })).collect();
        let spread = |x: &[Vec3]| {
            let mean = x.iter().copied().sum::<Vec3>() / x.len() as f32;
            (x.iter().map(|v| (*v - mean).length_squared()).sum::<f32>() / x.len() as f32).sqrt()
        };
        let smooth = |anchor: f32| graph.smoothed(&torn, &|_| anchor, &|_, _| 1.0, 32);
        assert!(spread(&smooth(0.05)) < 0.1 * spread(&torn), "{}", spread(&smooth(0.05)));
        assert!(spread(&smooth(1e4)) > 0.99 * spread(&torn), "{}", spread(&smooth(1e4)));
    }
}
