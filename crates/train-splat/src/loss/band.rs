//! One band of the loss, row by row, with rings of rows instead of whole maps.
//!
//! Row `y` enters: its photo and rendering are loaded and blurred horizontally. Row `y - 5` then has
//! its vertical window complete, which gives SSIM and its derivative maps, blurred horizontally in
//! turn. Row `y - 10` has the window of those complete, which gives the gradient. All that is alive
//! fits into the second-level cache; whole maps would be written to memory and read back (36 bytes
//! per pixel).

use std::ops::Range;

use fearless_simd::Simd;
use motes_raster::{Planes, TILE};

use super::ColorTransform;
use super::rows::{
    Column, GradientWeights, PAD, RADIUS, Row, RowSums, blur_row, finish_row, gradient_row,
    product_rows, ssim_row,
};
use crate::target::Target;

/// Rows a ring holds: at least the 11 of a window, a power of two.
const RING: usize = 16;

/// What a band reads.
pub(super) struct Rows<'a> {
    pub(super) render: &'a Planes,
    pub(super) target: &'a Target,
    pub(super) background: [f32; 3],
    pub(super) transform: ColorTransform,
}

impl Rows<'_> {
    /// Loads row `y` of channel `c` of the transformed rendering and of the photo into padded rows.
    #[inline(always)]
    pub(super) fn load(&self, c: usize, y: usize, x_row: &mut [f32], y_row: &mut [f32]) {
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

/// Sums of one band.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BandSums {
    pub(super) ssim: f64,
    pub(super) channels: [RowSums; 3],
}

/// Rings and single rows of one thread.
#[derive(Default)]
pub(super) struct Scratch {
    /// Padded rows of the rendering and of the photo.
    x: Vec<f32>,
    y: Vec<f32>,
    /// Padded products, and padded derivative rows.
    single: [Vec<f32>; 3],
    /// Horizontally blurred `x, y, x² + y², xy`.
    blurred: [Vec<f32>; 4],
    /// Horizontally blurred derivative maps.
    derivatives: [Vec<f32>; 3],
}

impl Scratch {
    /// Sizes the buffers for rows of `stride` values; everything outside the image is zero.
    fn prepare(&mut self, stride: usize) {
        let padded = ring_row(stride + 2 * PAD);
        for (buffer, length) in [(&mut self.x, RING * padded), (&mut self.y, RING * padded)]
            .into_iter()
            .chain(self.single.iter_mut().map(|row| (row, padded)))
        {
            buffer.clear();
            buffer.resize(length, 0.0);
        }
        for ring in self.blurred.iter_mut().chain(&mut self.derivatives) {
            ring.resize(RING * ring_row(stride), 0.0);
        }
    }
}

/// Length of a ring's row: an odd number of cache lines, so that the rows of a window do not fall
/// into the same few sets of the cache when the width is a multiple of 1024.
#[inline(always)]
fn ring_row(length: usize) -> usize {
    length + 16 * usize::from((length / 16).is_multiple_of(2))
}

/// Row `y` of a ring of rows of `length` values. Rows before the image have their place too.
#[inline(always)]
fn slot(y: isize, length: usize) -> Range<usize> {
    let k = y.rem_euclid(RING as isize) as usize;
    k * length..(k + 1) * length
}

/// The window of rows around `y` in a ring.
#[inline(always)]
fn column(ring: &[f32], y: isize, stride: usize) -> Column<'_> {
    let mut rows: Column<'_> = [&[]; 2 * RADIUS + 1];
    for (k, row) in rows.iter_mut().enumerate() {
        let whole: Row<'_> =
            ring[slot(y + k as isize - RADIUS as isize, ring_row(stride))][..stride].as_chunks().0;
        *row = whole;
    }
    rows
}

// tidy: long (one pass over the rows, in the order of the equations; splitting it would pass the ring
// of rows through every part)
/// Loss and gradient of the rows `range`; `out` is their part of the gradient's planes.
#[inline(always)]
pub(super) fn band<S: Simd>(
    simd: S,
    rows: &Rows<'_>,
    range: Range<usize>,
    weights: GradientWeights,
    out: &mut [f32],
    scratch: &mut Scratch,
) -> BandSums {
    let stride = rows.render.stride;
    let padded = ring_row(stride + 2 * PAD);
    let row_length = ring_row(stride);
    let (width, height) = (rows.target.width, rows.target.height as isize);
    let (first, end) = (range.start as isize, (range.end as isize).min(height));
    let reach = RADIUS as isize;
    scratch.prepare(stride);
    let Scratch { x, y, single, blurred, derivatives } = scratch;
    let mut sums = BandSums::default();
    out.fill(0.0);
    for c in 0..3 {
        for entering in first - 2 * reach..end + 2 * reach {
            let at = slot(entering, padded);
            let to = slot(entering, row_length);
            if (0..height).contains(&entering) {
                let (x_row, y_row) = (&mut x[at.clone()], &mut y[at]);
                rows.load(c, entering as usize, x_row, y_row);
                let [squares, product, _] = &mut *single;
                product_rows(simd, x_row, y_row, squares, product);
                for (source, ring) in
                    [&*x_row, y_row, squares, product].into_iter().zip(&mut *blurred)
                {
                    blur_row(simd, source, &mut ring[to.clone()][..stride]);
                }
            } else {
                for ring in &mut *blurred {
                    ring[to.clone()].fill(0.0);
                }
            }

            let middle = entering - reach;
            let to = slot(middle, row_length);
            if (0..height).contains(&middle) && middle >= first - reach {
                let [a, b, d, e] = &*blurred;
                let maps = [
                    column(a, middle, stride),
                    column(b, middle, stride),
                    column(d, middle, stride),
                    column(e, middle, stride),
                ];
                let inner = PAD..PAD + stride;
                let [mean, square, product] = &mut *single;
                let ssim = ssim_row(
                    simd,
                    &maps,
                    width,
                    [&mut mean[inner.clone()], &mut square[inner.clone()], &mut product[inner]],
                );
                if (first..end).contains(&middle) {
                    sums.ssim += ssim;
                }
                for (source, ring) in single.iter().zip(&mut *derivatives) {
                    blur_row(simd, source, &mut ring[to.clone()][..stride]);
                }
            } else {
                for ring in &mut *derivatives {
                    ring[to.clone()].fill(0.0);
                }
            }

            let leaving = middle - reach;
            if (first..end).contains(&leaving) {
                let [a, b, d] = &*derivatives;
                let maps = [
                    column(a, leaving, stride),
                    column(b, leaving, stride),
                    column(d, leaving, stride),
                ];
                let at = slot(leaving, padded);
                let (x_row, y_row) = (&x[at.clone()], &y[at]);
                let r = (leaving - first) as usize;
                // Row of the planes layout, relative to this band's slice.
                let start = (r / TILE) * 4 * TILE * stride + (c * TILE + r % TILE) * stride;
                let row = &mut out[start..start + stride];
                gradient_row(simd, &maps, x_row, y_row, weights, row);
                if let Some(weight) = &rows.target.weight {
                    let from = leaving as usize * width;
                    for (g, &w) in row.iter_mut().zip(&weight[from..from + width]) {
                        *g = if w == 0 { 0.0 } else { *g };
                    }
                }
                row[width..].fill(0.0);
                let raw_start = rows.render.row_start(c, leaving as usize);
                let raw = &rows.render.data[raw_start..raw_start + stride];
                let gain = rows.transform.gain[c];
                let row_sums = finish_row(simd, x_row, y_row, raw, gain, row);
                sums.channels[c].add(&row_sums);
            }
        }
    }
    sums
}
