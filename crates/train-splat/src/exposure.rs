//! Per-photo exposure: a gain and an offset per channel.
//!
//! Low capacity on purpose: a model that can paint over a photo's errors does not help the views
//! nobody took. The mean of all photos is kept at gain 1, offset 0, which is what held-out views
//! are rendered with.

use motes_math::adam::{AdamOptions, adam_step};

use crate::loss::{ColorTransform, LossValue};

/// Learning rate of log gains and offsets after [`Exposures::solve`].
const RATE: f32 = 1e-3;

/// Spread of the photos' log gains from which on exposures are worth their parameters. On photos
/// that differ by 6 % leaving them out scored 0.4 dB better on held-out views (view-dependent
/// color follows neighboring photos, exposures do not carry over to a view nobody took); at 10 %
/// a gray of one half errs by 13 steps of 255, which alone limits PSNR to 26 dB.
pub(crate) const NEEDED_SPREAD: f64 = 0.1;

/// Root mean square over photos and channels of the log gain that would fit the rendering to
/// each photo best, after the mean over photos is taken out.
///
/// `sums` as in [`Exposures::solve`].
pub(crate) fn gain_spread(sums: &[[[f64; 5]; 3]]) -> f64 {
    let mut sum = 0.0;
    for c in 0..3 {
        let gains: Vec<f64> =
            sums.iter().map(|p| (p[c][4].max(1e-9) / p[c][3].max(1e-9)).ln()).collect();
        let mean = gains.iter().sum::<f64>() / gains.len().max(1) as f64;
        sum += gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>();
    }
    (sum / (3 * sums.len()).max(1) as f64).sqrt()
}

/// Exposure of every training photo.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exposures {
    /// Per photo: log gain r, g, b, then offset r, g, b.
    pub values: Vec<[f32; 6]>,
    /// Adam's first moments.
    pub first: Vec<[f32; 6]>,
    /// Adam's second moments.
    pub second: Vec<[f32; 6]>,
    /// Steps taken per photo.
    pub steps: Vec<u64>,
}

impl Exposures {
    pub(crate) fn identity(views: usize) -> Self {
        let zeros = vec![[0.0; 6]; views];
        Self { values: zeros.clone(), first: zeros.clone(), second: zeros, steps: vec![0; views] }
    }

    /// Adds views that are taken as they are.
    pub(crate) fn extend(&mut self, views: usize) {
        let Self { values, first, second, steps } = Self::identity(views);
        self.values.extend(values);
        self.first.extend(first);
        self.second.extend(second);
        self.steps.extend(steps);
    }

    /// The transform of one photo.
    pub fn transform(&self, view: usize) -> ColorTransform {
        let v = self.values[view];
        ColorTransform { gain: [v[0].exp(), v[1].exp(), v[2].exp()], offset: [v[3], v[4], v[5]] }
    }

    /// Starts from the gains (and offsets where asked) that fit a rendering of each photo best, after
    /// the mean over photos is taken out: steps alone would need hundreds of visits to a photo.
    ///
    /// `sums` holds per photo and channel `n, Σ x, Σ y, Σ x², Σ x y` (rendering `x`, photo `y`).
    pub(crate) fn solve(&mut self, sums: &[[[f64; 5]; 3]], offsets: bool) {
        for (value, sums) in self.values.iter_mut().zip(sums) {
            for (c, &[n, x, y, xx, xy]) in sums.iter().enumerate() {
                let variance = n * xx - x * x;
                let affine = offsets && variance > 1e-6 * n * n;
                let gain = if affine { (n * xy - x * y) / variance } else { xy / xx.max(1e-12) };
                let gain = if gain.is_finite() { gain.clamp(0.1, 10.0) } else { 1.0 };
                value[c] = gain.ln() as f32;
                value[c + 3] = if affine { ((y - gain * x) / n) as f32 } else { 0.0 };
            }
        }
        self.center();
    }

    /// One step for one photo (gains, and offsets where asked), then the mean of all photos is taken
    /// back to the identity.
    ///
    /// `metadata_gain` is the factor on the photo's gains that its metadata gave.
    pub(crate) fn step(
        &mut self,
        view: usize,
        metadata_gain: f32,
        loss: &LossValue,
        offsets: bool,
    ) {
        // The derivative by a log gain is that by the whole gain times the whole gain.
        let gain = self.transform(view).brighter(metadata_gain).gain;
        let gradient: [f32; 6] = std::array::from_fn(|k| match k {
            0..3 => (loss.d_gain[k] * f64::from(gain[k])) as f32,
            _ if !offsets => 0.0,
            _ => loss.d_offset[k - 3] as f32,
        });
        self.steps[view] += 1;
        adam_step(
            &mut self.values[view],
            &gradient,
            &mut self.first[view],
            &mut self.second[view],
            &[RATE],
            self.steps[view],
            &AdamOptions::default(),
        );
        self.center();
    }

    fn center(&mut self) {
        for k in 0..6 {
            let mean = self.values.iter().map(|v| f64::from(v[k])).sum::<f64>()
                / self.values.len().max(1) as f64;
            for v in &mut self.values {
                v[k] -= mean as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_all_photos_stays_the_identity() {
        let mut exposures = Exposures::identity(3);
        for step in 0..50 {
            let loss = LossValue {
                d_gain: [0.1, -0.2, 0.0],
                d_offset: [0.0, 0.1, -0.3],
                ..LossValue::default()
            };
            exposures.step(step % 2, 1.0, &loss, true);
        }
        for k in 0..6 {
            let sum: f32 = exposures.values.iter().map(|v| v[k]).sum();
            assert!(sum.abs() < 1e-5, "component {k}: {sum}");
        }
        assert!(exposures.values[0][0] < 0.0 && exposures.values[2][0] > 0.0);
    }

    #[test]
    fn solved_exposures_are_those_that_were_applied() {
        // x = 0.1 .. 0.9, y = gain x + offset.
        let photo = |gain: f64, offset: f64| {
            let mut s = [0.0; 5];
            for i in 1..10 {
                let x = 0.1 * f64::from(i);
                let y = gain * x + offset;
                for (sum, term) in s.iter_mut().zip([1.0, x, y, x * x, x * y]) {
                    *sum += term;
                }
            }
            [s; 3]
        };
        let mut exposures = Exposures::identity(2);
        exposures.solve(&[photo(1.25, 0.1), photo(0.8, -0.1)], true);
        for c in 0..3 {
            assert!((exposures.values[0][c] - 1.25f32.ln()).abs() < 1e-5);
            assert!((exposures.values[1][c + 3] + 0.1).abs() < 1e-5);
        }
        exposures.solve(&[photo(1.25, 0.0), photo(0.8, 0.0)], false);
        assert!((exposures.values[0][0] - 1.25f32.ln()).abs() < 1e-5);
        assert_eq!(exposures.values[0][3], 0.0);
        exposures.solve(&[[[0.0; 5]; 3], photo(1.0, 0.0)], true);
        assert!(exposures.values.iter().flatten().all(|v| v.is_finite()));
    }

    #[test]
    fn spread_measures_differences_not_the_common_level() {
        let photo = |gain: f64| [[4.0, 2.0, gain * 2.0, 2.0, gain * 2.0]; 3];
        assert!(gain_spread(&[photo(1.7), photo(1.7), photo(1.7)]) < 1e-9);
        let spread = gain_spread(&[photo(1.1), photo(1.0 / 1.1)]);
        assert!((spread - 1.1f64.ln()).abs() < 1e-9, "{spread}");
        assert_eq!(gain_spread(&[]), 0.0);
    }
}
