//! Row kernels of the loss: blurs and the SSIM terms, 16 pixels at a time.
//!
//! No closures around vector operations: a closure is compiled for the baseline instruction set
//! and would turn every operation into a call (measured: 8 times slower).

use fearless_simd::{Simd, f32x16, prelude::*};

/// Taps on each side of the window's centre.
pub(super) const RADIUS: usize = 5;
/// Zeros on each side of a padded row; a whole vector, so that loads never leave the row.
pub(super) const PAD: usize = 16;
const C1: f32 = 0.01 * 0.01;
const C2: f32 = 0.03 * 0.03;

/// The normalised 1-D window, σ = 1.5, from the centre outwards.
pub(super) const WINDOW: [f32; RADIUS + 1] =
    [0.266_011_7, 0.213_005_54, 0.109_360_69, 0.036_000_77, 0.007_598_758, 0.001_028_38];

#[inline(always)]
fn load<S: Simd>(simd: S, row: &[f32], at: usize) -> f32x16<S> {
    f32x16::from_slice(simd, &row[at..at + 16])
}

/// Blurs a padded row into `out`; `row.len() >= out.len() + 2 PAD`, `out.len()` a multiple of 16.
#[inline(always)]
pub(super) fn blur_row<S: Simd>(simd: S, row: &[f32], out: &mut [f32]) {
    for x in (0..out.len()).step_by(16) {
        let at = x + PAD;
        let mut sum = load(simd, row, at) * WINDOW[0];
        for (k, &weight) in WINDOW.iter().enumerate().skip(1) {
            sum = (load(simd, row, at - k) + load(simd, row, at + k)).mul_add(weight, sum);
        }
        sum.store_slice(&mut out[x..x + 16]);
    }
}

/// Vertical blur at column `x` of 11 rows of `stride` values, the centre one being `row`.
#[inline(always)]
fn blur_column<S: Simd>(simd: S, rows: &[f32], stride: usize, row: usize, x: usize) -> f32x16<S> {
    let at = row * stride + x;
    let mut sum = load(simd, rows, at) * WINDOW[0];
    for (k, &weight) in WINDOW.iter().enumerate().skip(1) {
        let pair = load(simd, rows, at - k * stride) + load(simd, rows, at + k * stride);
        sum = pair.mul_add(weight, sum);
    }
    sum
}

/// Sum of SSIM over one row, and the derivatives of `Σ SSIM` by the blurred `x`, `x²` and `xy`.
///
/// `maps` holds the horizontally blurred `x, y, x², y², xy`, each `[rows, stride]`; `width` pixels
/// count, the rest is padding and gets 0.
#[inline(always)]
pub(super) fn ssim_row<S: Simd>(
    simd: S,
    maps: &[Vec<f32>; 5],
    stride: usize,
    row: usize,
    width: usize,
    out: [&mut [f32]; 3],
) -> f64 {
    let [d_mean, d_square, d_product] = out;
    let mut sum = 0.0;
    let index = f32x16::from_slice(simd, &std::array::from_fn::<f32, 16, _>(|i| i as f32));
    for x in (0..stride).step_by(16) {
        let mx = blur_column(simd, &maps[0], stride, row, x);
        let my = blur_column(simd, &maps[1], stride, row, x);
        let xx = blur_column(simd, &maps[2], stride, row, x);
        let yy = blur_column(simd, &maps[3], stride, row, x);
        let xy = blur_column(simd, &maps[4], stride, row, x);
        let (mx2, my2, mxy) = (mx * mx, my * my, mx * my);
        let a1 = mxy * 2.0 + C1;
        let a2 = (xy - mxy) * 2.0 + C2;
        let b1 = mx2 + my2 + C1;
        let b2 = (xx - mx2) + (yy - my2) + C2;
        let inverse = f32x16::splat(simd, 1.0) / (b1 * b2);
        let ssim = a1 * a2 * inverse;
        let inside = index.simd_lt((width as f32) - x as f32);
        let zero = f32x16::splat(simd, 0.0);
        let d_xx = -(ssim / b2);
        let d_xy = a1 * inverse * 2.0;
        // σx² = E[x²] - μx² and σxy = E[xy] - μx μy, so μx acts through them too.
        let d_mx = (my * a2 * inverse - mx * ssim / b1) * 2.0 - mx * d_xx * 2.0 - my * d_xy;
        inside.select(d_mx, zero).store_slice(&mut d_mean[x..x + 16]);
        inside.select(d_xx, zero).store_slice(&mut d_square[x..x + 16]);
        inside.select(d_xy, zero).store_slice(&mut d_product[x..x + 16]);
        sum += f64::from(inside.select(ssim, zero).reduce_sum());
    }
    sum
}

/// Weights of the two parts of the gradient, already divided by the number of values.
#[derive(Clone, Copy)]
pub(super) struct GradientWeights {
    pub(super) l1: f32,
    pub(super) ssim: f32,
}

/// Gradient by `x` along one row; returns `Σ |x - y|`.
///
/// `maps` holds the horizontally blurred derivative maps of [`ssim_row`] in its first three; `x` and `y` are padded rows.
#[inline(always)]
pub(super) fn gradient_row<S: Simd>(
    simd: S,
    maps: &[Vec<f32>; 5],
    stride: usize,
    row: usize,
    x_row: &[f32],
    y_row: &[f32],
    weights: GradientWeights,
    out: &mut [f32],
) -> f64 {
    let mut sum = 0.0;
    for x in (0..stride).step_by(16) {
        let mean = blur_column(simd, &maps[0], stride, row, x);
        let square = blur_column(simd, &maps[1], stride, row, x);
        let product = blur_column(simd, &maps[2], stride, row, x);
        let (vx, vy) = (load(simd, x_row, x + PAD), load(simd, y_row, x + PAD));
        let ssim = (vx * square).mul_add(2.0, vy.mul_add(product, mean));
        let difference = vx - vy;
        let zero = f32x16::splat(simd, 0.0);
        let one = f32x16::splat(simd, weights.l1);
        let sign =
            difference.simd_gt(zero).select(one, difference.simd_lt(zero).select(-one, zero));
        (sign - ssim * weights.ssim).store_slice(&mut out[x..x + 16]);
        sum += f64::from(difference.abs().reduce_sum());
    }
    sum
}
