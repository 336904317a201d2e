//! Copies.

use glam::DVec3;
use motes_scene::Selection;

use crate::changes::transform::transform;
use crate::{EditState, Similarity};

/// Appends `count` copies of the Gaussians of `rows`, the k-th shifted by `k * step`, and returns the
/// selection of all copies.
pub fn duplicate(state: &mut EditState, rows: &[u32], step: DVec3, count: usize) -> Selection {
    let first = state.len();
    let all: Vec<u32> =
        (0..first as u32).chain((0..count).flat_map(|_| rows.iter().copied())).collect();
    state.gather(&all);
    // The copies belong to no selection but their own.
    for selection in state.selections.values_mut() {
        selection.confidence[first..].fill(0.0);
    }
    for k in 0..count {
        let start = first + k * rows.len();
        let copy: Vec<u32> = (start as u32..(start + rows.len()) as u32).collect();
        transform(state, &copy, &Similarity::translation(step * (k + 1) as f64));
    }
    Selection::where_true(state.len(), |i| i >= first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_stand_in_a_row() {
        let gaussians = motes_testkit::random_gaussians(3, 5, 1);
        let mut state = EditState::new("t", gaussians, None, None, DVec3::Z);
        state.selections.insert("a".into(), Selection::all(5));
        let copies = duplicate(&mut state, &[1, 3], DVec3::X, 3);
        assert_eq!((state.len(), copies.count()), (11, 6));
        assert_eq!(state.selections["a"].count(), 5);
        let shift = state.gaussians.means[10][0] - state.gaussians.means[3][0];
        assert!((shift - 3.0).abs() < 1e-5, "{shift}");
        assert_eq!(state.origins[10].row, 3);
        assert_eq!(state.gaussians.sh_of(10), state.gaussians.sh_of(3));
    }
}
