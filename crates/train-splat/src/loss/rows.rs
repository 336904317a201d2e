//! Row kernels of the loss: blurs and the SSIM terms, 16 pixels at a time.
//!
//! No closures around vector operations: a closure is compiled for the baseline instruction set
//! and would turn every operation into a call (measured: 8 times slower).

use fearless_simd::{Simd, f32x16, prelude::*};

/// Taps on each side of the window's center.
pub(super) const RADIUS: usize = 5;
/// Zeros on each side of a padded row; a whole vector, so that loads never leave the row.
pub(super) const PAD: usize = 16;
const C1: f32 = 0.01 * 0.01;
const C2: f32 = 0.03 * 0.03;

/// The normalized 1-D window, σ = 1.5, from the center outwards.
pub(super) const WINDOW: [f32; RADIUS + 1] =
    [0.266_011_7, 0.213_005_54, 0.109_360_69, 0.036_000_77, 0.007_598_758, 0.001_028_38];

#[inline(always)]
fn load<S: Simd>(simd: S, row: &[f32], at: usize) -> f32x16<S> {
    f32x16::from_slice(simd, &row[at..at + 16])
}

/// A row of whole vectors.
pub(super) type Row<'a> = &'a [[f32; 16]];

/// The rows that a vertical window covers, from the top.
pub(super) type Column<'a> = [Row<'a>; 2 * RADIUS + 1];

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

/// Vertical blur of vector `i`.
#[inline(always)]
fn blur_column<S: Simd>(simd: S, rows: &Column<'_>, i: usize) -> f32x16<S> {
    let at = |k: usize| &rows[k][i];
    let mut sum = f32x16::from_slice(simd, at(RADIUS)) * WINDOW[0];
    for (k, &weight) in WINDOW.iter().enumerate().skip(1) {
        let above = f32x16::from_slice(simd, at(RADIUS - k));
        let below = f32x16::from_slice(simd, at(RADIUS + k));
        sum = (above + below).mul_add(weight, sum);
    }
    sum
}

