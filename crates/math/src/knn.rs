//! Nearest neighbors in 3D.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

/// Root mean squared distance from each point to its `k` nearest other points, `[N]`, same units.
///
/// Coincident points count as neighbors at distance 0. With a single point the result is 0.
/// Points with a non-finite coordinate are left out of the search and get NaN.
pub fn rms_neighbor_distance(points: &[[f32; 3]], k: usize) -> Vec<f32> {
    let distances = of_neighborhoods(points, k, |_, found| {
        // The nearest one is the point itself (or a coincident twin, also at distance 0).
        let others = found.len().saturating_sub(1);
        let sum: f64 = found.iter().skip(1).map(|&(_, squared)| f64::from(squared)).sum();
        (sum / others.max(1) as f64).sqrt() as f32
    });
    distances.into_iter().map(|distance| distance.unwrap_or(f32::NAN)).collect()
}

/// The `k` nearest other points of each point, nearest first, `[N, k]`; rows of points with fewer others, or with a
/// non-finite coordinate, are filled up with the point itself.
pub fn nearest_neighbors(points: &[[f32; 3]], k: usize) -> Vec<u32> {
    let mut out: Vec<u32> =
        (0..points.len() as u32).flat_map(|i| std::iter::repeat_n(i, k)).collect();
    let rows = of_neighborhoods(points, k, |i, found| -> Vec<u32> {
        found.iter().map(|&(j, _)| j).filter(|&j| j != i).take(k).collect()
    });
    for (i, row) in rows.into_iter().enumerate() {
        let row = row.unwrap_or_default();
        out[i * k..][..row.len()].copy_from_slice(&row);
    }
    out
}

/// A value for every query, of the `k` finite points nearest to it (fewer where there are fewer): nearest first, each
/// with its squared distance. None without points and for a query that is not finite.
pub fn of_nearest<T: Send>(
    queries: &[[f32; 3]],
    points: &[[f32; 3]],
    k: NonZero<usize>,
    value: impl Fn(u32, &[(u32, f32)]) -> T + Sync,
) -> Vec<Option<T>> {
    let is_finite = |p: &[f32; 3]| p.iter().all(|v| v.is_finite());
    let finite: Vec<u32> =
        (0..points.len() as u32).filter(|&i| is_finite(&points[i as usize])).collect();
    let entries: Vec<[f32; 3]> = finite.iter().map(|&i| points[i as usize]).collect();
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&entries).ok();
    let of_one = |(i, query): (usize, &[f32; 3])| {
        let tree = tree.as_ref().filter(|_| !entries.is_empty() && is_finite(query))?;
        let found = tree.query(query).nearest_n::<SquaredEuclidean<f32>>(k).execute();
        let found: Vec<(u32, f32)> =
            found.iter().map(|n| (finite[n.item as usize], n.distance)).collect();
        Some(value(i as u32, &found))
    };
    queries.par_iter().enumerate().map(of_one).collect()
}

/// As [`of_nearest`], of the points themselves, each of which is the nearest to itself: `k + 1` are found.
fn of_neighborhoods<T: Send>(
    points: &[[f32; 3]],
    k: usize,
    value: impl Fn(u32, &[(u32, f32)]) -> T + Sync,
) -> Vec<Option<T>> {
    let wanted = NonZero::new(k + 1).unwrap_or(NonZero::<usize>::MIN);
    of_nearest(points, points, wanted, value)
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
    fn queries_find_their_points_and_broken_ones_none() {
        let points = [[0.0; 3], [f32::NAN; 3], [4.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        let queries = [[3.0, 0.0, 0.0], [f32::INFINITY; 3], [0.4, 0.0, 0.0]];
        let two = |queries: &[[f32; 3]], points: &[[f32; 3]]| {
            let of = |_, found: &[(u32, f32)]| found.iter().map(|f| f.0).collect::<Vec<_>>();
            of_nearest(queries, points, NonZero::new(2).unwrap(), of)
        };
        assert_eq!(two(&queries, &points), [Some(vec![2, 3]), None, Some(vec![0, 3])]);
        assert_eq!(two(&queries[..1], &points[..2]), [Some(vec![0])]);
        assert_eq!(two(&queries[..1], &[]), [None]);
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
