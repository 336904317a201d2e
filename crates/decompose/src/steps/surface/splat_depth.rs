//! Depth of the views as the Gaussians see it.

use motes_raster::{RenderOptions, render};
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
    let options = RenderOptions { aovs: true, near: NEAR, ..RenderOptions::default() };
    let of = |view: &View| {
        let picture = render(gaussians, &view.camera, &view.camera_from_unit, &options);
        let depth = match picture.aovs {
            Some(aovs) => aovs
                .depth_median
                .data
                .iter()
                .zip(&picture.alpha.data)
                .map(|(&d, &a)| if a >= ALPHA && d > 0.0 && d.is_finite() { d } else { 0.0 })
                .collect(),
            None => Vec::new(),
        };
        DepthMap { depth }
    };
    views.par_iter().with_max_len(1).map(of).collect()
}
