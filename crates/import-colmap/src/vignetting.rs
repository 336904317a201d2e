//! Vignetting: how much darker a lens shows what is far from its axis.
//!
//! A point of the scene lies in the middle of one photo and near the border of another. What photo `i` shows of point `p` is
//!
//! ```text
//! x_ip = ln L_p + g_i + k ln cos θ_ip        x: log of linear brightness, g: log gain of the photo, θ: angle to the optical axis
//! ```
//!
//! `k` is 4 for a thin lens (natural vignetting) and 0 for photos that the camera has corrected. Points and photos are taken out
//! of both sides, robustly, and `k` is the slope of what is left (Goldman & Chen 2005 fit a polynomial in the same table; one number
//! needs fewer photos). It is kept where it is far above its standard error, with photos as the independent units, and where dark
//! and bright points say the same.

use std::collections::BTreeSet;

use motes_math::additive_fit::{AdditiveFit, Entry};

/// Residuals of log brightness beyond this count linearly.
const HUBER: f64 = 0.1;
/// Of log cosines, which hold no outliers: none is as large.
const ALL: f64 = 1.0;
const ROUNDS: usize = 200;
/// Solutions for the slope, each with the last one taken out.
const TURNS: usize = 4;
/// Photos and samples from which on there is anything to tell.
const LEAST_PHOTOS: usize = 5;
const LEAST_SAMPLES: usize = 200;
/// Standard errors that the exponent lies above 0.
const LEAST_SURENESS: f64 = 5.0;
/// Share of its light that a corner must lose.
const LEAST_LOSS: f64 = 0.05;
/// What dark and bright points say, the smaller over the larger: a lens is the same for both.
const LEAST_AGREEMENT: f64 = 0.5;

/// What a photo shows of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    pub(crate) point: usize,
    /// Log of linear brightness.
    pub(crate) log_brightness: f64,
    /// Log of the cosine of the angle to the optical axis.
    pub(crate) log_cosine: f64,
}

/// Light falls off with the cosine to a power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Vignetting {
    pub(crate) exponent: f64,
    /// Its standard error.
    error: f64,
    /// That of the darker and that of the brighter half of the points.
    halves: [f64; 2],
    /// Log cosine at the corner of a photo.
    corner: f64,
    photos: usize,
}

impl Vignetting {
    /// Whether photos are divided by it.
    pub(crate) fn is_evident(&self) -> bool {
        let [low, high] = [self.halves[0].min(self.halves[1]), self.halves[0].max(self.halves[1])];
        self.exponent > LEAST_SURENESS * self.error
            && self.loss() > LEAST_LOSS
            && low > LEAST_AGREEMENT * high
    }

    /// Share of its light that a corner loses.
    fn loss(&self) -> f64 {
        1.0 - (self.exponent * self.corner).exp()
    }

    /// What the report says about it.
    pub(crate) fn note(&self, is_kept: bool) -> String {
        let Self { exponent, error, halves: [dark, bright], photos, .. } = *self;
        let verdict = if is_kept { "kept: photos are divided by it" } else { "left out" };
        let loss = match 100.0 * self.loss() {
            loss if loss >= 0.5 => format!("corners lose {loss:.0} % of their light"),
            _ => "corners lose no light".to_owned(),
        };
        format!(
            "vignetting {verdict}; {loss} (cosine to the power {exponent:.1} ± {error:.1} from {photos} training photos, {dark:.1} by \
             dark points, {bright:.1} by bright ones)"
        )
    }
}

/// Fits the exponent to the training photos of one lens, whose corners have the log cosine `corner`; none where too little tells.
pub(crate) fn fit(photos: &[Vec<Sample>], points: usize, corner: f64) -> Option<Vignetting> {
    let (mut sums, mut counts) = (vec![0.0; points], vec![0u32; points]);
    for sample in photos.iter().flatten() {
        sums[sample.point] += sample.log_brightness;
        counts[sample.point] += 1;
    }
    let mean = |p: usize| sums[p] / f64::from(counts[p].max(1));
    let mut means: Vec<f64> = (0..points).filter(|&p| counts[p] > 1).map(mean).collect();
    means.sort_unstable_by(f64::total_cmp);
    let middle = *means.get(means.len() / 2)?;
    let told = |keep: &dyn Fn(usize) -> bool| {
        slope(photos, points, &|point| counts[point] > 1 && keep(point))
    };
    let (exponent, error) = told(&|_| true)?;
    let halves = [told(&|p| mean(p) < middle)?.0, told(&|p| mean(p) >= middle)?.0];
    let photos = photos.iter().filter(|samples| !samples.is_empty()).count();
    Some(Vignetting { exponent, error, halves, corner, photos })
}

