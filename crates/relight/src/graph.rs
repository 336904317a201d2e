//! Smoothing over the Gaussians themselves: where the mesh is torn, they still lie beside each other.

use glam::Vec3;
use motes_math::knn::nearest_neighbors;
use rayon::prelude::*;

/// Neighbors of each Gaussian.
const NEIGHBORS: usize = 8;

/// Who lies beside whom.
#[derive(Debug)]
pub(crate) struct Graph {
    neighbors: Vec<u32>,
}

impl Graph {
    pub(crate) fn new(means: &[[f32; 3]]) -> Self {
        Self { neighbors: nearest_neighbors(means, NEIGHBORS) }
    }

    fn around(&self, i: usize) -> &[u32] {
        &self.neighbors[i * NEIGHBORS..(i + 1) * NEIGHBORS]
    }

    /// The least value of each Gaussian and its neighbors.
    pub(crate) fn eroded(&self, values: &[f32]) -> Vec<f32> {
        let least = |i: usize| {
            let around = self.around(i).iter().map(|&j| values[j as usize]);
            around.fold(values[i], f32::min)
        };
        (0..values.len()).map(least).collect()
    }

    /// `rounds` Jacobi steps toward the minimum of
    /// `Σ a_i |x_i - v_i|² + Σ_j w_ij |x_i - x_j|²`, from `x = v`, with anchors `a` of the values.
    pub(crate) fn smoothed(
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
    fn the_least_value_reaches_its_neighbors_and_no_further() {
        let means: Vec<[f32; 3]> = (0..30u8).map(|i| [f32::from(i), 0.0, 0.0]).collect();
        let mut values = vec![1.0; 30];
        values[15] = 0.25;
        let eroded = Graph::new(&means).eroded(&values);
        let low = |i: &usize| eroded[*i] == 0.25;
        assert_eq!((0..30).filter(low).collect::<Vec<_>>(), (11..=19).collect::<Vec<_>>());
        assert!((0..30).filter(|i| !low(i)).all(|i| eroded[i] == 1.0));
    }

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
