//! Nearest neighbors in 3D.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

/// Root mean squared distance from each point to its `k` nearest other points, `[N]`, same units.
///
/// Coincident points count as neighbors at distance 0. With a single point the result is 0.
/// Points with a non-finite coordinate are left out of the search and get NaN.
pub fn rms_neighbor_distance(points: &[[f32; 3]], k: usize) -> Vec<f32> {
    let mut out = vec![f32::NAN; points.len()];
    let distances = of_neighborhoods(points, k, |_, found| {
        // The nearest one is the point itself (or a coincident twin, also at distance 0).
        let others = found.len().saturating_sub(1);
        let sum: f64 = found.iter().skip(1).map(|&(_, squared)| f64::from(squared)).sum();
        (sum / others.max(1) as f64).sqrt() as f32
    });
    for (i, distance) in distances {
        out[i as usize] = distance;
    }
    out
}

/// The `k` nearest other points of each point, nearest first, `[N, k]`; rows of points with fewer others, or with a
/// non-finite coordinate, are filled up with the point itself.
pub fn nearest_neighbors(points: &[[f32; 3]], k: usize) -> Vec<u32> {
    let mut out: Vec<u32> =
        (0..points.len() as u32).flat_map(|i| std::iter::repeat_n(i, k)).collect();
    let rows = of_neighborhoods(points, k, |i, found| -> Vec<u32> {
        found.iter().map(|&(j, _)| j).filter(|&j| j != i).take(k).collect()
    });
    for (i, row) in rows {
        out[i as usize * k..][..row.len()].copy_from_slice(&row);
    }
    out
}

/// A value for every finite point, of the `k + 1` points nearest to it (itself included): nearest first, each with
/// its squared distance.
fn of_neighborhoods<T: Send>(
    points: &[[f32; 3]],
    k: usize,
    value: impl Fn(u32, &[(u32, f32)]) -> T + Sync,
) -> Vec<(u32, T)> {
    let finite: Vec<u32> = (0..points.len() as u32)
        .filter(|&i| points[i as usize].iter().all(|v| v.is_finite()))
        .collect();
    let entries: Vec<[f32; 3]> = finite.iter().map(|&i| points[i as usize]).collect();
    let wanted = NonZero::new(k + 1).unwrap_or(NonZero::<usize>::MIN);
    let Ok(tree) = ImmutableKdTree::<f32, 3>::new_from_slice(&entries) else {
        // Only an empty set has no tree.
        return Vec::new();
    };
    let of_one = |(&i, point): (&u32, &[f32; 3])| {
        let found = tree.query(point).nearest_n::<SquaredEuclidean<f32>>(wanted).execute();
        let found: Vec<(u32, f32)> =
            found.iter().map(|n| (finite[n.item as usize], n.distance)).collect();
        (i, value(i, &found))
    };
    finite.par_iter().zip(&entries).map(of_one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbors_are_the_nearest_others_and_missing_ones_the_point_itself() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [f32::NAN; 3], [0.0, 0.4, 0.0], [9.0, 0.0, 0.0]];
        assert_eq!(nearest_neighbors(&points, 2), [3, 1, 0, 3, 2, 2, 0, 1, 1, 0]);
        assert_eq!(nearest_neighbors(&[[1.0; 3]], 2), [0, 0]);
        assert!(nearest_neighbors(&[], 3).is_empty());
    }

    #[test]
    fn matches_brute_force() {
        let points: Vec<[f32; 3]> = (0..400)
            .map(|i| {
                let f = i as f32;
                [(f * 0.37).sin(), (f * 0.73).cos(), (f * 0.11).sin()]
            })
            .collect();
        let fast = rms_neighbor_distance(&points, 3);
        for (i, p) in points.iter().enumerate() {
            let mut d2: Vec<f32> = points
                .iter()
                .map(|q| p.iter().zip(q).map(|(a, b)| (a - b) * (a - b)).sum())
                .collect();
            d2.sort_by(f32::total_cmp);
            let expected = ((d2[1] + d2[2] + d2[3]) / 3.0).sqrt();
            assert!((fast[i] - expected).abs() < 1e-5, "{i}: {} {expected}", fast[i]);
        }
    }

    #[test]
    fn few_coincident_and_broken_points() {
        assert!(rms_neighbor_distance(&[], 3).is_empty());
        assert_eq!(rms_neighbor_distance(&[[1.0; 3]], 3), [0.0]);
        assert_eq!(rms_neighbor_distance(&[[1.0; 3]; 5000], 3), [0.0; 5000]);
        let mixed = rms_neighbor_distance(&[[0.0; 3], [f32::NAN; 3], [2.0, 0.0, 0.0]], 3);
        assert_eq!((mixed[0], mixed[2]), (2.0, 2.0));
        assert!(mixed[1].is_nan());
    }
}
