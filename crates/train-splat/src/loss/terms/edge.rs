//! Differences of neighboring pixels: sharp edges where the photo has them, and nowhere else (gradient difference loss,
//! Mathieu et al. 2016).
//!
//! `mean (|∂x (x - y)| + |∂y (x - y)|)` with forward differences; pairs with a masked pixel do not count.

use rayon::prelude::*;

use super::term::{LossTerm, Picture};

pub(super) struct Edge;

impl LossTerm for Edge {
    fn name(&self) -> &'static str {
        "edge"
    }

    fn about(&self) -> &'static str {
        "absolute difference of the image gradients"
    }

    fn evaluate(&self, picture: &Picture<'_>, weight: f32, gradient: &mut [Vec<f32>; 3]) -> f64 {
        let count = picture.count().max(1) as f64;
        let step = (f64::from(weight) / count) as f32;
        let (width, height) = (picture.width, picture.height);
        let sums: Vec<f64> = gradient
            .par_iter_mut()
            .enumerate()
            .map(|(c, gradient)| {
                let (x, y) = (&picture.rendering[c], &picture.photo[c]);
                let mut sum = 0.0;
                let mut pair = |a: usize, b: usize| {
                    if !(picture.counts(a) && picture.counts(b)) {
                        return;
                    }
                    let d = (x[b] - y[b]) - (x[a] - y[a]);
                    sum += f64::from(d.abs());
                    let sign = if d == 0.0 { 0.0 } else { step.copysign(d) };
                    gradient[b] += sign;
                    gradient[a] -= sign;
                };
                for row in 0..height {
                    for i in row * width..(row + 1) * width {
                        if i + 1 < (row + 1) * width {
                            pair(i, i + 1);
                        }
                        if row + 1 < height {
                            pair(i, i + width);
                        }
                    }
                }
                sum
            })
            .collect();
        sums.iter().sum::<f64>() / count
    }
}
