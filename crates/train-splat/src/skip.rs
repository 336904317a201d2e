//! Leaving out the backward pass of views that have converged.
//!
//! Backward kernels and chain are about half of a step. Once the number of Gaussians is fixed, a
//! view whose loss is at or below its own running mean tells little that the last visits did not;
//! its gradient is left out, up to a share of the views so that none is forgotten (after SkipGS,
//! arXiv 2603.08997).

/// Decay of the running mean of a view's loss, per visit.
const DECAY: f32 = 0.8;

/// What decides: a running mean per view and how often it was used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkipState {
    /// Running mean of each view's loss; 0 before its first visit.
    pub baseline: Vec<f32>,
    /// Visits that could have been left out.
    pub eligible: u64,
    /// Visits that were.
    pub skipped: u64,
}

impl SkipState {
    pub(crate) fn new(views: usize) -> Self {
        Self { baseline: vec![0.0; views], ..Self::default() }
    }

    /// Notes a visit; whether its gradient may be left out. `share` bounds how many are.
    pub(crate) fn visit(&mut self, view: usize, loss: f64, share: f64) -> bool {
        let loss = loss as f32;
        let Some(baseline) = self.baseline.get_mut(view) else { return false };
        let usual = *baseline;
        *baseline = if usual > 0.0 { usual * DECAY + loss * (1.0 - DECAY) } else { loss };
        if !(share > 0.0) || !(usual > 0.0) {
            return false;
        }
        self.eligible += 1;
        let room = (self.skipped + 1) as f64 <= share * self.eligible as f64;
        let skip = room && loss <= usual;
        self.skipped += u64::from(skip);
        skip
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn converged_views_are_skipped_up_to_the_share_and_worse_ones_never() {
        let mut state = SkipState::new(2);
        let skips = (0..100).filter(|_| state.visit(0, 0.1, 0.4)).count();
        assert!((35..=40).contains(&skips), "{skips}");
        let mut state = SkipState::new(2);
        let worse = (0..50).filter(|i| state.visit(1, 0.1 + f64::from(*i) * 0.01, 0.9)).count();
        assert_eq!(worse, 0);
        assert!(!(0..50).any(|_| state.visit(0, 0.1, 0.0)));
    }
}
