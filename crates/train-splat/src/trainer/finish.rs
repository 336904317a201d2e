//! The end of a fit: Gaussians and color bands that no photo needs go.
//!
//! The contribution of a Gaussian is its blending weight `α T` summed over all pixels of all
//! training photos. Those that add up to a small share of the whole are removed, and the higher SH
//! bands of Gaussians whose view dependence is invisible are set to zero. Each step is taken only as far
//! as the training error says it is free: from the largest share down, the first that changes the
//! mean PSNR of the training photos by at most [`TOLERANCE_DB`] and that of no photo by more than
//! [`PHOTO_TOLERANCE_DB`]. Nothing is taken from a fit that has failed.

use motes_math::sh::SH_C0;
use motes_raster::{Modifiers, Planes, RenderOptions};
use motes_scene::Gaussians;

use super::Trainer;
use crate::auto::{Decision, ModelChoice};

/// Change of the training PSNR that removing what carries nothing may cost, dB.
const TOLERANCE_DB: f64 = 0.01;
/// Change of the PSNR of a single photo that it may cost, dB.
const PHOTO_TOLERANCE_DB: f64 = 0.1;
/// Shares of the summed contribution that are tried.
const SHARES: [f64; 5] = [1e-2, 3e-3, 1e-3, 3e-4, 0.0];
/// Root mean square of view dependence over directions below which it is tried to be left out, in
/// units of an 8-bit step.
const STEPS_8BIT: [f32; 3] = [2.0, 1.0, 0.5];
/// The error is measured on at most so many photos, evenly chosen: a change of 0.01 dB shows in any of
/// them, since the same photos are compared before and after.
pub(super) const JUDGES: usize = 12;
/// Contributions are summed over at most so many photos, evenly chosen.
const WITNESSES: usize = 64;

/// PSNR of each photo looked at, dB.
pub(super) struct Scores(Vec<f64>);

impl Scores {
    pub(super) fn mean(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len().max(1) as f64
    }

    /// Whether these are worse than `before` by at most `mean` on average, and on no photo by much.
    pub(super) fn is_within(&self, before: &Self, mean: f64) -> bool {
        let worst = self.0.iter().zip(&before.0).map(|(a, b)| a - b).fold(0.0, f64::min);
        self.mean() - before.mean() >= -mean && worst >= -PHOTO_TOLERANCE_DB.max(mean)
    }
}

impl Trainer {
    /// Removes what carries no information; once, after the last step. Does nothing but with
    /// `--model auto` and without a time budget.
    pub fn finish(&mut self) {
        let auto = self.options.model == ModelChoice::Auto && self.options.freeze.is_empty();
        // A timed run has spent its time.
        if !auto || self.is_timed() {
            return;
        }
        let failed = self.health().failure(self.state.gaussians.len(), self.plan.iterations);
        if failed.is_some() {
            let n = self.state.gaussians.len();
            let reason = "the fit has failed: no part of it can be told useless".to_owned();
            self.state.model.decisions.push(Decision::new("pruning", n, "measured", reason));
            return;
        }
        let before = self.training_psnr();
        self.prune_useless(&before);
        self.zero_invisible_bands(&before);
        let model = &mut self.state.model;
        model.sh_degree = self.state.gaussians.sh_degree;
        self.plan.sh_degree = model.sh_degree;
    }

    fn prune_useless(&mut self, before: &Scores) {
        let contribution = self.contributions();
        let total: f64 = contribution.iter().sum();
        let mut order: Vec<u32> = (0..contribution.len() as u32).collect();
        order.sort_by(|&a, &b| {
            contribution[a as usize].total_cmp(&contribution[b as usize]).then(a.cmp(&b))
        });
        let n = order.len();
        let whole = self.state.gaussians.clone();
        let filter = self.state.filter_3d.clone();
        let mut decision = Decision::new("pruning", n, "measured", String::new());
        for share in SHARES {
            let mut sum = 0.0;
            let useless = order
                .iter()
                .take_while(|i| {
                    sum += contribution[**i as usize];
                    sum <= share * total
                })
                .count();
            if useless == 0 || useless == n {
                continue;
            }
            let mut rows = order[useless..].to_vec();
            rows.sort_unstable();
            self.keep_rows(&whole, &filter, &rows);
            let after = self.training_psnr();
            let change = after.mean() - before.mean();
            if after.is_within(before, TOLERANCE_DB) {
                let sh_row = 3 * whole.sh_coefficients();
                let state = &mut self.state;
                state.moments.gather(&rows, &vec![false; rows.len()], sh_row);
                let pick = |v: &mut Vec<f32>| *v = rows.iter().map(|&r| v[r as usize]).collect();
                pick(&mut state.refine_stats.pull);
                let seen = &mut state.refine_stats.seen;
                *seen = rows.iter().map(|&r| seen[r as usize]).collect();
                decision.kept = (n - useless).to_string();
                decision.reason = format!(
                    "{useless} of {n} Gaussians make {:.2} % or less of all blending weight; without them \
                     the training PSNR changes by {change:+.4} dB (at most -{TOLERANCE_DB})",
                    100.0 * share
                );
                break;
            }
            self.keep_rows(&whole, &filter, &(0..n as u32).collect::<Vec<_>>());
        }
        if decision.reason.is_empty() {
            decision.reason =
                format!("no share of the blending weight costs less than {TOLERANCE_DB} dB");
        }
        self.state.model.decisions.push(decision);
    }

