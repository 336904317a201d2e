//! One strip of 16 pixel rows: from tile lists to pixels, and from pixel gradients to moments.
//!
//! Tiles may be 8, 16 or 32 pixels wide; the kernels always work on 16×16 pixels and take the list
//! of the tile around them (32), or the lists of the four tiles in them one after the other (8).

use std::ops::{AddAssign, Range};

use fearless_simd::{Simd, dispatch};

use crate::backward::{BackwardTile, MOMENTS, backward_batch};
use crate::batch::{BATCH, Batch};
use crate::binning::Bins;
use crate::forward::{ForwardTile, PairCount, forward_batch};
use crate::options::{RenderOptions, TILE};
use crate::simd::TilePlane;

/// Precision of the sums of gradients over tiles and rows.
pub(crate) trait Total: Copy + Default + Send + Sync + From<f32> + AddAssign {
    fn to_f32(self) -> f32;
}

impl Total for f32 {
    fn to_f32(self) -> f32 {
        self
    }
}

impl Total for f64 {
    fn to_f32(self) -> f32 {
        self as f32
    }
}

/// Rows of tiles that strip `y` lies in.
pub(crate) fn rows_of_strip(bins: &Bins, y: usize) -> Range<usize> {
    match bins.tile {
        8 => 2 * y..(2 * y + 2).min(bins.rows.len()),
        tile => y * TILE / tile..y * TILE / tile + 1,
    }
}

/// One list of splats and the blocks of a 16×16 tile that it serves.
struct Part<'a> {
    row: usize,
    entries: &'a [u32],
    blocks: u16,
}

/// The lists for tile `t` of strip `y`.
fn parts(bins: &Bins, y: usize, t: usize) -> impl Iterator<Item = Part<'_>> {
    let per_side = TILE.div_ceil(bins.tile);
    rows_of_strip(bins, y).flat_map(move |row| {
        (0..per_side).filter_map(move |column| {
            let tile = t * TILE / bins.tile + column;
            let entries = bins.rows[row].tile_or_empty(tile)?;
            // Blocks go down the columns: 4 * column + row.
            let blocks = match bins.tile {
                8 => 0x0033 << (8 * column + 2 * (row - 2 * y)),
                _ => u16::MAX,
            };
            Some(Part { row, entries, blocks })
        })
    })
}

/// What a strip needs to know of its surroundings.
#[derive(Clone, Copy)]
pub(crate) struct Strip<'a> {
    pub(crate) bins: &'a Bins,
    pub(crate) options: &'a RenderOptions,
    /// Number of the strip from the top.
    pub(crate) y: usize,
    /// Padded row length.
    pub(crate) stride: usize,
}

