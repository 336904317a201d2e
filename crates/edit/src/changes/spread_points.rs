//! Points of a surface at even distances: of more than are wanted, those that crowd are left out.
//!
//! Sample elimination (Yuksel 2015, "Sample Elimination for Generating Poisson Disk Sample Sets"): the point with the heaviest
//! neighborhood goes, until as many are left as are wanted.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

use glam::{DVec3, IVec3};

/// How steeply the weight of a neighbor falls with its distance.
const STEEPNESS: i32 = 8;

/// A point of the heap, heaviest first; of equal ones the later goes first.
struct Heavy {
    weight: f64,
    point: u32,
}

impl Ord for Heavy {
    fn cmp(&self, other: &Self) -> Ordering {
        self.weight.total_cmp(&other.weight).then(self.point.cmp(&other.point))
    }
}

impl PartialOrd for Heavy {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Heavy {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Heavy {}

/// Which `keep` of the points of a surface of this area are spread evenly, in ascending order. Points whose normals (unit) face
/// apart are not neighbors: both sides of a sheet are covered.
pub(crate) fn evenly(points: &[DVec3], normals: &[DVec3], keep: usize, area: f64) -> Vec<usize> {
    let n = points.len();
    if keep >= n {
        return (0..n).collect();
    }
    // Farther apart than this no two of `keep` points of an area can all be; twice of it is as far as neighbors count.
    let reach = 2.0 * (area / (2.0 * 3.0f64.sqrt() * keep.max(1) as f64)).sqrt();
    let grid = Grid::new(points, reach);
    let neighbors = |i: usize| {
        grid.near(points[i]).filter(move |&j| j != i && normals[i].dot(normals[j]) > 0.0)
    };
    let weight = |i: usize, j: usize| {
        let share = points[i].distance(points[j]) / reach;
        if share < 1.0 { (1.0 - share).powi(STEEPNESS) } else { 0.0 }
    };
    let mut weights: Vec<f64> =
        (0..n).map(|i| neighbors(i).map(|j| weight(i, j)).sum::<f64>()).collect();
    let mut is_kept = vec![true; n];
    let mut heap: BinaryHeap<Heavy> =
        weights.iter().zip(0..).map(|(&weight, point)| Heavy { weight, point }).collect();
    let mut left = n;
    while left > keep {
        let Some(Heavy { weight: said, point }) = heap.pop() else { break };
        let i = point as usize;
        if !is_kept[i] {
            continue;
        }
        if said > weights[i] {
            // Neighbors have gone since it was said.
            heap.push(Heavy { weight: weights[i], point });
            continue;
        }
        is_kept[i] = false;
        left -= 1;
        for j in neighbors(i).filter(|&j| is_kept[j]) {
            weights[j] -= weight(i, j);
        }
    }
    (0..n).filter(|&i| is_kept[i]).collect()
}

/// Which of `of` is nearest to each point, by place and normal (unit) on the same side of a sheet; none where none is within `reach`.
pub(crate) fn nearest_of(
    of: &[DVec3],
    normals: &[DVec3],
    points: impl Iterator<Item = (DVec3, DVec3)>,
    reach: f64,
) -> Vec<Option<usize>> {
    let grid = Grid::new(of, reach);
    let nearest = |(point, normal): (DVec3, DVec3)| {
        let near = grid.near(point).filter(|&j| normals[j].dot(normal) > 0.0);
        let near = near.map(|j| (of[j].distance_squared(point), j));
        near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, j)| j)
    };
    points.map(nearest).collect()
}

/// Points by cells of space.
struct Grid {
    cells: HashMap<IVec3, Vec<u32>>,
    side: f64,
}

impl Grid {
    fn new(points: &[DVec3], side: f64) -> Self {
        let side = side.max(f64::MIN_POSITIVE);
        let mut cells: HashMap<IVec3, Vec<u32>> = HashMap::new();
        for (point, i) in points.iter().zip(0..) {
            cells.entry(cell(*point, side)).or_default().push(i);
        }
        Self { cells, side }
    }

    /// Points in the cell of a point and in those around it, always in the same order.
    fn near(&self, point: DVec3) -> impl Iterator<Item = usize> {
        let home = cell(point, self.side);
        let around = (0..27).map(move |i| home + IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
        around.filter_map(|cell| self.cells.get(&cell)).flatten().map(|&j| j as usize)
    }
}

/// Far away cells are one, which costs time and nothing else.
fn cell(point: DVec3, side: f64) -> IVec3 {
    const FARTHEST: f64 = 1e9;
    (point / side).floor().clamp(DVec3::splat(-FARTHEST), DVec3::splat(FARTHEST)).as_ivec3()
}

#[cfg(test)]
mod tests {
    use motes_math::rng::keyed_rng;
    use rand::RngExt as _;

    use super::*;

    #[test]
    fn what_is_left_of_random_points_is_even() {
        let mut random = keyed_rng(1, 0, 0);
        let points: Vec<DVec3> = (0..2000)
            .map(|_| DVec3::new(random.random::<f64>(), random.random::<f64>(), 0.0))
            .collect();
        let normals = vec![DVec3::Z; points.len()];
        let kept = evenly(&points, &normals, 500, 1.0);
        assert_eq!(kept.len(), 500);
        let nearest = |of: &[usize]| {
            let distance = |&i: &usize| {
                let to = of.iter().filter(|&&j| j != i).map(|&j| points[i].distance(points[j]));
                to.fold(f64::INFINITY, f64::min)
            };
            of.iter().map(distance).fold(f64::INFINITY, f64::min)
        };
        // At best 500 points of a unit square are 0.048 apart; as many random ones come as near as 0.001.
        assert!(nearest(&kept) > 0.026, "{}", nearest(&kept));
        let first: Vec<usize> = (0..500).collect();
        assert!(nearest(&first) < 0.01);
        // Both sides of a sheet are covered.
        let twice = [points.clone(), points.clone()].concat();
        let sides = [normals, vec![-DVec3::Z; points.len()]].concat();
        let kept = evenly(&twice, &sides, 1000, 2.0);
        let front = kept.iter().filter(|&&i| i < 2000).count();
        assert!((460..=540).contains(&front), "{front}");
        assert_eq!(evenly(&points, &sides[..2000], 3000, 1.0).len(), 2000);
        assert!(evenly(&[], &[], 0, 0.0).is_empty());
    }
}
