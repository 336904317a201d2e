//! The tone curve, from how much dark, middle and bright points answer to the gains.

use motes_math::additive_fit::Entry;
use motes_math::srgb;
use motes_math::tone_curve::ToneCurve;
use rayon::prelude::*;

use super::{HUBER, LEAST_CONTRAST, LEAST_EVIDENCE, LEAST_PHOTOS, Table};

/// Steps of brightness, of what photos show.
const BINS: usize = 9;
/// Darkest and brightest.
const SHOWN: [f32; 2] = [0.05, 0.95];
/// A step with fewer values says nothing.
const LEAST_VALUES: usize = 200;
/// Steps that must say something.
const LEAST_BINS: usize = 4;
/// Errors that the scatter over photos does not show: the family of curves, light that changes.
const FLOOR: f64 = 0.03;
/// Every so many points: one number needs few.
const EVERY: usize = 4;
/// Contrasts that are tried first, and rounds of halving the step around the best of them.
const TRIED: usize = 7;
const ROUNDS: usize = 4;

/// A tone curve and its evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Response {
    pub(super) curve: ToneCurve,
    /// Drop of chi square against no curve.
    pub(super) evidence: f64,
    /// Steps of brightness that it rests on.
    pub(super) bins: usize,
}

impl Response {
    pub(super) fn is_evident(&self) -> bool {
        self.evidence >= LEAST_EVIDENCE && self.curve.contrast().abs() >= LEAST_CONTRAST
    }
}

/// The curve under which all brightnesses answer alike; `None` where too little tells.
pub(super) fn find(table: &Table) -> Option<Response> {
    let misfit = |contrast: f32| misfit(table, ToneCurve::new(contrast));
    let [low, high] = ToneCurve::RANGE;
    let mut step = (high - low) / (TRIED - 1) as f32;
    let none = misfit(0.0)?;
    let best_of = |contrasts: Vec<f32>| {
        let all: Vec<(f32, Option<Misfit>)> =
            contrasts.into_par_iter().map(|c| (c, misfit(c))).collect();
        let found = all.into_iter().filter_map(|(c, m)| Some((c, m?)));
        // The first of equals.
        found.reduce(|a, b| if b.1.chi_square < a.1.chi_square { b } else { a })
    };
    let mut best = best_of((0..TRIED).map(|k| low + k as f32 * step).collect())?;
    for _ in 0..ROUNDS {
        step *= 0.5;
        if let Some(beside) = best_of(vec![best.0 - step, best.0 + step]) {
            best = if beside.1.chi_square < best.1.chi_square { beside } else { best };
        }
    }
    let evidence = none.chi_square - best.1.chi_square;
    Some(Response { curve: ToneCurve::new(best.0), evidence, bins: best.1.bins })
}

/// How unequally brightnesses answer.
#[derive(Clone, Copy)]
struct Misfit {
    chi_square: f64,
    bins: usize,
}

fn misfit(table: &Table, curve: ToneCurve) -> Option<Misfit> {
    let entries = table.entries(curve, |k| k.is_multiple_of(EVERY));
    let gains = table.solve(&entries);
    let answers: Vec<Answer> = answers(&entries, &gains, 3 * table.points.len(), curve)
        .iter()
        .filter_map(|told| answer(told, table.lights.len()))
        .collect();
    if answers.len() < LEAST_BINS {
        return None;
    }
    let weight = |a: &Answer| 1.0 / (a.error * a.error + FLOOR * FLOOR);
    let weights: f64 = answers.iter().map(weight).sum();
    let mean = answers.iter().map(|a| weight(a) * a.slope).sum::<f64>() / weights;
    let chi_square = answers.iter().map(|a| weight(a) * (a.slope - mean).powi(2)).sum();
    Some(Misfit { chi_square, bins: answers.len() })
}

/// A value against the mean of the same point in the other photos: the difference of gains, and of log radiance.
struct Told {
    photo: usize,
    gain: f64,
    value: f64,
}

/// By the brightness of the point in the other photos, which its own noise does not move.
fn answers(entries: &[Entry], gains: &[f64], columns: usize, curve: ToneCurve) -> Vec<Vec<Told>> {
    let mut sums = vec![[0.0; 3]; columns];
    for e in entries {
        let sum = &mut sums[e.column as usize];
        let terms = [1.0, e.value, gains[e.row as usize]];
        sum.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }
    let mut bins: Vec<Vec<Told>> = (0..BINS).map(|_| Vec::new()).collect();
    for e in entries {
        let [count, values, all_gains] = sums[e.column as usize];
        let own = gains[e.row as usize];
        let others = 1.0 / (count - 1.0);
        let (mean, mean_gain) = ((values - e.value) * others, (all_gains - own) * others);
        let shown = curve.apply(srgb::encode(mean.exp() as f32));
        let bin = (shown - SHOWN[0]) / (SHOWN[1] - SHOWN[0]) * BINS as f32;
        if bin >= 0.0 && bin < BINS as f32 {
            let told =
                Told { photo: e.row as usize / 3, gain: own - mean_gain, value: e.value - mean };
            bins[bin as usize].push(told);
        }
    }
    bins
}

/// Slope of values over gains, through 0.
struct Answer {
    slope: f64,
    /// Standard error, photos being independent.
    error: f64,
}

fn answer(told: &[Told], photos: usize) -> Option<Answer> {
    const TURNS: usize = 15;
    if told.len() < LEAST_VALUES {
        return None;
    }
    let mut slope = 1.0;
    let weight = |t: &Told, slope: f64| HUBER / (t.value - slope * t.gain).abs().max(HUBER);
    let mut squares = 0.0;
    for _ in 0..TURNS {
        let (mut products, mut sum) = (0.0, 0.0);
        for t in told {
            let w = weight(t, slope);
            products += w * t.gain * t.value;
            sum += w * t.gain * t.gain;
        }
        if !(sum > 0.0) {
            return None;
        }
        (slope, squares) = (products / sum, sum);
    }
    let mut scores = vec![0.0; photos];
    for t in told {
        scores[t.photo] += weight(t, slope) * t.gain * (t.value - slope * t.gain);
    }
    if scores.iter().filter(|s| **s != 0.0).count() < LEAST_PHOTOS {
        return None;
    }
    let error = scores.iter().map(|s| s * s).sum::<f64>().sqrt() / squares;
    (slope.is_finite() && error.is_finite()).then_some(Answer { slope, error })
}