impl Strip<'_> {
    /// Composites the strip into `rows` (four planes).
    pub(crate) fn forward(&self, rows: &mut [f32], count_pairs: bool) -> PairCount {
        let Self { bins, options, y, stride } = *self;
        let level = options.dials.level();
        let mut pairs = PairCount::default();
        let plane = TILE * stride;
        let mut batch = Batch::new();
        for t in 0..stride / TILE {
            let mut tile = ForwardTile::new();
            let corner = [(t * TILE) as f32, (y * TILE) as f32];
            for part in parts(bins, y, t) {
                let splats = &bins.rows[part.row].splats;
                for entries in part.entries.chunks(BATCH) {
                    let alive = tile.alive & part.blocks;
                    if alive == 0 {
                        break;
                    }
                    dispatch!(level, simd => {
                        batch.prepare(simd, splats, entries, corner, alive);
                        batch.transpose(simd);
                        forward_any(simd, options, count_pairs, &batch, &mut tile, &mut pairs);
                    });
                }
            }
            for (c, color) in tile.color.iter_mut().enumerate() {
                for (value, transmittance) in color.0.iter_mut().zip(&tile.transmittance.0) {
                    *value += transmittance * options.background[c];
                }
                color.store_rows(&mut rows[c * plane..(c + 1) * plane], stride, t * TILE);
            }
            tile.transmittance.store_rows(&mut rows[3 * plane..], stride, t * TILE);
        }
        pairs
    }

    /// Moments of the splats of the strip's rows, one row of tiles after the other, from the
    /// finished image and the gradient by it (four planes each).
    pub(crate) fn backward<T: Total>(
        &self,
        image: &[f32],
        gradient: &[f32],
        moments: &mut Vec<[T; MOMENTS]>,
    ) {
        let Self { bins, options, y, stride } = *self;
        let level = options.dials.level();
        let count = rows_of_strip(bins, y).map(|row| bins.rows[row].ids.len()).sum();
        moments.clear();
        moments.resize(count, [T::default(); MOMENTS]);
        let first_row = rows_of_strip(bins, y).start;
        let mut batch = Batch::new();
        let mut sums = [[0.0; MOMENTS]; BATCH];
        for t in 0..stride / TILE {
            if parts(bins, y, t).all(|part| part.entries.is_empty()) {
                continue;
            }
            let mut tile = BackwardTile::new();
            self.load(&mut tile, image, gradient, t);
            let corner = [(t * TILE) as f32, (y * TILE) as f32];
            for part in parts(bins, y, t) {
                let splats = &bins.rows[part.row].splats;
                let base = if part.row == first_row { 0 } else { bins.rows[first_row].ids.len() };
                for entries in part.entries.chunks(BATCH) {
                    let alive = tile.alive & part.blocks;
                    if alive == 0 {
                        break;
                    }
                    let mut touched = dispatch!(level, simd => {
                        batch.prepare(simd, splats, entries, corner, alive);
                        backward_any(simd, options, &batch, entries.len(), &mut tile, &mut sums)
                    });
                    while touched != 0 {
                        let k = touched.trailing_zeros() as usize;
                        touched &= touched - 1;
                        let totals = &mut moments[base + entries[k] as usize];
                        for (total, sum) in totals.iter_mut().zip(sums[k]) {
                            *total += T::from(sum);
                        }
                    }
                }
            }
        }
    }

    fn load(&self, tile: &mut BackwardTile, image: &[f32], gradient: &[f32], t: usize) {
        let stride = self.stride;
        let plane = TILE * stride;
        let mut value = TilePlane::filled(0.0);
        for c in 0..3 {
            let rows = c * plane..(c + 1) * plane;
            tile.gradient[c].load_rows(&gradient[rows.clone()], stride, t * TILE);
            value.load_rows(&image[rows], stride, t * TILE);
            for ((s, g), v) in tile.behind.0.iter_mut().zip(&tile.gradient[c].0).zip(&value.0) {
                *s += g * v;
            }
        }
        // The final transmittance acts like one more colour channel: 0 on every splat, 1 behind.
        let mut d_transmittance = TilePlane::filled(0.0);
        d_transmittance.load_rows(&gradient[3 * plane..], stride, t * TILE);
        value.load_rows(&image[3 * plane..], stride, t * TILE);
        for ((s, g), v) in tile.behind.0.iter_mut().zip(&d_transmittance.0).zip(&value.0) {
            *s += g * v;
        }
    }
}

/// The forward kernel of the polynomial's degree.
#[inline(always)]
fn forward_any<S: Simd>(
    simd: S,
    options: &RenderOptions,
    count: bool,
    batch: &Batch,
    tile: &mut ForwardTile,
    pairs: &mut PairCount,
) {
    let stop = options.dials.transmittance_min;
    match (options.dials.exp_degree, count) {
        (2, false) => forward_batch::<S, 2, false>(simd, batch, tile, stop, pairs),
        (3, false) => forward_batch::<S, 3, false>(simd, batch, tile, stop, pairs),
        (4, false) => forward_batch::<S, 4, false>(simd, batch, tile, stop, pairs),
        (_, false) => forward_batch::<S, 5, false>(simd, batch, tile, stop, pairs),
        (2, true) => forward_batch::<S, 2, true>(simd, batch, tile, stop, pairs),
        (3, true) => forward_batch::<S, 3, true>(simd, batch, tile, stop, pairs),
        (4, true) => forward_batch::<S, 4, true>(simd, batch, tile, stop, pairs),
        (_, true) => forward_batch::<S, 5, true>(simd, batch, tile, stop, pairs),
    }
}

/// The backward kernel of the polynomial's degree.
#[inline(always)]
fn backward_any<S: Simd>(
    simd: S,
    options: &RenderOptions,
    batch: &Batch,
    count: usize,
    tile: &mut BackwardTile,
    sums: &mut [[f32; MOMENTS]; BATCH],
) -> u64 {
    let stop = options.dials.transmittance_min;
    match options.dials.exp_degree {
        2 => backward_batch::<S, 2>(simd, batch, count, tile, stop, sums),
        3 => backward_batch::<S, 3>(simd, batch, count, tile, stop, sums),
        4 => backward_batch::<S, 4>(simd, batch, count, tile, stop, sums),
        _ => backward_batch::<S, 5>(simd, batch, count, tile, stop, sums),
    }
}
