//! Vector pieces of the tile kernels: blocks of 4×4 pixels, one pixel per lane.
//!
//! 16 lanes are one AVX-512 register, two of AVX2, four of SSE or NEON; `fearless_simd` picks at
//! run time. A square block follows a small ellipse more closely than a row of 16 pixels would.

use fearless_simd::{Level, Simd, f32x4, f32x16, prelude::*};

use crate::ellipse::SLACK;
use crate::options::TILE;
use crate::project::Splat;

/// Pixels per side of a block.
pub(crate) const BLOCK: usize = 4;
/// Pixels of a block: the lanes of a vector.
pub(crate) const LANES: usize = BLOCK * BLOCK;
/// Blocks per tile; bit `4 * row + column` of a block mask.
pub(crate) const BLOCKS: usize = (TILE / BLOCK) * (TILE / BLOCK);
/// Pixels of a tile.
pub(crate) const TILE_PIXELS: usize = TILE * TILE;

/// One value per pixel of a tile, block after block.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct TilePlane(pub(crate) [f32; TILE_PIXELS]);

impl TilePlane {
    pub(crate) const fn filled(value: f32) -> Self {
        Self([value; TILE_PIXELS])
    }

    /// Copies a 16-row band slice (`stride` apart) at column `x0` in; past-the-end columns exist as
    /// padding.
    pub(crate) fn load_rows(&mut self, rows: &[f32], stride: usize, x0: usize) {
        for y in 0..TILE {
            for bx in 0..TILE / BLOCK {
                let from = y * stride + x0 + bx * BLOCK;
                let to = ((y / BLOCK) * (TILE / BLOCK) + bx) * LANES + (y % BLOCK) * BLOCK;
                self.0[to..to + BLOCK].copy_from_slice(&rows[from..from + BLOCK]);
            }
        }
    }

    /// The inverse of [`Self::load_rows`].
    pub(crate) fn store_rows(&self, rows: &mut [f32], stride: usize, x0: usize) {
        for y in 0..TILE {
            for bx in 0..TILE / BLOCK {
                let to = y * stride + x0 + bx * BLOCK;
                let from = ((y / BLOCK) * (TILE / BLOCK) + bx) * LANES + (y % BLOCK) * BLOCK;
                rows[to..to + BLOCK].copy_from_slice(&self.0[from..from + BLOCK]);
            }
        }
    }

    #[inline(always)]
    pub(crate) fn block<S: Simd>(&self, simd: S, i: usize) -> f32x16<S> {
        f32x16::from_slice(simd, &self.0[i * LANES..(i + 1) * LANES])
    }

    #[inline(always)]
    pub(crate) fn set_block<S: Simd>(&mut self, i: usize, value: f32x16<S>) {
        value.store_slice(&mut self.0[i * LANES..(i + 1) * LANES]);
    }
}

/// The best instruction set of this machine.
pub(crate) fn level() -> Level {
    static LEVEL: std::sync::OnceLock<Level> = std::sync::OnceLock::new();
    *LEVEL.get_or_init(Level::new)
}

/// Offsets of the pixel centres of a block from the corner of the block.
#[inline(always)]
pub(crate) fn lane_offsets<S: Simd>(simd: S) -> (f32x16<S>, f32x16<S>) {
    let mut x = [0.0; LANES];
    let mut y = [0.0; LANES];
    for lane in 0..LANES {
        x[lane] = (lane % BLOCK) as f32 + 0.5;
        y[lane] = (lane / BLOCK) as f32 + 0.5;
    }
    (f32x16::from_slice(simd, &x), f32x16::from_slice(simd, &y))
}

/// `2^x` for `x` in [-8, 0], relative error below 2e-6; large for `x` far below, so mask first.
///
/// `2^x = (2^(x/8))^8`: a polynomial of degree 5 on [-1, 0] and three squarings, which needs no
/// rounding and no integer arithmetic.
#[inline(always)]
pub(crate) fn exp2_unit<S: Simd>(x: f32x16<S>) -> f32x16<S> {
    let t = x * 0.125;
    let mut r = t.mul_add(EXP2[5], EXP2[4]);
    for k in (0..4).rev() {
        r = r.mul_add(t, EXP2[k]);
    }
    let r2 = r * r;
    let r4 = r2 * r2;
    r4 * r4
}

/// Minimax coefficients of `2^t` on [-1, 0] with the value at 0 fixed to 1 (iteratively reweighted
/// least squares); 8.4e-8 relative error, eight times that after the squarings.
const EXP2: [f32; 6] =
    [1.0, 0.693_143_7, 0.240_180_15, 0.055_297_36, 0.009_205_798, 0.000_944_903_5];

