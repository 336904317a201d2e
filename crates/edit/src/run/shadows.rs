//! Shadows of a plain splat, as operations go.

use glam::DVec3;

use super::Run;
use crate::EditState;
use crate::changes::ratio_shadow::RatioShadow;

impl Run<'_> {
    /// Says on a plain splat that light does not follow.
    pub(crate) fn unlit(&mut self, state: &EditState, at: &str, what: &str) {
        if state.parts.is_none() && !self.ratio_shadow {
            let text = format!(
                "a plain splat has its light in its colors: {what}; --shadow ratio moves shadows roughly, decompose finds the light"
            );
            self.warn(at, text);
        }
    }

    /// The shadow of what is about to leave its place, when shadows follow by ratio; it is taken away.
    pub(crate) fn lift_shadow(
        &mut self,
        state: &mut EditState,
        rows: &[u32],
        at: &str,
    ) -> Option<RatioShadow> {
        if !self.ratio_shadow {
            return None;
        }
        let shadow = RatioShadow::read(state, rows);
        match &shadow {
            Some(shadow) => {
                shadow.apply(&mut state.gaussians, DVec3::ZERO, true, rows);
            }
            None => self.warn(at, "there is no ground beside it to read its shadow off"),
        }
        shadow
    }

    /// The contact shadow of what was inserted.
    pub(crate) fn drop_ball_shadow(&mut self, state: &mut EditState, rows: &[u32], at: &str) {
        if !self.ratio_shadow {
            return;
        }
        match RatioShadow::of_ball(state, rows) {
            Some(shadow) => {
                shadow.apply(&mut state.gaussians, DVec3::ZERO, false, rows);
            }
            None => self.warn(at, "there is no ground for its shadow to fall on"),
        }
    }
}
