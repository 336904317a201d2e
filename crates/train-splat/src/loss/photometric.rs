//! The loss over whole images, one pass over bands of rows ([`super::band`]).

use std::cell::RefCell;

use fearless_simd::{Level, dispatch};
use motes_raster::{Planes, TILE};
use rayon::prelude::*;

use super::band::{BandSums, Rows, Scratch, band};
use super::rows::GradientWeights;
use crate::target::Target;

/// Rows per task, a multiple of the tile height: large against the overlap of the windows (twice
/// 10 rows of the first blur), small enough that a picture gives every thread several tasks.
fn band_rows(height: usize) -> usize {
    if height >= 256 { 4 * TILE } else { 2 * TILE }
}

/// Per-channel map from the rendering to the photo: `x = gain · color + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorTransform {
    /// Factor per channel.
    pub gain: [f32; 3],
    /// Added per channel.
    pub offset: [f32; 3],
}

impl ColorTransform {
    /// Changes nothing.
    pub const IDENTITY: Self = Self { gain: [1.0; 3], offset: [0.0; 3] };

    /// This transform with all gains times `gain`; offsets stay.
    pub(crate) fn brighter(self, gain: f32) -> Self {
        Self { gain: self.gain.map(|g| g * gain), ..self }
    }
}

/// Value of the loss and its gradient by the color transform.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LossValue {
    /// `(1 - λ) l1 + λ (1 - ssim)`
    pub loss: f64,
    /// Mean absolute difference.
    pub l1: f64,
    /// Mean SSIM.
    pub ssim: f64,
    /// Mean squared difference, for reporting.
    pub mse: f64,
    /// Gradient by the gains.
    pub d_gain: [f64; 3],
    /// Gradient by the offsets.
    pub d_offset: [f64; 3],
}

thread_local! {
    /// Kept per thread: allocating rings for every band would cost more in page faults than the
    /// arithmetic does.
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Evaluates the loss.
#[derive(Debug, Default)]
pub struct PhotometricLoss {
    sums: Vec<BandSums>,
}

impl PhotometricLoss {
    /// Empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Evaluates the loss of `render` (planes 0..3: color over `background`) against `target` and
    /// writes `dL/d color` into planes 0..3 of `gradient`; its fourth plane becomes 0.
    ///
    /// # Panics
    /// When the sizes differ.
    pub fn evaluate(
        &mut self,
        render: &Planes,
        target: &Target,
        background: [f32; 3],
        transform: ColorTransform,
        ssim_weight: f32,
        gradient: &mut Planes,
    ) -> LossValue {
        assert_eq!([render.width, render.height], [target.width, target.height], "loss size");
        assert_eq!(render.data.len(), gradient.data.len(), "gradient size");
        let level = Level::new();
        let rows = Rows { render, target, background, transform };
        let count = (3 * target.width * target.height).max(1) as f64;
        let weights = GradientWeights {
            l1: ((1.0 - f64::from(ssim_weight)) / count) as f32,
            ssim: (f64::from(ssim_weight) / count) as f32,
        };
        let height = band_rows(target.height);
        let planes_band = gradient.band_len() * (height / TILE);
        gradient
            .data
            .par_chunks_mut(planes_band)
            .with_max_len(1)
            .enumerate()
            .map(|(index, out)| {
                let first = index * height;
                SCRATCH.with_borrow_mut(|scratch| {
                    dispatch!(level, simd => band(
                        simd, &rows, first..first + height, weights, out, scratch))
                })
            })
            .collect_into_vec(&mut self.sums);
        let mut value = LossValue::default();
        for band in &self.sums {
            value.ssim += band.ssim / count;
            for (c, sums) in band.channels.iter().enumerate() {
                value.l1 += sums.l1 / count;
                value.mse += sums.squared / count;
                value.d_gain[c] += sums.d_gain;
                value.d_offset[c] += sums.d_offset;
            }
        }
        let lambda = f64::from(ssim_weight);
        value.loss = (1.0 - lambda) * value.l1 + lambda * (1.0 - value.ssim);
        value
    }
}

#[cfg(test)]
pub(super) mod tests;
