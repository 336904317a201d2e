//! Pixels of a tile in the order of the kernels: blocks of 4×4, one pixel per lane.
//!
//! 16 lanes are one AVX-512 register, two of AVX2, four of SSE or NEON; `fearless_simd` picks at
//! run time. A square block follows a small ellipse more closely than a row of 16 pixels would.

use fearless_simd::{Simd, prelude::*};

use crate::options::TILE;

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
            let row = &rows[y * stride + x0..][..TILE];
            for bx in 0..TILE / BLOCK {
                let to = first_lane(bx, y);
                self.0[to..to + BLOCK].copy_from_slice(&row[bx * BLOCK..(bx + 1) * BLOCK]);
            }
        }
    }

    /// The inverse of [`Self::load_rows`].
    #[inline(always)]
    pub(crate) fn store_rows(&self, rows: &mut [f32], stride: usize, x0: usize) {
        for y in 0..TILE {
            let row = &mut rows[y * stride + x0..][..TILE];
            for bx in 0..TILE / BLOCK {
                let from = first_lane(bx, y);
                row[bx * BLOCK..(bx + 1) * BLOCK].copy_from_slice(&self.0[from..from + BLOCK]);
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

#[cfg(test)]
mod tests {
    use super::*;

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
