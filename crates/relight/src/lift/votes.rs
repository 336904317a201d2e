//! What each Gaussian hears from a view: means over its pixels by blending weight.
//!
//! `Σ_p w_ip G(p)` is the gradient of `Σ_p G(p) color(p)` by the color of Gaussian `i`, so the backward pass of
//! the rasterizer computes it: once for the ratios times their weights, once for the weights.

use motes_math::sh::SH_C0;
use motes_raster::{
    Antialias, Frame, GaussianGradients, Modifiers, Planes, RenderOptions, ViewTransform, render,
};
use motes_scene::{Gaussians, ImageF32};

use super::RelitView;
use super::ratio::ratio;

/// Mean log ratio per Gaussian, and how much it rests on.
pub(super) struct Votes {
    pub(super) ratio: Vec<[f32; 3]>,
    pub(super) weight: Vec<f32>,
}

/// The votes of a view.
pub(super) fn votes_of(
    gaussians: &Gaussians,
    antialias: Antialias,
    view: &RelitView,
    radius_share: f32,
) -> Votes {
    let options = RenderOptions { antialias, aovs: true, ..RenderOptions::default() };
    let rendered = render(gaussians, &view.camera, &view.camera_from_world, &options);
    let ratio = ratio(view, &rendered, radius_share);
    let (width, height) = (view.picture.width, view.picture.height);
    let weighted =
        ratio.log.iter().zip(&ratio.weight).flat_map(|(r, w)| (*r * *w).to_array()).collect();
    let weighted = ImageF32::from_data(width, height, 3, weighted);
    let weight = ratio.weight.iter().flat_map(|w| [*w; 3]).collect();
    let weight = ImageF32::from_data(width, height, 3, weight);
    let mut back = BackProjection::new(gaussians, antialias, view);
    let sums = back.sums(&weighted);
    let weights: Vec<f32> = back.sums(&weight).into_iter().map(|w| w[0]).collect();
    let mean = |(sum, weight): (&[f32; 3], &f32)| {
        if *weight > 0.0 { sum.map(|s| s / weight) } else { [0.0; 3] }
    };
    Votes { ratio: sums.iter().zip(&weights).map(mean).collect(), weight: weights }
}

/// Sums of pixels by blending weight, for one view.
pub(super) struct BackProjection {
    frame: Frame,
    /// Colors in the middle of their range, so that no clamp hides one.
    gray: Gaussians,
    options: RenderOptions,
    gradients: GaussianGradients,
    size: [usize; 2],
}

impl BackProjection {
    pub(super) fn new(gaussians: &Gaussians, antialias: Antialias, view: &RelitView) -> Self {
        let gray = Gaussians {
            sh_degree: 0,
            sh: vec![0.0; 3 * gaussians.len()],
            extra: Vec::new(),
            ..gaussians.clone()
        };
        let options = RenderOptions { antialias, ..RenderOptions::default() };
        let mut frame = Frame::new();
        let transform = ViewTransform::new(&view.camera, &view.camera_from_world);
        frame.forward(&gray, &transform, &Modifiers::default(), &options);
        let size = [view.camera.width, view.camera.height];
        Self { frame, gray, options, gradients: GaussianGradients::default(), size }
    }

    /// `Σ_p w_ip G(p)` for every Gaussian and channel.
    pub(super) fn sums(&mut self, image: &ImageF32) -> Vec<[f32; 3]> {
        let mut planes = Planes::new(self.size[0], self.size[1], 4);
        (0..3).for_each(|c| planes.set_plane(c, image, c));
        let (none, out) = (Modifiers::default(), &mut self.gradients);
        self.frame.backward(&self.gray, &none, &self.options, &planes, out);
        let inverse = 1.0 / SH_C0 as f32;
        out.sh.chunks_exact(3).map(|g| [g[0] * inverse, g[1] * inverse, g[2] * inverse]).collect()
    }
}
