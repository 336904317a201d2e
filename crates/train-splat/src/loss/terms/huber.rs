//! Huber's loss of the difference: quadratic where the rendering is nearly right, so that the gradient fades there, linear
//! beyond, so that what the photo shows and the scene does not have pulls no harder (Huber 1964).
//!
//! `mean h(x - y)` with `h(d) = d² / 2δ` for `|d| < δ` and `|d| - δ / 2` beyond, δ = 0.1.

use rayon::prelude::*;

use super::term::{LossTerm, Picture};

/// Where the quadratic part ends, as a share of the range of a channel.
const DELTA: f32 = 0.1;

pub(super) struct Huber;

impl LossTerm for Huber {
    fn name(&self) -> &'static str {
        "huber"
    }

    fn about(&self) -> &'static str {
        "Huber loss of the difference, quadratic below 0.1"
    }

    fn evaluate(&self, picture: &Picture<'_>, weight: f32, gradient: &mut [Vec<f32>; 3]) -> f64 {
        let count = picture.count().max(1) as f64;
        let step = (f64::from(weight) / count) as f32;
        let sums: Vec<f64> = gradient
            .par_iter_mut()
            .enumerate()
            .map(|(c, gradient)| {
                let mut sum = 0.0;
                let pairs = picture.rendering[c].iter().zip(&picture.photo[c]);
                for (g, (x, y)) in gradient.iter_mut().zip(pairs) {
                    let d = x - y;
                    let value = match d.abs() < DELTA {
                        true => d * d / (2.0 * DELTA),
                        false => d.abs() - DELTA / 2.0,
                    };
                    sum += f64::from(value);
                    *g += step * (d / DELTA).clamp(-1.0, 1.0);
                }
                sum
            })
            .collect();
        sums.iter().sum::<f64>() / count
    }
}
