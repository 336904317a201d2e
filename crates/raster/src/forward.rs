//! The forward tile kernel: composites the splats of one tile front to back.
//!
//! Block by block: the state of 16 pixels stays in registers while the splats of a batch that
//! reach the block pass by, and a finished block stops at once.

use fearless_simd::{Simd, prelude::*};

use crate::batch::{Batch, falloff};
use crate::exp2::exp2_minus_8;
use crate::options::ALPHA_MAX;
use crate::simd::{BLOCKS, LANES, TilePlane};

/// Color and transmittance of a tile while it is composited.
pub(crate) struct ForwardTile {
    pub(crate) color: [TilePlane; 3],
    pub(crate) transmittance: TilePlane,
    /// Blocks that are not finished.
    pub(crate) alive: u16,
}

impl ForwardTile {
    pub(crate) const fn new() -> Self {
        Self {
            color: [TilePlane::filled(0.0), TilePlane::filled(0.0), TilePlane::filled(0.0)],
            transmittance: TilePlane::filled(1.0),
            alive: u16::MAX,
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

/// Composites a batch into the blocks `alive` of `tile` (start: black, 1).
#[inline(always)]
pub(crate) fn forward_batch<S: Simd, const DEGREE: usize, const COUNT: bool>(
    simd: S,
    batch: &Batch,
    alive: u16,
    tile: &mut ForwardTile,
    transmittance_min: f32,
    pairs: &mut PairCount,
) {
    let zero = S::f32s::simd_from(simd, 0.0);
    for block in 0..BLOCKS {
        if batch.bits[block] == 0 || alive & (1 << block) == 0 {
            continue;
        }
        let mut block_alive = false;
        let mut lane = block * LANES;
        while lane < (block + 1) * LANES {
            let mut splats = batch.bits[block];
            let mut t = tile.transmittance.lanes(simd, lane);
            let mut r = tile.color[0].lanes(simd, lane);
            let mut g = tile.color[1].lanes(simd, lane);
            let mut b = tile.color[2].lanes(simd, lane);
            let mut alive = t.simd_ge(transmittance_min);
            let mut any = alive.any_true();
            while splats != 0 && any {
                let item = &batch.items[splats.trailing_zeros() as usize & 63];
                splats &= splats - 1;
                let (_, _, depth) = falloff(simd, item, lane);
                // Positive comparisons: NaN contributes nothing.
                let seen = depth.simd_le(item.limit) & alive;
                let alpha = exp2_minus_8::<S, DEGREE>(simd, depth).min(ALPHA_MAX);
                let weight = seen.select(alpha * t, zero);
                r = weight.mul_add(item.color[0], r);
                g = weight.mul_add(item.color[1], g);
                b = weight.mul_add(item.color[2], b);
                t -= weight;
                if COUNT {
                    pairs.visited += S::f32s::LEN as u64;
                    pairs.composited += u64::from(seen.to_bitmask().count_ones());
                }
                alive = t.simd_ge(transmittance_min);
                any = alive.any_true();
            }
            tile.transmittance.set_lanes::<S>(lane, t);
            tile.color[0].set_lanes::<S>(lane, r);
            tile.color[1].set_lanes::<S>(lane, g);
            tile.color[2].set_lanes::<S>(lane, b);
            block_alive |= any;
            lane += S::f32s::LEN;
        }
        if !block_alive {
            tile.alive &= !(1 << block);
        }
    }
}
