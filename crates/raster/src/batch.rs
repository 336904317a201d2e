//! A few splats made ready for one tile: what each pixel needs in one place, and which blocks each
//! splat reaches.
//!
//! The masks of a batch are found before any pixel is touched. So the branch that ends a list is
//! decided long before the arithmetic that precedes it is done, and costs little; and a block
//! walks only over the splats that reach it.

use fearless_simd::{Simd, f32x4, prelude::*, u16x32};

use crate::simd::{BLOCKS, LANES, PIXEL_X, PIXEL_Y};
use crate::spans::{BLOCK_ROWS, Span, TileColumns};
use crate::splat::Splat;

/// Splats per batch: one bit each in a word.
pub(crate) const BATCH: usize = 64;

/// What all tiles of a strip share of a splat.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct StripItem {
    sa: f32,
    sb: f32,
    sd: f32,
    /// Of the center, pixels.
    x: f32,
    /// From the center to the top of the strip.
    y: f32,
    /// `-level`
    base: f32,
    /// `-threshold`
    limit: f32,
    color: [f32; 3],
}

impl StripItem {
    /// For the strip with top `y0`.
    #[inline(always)]
    pub(crate) fn new(splat: &Splat, y0: f32) -> Self {
        Self {
            sa: splat.sa,
            sb: splat.sb,
            sd: splat.sd,
            x: splat.x,
            y: y0 - splat.y,
            base: -splat.level,
            limit: -splat.threshold,
            color: splat.color,
        }
    }
}

/// A splat in a tile. `E` and `D` of a pixel are a sum of two: one of its place in the block and
/// one of the block, so that a pair costs two additions and no product.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct Item {
    /// `sa px + sb py` and `sd py` from the corner of a block.
    pub(crate) e_in_block: [f32; LANES],
    pub(crate) d_in_block: [f32; LANES],
    /// `E` and `D` of the corners of the blocks.
    pub(crate) e_of_block: [f32; BLOCKS],
    pub(crate) d_of_row: [f32; BLOCK_ROWS],
    pub(crate) base: f32,
    pub(crate) limit: f32,
    pub(crate) color: [f32; 3],
}

impl Item {
    /// Of the tile with left edge `x0`.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, strip: &StripItem, x0: f32) {
        let StripItem { sa, sb, sd, x, y, .. } = *strip;
        let (e0, d0) = (sa * (x0 - x) + sb * y, sd * y);
        for at in (0..LANES).step_by(S::f32s::LEN) {
            let lanes = at..at + S::f32s::LEN;
            let (px, py) = (PIXEL_X.lanes(simd, at), PIXEL_Y.lanes(simd, at));
            px.mul_add(sa, py * sb).store_slice(&mut self.e_in_block[lanes.clone()]);
            (py * sd).store_slice(&mut self.d_in_block[lanes.clone()]);
            let (bx, by) = (
                S::f32s::from_slice(simd, &CORNER_X[lanes.clone()]),
                S::f32s::from_slice(simd, &CORNER_Y[lanes.clone()]),
            );
            bx.mul_add(sa, by.mul_add(sb, e0)).store_slice(&mut self.e_of_block[lanes]);
        }
        let rows = f32x4::from_slice(simd, &CORNER_Y[..BLOCK_ROWS]);
        rows.mul_add(sd, d0).store_slice(&mut self.d_of_row);
        self.base = strip.base;
        self.limit = strip.limit;
        self.color = strip.color;
    }
}

/// Corners of the blocks from the corner of the tile.
static CORNER_X: [f32; BLOCKS] =
    [0.0, 0.0, 0.0, 0.0, 4.0, 4.0, 4.0, 4.0, 8.0, 8.0, 8.0, 8.0, 12.0, 12.0, 12.0, 12.0];
static CORNER_Y: [f32; BLOCKS] =
    [0.0, 4.0, 8.0, 12.0, 0.0, 4.0, 8.0, 12.0, 0.0, 4.0, 8.0, 12.0, 0.0, 4.0, 8.0, 12.0];

/// Up to [`BATCH`] consecutive splats of a tile.
pub(crate) struct Batch {
    pub(crate) items: [Item; BATCH],
    /// Blocks of each splat.
    pub(crate) masks: [u16; BATCH],
    /// Splats of each block: the same bits, transposed.
    pub(crate) bits: [u64; BLOCKS],
}

impl Batch {
    pub(crate) fn new() -> Self {
        Self { items: [Item::default(); BATCH], masks: [0; BATCH], bits: [0; BLOCKS] }
    }

    /// Fills [`Self::items`] with the `entries` (at most [`BATCH`]) of a strip for the tile with
    /// left edge `x0`.
    #[inline(always)]
    pub(crate) fn pack<S: Simd>(&mut self, simd: S, strip: &[StripItem], entries: &[u32], x0: f32) {
        for (item, &entry) in self.items.iter_mut().zip(entries) {
            item.fill(simd, &strip[entry as usize], x0);
        }
    }

    /// Fills [`Self::masks`] for the same entries.
    #[inline(always)]
    pub(crate) fn find_masks<S: Simd>(
        &mut self,
        simd: S,
        spans: &[Span],
        entries: &[u32],
        columns: &TileColumns,
    ) {
        for (mask, &entry) in self.masks.iter_mut().zip(entries) {
            *mask = columns.mask(simd, &spans[entry as usize]);
        }
        if let Some(rest) = self.masks.get_mut(entries.len()..) {
            rest.fill(0);
        }
    }

    /// Fills [`Self::bits`].
    #[inline(always)]
    pub(crate) fn transpose<S: Simd>(&mut self, simd: S) {
        let low = u16x32::from_slice(simd, &self.masks[..32]);
        let high = u16x32::from_slice(simd, &self.masks[32..]);
        for (i, bits) in self.bits.iter_mut().enumerate() {
            let bit = u16x32::splat(simd, 1 << i);
            let words = [(low & bit).simd_eq(bit), (high & bit).simd_eq(bit)];
            *bits = words[0].to_bitmask() | words[1].to_bitmask() << 32;
        }
    }
}

/// `E`, `D` and `E² + D² - level` (an eighth of `-log2 alpha`) of a splat over some lanes.
///
/// With the comparison against [`Item::limit`] this is the only place that decides what a splat
/// contributes: forward and backward both use it, so they cannot disagree.
#[inline(always)]
pub(crate) fn falloff<S: Simd>(simd: S, item: &Item, lane: usize) -> (S::f32s, S::f32s, S::f32s) {
    let (block, at) = (lane / LANES, lane % LANES);
    let in_block =
        |values: &[f32; LANES]| S::f32s::from_slice(simd, &values[at..at + S::f32s::LEN]);
    let e = in_block(&item.e_in_block) + item.e_of_block[block];
    let d = in_block(&item.d_in_block) + item.d_of_row[block % BLOCK_ROWS];
    (e, d, e.mul_add(e, d.mul_add(d, item.base)))
}
