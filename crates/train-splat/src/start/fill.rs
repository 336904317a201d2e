//! Points for the places where others are missing.

use std::collections::HashSet;

use glam::{IVec3, Vec3};
use motes_scene::SparsePoints;

/// Cells around a point that need no other.
const REACH: i32 = 2;

/// Adds, evenly chosen, up to `most` of `more` that have no point near; the number added. `cell` is
/// the spacing of `more`.
pub(super) fn fill(
    points: &mut SparsePoints,
    more: &SparsePoints,
    cell: f64,
    most: usize,
) -> usize {
    let at = |p: &[f32; 3]| -> IVec3 { (Vec3::from(*p).as_dvec3() / cell).floor().as_ivec3() };
    let taken: HashSet<IVec3> = points.positions.iter().map(at).collect();
    let is_free = |p: &[f32; 3]| {
        let here = at(p);
        let range = || -REACH..=REACH;
        !range().any(|z| {
            range().any(|y| range().any(|x| taken.contains(&(here + IVec3::new(x, y, z)))))
        })
    };
    let free: Vec<usize> = (0..more.len()).filter(|&i| is_free(&more.positions[i])).collect();
    let take = free.len().min(most);
    for i in 0..take {
        let row = free[i * free.len() / take];
        points.positions.push(more.positions[row]);
        points.colors.push(more.colors[row]);
    }
    take
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_places_without_points_are_filled() {
        let row = |low: usize, high: usize| SparsePoints {
            positions: (low..high).map(|i| [i as f32 + 0.5, 0.5, 0.5]).collect(),
            colors: vec![[7; 3]; high - low],
        };
        let mut points = row(0, 10);
        let added = fill(&mut points, &row(0, 30), 1.0, 100);
        assert_eq!((added, points.len()), (18, 28), "those beyond 12");
        assert!(points.positions[10..].iter().all(|p| p[0] > 12.0));
        assert_eq!(fill(&mut row(0, 10), &row(0, 30), 1.0, 5), 5);
    }
}
