//! A few splats made ready for one tile: what each pixel needs in one place, and which blocks each
//! splat reaches.
//!
//! The masks of a batch are found before any pixel is touched. So the branch that ends a list is
//! decided long before the arithmetic that precedes it is done, and costs little; and a block
//! walks only over the splats that reach it.

use fearless_simd::{Simd, prelude::*, u16x32};

use crate::simd::{BLOCKS, PIXEL_X, PIXEL_Y};
use crate::spans::{Span, TileColumns};
use crate::splat::Splat;

/// Splats per batch: one bit each in a word.
pub(crate) const BATCH: usize = 64;

/// A splat relative to the corner of a tile: `E = sa px + sb py + e0`, `D = sd py + d0`.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct Item {
    pub(crate) sa: f32,
    pub(crate) sb: f32,
    pub(crate) sd: f32,
    pub(crate) e0: f32,
    pub(crate) d0: f32,
    /// `-level`
    pub(crate) base: f32,
    /// `-threshold`
    pub(crate) limit: f32,
    pub(crate) color: [f32; 3],
    /// Of the center, pixels.
    x: f32,
}

impl Item {
    /// Of a splat relative to the left end of the strip with top `y0`: what all tiles of the strip
    /// share.
    #[inline(always)]
    pub(crate) fn of_strip(splat: &Splat, y0: f32) -> Self {
        let y = y0 - splat.y;
        Self {
            sa: splat.sa,
            sb: splat.sb,
            sd: splat.sd,
            // What is left of `e0` when the center is at the left edge of the tile.
            e0: splat.sb * y,
            d0: splat.sd * y,
            base: -splat.level,
            limit: -splat.threshold,
            color: splat.color,
            x: splat.x,
        }
    }
}

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
    pub(crate) fn pack(&mut self, strip: &[Item], entries: &[u32], x0: f32) {
        for (item, &entry) in self.items.iter_mut().zip(entries) {
            *item = strip[entry as usize];
            item.e0 += item.sa * (x0 - item.x);
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
    let (px, py) = (PIXEL_X.lanes(simd, lane), PIXEL_Y.lanes(simd, lane));
    let e = px.mul_add(item.sa, py.mul_add(item.sb, item.e0));
    let d = py.mul_add(item.sd, item.d0);
    (e, d, e.mul_add(e, d.mul_add(d, item.base)))
}
