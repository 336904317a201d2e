//! Taking Gaussians away, or keeping them alone.

use glam::DVec3;

use crate::{EditState, Fill};

/// Removes the Gaussians of `rows`, ascending; what becomes visible is to be filled.
pub fn delete(state: &mut EditState, rows: &[u32], fill: Fill) {
    state.remove(rows, fill);
}

/// Keeps the Gaussians of `rows`, ascending, alone.
pub fn extract(state: &mut EditState, rows: &[u32]) {
    state.gather(rows);
}

/// Rows with centers in a box along the axes, bounds included.
pub fn rows_in_box(state: &EditState, min: DVec3, max: DVec3) -> Vec<u32> {
    rows_where(state, |p| p.cmpge(min).all() && p.cmple(max).all())
}

/// Rows with centers in a ball.
pub fn rows_in_sphere(state: &EditState, center: DVec3, radius: f64) -> Vec<u32> {
    rows_where(state, |p| p.distance(center) <= radius)
}

fn rows_where(state: &EditState, inside: impl Fn(DVec3) -> bool) -> Vec<u32> {
    let means = &state.gaussians.means;
    let inside = |i: &u32| inside(DVec3::from_array(means[*i as usize].map(f64::from)));
    (0..state.len() as u32).filter(inside).collect()
}

/// The rows that are not in `rows`, both ascending.
pub fn other_rows(rows: &[u32], n: usize) -> Vec<u32> {
    let mut inside = rows.iter().copied().peekable();
    (0..n as u32).filter(|row| inside.next_if_eq(row).is_none()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_split_the_rows() {
        let gaussians = motes_testkit::random_gaussians(3, 200, 0);
        let mut state = EditState::new("t", gaussians, None, None, DVec3::Z);
        let ball = rows_in_sphere(&state, DVec3::ZERO, 0.7);
        let others = other_rows(&ball, 200);
        assert!(!ball.is_empty() && !others.is_empty());
        assert_eq!(ball.len() + others.len(), 200);
        let in_box = rows_in_box(&state, DVec3::splat(-9.0), DVec3::splat(9.0));
        assert_eq!(in_box.len(), 200);
        extract(&mut state, &ball);
        assert_eq!(rows_in_sphere(&state, DVec3::ZERO, 0.7).len(), state.len());
        delete(&mut state, &[0], Fill::None);
        assert_eq!(state.len(), ball.len() - 1);
    }
}
