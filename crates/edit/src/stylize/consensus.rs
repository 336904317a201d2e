//! What edited pictures agree on.

use glam::Vec3;
use motes_scene::ImageF32;

use super::pixel;
use super::warp::{Sight, seen_by};

/// Rounds in which gains and consensus follow each other.
const GAIN_ROUNDS: usize = 3;
/// Keeps black from deciding a gain.
const DARK: f32 = 0.02;
/// Pixels of which the chosen Gaussians have less do not count.
const LEAST_SHARE: f32 = 0.5;

/// Pictures of other views, all of one weight.
fn others<'a>(
    sights: &'a [Sight],
    pictures: &'a [ImageF32],
    but: usize,
    weights: &[f32],
) -> Vec<(&'a Sight, &'a ImageF32, f32)> {
    let all = sights.iter().zip(pictures).zip(weights).enumerate();
    all.filter(|(i, _)| *i != but).map(|(_, ((s, p), w))| (s, p, *w)).collect()
}

/// Root mean square difference of each picture to what the others show at the same points, where the chosen Gaussians
/// are; NaN where no other view sees them.
pub(super) fn disagreements(sights: &[Sight], pictures: &[ImageF32]) -> Vec<f64> {
    let even = vec![1.0; sights.len()];
    (0..sights.len())
        .map(|i| {
            let seen = seen_by(&sights[i], &others(sights, pictures, i, &even));
            let (mut sum, mut n) = (0.0, 0u64);
            for (at, (color, weight)) in seen.iter().enumerate() {
                if *weight > 0.0 && sights[i].share.data[at] >= LEAST_SHARE {
                    sum += f64::from((pixel(&pictures[i], at) - *color).length_squared()) / 3.0;
                    n += 1;
                }
            }
            (sum / n as f64).sqrt()
        })
        .collect()
}

/// Pictures with one gain per channel each, so that all agree on the brightness of what they share. The mean of the gains'
/// logarithms stays 0: the edit as a whole gets neither brighter nor darker.
pub(super) fn harmonized(sights: &[Sight], mut pictures: Vec<ImageF32>) -> Vec<ImageF32> {
    let even = vec![1.0; sights.len()];
    for _ in 0..GAIN_ROUNDS {
        let mut logs: Vec<Vec3> = (0..sights.len())
            .map(|i| {
                let seen = seen_by(&sights[i], &others(sights, &pictures, i, &even));
                log_gain(&sights[i], &pictures[i], &seen)
            })
            .collect();
        let mean = logs.iter().sum::<Vec3>() / logs.len().max(1) as f32;
        logs.iter_mut().for_each(|log| *log -= mean);
        for ((sight, picture), log) in sights.iter().zip(&mut pictures).zip(&logs) {
            apply_gain(sight, picture, *log);
        }
    }
    pictures
}

/// Half the mean difference of logarithms: two views meet in the middle.
fn log_gain(sight: &Sight, picture: &ImageF32, seen: &[(Vec3, f32)]) -> Vec3 {
    let (mut sum, mut n) = (Vec3::ZERO, 0.0f32);
    let log = |c: Vec3| Vec3::from(c.to_array().map(|v| (v.max(0.0) + DARK).ln()));
    for (at, (color, weight)) in seen.iter().enumerate() {
        if *weight > 0.0 && sight.share.data[at] >= LEAST_SHARE {
            sum += log(*color) - log(pixel(picture, at));
            n += 1.0;
        }
    }
    if n > 0.0 { sum / n } else { Vec3::ZERO }
}

fn apply_gain(sight: &Sight, picture: &mut ImageF32, log: Vec3) {
    let gain = log.to_array().map(f32::exp);
    for (at, rgb) in picture.data.chunks_exact_mut(3).enumerate() {
        // Where the chosen Gaussians are not, nothing was edited.
        let share = sight.share.data[at];
        rgb.iter_mut().zip(gain).for_each(|(v, g)| *v *= 1.0 + (g - 1.0) * share);
    }
}

/// Which of `n` views are the key views, evenly spread; all when none are wanted.
pub(super) fn is_key(n: usize, key_views: usize) -> Vec<bool> {
    match key_views.min(n) {
        0 => vec![true; n],
        keys => (0..n).map(|i| (i * keys) % n < keys).collect(),
    }
}

/// What the fit sees: key views as they are, the others from the key views where those see the same, from
/// themselves elsewhere. With `weigh`, views count by how far they agree with the others.
pub(super) fn targets(
    sights: &[Sight],
    pictures: Vec<ImageF32>,
    key_views: usize,
    weigh: bool,
) -> Vec<ImageF32> {
    let n = sights.len();
    let weights = if weigh { weights(&disagreements(sights, &pictures)) } else { vec![1.0; n] };
    let is_key = is_key(n, key_views);
    let sources: Vec<(&Sight, &ImageF32, f32)> =
        (0..n).filter(|i| is_key[*i]).map(|i| (&sights[i], &pictures[i], weights[i])).collect();
    (0..n)
        .map(|i| {
            // A key view looks at itself, too: keys meet in their weighted mean.
            let seen = seen_by(&sights[i], &sources);
            let mut target = pictures[i].clone();
            for (at, (color, weight)) in seen.iter().enumerate() {
                if *weight > 0.0 {
                    let share = sights[i].share.data[at];
                    let own = pixel(&pictures[i], at);
                    let mixed = own + (*color - own) * share;
                    target.data[3 * at..3 * at + 3].copy_from_slice(&mixed.to_array());
                }
            }
            target
        })
        .collect()
}

/// One for a view that disagrees as much as usual or less, a fifth at twice as much.
fn weights(disagreements: &[f64]) -> Vec<f32> {
    let mut sorted: Vec<f64> = disagreements.iter().copied().filter(|d| d.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0).max(1e-6);
    disagreements
        .iter()
        .map(|d| {
            let beyond = (d / usual - 1.0).max(0.0) * 2.0;
            if beyond.is_finite() { (1.0 / (1.0 + beyond * beyond)) as f32 } else { 1.0 }
        })
        .collect()
}
