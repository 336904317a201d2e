//! Per-photo exposure: a gain and an offset per channel.
//!
//! Low capacity on purpose: a model that can paint over a photo's errors does not help the views
//! nobody took. The mean of all photos is kept at gain 1, offset 0, which is what held-out views
//! are rendered with.

use motes_math::adam::{AdamOptions, adam_step};

use crate::loss::{ColorTransform, LossValue};

/// Learning rate of log gains and offsets.
const RATE: f32 = 2e-3;

/// Spread of the photos' log gains from which on exposures are worth their parameters. On photos
/// that differ by 6 % leaving them out scored 0.4 dB better on held-out views (view-dependent
/// colour follows neighbouring photos, exposures do not carry over to a view nobody took); at 10 %
/// a grey of one half errs by 13 steps of 255, which alone limits PSNR to 26 dB.
pub(crate) const NEEDED_SPREAD: f64 = 0.1;

/// Root mean square over photos and channels of the log gain that would fit the rendering to
/// each photo best, after the mean over photos is taken out.
///
/// `pairs` holds per photo `Σ x y` and `Σ x²` per channel (rendering `x`, photo `y`).
pub(crate) fn gain_spread(pairs: &[[[f64; 2]; 3]]) -> f64 {
    let mut sum = 0.0;
    for c in 0..3 {
        let gains: Vec<f64> =
            pairs.iter().map(|p| (p[c][0].max(1e-9) / p[c][1].max(1e-9)).ln()).collect();
        let mean = gains.iter().sum::<f64>() / gains.len().max(1) as f64;
        sum += gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>();
    }
    (sum / (3 * pairs.len()).max(1) as f64).sqrt()
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

    /// The transform of one photo.
    pub fn transform(&self, view: usize) -> ColorTransform {
        let v = self.values[view];
        ColorTransform { gain: [v[0].exp(), v[1].exp(), v[2].exp()], offset: [v[3], v[4], v[5]] }
    }

    /// One step for one photo, then the mean of all photos is taken back to the identity.
    pub(crate) fn step(&mut self, view: usize, loss: &LossValue) {
        let gain = self.transform(view).gain;
        let gradient: [f32; 6] = std::array::from_fn(|k| match k {
            0..3 => (loss.d_gain[k] * f64::from(gain[k])) as f32,
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
            exposures.step(step % 2, &loss);
        }
        for k in 0..6 {
            let sum: f32 = exposures.values.iter().map(|v| v[k]).sum();
            assert!(sum.abs() < 1e-5, "component {k}: {sum}");
        }
        assert!(exposures.values[0][0] < 0.0 && exposures.values[2][0] > 0.0);
    }

    #[test]
    fn spread_measures_differences_not_the_common_level() {
        let photo = |gain: f64| [[gain * 2.0, 2.0]; 3];
        assert!(gain_spread(&[photo(1.7), photo(1.7), photo(1.7)]) < 1e-9);
        let spread = gain_spread(&[photo(1.1), photo(1.0 / 1.1)]);
        assert!((spread - 1.1f64.ln()).abs() < 1e-9, "{spread}");
        assert_eq!(gain_spread(&[]), 0.0);
    }
}
