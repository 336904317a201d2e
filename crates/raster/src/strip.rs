//! One strip of 16 pixel rows: from tile lists to pixels, and from pixel gradients to moments.
//!
//! Tiles may be 8, 16 or 32 pixels wide; the kernels always work on 16×16 pixels and take the list
//! of the tile around them (32), or the lists of the four tiles in them one after the other (8).

use std::ops::{AddAssign, Range};

use fearless_simd::{Simd, dispatch};

use crate::backward::{BackwardTile, MOMENTS, backward_batch};
use crate::batch::{BATCH, Batch, StripItem};
use crate::binning::Bins;
use crate::forward::{ForwardTile, PairCount, forward_batch};
use crate::options::{RenderOptions, TILE};
use crate::spans::{BLOCK_ROWS, TileColumns};

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
    /// Splats of the strip that belong to rows of tiles above this one.
    base: usize,
    entries: &'a [u32],
    blocks: u16,
}

/// The lists for tile `t` of strip `y`.
fn parts(bins: &Bins, y: usize, t: usize) -> impl Iterator<Item = Part<'_>> {
    let per_side = TILE.div_ceil(bins.tile);
    let first_row = rows_of_strip(bins, y).start;
    rows_of_strip(bins, y).flat_map(move |row| {
        (0..per_side).filter_map(move |column| {
            let tile = t * TILE / bins.tile + column;
            let entries = bins.rows[row].tile_or_empty(tile)?;
            // Blocks go down the columns: 4 * column + row.
            let blocks = match bins.tile {
                8 => 0x0033 << (8 * column + 2 * (row - 2 * y)),
                _ => u16::MAX,
            };
            let base = if row == first_row { 0 } else { bins.rows[first_row].ids.len() };
            Some(Part { row, base, entries, blocks })
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
    /// Composites the strip into `rows` (four planes) and notes in `masks` which blocks each entry
    /// of its lists can reach.
    pub(crate) fn forward(&self, rows: &mut [f32], masks: &mut Vec<u16>, count: bool) -> PairCount {
        let parameters = &self.options.parameters;
        // The whole strip in one dispatch, so that all of it uses the wide instructions.
        dispatch!(parameters.level(), simd => match (parameters.exp_degree, count) {
            (2, false) => self.forward_with::<_, 2, false>(simd, rows, masks),
            (3, false) => self.forward_with::<_, 3, false>(simd, rows, masks),
            (4, false) => self.forward_with::<_, 4, false>(simd, rows, masks),
            (_, false) => self.forward_with::<_, 5, false>(simd, rows, masks),
            (2, true) => self.forward_with::<_, 2, true>(simd, rows, masks),
            (3, true) => self.forward_with::<_, 3, true>(simd, rows, masks),
            (4, true) => self.forward_with::<_, 4, true>(simd, rows, masks),
            (_, true) => self.forward_with::<_, 5, true>(simd, rows, masks),
        })
    }

    /// Splats of the rows of tiles, one row after the other, relative to the strip. They are read
    /// in the order of memory here and stay near for the tiles, which ask for them in leaps.
    #[inline(always)]
    fn items(&self) -> Vec<StripItem> {
        let top = (self.y * TILE) as f32;
        let rows = &self.bins.rows[rows_of_strip(self.bins, self.y)];
        let mut items = Vec::with_capacity(rows.iter().map(|row| row.splats.len()).sum());
        for row in rows {
            items.extend(row.splats.iter().map(|splat| StripItem::new(splat, top)));
        }
        items
    }

    #[inline(always)]
    fn forward_with<S: Simd, const DEGREE: usize, const COUNT: bool>(
        &self,
        simd: S,
        rows: &mut [f32],
        masks: &mut Vec<u16>,
    ) -> PairCount {
        let Self { bins, options, y, stride } = *self;
        let stop = options.parameters.transmittance_min;
        let mut pairs = PairCount::default();
        let plane = TILE * stride;
        let items = self.items();
        // Brings near, in the order of memory, what the tiles write column by column.
        rows.fill(0.0);
        let mut batch = Batch::new();
        masks.clear();
        for t in 0..stride / TILE {
            let mut tile = ForwardTile::new();
            let columns = TileColumns::new(t * BLOCK_ROWS);
            for part in parts(bins, y, t) {
                let items = &items[part.base..];
                let spans = bins.rows[part.row].spans(y - part.row * bins.tile / TILE);
                let end = masks.len() + part.entries.len();
                for entries in part.entries.chunks(BATCH) {
                    let alive = tile.alive & part.blocks;
                    if alive == 0 {
                        break;
                    }
                    batch.find_masks(simd, spans, entries, &columns);
                    batch.pack(simd, items, entries, (t * TILE) as f32);
                    masks.extend_from_slice(&batch.masks[..entries.len()]);
                    batch.transpose(simd);
                    forward_batch::<S, DEGREE, COUNT>(
                        simd, &batch, alive, &mut tile, stop, &mut pairs,
                    );
                }
                // What was not looked at reaches nothing.
                masks.resize(end, 0);
            }
            for c in 0..3 {
                for (value, t) in tile.color[c].0.iter_mut().zip(&tile.transmittance.0) {
                    *value += t * options.background[c];
                }
                tile.color[c].store_rows(&mut rows[c * plane..(c + 1) * plane], stride, t * TILE);
            }
            tile.transmittance.store_rows(&mut rows[3 * plane..], stride, t * TILE);
        }
        pairs
    }

    /// Moments of the splats of the strip's rows, one row of tiles after the other, from the
    /// finished image and the gradient by it (four planes each) and the masks of the forward pass.
    pub(crate) fn backward<T: Total>(
        &self,
        image: &[f32],
        gradient: &[f32],
        masks: &[u16],
        moments: &mut Vec<[T; MOMENTS]>,
    ) {
        let parameters = &self.options.parameters;
        dispatch!(parameters.level(), simd => match parameters.exp_degree {
            2 => self.backward_with::<_, T, 2>(simd, image, gradient, masks, moments),
            3 => self.backward_with::<_, T, 3>(simd, image, gradient, masks, moments),
            4 => self.backward_with::<_, T, 4>(simd, image, gradient, masks, moments),
            _ => self.backward_with::<_, T, 5>(simd, image, gradient, masks, moments),
        });
    }

    #[inline(always)]
    fn backward_with<S: Simd, T: Total, const DEGREE: usize>(
        &self,
        simd: S,
        image: &[f32],
        gradient: &[f32],
        mut masks: &[u16],
        moments: &mut Vec<[T; MOMENTS]>,
    ) {
        let Self { bins, options, y, stride } = *self;
        let stop = options.parameters.transmittance_min;
        let count = rows_of_strip(bins, y).map(|row| bins.rows[row].ids.len()).sum();
        moments.clear();
        moments.resize(count, [T::default(); MOMENTS]);
        let items = self.items();
        let behind = self.behind(image, gradient);
        let mut batch = Batch::new();
        let mut sums = [[0.0; MOMENTS]; BATCH];
        for t in 0..stride / TILE {
            if parts(bins, y, t).all(|part| part.entries.is_empty()) {
                continue;
            }
            let mut tile = BackwardTile::new();
            for (c, plane) in tile.gradient.iter_mut().enumerate() {
                plane.load_rows(&gradient[c * TILE * stride..], stride, t * TILE);
            }
            tile.behind.load_rows(&behind, stride, t * TILE);
            for part in parts(bins, y, t) {
                let items = &items[part.base..];
                let (part_masks, rest) = masks.split_at(part.entries.len());
                masks = rest;
                for (entries, masks) in part.entries.chunks(BATCH).zip(part_masks.chunks(BATCH)) {
                    let alive = tile.alive & part.blocks;
                    if alive == 0 {
                        break;
                    }
                    batch.pack(simd, items, entries, (t * TILE) as f32);
                    let mut touched = backward_batch::<S, DEGREE>(
                        simd,
                        &batch,
                        masks,
                        part.blocks,
                        &mut tile,
                        stop,
                        &mut sums,
                    );
                    while touched != 0 {
                        let k = touched.trailing_zeros() as usize & (BATCH - 1);
                        touched &= touched - 1;
                        let totals = &mut moments[part.base + entries[k] as usize];
                        for (total, sum) in totals.iter_mut().zip(sums[k]) {
                            *total += T::from(sum);
                        }
                    }
                }
            }
        }
    }

    /// `g·color + dL/dT_end T_end` of the finished strip: what lies behind the first splat. Like
    /// [`Self::items`], it brings near what the tiles read column by column.
    #[inline(always)]
    fn behind(&self, image: &[f32], gradient: &[f32]) -> Vec<f32> {
        let plane = TILE * self.stride;
        let mut behind = vec![0.0; plane];
        for (y, behind) in behind.chunks_exact_mut(self.stride).enumerate() {
            // The final transmittance acts like one more color channel: 0 on every splat, 1 behind.
            for c in 0..4 {
                let row = c * plane + y * self.stride..c * plane + (y + 1) * self.stride;
                let values = gradient[row.clone()].iter().zip(&image[row]);
                for (sum, (g, value)) in behind.iter_mut().zip(values) {
                    *sum += g * value;
                }
            }
        }
        behind
    }
}
