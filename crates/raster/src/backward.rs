//! The backward tile kernel: gradients of one tile, front to back like the forward pass.
//!
//! With `g` the gradient of the loss by the pixel's color, `w_i = alpha_i T_i` and
//! `S_i = Σ_{j>i} w_j g·c_j + T_end g·background` (what lies behind i),
//! `alpha_i dL/d alpha_i = w_i g·c_i - S_i alpha_i / (1 - alpha_i)`. `S` starts as `g·color` of
//! the finished pixel and loses one term per splat, so no second traversal and no stored list is
//! needed.
//!
//! `log2 alpha = 8 (level - E² - D²)`, so the gradients by position and shape are moments of
//! `v = alpha dL/d alpha` over the pixels in the coordinates `E`, `D`; [`MOMENTS`] of them per
//! splat leave the kernel.

use fearless_simd::{Simd, prelude::*};

use crate::batch::{BATCH, Batch, falloff};
use crate::exp2::exp2_minus_8;
use crate::options::ALPHA_MAX;
use crate::simd::{LANES, TilePlane};

/// `Σ v`, `Σ v E`, `Σ v D`, `Σ v E²`, `Σ v E D`, `Σ v D²`, `Σ w g_r`, `Σ w g_g`, `Σ w g_b`.
pub(crate) const MOMENTS: usize = 9;

/// Inputs and running state of a tile's backward pass.
pub(crate) struct BackwardTile {
    /// `dL/d color` per pixel.
    pub(crate) gradient: [TilePlane; 3],
    /// `S`: start with `g·color + dL/dT_end T_end`.
    pub(crate) behind: TilePlane,
    pub(crate) transmittance: TilePlane,
    /// Blocks that are not finished.
    pub(crate) alive: u16,
}

impl BackwardTile {
    pub(crate) const fn new() -> Self {
        Self {
            gradient: [TilePlane::filled(0.0), TilePlane::filled(0.0), TilePlane::filled(0.0)],
            behind: TilePlane::filled(0.0),
            transmittance: TilePlane::filled(1.0),
            alive: u16::MAX,
        }
    }
}

/// Writes the tile's moments of the splats of a batch (as many as there are masks) to `sums`, over
/// the `blocks` that are alive; those that reach nothing stay as they were and their bit in the
/// result is 0.
#[inline(always)]
pub(crate) fn backward_batch<S: Simd, const DEGREE: usize>(
    simd: S,
    batch: &Batch,
    masks: &[u16],
    blocks: u16,
    tile: &mut BackwardTile,
    transmittance_min: f32,
    sums: &mut [[f32; MOMENTS]; BATCH],
) -> u64 {
    let zero = S::f32s::simd_from(simd, 0.0);
    let one = S::f32s::simd_from(simd, 1.0);
    let mut touched = 0;
    for (k, (item, mask)) in batch.items.iter().zip(masks).enumerate() {
        let mut blocks = mask & blocks & tile.alive;
        if blocks == 0 {
            continue;
        }
        touched |= 1 << k;
        let mut sum = [zero; MOMENTS];
        while blocks != 0 {
            let block = blocks.trailing_zeros() as usize & 15;
            blocks &= blocks - 1;
            let mut block_alive = false;
            let mut lane = block * LANES;
            while lane < (block + 1) * LANES {
                let t = tile.transmittance.lanes(simd, lane);
                let alive = t.simd_ge(transmittance_min);
                block_alive |= alive.any_true();
                let (e, d, depth) = falloff(simd, item, lane);
                let seen = depth.simd_le(item.limit) & alive;
                let raw = exp2_minus_8::<S, DEGREE>(simd, depth);
                let alpha = seen.select(raw.min(ALPHA_MAX), zero);
                let weight = alpha * t;
                let gr = tile.gradient[0].lanes(simd, lane);
                let gg = tile.gradient[1].lanes(simd, lane);
                let gb = tile.gradient[2].lanes(simd, lane);
                let [cr, cg, cb] = item.color;
                let gc = gb.mul_add(cb, gg.mul_add(cg, gr * cr));
                let own = weight * gc;
                let behind = tile.behind.lanes(simd, lane) - own;
                tile.behind.set_lanes::<S>(lane, behind);
                tile.transmittance.set_lanes::<S>(lane, t - weight);
                // Above the cap alpha is constant, so nothing flows through its exponent.
                let v = own - behind * (alpha / (one - alpha));
                let v = raw.simd_lt(ALPHA_MAX).select(v, zero);
                let (ve, vd) = (v * e, v * d);
                sum[0] += v;
                sum[1] += ve;
                sum[2] += vd;
                sum[3] = ve.mul_add(e, sum[3]);
                sum[4] = ve.mul_add(d, sum[4]);
                sum[5] = vd.mul_add(d, sum[5]);
                sum[6] = weight.mul_add(gr, sum[6]);
                sum[7] = weight.mul_add(gg, sum[7]);
                sum[8] = weight.mul_add(gb, sum[8]);
                lane += S::f32s::LEN;
            }
            // Found one splat late, which then adds nothing: the comparison serves twice.
            if !block_alive {
                tile.alive &= !(1 << block);
            }
        }
        let [a, b, c, d, e, f, g, h, last] = sum;
        let first = sum_lanes_of_eight::<S>([a, b, c, d, e, f, g, h]);
        sums[k][..8].copy_from_slice(&first);
        sums[k][8] = last.reduce_sum();
    }
    touched
}

/// Sums over the lanes of eight vectors at once: a tree of pairs shares its additions.
#[inline(always)]
fn sum_lanes_of_eight<S: Simd>(v: [S::f32s; 8]) -> [f32; 8] {
    let [a, b, c, d, e, f, g, h] = v;
    let (ab, cd) = (pairs::<S>(a, b), pairs::<S>(c, d));
    let (ef, gh) = (pairs::<S>(e, f), pairs::<S>(g, h));
    let (abcd, efgh) = (pairs::<S>(ab, cd), pairs::<S>(ef, gh));
    let mut out = [0.0; 8];
    if S::f32s::LEN == 4 {
        out[..4].copy_from_slice(&abcd.as_slice()[..4]);
        out[4..].copy_from_slice(&efgh.as_slice()[..4]);
    } else {
        let mut all = pairs::<S>(abcd, efgh);
        if S::f32s::LEN == 16 {
            all = pairs::<S>(all, all);
        }
        out.copy_from_slice(&all.as_slice()[..8]);
    }
    out
}

/// Sums of neighboring lanes: those of `a`, then those of `b`.
#[inline(always)]
fn pairs<S: Simd>(a: S::f32s, b: S::f32s) -> S::f32s {
    a.unzip_low(b) + a.unzip_high(b)
}
