//! What every Gaussian carries in several views, and how much of their error it covers.
//!
//! The sums over pixels `Σ w_i e` of the blending weights `w_i` with any picture `e` are what the
//! backward pass of the rasterizer gives as the gradient by a Gaussian's color. So one backward
//! pass per view scores all Gaussians: `e` is 1 in one channel and the error in another.

use motes_math::rng::keyed_rng;
use motes_math::sh::SH_C0;
use motes_raster::{GaussianGradients, Modifiers, Planes, RenderOptions};
use motes_scene::Gaussians;
use rand::RngExt;

use super::Trainer;
use crate::target::Target;

const STREAM_SCORE: u64 = 4;

/// Pixels' worth of blending weight below which a Gaussian carries nothing in a view.
const NEEDED_WEIGHT: f32 = 0.1;

/// Sums over a few views.
pub(super) struct ViewScores {
    /// Sum over views of the error that each Gaussian covers, pixels times difference.
    pub(super) error: Vec<f32>,
    /// Whether a Gaussian was on one of the images and carries nothing in any of them.
    pub(super) unneeded: Vec<bool>,
}

impl Trainer {
    /// Scores all Gaussians in `count` views drawn at random without repetition.
    pub(super) fn score_gaussians(&mut self, count: usize, stage: usize) -> ViewScores {
        let n = self.state.gaussians.len();
        let mut order: Vec<usize> = (0..self.views.len()).collect();
        let mut rng = keyed_rng(self.seed, STREAM_SCORE, u64::from(self.state.step));
        let count = count.min(order.len());
        for i in 0..count {
            let j = rng.random_range(i..order.len());
            order.swap(i, j);
        }
        let progress = self.progress();
        let options = RenderOptions {
            background: self.background(),
            sh_degree_limit: Some(self.sh_degree_at(progress)),
            parameters: self.options.raster,
            ..RenderOptions::default()
        };
        let modifiers = Modifiers::with_filter(&self.state.filter_3d);
        // Gray: the gradient by a color that is clamped at black would be 0.
        let gray = Gaussians {
            sh: vec![0.0; 3 * n],
            sh_degree: 0,
            extra: Vec::new(),
            ..self.state.gaussians.clone()
        };
        let mut gradients = GaussianGradients::default();
        let mut error = vec![0.0f32; n];
        let (mut carried, mut seen) = (vec![0.0f32; n], vec![false; n]);
        for &view in &order[..count] {
            let (transform, target) = &self.views[view].levels[stage];
            let image = self.frame.forward(&self.state.gaussians, transform, &modifiers, &options);
            let [width, height] = transform.size;
            let mut picture = Planes::new(width, height, 4);
            for y in 0..height {
                error_row(image, target, y, &mut picture);
            }
            self.frame.backward(&gray, &modifiers, &options, &picture, &mut gradients);
            for i in 0..n {
                let by_color = &gradients.sh[3 * i..3 * i + 2];
                error[i] += by_color[1] / SH_C0 as f32;
                carried[i] = carried[i].max(by_color[0] / SH_C0 as f32);
                seen[i] |= gradients.seen[i];
            }
        }
        let unneeded = carried.iter().zip(&seen).map(|(&w, &seen)| seen && w < NEEDED_WEIGHT);
        ViewScores { unneeded: unneeded.collect(), error }
    }
}

/// Row `y`: plane 0 becomes 1, plane 1 the mean absolute difference, where the pixel counts.
fn error_row(image: &Planes, target: &Target, y: usize, picture: &mut Planes) {
    for x in 0..target.width {
        let at = y * target.width + x;
        if target.weight.as_ref().is_some_and(|w| w[at] == 0) {
            continue;
        }
        let difference = |c: usize| {
            let photo = f32::from(target.row(c, y)[x]) / 255.0;
            (image.row(c, y)[x] - photo).abs()
        };
        let error = (difference(0) + difference(1) + difference(2)) / 3.0;
        picture.row_mut(0, y)[x] = 1.0;
        // Transparent photos have no color of their own there.
        let opaque = target.alpha.as_ref().is_none_or(|a| a[at] == 255);
        picture.row_mut(1, y)[x] = if opaque { error } else { 0.0 };
    }
}
