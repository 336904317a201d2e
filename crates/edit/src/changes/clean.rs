//! What hurts other programs: values that are not numbers, and bands that nobody needs.

use crate::EditState;

/// Removes Gaussians with values that are not numbers; returns how many.
pub fn drop_nan(state: &mut EditState) -> usize {
    let invalid = state.gaussians.invalid_rows();
    if !invalid.is_empty() {
        let kept = super::delete::other_rows(&invalid, state.len());
        state.gather(&kept);
    }
    invalid.len()
}

/// Drops the bands above `degree`; whether there were any.
pub fn sh_reduce(state: &mut EditState, degree: u8) -> bool {
    if degree >= state.gaussians.sh_degree {
        return false;
    }
    state.gaussians = state.gaussians.with_sh_degree(degree);
    true
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn broken_rows_go_and_bands_are_dropped() {
        let mut gaussians = motes_testkit::random_gaussians(3, 8, 2);
        gaussians.means[2][1] = f32::NAN;
        gaussians.sh[5 * 27] = f32::INFINITY;
        let mut state = EditState::new("t", gaussians, None, None, DVec3::Z);
        assert_eq!(drop_nan(&mut state), 2);
        assert_eq!(drop_nan(&mut state), 0);
        assert_eq!(state.origins.iter().map(|o| o.row).collect::<Vec<_>>(), [0, 1, 3, 4, 6, 7]);
        let dc = state.gaussians.sh_of(3)[..3].to_vec();
        assert!(sh_reduce(&mut state, 0) && !sh_reduce(&mut state, 1));
        assert_eq!(state.gaussians.sh_of(3), dc);
    }
}