/// Which blocks of the tile with corner `(x0, y0)` the ellipse of a splat can reach.
#[inline(always)]
pub(crate) fn block_mask<S: Simd>(simd: S, splat: &Splat, x0: f32, y0: f32) -> u32 {
    let e = &splat.ellipse;
    // Same bounds as `Ellipse::band`, for the four block rows at once.
    let row = f32x4::from_slice(simd, &[0.0, 4.0, 8.0, 12.0]);
    let top = row + (y0 + 0.5 - splat.y);
    let low = top.max(-e.half_height);
    let high = (top + 3.0).min(e.half_height);
    let misses = low.simd_gt(high + SLACK);
    let zero = f32x4::splat(simd, 0.0);
    let right_y = low.max(e.rightmost_dy).min(high);
    let left_y = low.max(-e.rightmost_dy).min(high);
    let det = f32x4::splat(simd, -e.aspect);
    let reach_right = (det * right_y).mul_add(right_y, e.reach2).max(zero).sqrt();
    let reach_left = (det * left_y).mul_add(left_y, e.reach2).max(zero).sqrt();
    let slope = f32x4::splat(simd, -e.shear);
    let base = splat.x - x0;
    let left = slope.mul_add(left_y, base) - reach_left;
    let right = slope.mul_add(right_y, base) + reach_right;
    // Block i holds centres 4i + 0.5 ... 4i + 3.5.
    let first = ((left - (3.5 + SLACK)) * 0.25).ceil().max(zero).min(4.0);
    let last = ((right - (0.5 - SLACK)) * 0.25).floor().min(3.0).max(-1.0);
    let first = misses.select(f32x4::splat(simd, 4.0), first);
    let (first, last) = (<[f32; 4]>::from(first), <[f32; 4]>::from(last));
    let mut mask = 0u32;
    for r in 0..4 {
        let (first, last) = (first[r] as i32 as u32 & 7, (last[r] as i32 + 1) as u32 & 7);
        // Bits first..last of four; empty when first >= last.
        let bits = ((1u32 << last) - 1) & !((1u32 << first) - 1);
        mask |= bits << (4 * r);
    }
    mask
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::*;
    use crate::ellipse::Ellipse;

    #[test]
    fn exp2_is_accurate_where_alpha_is_visible() {
        let mut worst = 0.0f64;
        for i in 0..=80_000 {
            let x = -8.0 * i as f32 / 80_000.0;
            let got = dispatch!(level(), simd => {
                let y = exp2_unit(f32x16::splat(simd, x));
                y.as_slice()[0]
            });
            worst = worst.max((f64::from(got) / f64::from(x).exp2() - 1.0).abs());
        }
        assert!(worst < 2e-6, "relative error {worst:e}");
    }

    #[test]
    fn block_masks_cover_every_pixel_of_the_ellipse() {
        let mut wasted = 0;
        let mut needed_blocks = 0;
        for case in 0..4000u32 {
            let u =
                |k: u32| ((case * 2654435761u32.wrapping_add(k * 40503)) >> 8) as f32 / 16777216.0;
            let (sx, sy, rho) = (0.5 + 6.0 * u(1), 0.5 + 6.0 * u(2), 1.6 * u(3) - 0.8);
            let det = sx * sx * sy * sy * (1.0 - rho * rho);
            let (a, b, c) = (sy * sy / det, -rho * sx * sy / det, sx * sx / det);
            let k = 0.5 + 7.0 * u(4);
            let splat = Splat {
                x: 40.0 * u(5) - 12.0,
                y: 40.0 * u(6) - 12.0,
                a,
                ellipse: Ellipse::from_conic(a, b, c, k).unwrap(),
                ..Splat::INVISIBLE
            };
            let mask = dispatch!(level(), simd => block_mask(simd, &splat, 0.0, 0.0));
            assert!(mask < 1 << 16);
            let mut needed = 0u32;
            for y in 0..TILE {
                for x in 0..TILE {
                    let (dx, dy) = (x as f32 + 0.5 - splat.x, y as f32 + 0.5 - splat.y);
                    if a * dx * dx + 2.0 * b * dx * dy + c * dy * dy <= k {
                        needed |= 1 << ((y / BLOCK) * 4 + x / BLOCK);
                    }
                }
            }
            assert_eq!(needed & !mask, 0, "case {case}: missing blocks {needed:016b} {mask:016b}");
            wasted += (mask & !needed).count_ones();
            needed_blocks += needed.count_ones();
        }
        // The x range of a block row is exact up to pixel centres, so little is visited in vain.
        assert!(wasted * 10 < needed_blocks, "{wasted} wasted of {needed_blocks}");
    }

    #[test]
    fn tile_rows_survive_the_block_order() {
        let stride = 40;
        let rows: Vec<f32> = (0..TILE * stride).map(|v| v as f32).collect();
        let mut plane = TilePlane::filled(0.0);
        plane.load_rows(&rows, stride, 16);
        let mut back = vec![0.0; rows.len()];
        plane.store_rows(&mut back, stride, 16);
        for y in 0..TILE {
            assert_eq!(
                back[y * stride + 16..y * stride + 32],
                rows[y * stride + 16..y * stride + 32]
            );
            assert_eq!(back[y * stride], 0.0);
        }
    }
}
