use rand::RngExt as _;

use super::*;
use crate::rng::keyed_rng;

/// Points around `centers` corners of a cube in many dimensions.
fn blobs(n: usize, dimensions: usize, centers: usize, spread: f32) -> Vec<f32> {
    let mut rng = keyed_rng(7, 0, 0);
    let corners: Vec<f32> = (0..centers * dimensions).map(|_| rng.random::<f32>()).collect();
    (0..n)
        .flat_map(|i| {
            let corner = &corners[i % centers * dimensions..(i % centers + 1) * dimensions];
            corner.iter().map(|c| c + spread * (rng.random::<f32>() - 0.5)).collect::<Vec<_>>()
        })
        .collect()
}

/// Lloyd's algorithm on all centroids at once.
fn flat(points: &[f32], dimensions: usize, clusters: usize) -> Clusters {
    let centroids = lloyd(points, dimensions, clusters, 10, 0, 99);
    let mut labels = vec![0; points.len() / dimensions];
    centroids.search(points, |i, _, label| labels[i] = label);
    Clusters { centroids: centroids.rows().to_vec(), labels }
}

#[test]
fn the_error_is_near_that_of_the_flat_algorithm() {
    let points = blobs(20_000, 9, 100, 0.8);
    let options = KmeansOptions { clusters: 1024, iterations: 10, ..KmeansOptions::default() };
    let found = kmeans(&points, 9, &options);
    let error = found.mean_squared_error(&points, 9);
    let reference = flat(&points, 9, 1024).mean_squared_error(&points, 9);
    assert!(error < 1.08 * reference, "{error} against {reference}");
    assert_eq!(found.centroids.len(), 1024 * 9);
}

#[test]
fn labels_are_those_of_the_nearest_centroid_when_all_groups_are_probed() {
    let points = blobs(2000, 5, 10, 0.5);
    let options = KmeansOptions { clusters: 64, probes: 8, ..KmeansOptions::default() };
    let found = kmeans(&points, 5, &options);
    // The last move to the means changes few of them.
    let distance = |i: usize, c: usize| -> f32 {
        (0..5).map(|d| (points[i * 5 + d] - found.centroids[c * 5 + d]).powi(2)).sum()
    };
    let right = (0..2000).filter(|&i| {
        let best = (0..64).map(|c| distance(i, c)).fold(f32::INFINITY, f32::min);
        distance(i, found.labels[i] as usize) <= best * 1.0001
    });
    assert!(right.count() > 1900);
}

#[test]
fn few_or_equal_points_are_no_trouble() {
    let options = KmeansOptions { clusters: 16, ..KmeansOptions::default() };
    let same = kmeans(&[1.0; 300], 3, &options);
    assert_eq!(same.mean_squared_error(&[1.0; 300], 3), 0.0);
    let few = kmeans(&[1.0, 2.0, 3.0], 1, &options);
    assert_eq!(few.mean_squared_error(&[1.0, 2.0, 3.0], 1), 0.0);
    assert!(kmeans(&[], 4, &options).labels.is_empty());
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let points = blobs(9000, 6, 30, 0.6);
    let options = KmeansOptions { clusters: 300, ..KmeansOptions::default() };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| kmeans(&points, 6, &options))
    };
    assert_eq!(with(1), with(3));
}
