//! Gaussians fitted to the photos under the light that was found.
//!
//! Gaussians come from a fit in which each may look different from every side; with one base color each, their shapes are no
//! longer the best. So they are fitted once more, to the photos again, but through the shading of every pixel:
//!
//! ```text
//! picture = encode(slope decode(Σ α T e) + offset)        e: base color, sRGB-encoded
//! cost    = mean w (sqrt((picture - photo)² + ε²) - ε)    ε: what is noise
//! ```
//!
//! Adam with the rates of training (Kerbl et al. 2023) on shapes, opacities and base colors; the cost is Charbonnier's, 1994. Every
//! such step is followed by one on the colors as captured and the same shapes, which serve both. Pixels that tell nothing (no
//! surface, masked, clipped) keep what they showed. Number and order of the Gaussians never change.

use std::collections::BTreeSet;
use std::mem::swap;

use motes_math::{sh, srgb};
use motes_raster::{
    Frame, GaussianGradients, Modifiers, Planes, RenderOptions, ViewTransform, render,
};
use motes_scene::Gaussians;
use train_splat::{FitOptions, Moments, PhotoOrder, Rates, Update, scene_extent};

use crate::appearance::PixelShading;
use crate::appearance::pixel_shading::is_told;
use crate::image_gradient::slopes;
use crate::observation::SeenView;

/// Differences below this are noise, sRGB-encoded.
const NOISE: f32 = 0.01;
/// Of the rates, at the last step.
const LAST: f64 = 0.1;
/// Weight of what stays as it was.
const STAYING: f32 = 0.3;
/// Share of a view's pixels from which those that tell nothing are looked after.
const MANY: f32 = 0.01;
/// Darkest and brightest base color, sRGB-encoded: below, the rasterizer's clamp would stop a gradient.
const RANGE: [f32; 2] = [0.004, 1.0];
const SH_C0: f32 = sh::SH_C0 as f32;
const PURPOSE: u64 = 0x5048_4649;

/// What Gaussians are compared with.
pub(crate) struct PhotoFit<'a> {
    pub views: &'a [SeenView<'a>],
    /// Of the views, same order.
    pub shadings: &'a [PixelShading],
    pub render: &'a RenderOptions,
    /// Key of the order of the views.
    pub seed: u64,
}

/// What the colors of the Gaussians are.
#[derive(Clone, Copy, PartialEq)]
enum Colors {
    /// What the photos show.
    Captured,
    /// Base color, sRGB-encoded.
    Base,
}

const ALL: [Colors; 2] = [Colors::Captured, Colors::Base];