    pub(super) fn keep_rows(&mut self, whole: &Gaussians, filter: &[f32], rows: &[u32]) {
        self.state.gaussians = whole.clone();
        self.state.gaussians.gather(rows);
        if !filter.is_empty() {
            self.state.filter_3d = rows.iter().map(|&r| filter[r as usize]).collect();
        }
    }

    fn zero_invisible_bands(&mut self, before: &Scores) {
        let degree = self.state.gaussians.sh_degree;
        if degree == 0 {
            return;
        }
        let row = 3 * self.state.gaussians.sh_coefficients();
        // The basis is orthonormal: the mean square over directions is the sum of squares over 4π.
        let strength: Vec<f32> = self
            .state
            .gaussians
            .sh
            .chunks_exact(row)
            .map(|sh| {
                (sh[3..].iter().map(|v| v * v).sum::<f32>() / (3.0 * 4.0 * std::f32::consts::PI))
                    .sqrt()
            })
            .collect();
        let whole = self.state.gaussians.sh.clone();
        let reason = "no Gaussian's view dependence is free to leave out".to_owned();
        let mut decision = Decision::new("sh-degree-per-gaussian", 0, "measured", reason);
        for steps in STEPS_8BIT {
            let mut zeroed = 0;
            for (sh, s) in self.state.gaussians.sh.chunks_exact_mut(row).zip(&strength) {
                if *s < steps / 255.0 {
                    sh[3..].fill(0.0);
                    zeroed += 1;
                }
            }
            let after = self.training_psnr();
            let change = after.mean() - before.mean();
            if zeroed > 0 && after.is_within(before, 2.0 * TOLERANCE_DB) {
                let n = strength.len();
                decision.kept = format!("degree 0 for {zeroed} of {n}");
                decision.reason = format!(
                    "{zeroed} of {n} Gaussians vary with direction by less than {steps} of 255 \
                     (root mean square); at degree 0 they save {} of {} stored values, with \
                     pruning the training PSNR changes by {change:+.4} dB",
                    zeroed * (row - 3),
                    n * (11 + row)
                );
                if zeroed == n {
                    self.put_sh_degree(0);
                }
                break;
            }
            self.state.gaussians.sh.clone_from(&whole);
        }
        self.state.model.decisions.push(decision);
    }

    /// `Σ α T` of every Gaussian over the pixels of training photos that count.
    ///
    /// The gradient of the sum of the red channel by a Gaussian's red, which one backward pass with
    /// a gradient image of ones gives.
    fn contributions(&mut self) -> Vec<f64> {
        let mut gray = self.state.gaussians.with_sh_degree(0);
        gray.sh.fill(0.0);
        let modifiers = Modifiers::with_filter(&self.state.filter_3d);
        let options = RenderOptions::default();
        let mut sums = vec![0.0; gray.len()];
        // The finest resolution but one: shares of the weight hardly depend on it, the cost does.
        let level = self.plan.stages.len().saturating_sub(2);
        let n = self.views.len();
        let take = n.min(WITNESSES);
        for i in 0..take {
            let (transform, target) = &self.views[i * n / take].levels[level];
            self.frame.forward(&gray, transform, &modifiers, &options);
            let mut ones = Planes::new(target.width, target.height, 4);
            for y in 0..target.height {
                for (x, value) in ones.row_mut(0, y).iter_mut().enumerate() {
                    let at = y * target.width + x;
                    *value = f32::from(u8::from(target.weight.as_ref().is_none_or(|w| w[at] > 0)));
                }
            }
            self.frame.backward(&gray, &modifiers, &options, &ones, &mut self.gradients);
            for (sum, d) in sums.iter_mut().zip(self.gradients.sh.chunks_exact(3)) {
                *sum += f64::from(d[0]) / SH_C0;
            }
        }
        sums
    }

    /// PSNR of training photos at the finest resolution, with their exposures.
    fn training_psnr(&mut self) -> Scores {
        self.training_psnr_at(self.plan.stages.len() - 1)
    }

    /// The same at any resolution.
    pub(super) fn training_psnr_at(&mut self, level: usize) -> Scores {
        let n = self.views.len();
        let take = n.min(JUDGES);
        let background = self.color_behind();
        let modifiers = Modifiers::with_filter(&self.state.filter_3d);
        let options = RenderOptions {
            background,
            parameters: self.options.raster,
            ..RenderOptions::default()
        };
        let mut gradient: Option<Planes> = None;
        let mut scores = Vec::with_capacity(take);
        for i in 0..take {
            let view = i * n / take;
            let color = self.color_transform(view);
            let (transform, target) = &self.views[view].levels[level];
            let image = self.frame.forward(&self.state.gaussians, transform, &modifiers, &options);
            let scratch = gradient
                .take()
                .filter(|g| [g.width, g.height] == [target.width, target.height])
                .unwrap_or_else(|| Planes::new(target.width, target.height, 4));
            let scratch = gradient.insert(scratch);
            let value = self.loss.evaluate(image, target, background, color, 0.0, scratch);
            scores.push(-10.0 * value.mse.max(1e-12).log10());
        }
        Scores(scores)
    }
}
