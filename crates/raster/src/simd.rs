//! Pixels of a tile in the order of the kernels: blocks of 4×4, one pixel per lane.
//!
//! 16 lanes are one AVX-512 register, two of AVX2, four of SSE or NEON; `fearless_simd` picks at
//! run time. A square block follows a small ellipse more closely than a row of 16 pixels would.

use fearless_simd::{Simd, f32x4, prelude::*};

use crate::options::TILE;
use crate::splat::{SLACK, Splat};

/// Pixels per side of a block.
pub(crate) const BLOCK: usize = 4;
/// Pixels of a block.
pub(crate) const LANES: usize = BLOCK * BLOCK;
/// Blocks per tile; block `4 * column + row`.
pub(crate) const BLOCKS: usize = (TILE / BLOCK) * (TILE / BLOCK);
/// Pixels of a tile.
pub(crate) const TILE_PIXELS: usize = TILE * TILE;

const _: () = assert!(TILE == 16 && BLOCKS == 16, "block masks are 16 bits");

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
    #[inline(always)]
    pub(crate) fn load_rows(&mut self, rows: &[f32], stride: usize, x0: usize) {
        for y in 0..TILE {
            for bx in 0..TILE / BLOCK {
                let from = y * stride + x0 + bx * BLOCK;
                let to = first_lane(bx, y);
                self.0[to..to + BLOCK].copy_from_slice(&rows[from..from + BLOCK]);
            }
        }
    }

    /// The inverse of [`Self::load_rows`].
    #[inline(always)]
    pub(crate) fn store_rows(&self, rows: &mut [f32], stride: usize, x0: usize) {
        for y in 0..TILE {
            for bx in 0..TILE / BLOCK {
                let to = y * stride + x0 + bx * BLOCK;
                let from = first_lane(bx, y);
                rows[to..to + BLOCK].copy_from_slice(&self.0[from..from + BLOCK]);
            }
        }
    }

    /// The lanes from `i` on, as many as a register has.
    #[inline(always)]
    pub(crate) fn lanes<S: Simd>(&self, simd: S, i: usize) -> S::f32s {
        S::f32s::from_slice(simd, &self.0[i..i + S::f32s::LEN])
    }

    #[inline(always)]
    pub(crate) fn set_lanes<S: Simd>(&mut self, i: usize, value: S::f32s) {
        value.store_slice(&mut self.0[i..i + S::f32s::LEN]);
    }
}

/// Where pixel row `y` of the block column `bx` starts in a plane.
#[inline(always)]
const fn first_lane(bx: usize, y: usize) -> usize {
    (bx * (TILE / BLOCK) + y / BLOCK) * LANES + (y % BLOCK) * BLOCK
}

/// Offsets of the pixel centers from the corner of the tile.
pub(crate) static PIXEL_X: TilePlane = pixel_centers(true);
pub(crate) static PIXEL_Y: TilePlane = pixel_centers(false);

const fn pixel_centers(along_x: bool) -> TilePlane {
    let mut plane = TilePlane::filled(0.0);
    let mut p = 0;
    while p < TILE_PIXELS {
        let (x, y) = (p % TILE, p / TILE);
        let lane = first_lane(x / BLOCK, y) + x % BLOCK;
        plane.0[lane] = (if along_x { x } else { y }) as f32 + 0.5;
        p += 1;
    }
    plane
}

/// Which blocks of the tile with corner `(x0, y0)` the ellipse of a splat can reach.
#[inline(always)]
pub(crate) fn block_mask<S: Simd>(simd: S, splat: &Splat, x0: f32, y0: f32) -> u16 {
    // Same bounds as `Splat::band`, for the four block rows at once.
    let row = f32x4::from_slice(simd, &[0.0, 4.0, 8.0, 12.0]);
    let top = row + (y0 + 0.5 - splat.y);
    let low = top.max(-splat.half_height);
    let high = (top + 3.0).min(splat.half_height);
    let touched = low.simd_le(high + SLACK);
    let zero = f32x4::splat(simd, 0.0);
    let right_y = low.max(splat.rightmost_dy).min(high);
    let left_y = low.max(-splat.rightmost_dy).min(high);
    let k = f32x4::splat(simd, splat.level - splat.threshold);
    let (right_d, left_d) = (right_y * splat.sd, left_y * splat.sd);
    let reach_right = (k - right_d * right_d).max(zero).sqrt();
    let reach_left = (k - left_d * left_d).max(zero).sqrt();
    let slope = -splat.sb * splat.inverse_sa;
    // Block column i holds centers 4i + 0.5 ... 4i + 3.5.
    let base = splat.x - x0;
    let left = left_y.mul_add(slope, f32x4::splat(simd, base - 3.5 - SLACK))
        - reach_left * splat.inverse_sa;
    let right = right_y.mul_add(slope, f32x4::splat(simd, base - 0.5 + SLACK))
        + reach_right * splat.inverse_sa;
    let mut mask = 0;
    for column in 0..4u32 {
        let x = f32x4::splat(simd, (4 * column) as f32);
        let hit = touched & left.simd_le(x) & right.simd_ge(x);
        mask |= (hit.to_bitmask() as u16) << (4 * column);
    }
    mask
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn block_masks_cover_every_pixel_of_the_ellipse() {
        let mut wasted = 0;
        let mut needed_blocks = 0;
        for case in 0..4000u32 {
            let u =
                |k: u32| ((case * 2654435761u32.wrapping_add(k * 40503)) >> 8) as f32 / 16777216.0;
            let (sx, sy, rho) = (0.5 + 6.0 * u(1), 0.5 + 6.0 * u(2), 1.6 * u(3) - 0.8);
            let center = [40.0 * u(5) - 12.0, 40.0 * u(6) - 12.0];
            let covariance = [sx * sx, rho * sx * sy, sy * sy];
            let Some((splat, _)) = Splat::from_covariance(center, covariance, 0.01 + 0.98 * u(4))
            else {
                panic!("case {case} is visible");
            };
            let mask = dispatch!(Level::new(), simd => block_mask(simd, &splat, 0.0, 0.0));
            let mut needed = 0u16;
            for y in 0..TILE {
                for x in 0..TILE {
                    if splat.alpha_at(x as f32 + 0.5, y as f32 + 0.5, 5).is_some() {
                        needed |= 1 << ((x / BLOCK) * 4 + y / BLOCK);
                    }
                }
            }
            assert_eq!(needed & !mask, 0, "case {case}: missing blocks {needed:016b} {mask:016b}");
            wasted += (mask & !needed).count_ones();
            needed_blocks += needed.count_ones();
        }
        // The x range of a block row is exact up to pixel centers, so little is visited in vain.
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
        let rows_of = |value: &dyn Fn(usize, usize) -> f32| -> Vec<f32> {
            (0..TILE * TILE).map(|p| value(p % TILE, p / TILE)).collect()
        };
        let mut centers = TilePlane::filled(0.0);
        centers.load_rows(&rows_of(&|x, _| x as f32 + 0.5), TILE, 0);
        assert_eq!(centers.0, PIXEL_X.0);
        centers.load_rows(&rows_of(&|_, y| y as f32 + 0.5), TILE, 0);
        assert_eq!(centers.0, PIXEL_Y.0);
    }
}
