//! The loss over whole images: two passes over bands of rows.

use std::cell::RefCell;

use fearless_simd::{Level, Simd, dispatch};
use motes_raster::{Planes, TILE};
use rayon::prelude::*;

use super::rows::{GradientWeights, PAD, RADIUS, blur_row, gradient_row, ssim_row};
use crate::target::Target;

/// Rows per task: a multiple of the tile height, large against the 2 × 5 rows of overlap.
const BAND: usize = 2 * TILE;

/// Per-channel map from the rendering to the photo: `x = gain · colour + offset`.
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
}

/// Value of the loss and its gradient by the colour transform.
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

/// Buffers of the loss, reused from step to step.
#[derive(Debug, Default)]
pub struct PhotometricLoss {
    /// Derivative maps `[band][channel][mean, square, product][BAND rows][stride]`.
    maps: Vec<f32>,
}

struct Rows<'a> {
    render: &'a Planes,
    target: &'a Target,
    background: [f32; 3],
    transform: ColorTransform,
}

impl Rows<'_> {
    /// Loads row `y` of channel `c` of the transformed rendering and of the photo into padded rows.
    fn load(&self, c: usize, y: usize, x_row: &mut [f32], y_row: &mut [f32]) {
        let width = self.target.width;
        let (gain, offset) = (self.transform.gain[c], self.transform.offset[c]);
        let x_out = &mut x_row[PAD..PAD + width];
        for (out, value) in x_out.iter_mut().zip(self.render.row(c, y)) {
            *out = gain * value + offset;
        }
        let y_out = &mut y_row[PAD..PAD + width];
        for (out, &value) in y_out.iter_mut().zip(self.target.row(c, y)) {
            *out = f32::from(value) * (1.0 / 255.0);
        }
        let span = y * width..(y + 1) * width;
        if let Some(alpha) = &self.target.alpha {
            for (out, &alpha) in y_out.iter_mut().zip(&alpha[span.clone()]) {
                let alpha = f32::from(alpha) * (1.0 / 255.0);
                *out = *out * alpha + self.background[c] * (1.0 - alpha);
            }
        }
        if let Some(weight) = &self.target.weight {
            for ((x, y), &weight) in x_out.iter_mut().zip(y_out).zip(&weight[span]) {
                if weight == 0 {
                    *x = *y;
                }
            }
        }
    }
}

impl PhotometricLoss {
    /// Empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Evaluates the loss of `render` (planes 0..3: colour over `background`) against `target` and
    /// writes `dL/d colour` into planes 0..3 of `gradient`; its fourth plane becomes 0.
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
        let stride = render.stride;
        let bands = target.height.div_ceil(BAND);
        let map_band = 9 * BAND * stride;
        self.maps.resize(bands * map_band, 0.0);
        let ssim_sums: Vec<f64> = self
            .maps
            .par_chunks_mut(map_band)
            .enumerate()
            .map(|(band, maps)| {
                SCRATCH.with_borrow_mut(|scratch| {
                    dispatch!(level, simd => ssim_band(simd, &rows, band, stride, maps, scratch))
                })
            })
            .collect();
        let count = (3 * target.width * target.height).max(1) as f64;
        let weights = GradientWeights {
            l1: ((1.0 - f64::from(ssim_weight)) / count) as f32,
            ssim: (f64::from(ssim_weight) / count) as f32,
        };
        let planes_band = gradient.band_len() * (BAND / TILE);
        let maps = &self.maps;
        let sums: Vec<BandSums> = gradient
            .data
            .par_chunks_mut(planes_band)
            .enumerate()
            .map(|(band, out)| {
                SCRATCH.with_borrow_mut(|scratch| {
                    dispatch!(level, simd => gradient_band(
                        simd, &rows, maps, band, stride, weights, out, scratch))
                })
            })
            .collect();
        let mut value =
            LossValue { ssim: ssim_sums.iter().sum::<f64>() / count, ..Default::default() };
        for band in &sums {
            value.l1 += band.l1 / count;
            value.mse += band.squared / count;
            for c in 0..3 {
                value.d_gain[c] += band.d_gain[c];
                value.d_offset[c] += band.d_offset[c];
            }
        }
        let lambda = f64::from(ssim_weight);
        value.loss = (1.0 - lambda) * value.l1 + lambda * (1.0 - value.ssim);
        value
    }
}

