//! Depth of the views as the Gaussians see it.

use motes_raster::{RenderOptions, render_depth_median};
use motes_scene::Gaussians;
use rayon::prelude::*;

use super::view::View;

/// `[h, w]`, depth along the axis of view in the unit world; 0 where there is none.
#[derive(Clone)]
pub(super) struct DepthMap {
    pub(super) depth: Vec<f32>,
}

/// Opacity from which a pixel has a depth.
const ALPHA: f32 = 0.6;

/// Gaussians nearer than this share of the cameras' spread hang before a lens.
const NEAR: f32 = 0.02;
/// Fainter Gaussians (opacity 2 %) are haze at any power, and often as wide as the picture.
const FAINT_LOGIT: f32 = -3.9;

/// Where the transmittance of each pixel passes 1/2.
pub(super) fn splat_depths(mut gaussians: Gaussians, views: &[View], power: f32) -> Vec<DepthMap> {
    if power != 1.0 {
        for logit in gaussians.opacity_logits.iter_mut().filter(|l| **l > FAINT_LOGIT) {
            // 1 - o' = (1 - o)^k; o' = 1 - 1/(1+e^l)^k.
            let through = (-power * logit.exp().ln_1p()).exp();
            *logit = ((1.0 - through).max(1e-6) / through.max(1e-6)).ln();
        }
    }
    let gaussians = &gaussians;
    let options = RenderOptions { near: NEAR, ..RenderOptions::default() };
    let of = |view: &View| {
        let (camera, pose) = (&view.camera, &view.camera_from_unit);
        let mut depth = render_depth_median(gaussians, camera, pose, &options, ALPHA).data;
        depth.iter_mut().filter(|d| !d.is_finite()).for_each(|d| *d = 0.0);
        DepthMap { depth }
    };
    views.par_iter().with_max_len(1).map(of).collect()
}
