//! The forward tile kernel: composites the splats of one tile front to back.

use fearless_simd::{Simd, f32x16, prelude::*};

use crate::options::{ALPHA_MAX, ALPHA_MIN, TILE, TRANSMITTANCE_MIN};
use crate::project::Splat;
use crate::simd::{BLOCKS, TilePlane, block_mask, exp2_unit, lane_offsets};

/// Colour and transmittance of a tile while it is composited.
pub(crate) struct ForwardTile {
    pub(crate) color: [TilePlane; 3],
    pub(crate) transmittance: TilePlane,
}

impl ForwardTile {
    pub(crate) const fn new() -> Self {
        Self {
            color: [TilePlane::filled(0.0), TilePlane::filled(0.0), TilePlane::filled(0.0)],
            transmittance: TilePlane::filled(1.0),
        }
    }
}

/// What the kernels visited; only counted when asked.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PairCount {
    /// (pixel, splat) pairs evaluated.
    pub(crate) visited: u64,
    /// Pairs that changed a pixel.
    pub(crate) composited: u64,
}

/// Alpha of a splat over one block, which lanes it changes, and `u = dx + shear dy`.
///
/// The only place that decides what a splat contributes: forward and backward both call it, so
/// they cannot disagree (positive comparisons: NaN contributes nothing).
#[inline(always)]
pub(crate) fn splat_alpha<S: Simd>(
    simd: S,
    splat: &Splat,
    dx: f32x16<S>,
    dy: f32x16<S>,
    transmittance: f32x16<S>,
) -> (f32x16<S>, fearless_simd::mask32x16<S>, f32x16<S>) {
    let u = dy.mul_add(splat.ellipse.shear, dx);
    let q = (dy * dy).mul_add(splat.ellipse.aspect, u * u);
    let log2_alpha = q.mul_add(-splat.a, f32x16::splat(simd, splat.log2_opacity));
    let log2_min = const { -7.994_353_4f32 };
    debug_assert!((log2_min - ALPHA_MIN.log2()).abs() < 1e-6);
    let seen = log2_alpha.simd_ge(log2_min) & transmittance.simd_ge(TRANSMITTANCE_MIN);
    (exp2_unit(log2_alpha), seen, u)
}

/// Composites `entries` over the tile with corner `(x0, y0)` into `tile` (start: black, 1).
#[inline(always)]
pub(crate) fn forward_tile<S: Simd, const COUNT: bool>(
    simd: S,
    splats: &[Splat],
    entries: &[u32],
    x0: f32,
    y0: f32,
    tile: &mut ForwardTile,
    pairs: &mut PairCount,
) {
    let (lane_x, lane_y) = lane_offsets(simd);
    let mut alive = (1u32 << BLOCKS) - 1;
    for &entry in entries {
        let splat = &splats[entry as usize];
        let mut blocks = block_mask(simd, splat, x0, y0) & alive;
        while blocks != 0 {
            let i = blocks.trailing_zeros() as usize;
            blocks &= blocks - 1;
            let (bx, by) = ((i % 4 * 4) as f32, (i / 4 * 4) as f32);
            let dx = lane_x + (x0 + bx - splat.x);
            let dy = lane_y + (y0 + by - splat.y);
            let t = tile.transmittance.block(simd, i);
            let (alpha, seen, _) = splat_alpha(simd, splat, dx, dy, t);
            let weight = seen.select(alpha.min(ALPHA_MAX) * t, f32x16::splat(simd, 0.0));
            for (plane, color) in tile.color.iter_mut().zip(splat.color) {
                plane.set_block(i, weight.mul_add(color, plane.block(simd, i)));
            }
            let t = t - weight;
            tile.transmittance.set_block(i, t);
            if COUNT {
                pairs.visited += 16;
                pairs.composited += u64::from(seen.to_bitmask().count_ones());
            }
            if !t.simd_ge(TRANSMITTANCE_MIN).any_true() {
                alive &= !(1 << i);
            }
        }
        if alive == 0 {
            break;
        }
    }
}

const _: () = assert!(TILE == 16 && BLOCKS == 16, "block masks are 16 bits");
