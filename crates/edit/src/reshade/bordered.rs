//! Openings that ground borders.

use std::collections::BTreeSet;

use motes_math::disjoint_sets::DisjointSets;

use super::grid::Grid;

/// An opening needs ground along this share of its border: else it lies beyond the end of the ground, as below what hung over an edge,
/// and what would fill it would float.
const LEAST_BORDER: f32 = 1.0 / 3.0;

/// The open cells of the pieces that enough ground borders, and the number of the others.
pub(super) fn split_by_border(grid: &Grid, open: &[bool], ground: &[bool]) -> (Vec<bool>, usize) {
    let mut pieces = DisjointSets::new(open.len());
    for c in (0..open.len()).filter(|c| open[*c]) {
        grid.around(c).filter(|n| open[*n]).for_each(|n| pieces.join(c as u32, n as u32));
    }
    let piece_of = pieces.labels();
    // Cells along the border of each piece, and those of them that are ground.
    let mut border = vec![[0u32; 2]; open.len()];
    for c in (0..open.len()).filter(|c| !open[*c]) {
        let beside: BTreeSet<u32> =
            grid.around(c).filter(|n| open[*n]).map(|n| piece_of[n]).collect();
        for piece in beside {
            border[piece as usize][0] += 1;
            border[piece as usize][1] += u32::from(ground[c]);
        }
    }
    let is_bordered = |c: usize| {
        let [all, along] = border[piece_of[c] as usize];
        along as f32 >= LEAST_BORDER * all as f32
    };
    let kept: Vec<bool> = (0..open.len()).map(|c| open[c] && is_bordered(c)).collect();
    let floating = (0..open.len()).filter(|c| open[*c] && !kept[*c]).count();
    (kept, floating)
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::reshade::support::Plane;

    #[test]
    fn an_opening_in_the_ground_is_kept_and_one_beside_it_is_not() {
        let plane = Plane::new(DVec3::Z, DVec3::ZERO);
        let corners = [Vec3::ZERO, Vec3::new(20.0, 10.0, 0.0)];
        let grid = Grid::over(plane, &corners, 1.0, 0.0).expect("a grid");
        let column = |c: usize| c % grid.size[0];
        let row = |c: usize| c / grid.size[0];
        // Ground to the left of column 10; an opening in it, one at its end, one beyond.
        let is_open = |c: usize| {
            (4..7).contains(&row(c)) && [3..6, 9..12, 15..18].iter().any(|r| r.contains(&column(c)))
        };
        let open: Vec<bool> = (0..grid.cells()).map(is_open).collect();
        let ground: Vec<bool> = (0..grid.cells()).map(|c| !open[c] && column(c) < 10).collect();
        let (kept, floating) = split_by_border(&grid, &open, &ground);
        assert_eq!(floating, 9);
        for c in 0..grid.cells() {
            assert_eq!(kept[c], open[c] && column(c) < 12, "{c}");
        }
    }
}
