//! Which blocks of a strip each splat reaches: of every row of blocks the first and the last column.
//!
//! All of it that needs arithmetic is found once per splat and strip, one splat per lane. What is
//! left for a tile is a comparison of small integers with its own columns.

use fearless_simd::{Simd, i16x32, i32x4, prelude::*};

use crate::lanes::{MAX_LANES, transpose};
use crate::simd::BLOCK;
use crate::splat::{SLACK, Splat};

/// Rows of blocks in a strip.
pub(crate) const BLOCK_ROWS: usize = 4;

/// Eight numbers of 16 bits, two in a word: the first columns of the four rows of blocks, then the
/// negated ends, so that both are compared alike.
pub(crate) type Span = [i32; BLOCK_ROWS];

/// Shapes of splats, one per lane.
pub(crate) struct Shapes<S: Simd> {
    x: S::f32s,
    y: S::f32s,
    sd: S::f32s,
    half_height: S::f32s,
    rightmost_dy: S::f32s,
    inverse_sa: S::f32s,
    slope: S::f32s,
    reach: S::f32s,
}

/// Columns of blocks from `first` to before `end`, fractions to be cut off, one splat per lane.
/// Infinity and 0 where none is reached.
#[derive(Clone, Copy)]
pub(crate) struct Columns<S: Simd> {
    pub(crate) first: S::f32s,
    pub(crate) end: S::f32s,
}

impl<S: Simd> Columns<S> {
    #[inline(always)]
    pub(crate) fn none(simd: S) -> Self {
        Self { first: S::f32s::simd_from(simd, f32::INFINITY), end: S::f32s::simd_from(simd, 0.0) }
    }

    /// All columns from those of the one to those of the other.
    #[inline(always)]
    pub(crate) fn hull(self, other: Self) -> Self {
        Self { first: self.first.min(other.first), end: self.end.max(other.end) }
    }
}

impl<S: Simd> Shapes<S> {
    /// Of at most as many splats as there are lanes; the other lanes hold none.
    #[inline(always)]
    pub(crate) fn gather(simd: S, splats: &[Splat]) -> Self {
        let n = S::f32s::LEN;
        let mut values = [S::f32s::simd_from(simd, 0.0); MAX_LANES];
        for (lane, splat) in splats.iter().enumerate() {
            let row = splat.values();
            for part in 0..MAX_LANES / n {
                values[part * n + lane] = S::f32s::from_slice(simd, &row[part * n..(part + 1) * n]);
            }
        }
        for part in values.chunks_exact_mut(n) {
            transpose::<S>(part);
        }
        let [x, y, _, sb, sd, level, threshold, ..] = values;
        let [.., half_height, rightmost_dy, inverse_sa, _, _] = values;
        let (slope, reach) = (-(sb * inverse_sa), level - threshold);
        Self { x, y, sd, half_height, rightmost_dy, inverse_sa, slope, reach }
    }

    /// Columns of the row of blocks with top `y0` in a picture of `columns`: [`Splat::band`] over the
    /// pixel centers of the row.
    #[inline(always)]
    pub(crate) fn columns(&self, simd: S, y0: f32, columns: f32) -> Columns<S> {
        let zero = S::f32s::simd_from(simd, 0.0);
        let top = -self.y + (y0 + 0.5);
        let low = top.max(-self.half_height);
        let high = (top + (BLOCK - 1) as f32).min(self.half_height);
        let touched = low.simd_le(high + SLACK);
        let right_y = self.rightmost_dy.max(low).min(high);
        let left_y = (-self.rightmost_dy).max(low).min(high);
        let (right_d, left_d) = (right_y * self.sd, left_y * self.sd);
        let right_reach = (self.reach - right_d * right_d).max(zero).sqrt();
        let left_reach = (self.reach - left_d * left_d).max(zero).sqrt();
        let left = self.slope * left_y - self.inverse_sa * left_reach - SLACK;
        let right = self.slope * right_y + self.inverse_sa * right_reach + SLACK;
        // Block column i holds centers 4i + 0.5 ... 4i + 3.5.
        let scale = (BLOCK as f32).recip();
        let first = ((self.x + left + 0.5) * scale).max(zero);
        let end = ((self.x + right + (BLOCK as f32 - 0.5)) * scale).max(zero).min(columns);
        // NaN reaches nothing.
        let reached = touched & first.simd_le(end);
        let none = Columns::none(simd);
        Columns { first: reached.select(first, none.first), end: reached.select(end, none.end) }
    }
}