/// Sum of SSIM over one row, and the derivatives of `Σ SSIM` by the blurred `x`, `x²` and `xy`.
///
/// `maps` holds the horizontally blurred `x, y, x² + y², xy`; `width` pixels count, the rest is
/// padding and gets 0. `out` has whole vectors.
#[inline(always)]
pub(super) fn ssim_row<S: Simd>(
    simd: S,
    maps: &[Column<'_>; 4],
    width: usize,
    out: [&mut [f32]; 3],
) -> f64 {
    let [d_mean, d_square, d_product] = out;
    let zero = f32x16::splat(simd, 0.0);
    let mut sum = zero;
    let index = f32x16::from_slice(simd, &std::array::from_fn::<f32, 16, _>(|i| i as f32));
    for i in 0..d_mean.len() / 16 {
        let x = 16 * i;
        let mx = blur_column(simd, &maps[0], i);
        let my = blur_column(simd, &maps[1], i);
        let squares = blur_column(simd, &maps[2], i);
        let xy = blur_column(simd, &maps[3], i);
        let (mean_squares, mxy) = (mx.mul_add(mx, my * my), mx * my);
        let a1 = mxy * 2.0 + C1;
        let a2 = (xy - mxy) * 2.0 + C2;
        let b1 = mean_squares + C1;
        let b2 = (squares - mean_squares) + C2;
        let inverse = f32x16::splat(simd, 1.0) / (b1 * b2);
        let ssim = a1 * a2 * inverse;
        let inside = index.simd_lt((width as f32) - x as f32);
        // 1 / b1 = b2 inverse, and the other way round: one division instead of three.
        let scaled = ssim * inverse;
        let d_xx = -(scaled * b1);
        let d_xy = a1 * inverse * 2.0;
        // σx² = E[x²] - μx² and σxy = E[xy] - μx μy, so μx acts through them too.
        let d_mx = (my * a2 * inverse - mx * (scaled * b2)) * 2.0 - mx * d_xx * 2.0 - my * d_xy;
        inside.select(d_mx, zero).store_slice(&mut d_mean[x..x + 16]);
        inside.select(d_xx, zero).store_slice(&mut d_square[x..x + 16]);
        inside.select(d_xy, zero).store_slice(&mut d_product[x..x + 16]);
        sum += inside.select(ssim, zero);
    }
    f64::from(sum.reduce_sum())
}

/// Weights of the two parts of the gradient, already divided by the number of values.
#[derive(Clone, Copy)]
pub(super) struct GradientWeights {
    pub(super) l1: f32,
    pub(super) ssim: f32,
}

/// Gradient by `x` along one row, whole vectors.
///
/// `maps` holds the horizontally blurred derivative maps of [`ssim_row`]; `x_row` and `y_row` are
/// padded rows.
#[inline(always)]
pub(super) fn gradient_row<S: Simd>(
    simd: S,
    maps: &[Column<'_>; 3],
    x_row: &[f32],
    y_row: &[f32],
    weights: GradientWeights,
    out: &mut [f32],
) {
    let zero = f32x16::splat(simd, 0.0);
    let one = f32x16::splat(simd, weights.l1);
    for i in 0..out.len() / 16 {
        let x = 16 * i;
        let mean = blur_column(simd, &maps[0], i);
        let square = blur_column(simd, &maps[1], i);
        let product = blur_column(simd, &maps[2], i);
        let (vx, vy) = (load(simd, x_row, x + PAD), load(simd, y_row, x + PAD));
        let ssim = (vx * square).mul_add(2.0, vy.mul_add(product, mean));
        let difference = vx - vy;
        let sign =
            difference.simd_gt(zero).select(one, difference.simd_lt(zero).select(-one, zero));
        (sign - ssim * weights.ssim).store_slice(&mut out[x..x + 16]);
    }
}

/// What one row adds to the value of the loss and its gradient by the color transform.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RowSums {
    pub(super) l1: f64,
    pub(super) squared: f64,
    pub(super) d_gain: f64,
    pub(super) d_offset: f64,
}

impl RowSums {
    pub(super) fn add(&mut self, row: &Self) {
        self.l1 += row.l1;
        self.squared += row.squared;
        self.d_gain += row.d_gain;
        self.d_offset += row.d_offset;
    }
}

/// Sums along a finished row, then scales its gradient by the gain.
///
/// `gradient` is zero beyond the width, `raw` is the rendering before the color transform.
#[inline(always)]
pub(super) fn finish_row<S: Simd>(
    simd: S,
    x_row: &[f32],
    y_row: &[f32],
    raw: &[f32],
    gain: f32,
    gradient: &mut [f32],
) -> RowSums {
    let zero = f32x16::splat(simd, 0.0);
    let (mut l1, mut squared, mut d_gain, mut d_offset) = (zero, zero, zero, zero);
    for x in (0..gradient.len()).step_by(16) {
        let difference = load(simd, x_row, x + PAD) - load(simd, y_row, x + PAD);
        let g = load(simd, gradient, x);
        l1 += difference.abs();
        squared = difference.mul_add(difference, squared);
        d_gain = g.mul_add(load(simd, raw, x), d_gain);
        d_offset += g;
        (g * gain).store_slice(&mut gradient[x..x + 16]);
    }
    RowSums {
        l1: f64::from(l1.reduce_sum()),
        squared: f64::from(squared.reduce_sum()),
        d_gain: f64::from(d_gain.reduce_sum()),
        d_offset: f64::from(d_offset.reduce_sum()),
    }
}

/// `a² + b²` and `a b` of two padded rows.
#[inline(always)]
pub(super) fn product_rows<S: Simd>(
    simd: S,
    a: &[f32],
    b: &[f32],
    squares: &mut [f32],
    product: &mut [f32],
) {
    for x in (PAD..a.len() - PAD).step_by(16) {
        let (va, vb) = (load(simd, a, x), load(simd, b, x));
        va.mul_add(va, vb * vb).store_slice(&mut squares[x..x + 16]);
        (va * vb).store_slice(&mut product[x..x + 16]);
    }
}