/// The exponent that the points of `keep` tell, and its standard error.
fn slope(
    photos: &[Vec<Sample>],
    points: usize,
    keep: &dyn Fn(usize) -> bool,
) -> Option<(f64, f64)> {
    let samples: Vec<(usize, &Sample)> = (0..)
        .zip(photos)
        .flat_map(|(i, samples)| samples.iter().map(move |sample| (i, sample)))
        .filter(|(_, sample)| keep(sample.point))
        .collect();
    let seen_by: BTreeSet<usize> = samples.iter().map(|(i, _)| *i).collect();
    if samples.len() < LEAST_SAMPLES || seen_by.len() < LEAST_PHOTOS {
        return None;
    }
    let left = |huber: f64, value: &dyn Fn(&Sample) -> f64| {
        let entry = |&(i, sample): &(usize, &Sample)| Entry {
            row: i as u32,
            column: sample.point as u32,
            value: value(sample),
        };
        let entries: Vec<Entry> = samples.iter().map(entry).collect();
        let size = [photos.len(), points];
        let fit = AdditiveFit::solve(&entries, size, huber, ROUNDS, |rows| {
            let mean = rows.iter().sum::<f64>() / rows.len().max(1) as f64;
            rows.iter_mut().for_each(|row| *row -= mean);
        });
        let rest = |e: &Entry| e.value - fit.rows[e.row as usize] - fit.columns[e.column as usize];
        entries.iter().map(rest).collect::<Vec<f64>>()
    };
    let cosines = left(ALL, &|sample| sample.log_cosine);
    let squares: f64 = cosines.iter().map(|u| u * u).sum();
    if !(squares > 0.0) {
        return None;
    }
    let (mut exponent, mut scores, mut curvature) = (0.0, vec![0.0; photos.len()], 0.0);
    for _ in 0..TURNS {
        let rest = left(HUBER, &|sample| sample.log_brightness - exponent * sample.log_cosine);
        let weight = |r: f64| HUBER / r.abs().max(HUBER);
        scores.fill(0.0);
        for (((i, _), r), u) in samples.iter().zip(&rest).zip(&cosines) {
            scores[*i] += weight(*r) * r * u;
        }
        curvature = rest.iter().zip(&cosines).map(|(r, u)| weight(*r) * u * u).sum();
        exponent += scores.iter().sum::<f64>() / curvature;
    }
    let error = scores.iter().map(|s| s * s).sum::<f64>().sqrt() / curvature;
    (exponent.is_finite() && error.is_finite()).then_some((exponent, error))
}

#[cfg(test)]
impl Vignetting {
    /// A lens without doubts.
    pub(crate) fn of_exponent(exponent: f64) -> Self {
        Self { exponent, error: 0.0, halves: [exponent; 2], corner: -0.2, photos: 9 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of `photos` photos of 300 points under gains, with an exponent; `odd` is added to the log brightness.
    fn photos(count: usize, exponent: f64, odd: impl Fn(usize, usize) -> f64) -> Vec<Vec<Sample>> {
        let of = |i: usize| {
            let sample = |p: usize| {
                let wave = |s: f64| (s * (p * 7 + i * 13) as f64).sin();
                let log_cosine = -0.18 * (0.5 + 0.5 * wave(0.37)).powi(2);
                let gain = 0.4 * (1.9 * i as f64).sin();
                let noise = 0.02 * wave(5.1);
                let log_brightness = -1.0 - (p % 17) as f64 / 9.0 + gain + exponent * log_cosine;
                Sample { point: p, log_brightness: log_brightness + noise + odd(i, p), log_cosine }
            };
            (0..300).filter(|p| !(p + i).is_multiple_of(3)).map(sample).collect()
        };
        (0..count).map(of).collect()
    }

    #[test]
    fn a_falloff_is_found_under_gains_and_outliers() {
        for exponent in [1.0, 4.0, 6.0] {
            let highlights =
                |i: usize, p: usize| if (i * 31 + p).is_multiple_of(11) { 0.7 } else { 0.0 };
            let found = fit(&photos(12, exponent, highlights), 300, -0.18).unwrap();
            assert!((found.exponent - exponent).abs() < 0.25, "{found:?} for {exponent}");
            assert!(found.is_evident(), "{found:?}");
        }
    }

    #[test]
    fn photos_of_a_corrected_lens_stay_as_they_are() {
        assert!(!fit(&photos(12, 0.0, |_, _| 0.0), 300, -0.18).unwrap().is_evident());
        assert!(!fit(&photos(12, 0.1, |_, _| 0.0), 300, -0.18).unwrap().is_evident());
        // What brightens toward the border is no lens.
        assert!(!fit(&photos(12, -3.0, |_, _| 0.0), 300, -0.18).unwrap().is_evident());
        // Only dark points lose light: a curve of the camera, or haze.
        let of_dark = |exponent: f64| {
            let all = photos(12, exponent, |_, _| 0.0);
            let plain = photos(12, 0.0, |_, _| 0.0);
            let pick = |(a, b): (Vec<Sample>, Vec<Sample>)| {
                a.into_iter().zip(b).map(|(a, b)| if a.point % 17 > 8 { a } else { b }).collect()
            };
            all.into_iter().zip(plain).map(pick).collect::<Vec<Vec<Sample>>>()
        };
        assert!(!fit(&of_dark(4.0), 300, -0.18).unwrap().is_evident());
    }

    #[test]
    fn too_little_tells_nothing() {
        assert!(fit(&[], 0, -0.18).is_none());
        assert!(fit(&photos(4, 4.0, |_, _| 0.0), 300, -0.18).is_none());
        assert!(fit(&vec![Vec::new(); 12], 300, -0.18).is_none());
        // All points lie where they lie in every photo.
        let mut level = photos(12, 4.0, |_, _| 0.0);
        level.iter_mut().flatten().for_each(|s| s.log_cosine = -0.1);
        assert!(fit(&level, 300, -0.18).is_none_or(|found| !found.is_evident()));
    }
}
