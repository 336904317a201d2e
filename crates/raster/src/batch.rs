//! A few splats made ready for one tile: what each pixel needs in one place, and which blocks each
//! splat reaches.
//!
//! The masks of a batch are found before any pixel is touched. So the branch that ends a list is
//! decided long before the arithmetic that precedes it is done, and costs little; and a block
//! walks only over the splats that reach it.

use fearless_simd::{Simd, prelude::*, u16x32};

use crate::simd::{BLOCKS, PIXEL_X, PIXEL_Y, block_mask};
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

    /// Fills [`Self::items`] with the splats `entries` (at most [`BATCH`]) for the tile at a corner.
    #[inline(always)]
    pub(crate) fn pack(&mut self, splats: &[Splat], entries: &[u32], [x0, y0]: [f32; 2]) {
        for (item, &entry) in self.items.iter_mut().zip(entries) {
            let s = &splats[entry as usize];
            let (x, y) = (x0 - s.x, y0 - s.y);
            *item = Item {
                sa: s.sa,
                sb: s.sb,
                sd: s.sd,
                e0: s.sa * x + s.sb * y,
                d0: s.sd * y,
                base: -s.level,
                limit: -s.threshold,
                color: s.color,
            };
        }
    }

    /// Fills [`Self::masks`] for the same splats.
    #[inline(always)]
    pub(crate) fn find_masks<S: Simd>(
        &mut self,
        simd: S,
        splats: &[Splat],
        entries: &[u32],
        [x0, y0]: [f32; 2],
    ) {
        for (mask, &entry) in self.masks.iter_mut().zip(entries) {
            *mask = block_mask(simd, &splats[entry as usize], x0, y0);
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
