//! k-means of many points in many dimensions with many clusters, on the CPU.
//!
//! Lloyd's algorithm compares every point with every centroid; with 64 thousand centroids that is out of
//! the question. Here about √k groups are found first, each group gets its share of the centroids,
//! Lloyd's rounds run inside the groups, and at the end every point looks through the centroids of the few groups
//! nearest to it (an inverted file, Jégou et al. 2011). Distances are matrix products:
//! `|x - c|² = |x|² - 2 x·c + |c|²`.
//!
//! The result does not depend on the number of threads: groups are independent, sums follow the
//! order of the points.

use rayon::prelude::*;

mod groups;
mod lloyd;

use groups::{Groups, shares};
use lloyd::{Centroids, lloyd};

/// Parameters of [`kmeans`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KmeansOptions {
    /// Centroids; fewer come back when there are fewer points.
    pub clusters: usize,
    /// Lloyd's rounds, among the groups and inside each.
    pub iterations: u32,
    /// Groups whose centroids a point looks through at the end, at least 1.
    pub probes: usize,
    /// Seed of the first centroids.
    pub seed: u64,
}

impl Default for KmeansOptions {
    fn default() -> Self {
        Self { clusters: 256, iterations: 6, probes: 4, seed: 0 }
    }
}

/// A vector quantization.
#[derive(Clone, Debug, PartialEq)]
pub struct Clusters {
    /// `[k, dimensions]`.
    pub centroids: Vec<f32>,
    /// Centroid of each point.
    pub labels: Vec<u32>,
}

impl Clusters {
    /// Mean squared distance of the points `[n, dimensions]` to their centroids.
    pub fn mean_squared_error(&self, points: &[f32], dimensions: usize) -> f64 {
        let row = |i: usize| &points[i * dimensions..(i + 1) * dimensions];
        let squared = |i: usize, label: usize| -> f64 {
            let centroid = &self.centroids[label * dimensions..(label + 1) * dimensions];
            row(i).iter().zip(centroid).map(|(x, c)| f64::from(x - c).powi(2)).sum()
        };
        let sum: f64 = self.labels.iter().enumerate().map(|(i, l)| squared(i, *l as usize)).sum();
        sum / self.labels.len().max(1) as f64
    }
}

/// Groups for this many centroids: as many as each will get, so that both searches cost the same.
fn group_count(clusters: usize) -> usize {
    (clusters as f64).sqrt().round().max(1.0) as usize
}

/// Clusters points `[n, dimensions]`, finite, by squared distance.
///
/// # Panics
/// When the length of `points` is not a multiple of `dimensions`, or there are no dimensions.
pub fn kmeans(points: &[f32], dimensions: usize, options: &KmeansOptions) -> Clusters {
    assert!(dimensions > 0 && points.len().is_multiple_of(dimensions), "{} values", points.len());
    let n = points.len() / dimensions;
    let clusters = options.clusters.min(n);
    if n == 0 || clusters == 0 {
        return Clusters { centroids: Vec::new(), labels: vec![0; n] };
    }
    let groups = Groups::find(points, dimensions, group_count(clusters), options);
    let shares = shares(&groups, clusters);
    // Inside the groups, each on its own.
    let fitted: Vec<Centroids> = groups
        .members
        .par_iter()
        .zip(&shares)
        .enumerate()
        .map(|(g, (members, share))| {
            let own = groups::gather(points, dimensions, members);
            lloyd(&own, dimensions, *share, options.iterations, options.seed, 1 + g as u64)
        })
        .collect();
    let mut first = 0;
    let starts: Vec<u32> = fitted
        .iter()
        .map(|centroids| {
            let start = first;
            first += centroids.len() as u32;
            start
        })
        .collect();
    let labels = groups.nearest(points, dimensions, &fitted, &starts, options.probes.max(1));
    let mut centroids: Vec<f32> =
        fitted.iter().flat_map(|centroids| centroids.rows().iter().copied()).collect();
    lloyd::move_to_means(points, dimensions, &labels, &mut centroids);
    Clusters { centroids, labels }
}

#[cfg(test)]
mod tests;