impl PhotoFit<'_> {
    /// Fits `start`, whose colors are as captured, and `base`: the same Gaussians with base colors (degree 0, sRGB-encoded).
    /// Same rows; both results have the same shapes.
    ///
    /// # Errors
    /// What `observer` says, which gets the share of the steps that are done.
    pub(crate) fn fit<E>(
        &self,
        start: &Gaussians,
        base: &Gaussians,
        steps: u32,
        mut observer: impl FnMut(f32) -> Result<(), E>,
    ) -> Result<(Gaussians, Gaussians), E> {
        let (mut model, mut moments) = (start.clone(), Moments::zeros(start));
        let mut waiting = WaitingColors::new(base);
        let looked_after: Vec<[bool; 2]> = (0..self.views.len())
            .map(|v| ALL.map(|colors| self.untold_share(v, colors) > MANY))
            .collect();
        let poses = self.views.iter().map(|v| &v.photo.camera_from_world);
        let extent = scene_extent(poses, &start.means);
        let options = FitOptions::default();
        let (mut frame, mut frame_before) = (Frame::new(), Frame::new());
        let mut gradients = GaussianGradients::default();
        let none = Modifiers::default();
        let gains = self.captured_gains(start);
        let mut order = PhotoOrder::new(self.views.len(), self.seed, PURPOSE);
        for step in 0..steps {
            let Some(v) = order.at(step) else { break };
            observer(step as f32 / steps as f32)?;
            let photo = self.views[v].photo;
            let view = ViewTransform::new(&photo.camera, &photo.camera_from_world);
            let progress = f64::from(step) / f64::from(steps);
            let rates = Rates::at(&options, extent, LAST.powf(progress), progress);
            for (k, colors) in ALL.into_iter().enumerate() {
                let before = match colors {
                    Colors::Captured => start,
                    Colors::Base => base,
                };
                let stays = looked_after[v][k]
                    .then(|| frame_before.forward(before, &view, &none, self.render));
                let image = frame.forward(&model, &view, &none, self.render);
                let slope = self.slope((v, gains[v]), colors, image, stays);
                frame.backward(&model, &none, self.render, &slope, &mut gradients);
                let update = Update {
                    step: u64::from(step) + 1,
                    sh_degree: model.sh_degree,
                    sh_every: 1,
                    sparse: true,
                };
                moments.apply(&mut model, &gradients, &rates, &update);
                if colors == Colors::Base {
                    let [low, high] = RANGE.map(|e| (e - 0.5) / SH_C0);
                    model.sh.iter_mut().for_each(|v| *v = v.clamp(low, high));
                }
                waiting.take_turns(&mut model, &mut moments);
            }
        }
        let mut captured = model;
        let mut base_fitted = Gaussians {
            sh: waiting.sh,
            sh_degree: waiting.sh_degree,
            extra: Vec::new(),
            ..captured.clone()
        };
        keep_finite([&mut captured, &mut base_fitted], [start, base]);
        Ok((captured, base_fitted))
    }

    /// Gains that the photos keep where colors are as captured. If training left exposures to the look of the sides that the photos
    /// were taken from, that look is kept; if it modeled them, the colors are those of the mean exposure. `start` says which: it is
    /// closer to the photos as they were taken, or to the developed ones.
    fn captured_gains(&self, start: &Gaussians) -> Vec<[f32; 3]> {
        let gains: Vec<[f32; 3]> = self.views.iter().map(|view| view.photo.gain).collect();
        let (mut as_taken, mut developed) = (0.0, 0.0);
        for (view, gain) in self.views.iter().zip(&gains).filter(|(_, gain)| **gain != [1.0; 3]) {
            let photo = view.photo;
            let shown = render(start, &photo.camera, &photo.camera_from_world, self.render).color;
            let radiance = photo.radiance_linear.pixels().flat_map(|v| v.to_array());
            for (k, (shown, radiance)) in shown.data.iter().zip(radiance).enumerate() {
                let error = |seen: f32| f64::from((shown - srgb::encode(seen)).abs());
                let weight = f64::from(u8::from(photo.usable[k / 3]));
                as_taken += weight * error(radiance * gain[k % 3]);
                developed += weight * error(radiance);
            }
        }
        if developed < as_taken { vec![[1.0; 3]; gains.len()] } else { gains }
    }

    fn untold_share(&self, v: usize, colors: Colors) -> f32 {
        let count = self.shadings[v].count();
        let told = (0..count).filter(|&i| self.told(v, i, colors)).count();
        1.0 - told as f32 / count.max(1) as f32
    }

    fn told(&self, v: usize, i: usize, colors: Colors) -> bool {
        let lit = colors == Colors::Captured || is_told(self.shadings[v].slope(i));
        lit && self.views[v].photo.usable[i]
    }

    /// Slope of the cost by every value of the picture of a view.
    fn slope(
        &self,
        (v, captured_gain): (usize, [f32; 3]),
        colors: Colors,
        image: &Planes,
        before: Option<&Planes>,
    ) -> Planes {
        let (photo, shading) = (self.views[v].photo, &self.shadings[v]);
        let gain = if colors == Colors::Captured { captured_gain } else { [1.0; 3] };
        let seen = photo.radiance_linear.turned(|c, v| srgb::encode(v * gain[c]));
        slopes([image.width, image.height], |x, y| {
            let i = y * image.width + x;
            let shown = [0, 1, 2].map(|c| image.row(c, y)[x]);
            if !self.told(v, i, colors) {
                let Some(before) = before else { return [0.0; 3] };
                return [0, 1, 2].map(|c| STAYING * difference(shown[c], before.row(c, y)[x]));
            }
            let seen = [0, 1, 2].map(|c| seen.at(i, c));
            if colors == Colors::Captured {
                return [0, 1, 2].map(|c| difference(shown[c], seen[c]));
            }
            let (slope, offset) = (shading.slope(i), shading.offset(i));
            let pixel = |c| Pixel { slope: slope[c], offset: offset[c], seen: seen[c] };
            let slopes = [0, 1, 2].map(|c| pixel(c).slope_at(shown[c]));
            let (uniform, color) = shading.uniform(i);
            if uniform == 0.0 {
                return slopes;
            }
            [0, 1, 2].map(|c| {
                let of_part = difference(shown[c], srgb::encode(color[c]));
                (1.0 - uniform) * slopes[c] + uniform * of_part
            })
        })
    }
}