/// Rows and blurred maps of one band. Kept per thread: allocating them for every band would cost
/// more in page faults than the arithmetic does.
#[derive(Default)]
struct Scratch {
    x_row: Vec<f32>,
    y_row: Vec<f32>,
    product: Vec<f32>,
    blurred: [Vec<f32>; 5],
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

impl Scratch {
    /// Sizes the buffers for rows of `stride` values; everything outside the image is zero.
    fn prepare(&mut self, stride: usize) {
        for row in [&mut self.x_row, &mut self.y_row, &mut self.product] {
            row.clear();
            row.resize(stride + 2 * PAD, 0.0);
        }
        for map in &mut self.blurred {
            map.resize((BAND + 2 * RADIUS) * stride, 0.0);
        }
    }
}

/// Rows `y0 - RADIUS .. y0 + BAND + RADIUS` of a band; those outside the image are `None`.
fn halo(band: usize, height: usize) -> impl Iterator<Item = (usize, Option<usize>)> {
    (0..BAND + 2 * RADIUS).map(move |r| {
        let y = (band * BAND + r).checked_sub(RADIUS).filter(|&y| y < height);
        (r, y)
    })
}

#[inline(always)]
fn ssim_band<S: Simd>(
    simd: S,
    rows: &Rows<'_>,
    band: usize,
    stride: usize,
    maps: &mut [f32],
    scratch: &mut Scratch,
) -> f64 {
    let (width, height) = (rows.target.width, rows.target.height);
    scratch.prepare(stride);
    let Scratch { x_row, y_row, product, blurred } = scratch;
    let mut sum = 0.0;
    for c in 0..3 {
        for (r, y) in halo(band, height) {
            let span = r * stride..(r + 1) * stride;
            let Some(y) = y else {
                for map in blurred.iter_mut() {
                    map[span.clone()].fill(0.0);
                }
                continue;
            };
            rows.load(c, y, x_row, y_row);
            blur_row(simd, x_row, &mut blurred[0][span.clone()]);
            blur_row(simd, y_row, &mut blurred[1][span.clone()]);
            for (m, (a, b)) in
                [(&*x_row, &*x_row), (y_row, y_row), (x_row, y_row)].into_iter().enumerate()
            {
                for ((p, a), b) in product.iter_mut().zip(a.iter()).zip(b.iter()) {
                    *p = a * b;
                }
                blur_row(simd, product, &mut blurred[2 + m][span.clone()]);
            }
        }
        let plane = BAND * stride;
        let (d_mean, rest) = maps[3 * c * plane..3 * (c + 1) * plane].split_at_mut(plane);
        let (d_square, d_product) = rest.split_at_mut(plane);
        for r in 0..BAND.min(height - band * BAND) {
            let span = r * stride..(r + 1) * stride;
            let out =
                [&mut d_mean[span.clone()], &mut d_square[span.clone()], &mut d_product[span]];
            sum += ssim_row(simd, blurred, stride, r + RADIUS, width, out);
        }
    }
    sum
}

#[derive(Default)]
struct BandSums {
    l1: f64,
    squared: f64,
    d_gain: [f64; 3],
    d_offset: [f64; 3],
}

#[inline(always)]
fn gradient_band<S: Simd>(
    simd: S,
    rows: &Rows<'_>,
    maps: &[f32],
    band: usize,
    stride: usize,
    weights: GradientWeights,
    out: &mut [f32],
    scratch: &mut Scratch,
) -> BandSums {
    let (width, height) = (rows.target.width, rows.target.height);
    scratch.prepare(stride);
    let Scratch { x_row, y_row, product: padded, blurred } = scratch;
    let mut sums = BandSums::default();
    out.fill(0.0);
    for c in 0..3 {
        for (r, y) in halo(band, height) {
            let span = r * stride..(r + 1) * stride;
            for (m, map) in blurred[..3].iter_mut().enumerate() {
                let Some(y) = y else {
                    map[span.clone()].fill(0.0);
                    continue;
                };
                let start = (((y / BAND) * 3 + c) * 3 + m) * BAND * stride + (y % BAND) * stride;
                padded[PAD..PAD + stride].copy_from_slice(&maps[start..start + stride]);
                blur_row(simd, padded, &mut map[span.clone()]);
            }
        }
        for r in 0..BAND.min(height - band * BAND) {
            let y = band * BAND + r;
            rows.load(c, y, x_row, y_row);
            // Row of the planes layout, relative to this band's slice.
            let start = (r / TILE) * 4 * TILE * stride + (c * TILE + r % TILE) * stride;
            let row = &mut out[start..start + stride];
            sums.l1 += gradient_row(simd, blurred, stride, r + RADIUS, x_row, y_row, weights, row);
            if let Some(weight) = &rows.target.weight {
                for (g, &w) in row.iter_mut().zip(&weight[y * width..(y + 1) * width]) {
                    *g = if w == 0 { 0.0 } else { *g };
                }
            }
            row[width..].fill(0.0);
            let gain = rows.transform.gain[c];
            let (mut d_gain, mut d_offset, mut squared) = (0.0f32, 0.0f32, 0.0f32);
            let pixels = row[..width].iter_mut().zip(rows.render.row(c, y));
            for ((g, &raw), (x, y)) in pixels.zip(x_row[PAD..].iter().zip(&y_row[PAD..])) {
                d_gain += *g * raw;
                d_offset += *g;
                squared += (x - y) * (x - y);
                *g *= gain;
            }
            sums.d_gain[c] += f64::from(d_gain);
            sums.d_offset[c] += f64::from(d_offset);
            sums.squared += f64::from(squared);
        }
    }
    sums
}

#[cfg(test)]
mod tests;