/// Packs the columns of the four rows of blocks: the words of one splat after the other.
#[inline(always)]
pub(crate) fn pack<S: Simd>(rows: [Columns<S>; BLOCK_ROWS]) -> [i32; BLOCK_ROWS * MAX_LANES] {
    let [a, b, c, d] = rows;
    let limit = f32::from(i16::MAX);
    let first = |row: Columns<S>| row.first.min(limit).to_int::<S::i32s>();
    let end = |row: Columns<S>| (-row.end.min(limit + 1.0)).to_int::<S::i32s>();
    let two = |low: S::i32s, high: S::i32s| (low & 0xffff) | (high << 16);
    let (ab, cd) = (two(first(a), first(b)), two(first(c), first(d)));
    let (end_ab, end_cd) = (two(end(a), end(b)), two(end(c), end(d)));
    let evens = ab.interleave(end_ab);
    let odds = cd.interleave(end_cd);
    let (low, high) = (evens.0.interleave(odds.0), evens.1.interleave(odds.1));
    let mut words = [0; BLOCK_ROWS * MAX_LANES];
    for (words, four) in words.chunks_exact_mut(S::i32s::LEN).zip([low.0, low.1, high.0, high.1]) {
        four.store_slice(words);
    }
    words
}

/// What the spans are compared with in the tile whose first column of blocks is `column`.
pub(crate) struct TileColumns([i16; 32]);

impl TileColumns {
    pub(crate) fn new(column: usize) -> Self {
        Self(std::array::from_fn(|i| match i16::try_from(column + i / 8) {
            Ok(column) => {
                if i % 8 < BLOCK_ROWS {
                    column
                } else {
                    !column
                }
            }
            // Farther right than the numbers go, every block counts as reached.
            Err(_) => i16::MAX,
        }))
    }

    /// Blocks of the tile that a span reaches: bit `4 * column + row`.
    #[inline(always)]
    pub(crate) fn mask<S: Simd>(&self, simd: S, span: &Span) -> u16 {
        let span = i32x4::from_slice(simd, span).bitcast();
        let inside = i16x32::block_splat(span).simd_le(i16x32::from_slice(simd, &self.0));
        let bits = inside.to_bitmask() as u32;
        // A byte per column: rows that start before its end, rows that end after its start.
        let nibbles = bits & (bits >> 4) & 0x0f0f_0f0f;
        let bytes = nibbles | (nibbles >> 4);
        (bytes & 0xff | (bytes >> 8) & 0xff00) as u16
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::*;
    use crate::lanes::tests::levels;
    use crate::options::TILE;

    #[inline(always)]
    fn masks<S: Simd>(simd: S, splat: &Splat, strip: usize, tiles: usize) -> Vec<u16> {
        let shapes = Shapes::gather(simd, std::slice::from_ref(splat));
        let mut rows = [Columns::none(simd); BLOCK_ROWS];
        for (k, row) in rows.iter_mut().enumerate() {
            let y0 = (strip * TILE + k * BLOCK) as f32;
            *row = shapes.columns(simd, y0, (tiles * BLOCK_ROWS) as f32);
        }
        let span = pack(rows)[..BLOCK_ROWS].try_into().unwrap();
        (0..tiles).map(|t| TileColumns::new(BLOCK_ROWS * t).mask(simd, &span)).collect()
    }

    #[test]
    fn block_masks_cover_every_pixel_of_the_ellipse() {
        let (mut wasted, mut needed_blocks) = (0, 0);
        for (case, level) in (0..6000u32).zip(levels().into_iter().cycle()) {
            let u =
                |k: u32| ((case * 2654435761u32.wrapping_add(k * 40503)) >> 8) as f32 / 16777216.0;
            let (sx, sy, rho) = (0.5 + 6.0 * u(1), 0.5 + 6.0 * u(2), 1.6 * u(3) - 0.8);
            let center = [60.0 * u(5) - 12.0, 40.0 * u(6) + 4.0];
            let covariance = [sx * sx, rho * sx * sy, sy * sy];
            let Some((splat, _)) = Splat::from_covariance(center, covariance, 0.01 + 0.98 * u(4))
            else {
                panic!("case {case} is visible");
            };
            let masks = dispatch!(level, simd => masks(simd, &splat, 1, 2));
            for (t, mask) in masks.into_iter().enumerate() {
                let mut needed = 0u16;
                for y in 0..TILE {
                    for x in 0..TILE {
                        let center = ((t * TILE + x) as f32 + 0.5, (TILE + y) as f32 + 0.5);
                        if splat.alpha_at(center.0, center.1, 5).is_some() {
                            needed |= 1 << ((x / BLOCK) * 4 + y / BLOCK);
                        }
                    }
                }
                assert_eq!(needed & !mask, 0, "case {case}: missing {needed:016b} {mask:016b}");
                wasted += (mask & !needed).count_ones();
                needed_blocks += needed.count_ones();
            }
        }
        assert!(needed_blocks > 20_000, "{needed_blocks}");
        // The x range of a block row is exact up to pixel centers, so little is visited in vain.
        assert!(wasted * 10 < needed_blocks, "{wasted} wasted of {needed_blocks}");
    }

    #[test]
    fn a_picture_wider_than_the_numbers_loses_no_block() {
        let (splat, _) = Splat::from_covariance([131_088.0, 8.0], [9.0, 1.0, 9.0], 0.9).unwrap();
        for level in levels() {
            let masks = dispatch!(level, simd => masks(simd, &splat, 0, 8194));
            assert!(masks[..8190].iter().all(|&mask| mask == 0));
            assert!(masks[8192] & masks[8193] == u16::MAX);
        }
    }
}