/// Derivative of the cost by the first value.
fn difference(shown: f32, seen: f32) -> f32 {
    let r = shown - seen;
    r / (r * r + NOISE * NOISE).sqrt()
}

/// A channel of a pixel: radiance is `b slope + offset`.
struct Pixel {
    slope: f32,
    offset: f32,
    /// In the photo, sRGB-encoded.
    seen: f32,
}

impl Pixel {
    /// Derivative of the cost by the base color, sRGB-encoded.
    fn slope_at(&self, encoded: f32) -> f32 {
        let (base, by_encoded) = srgb::decode_with_slope(encoded.max(0.0));
        let (shown, by_radiance) = srgb::encode_with_slope(self.slope * base + self.offset);
        difference(shown, self.seen) * by_radiance * self.slope * by_encoded
    }
}

/// The colors whose turn it is not, with what Adam knows of them. Shapes and opacities are shared.
struct WaitingColors {
    sh: Vec<f32>,
    sh_degree: u8,
    first: Vec<f32>,
    second: Vec<f32>,
}

impl WaitingColors {
    fn new(gaussians: &Gaussians) -> Self {
        let zeros = vec![0.0; gaussians.sh.len()];
        let (sh, sh_degree) = (gaussians.sh.clone(), gaussians.sh_degree);
        Self { sh, sh_degree, first: zeros.clone(), second: zeros }
    }

    /// Changes places with the colors in `model` and `moments`.
    fn take_turns(&mut self, model: &mut Gaussians, moments: &mut Moments) {
        swap(&mut self.sh, &mut model.sh);
        swap(&mut self.sh_degree, &mut model.sh_degree);
        swap(&mut self.first, &mut moments.first.sh);
        swap(&mut self.second, &mut moments.second.sh);
    }
}

/// Rows of which a value is no longer finite become what they were, in both models.
fn keep_finite(mut models: [&mut Gaussians; 2], before: [&Gaussians; 2]) {
    let rows: BTreeSet<u32> = models.iter().flat_map(|model| model.invalid_rows()).collect();
    for i in rows.into_iter().map(|i| i as usize) {
        for (model, start) in models.iter_mut().zip(before) {
            let width = 3 * model.sh_coefficients();
            let sh = i * width..(i + 1) * width;
            model.means[i] = start.means[i];
            model.rotations[i] = start.rotations[i];
            model.log_scales[i] = start.log_scales[i];
            model.opacity_logits[i] = start.opacity_logits[i];
            model.sh[sh.clone()].copy_from_slice(&start.sh[sh]);
        }
    }
}

#[cfg(test)]
mod tests;
