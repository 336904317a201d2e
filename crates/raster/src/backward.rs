//! The backward tile kernel: gradients of one tile, front to back like the forward pass.
//!
//! With `g` the gradient of the loss by the pixel's colour, `w_i = alpha_i T_i` and
//! `S_i = Σ_{j>i} w_j g·c_j + T_end g·background` (what lies behind i),
//! `dL/d alpha_i = T_i g·c_i - S_i / (1 - alpha_i)`. `S` starts as `g·colour` of the finished
//! pixel and loses one term per splat, so no second traversal and no stored list is needed.
//!
//! `alpha = 2^(log2 o - Q)`, so the gradients by position and shape are moments of
//! `v = alpha dL/d alpha` over the pixels; [`MOMENTS`] of them per splat leave the kernel.

use fearless_simd::{Simd, f32x16, prelude::*};

use crate::forward::splat_alpha;
use crate::options::{ALPHA_MAX, TRANSMITTANCE_MIN};
use crate::project::Splat;
use crate::simd::{BLOCKS, TilePlane, block_mask, lane_offsets};

/// `Σ v`, `Σ v u`, `Σ v dy`, `Σ v u²`, `Σ v u dy`, `Σ v dy²`, `Σ w g_r`, `Σ w g_g`, `Σ w g_b`, where
/// `u = dx + shear dy` is what the exponent is made of: moments of dx would cancel for needles.
pub(crate) const MOMENTS: usize = 9;

/// Inputs and running state of a tile's backward pass.
pub(crate) struct BackwardTile {
    /// `dL/d colour` per pixel.
    pub(crate) gradient: [TilePlane; 3],
    /// `S`: start with `g·colour + dL/dT_end T_end`.
    pub(crate) behind: TilePlane,
    pub(crate) transmittance: TilePlane,
}

impl BackwardTile {
    pub(crate) const fn new() -> Self {
        Self {
            gradient: [TilePlane::filled(0.0), TilePlane::filled(0.0), TilePlane::filled(0.0)],
            behind: TilePlane::filled(0.0),
            transmittance: TilePlane::filled(1.0),
        }
    }
}

/// Adds the tile's moments of each splat to `moments[entry]`.
#[inline(always)]
pub(crate) fn backward_tile<S: Simd>(
    simd: S,
    splats: &[Splat],
    entries: &[u32],
    x0: f32,
    y0: f32,
    tile: &mut BackwardTile,
    moments: &mut [[f32; MOMENTS]],
) {
    let (lane_x, lane_y) = lane_offsets(simd);
    let zero = f32x16::splat(simd, 0.0);
    let mut alive = (1u32 << BLOCKS) - 1;
    for &entry in entries {
        let splat = &splats[entry as usize];
        let mut blocks = block_mask(simd, splat, x0, y0) & alive;
        if blocks == 0 {
            continue;
        }
        let mut sum = [zero; MOMENTS];
        let [r, g, b] = splat.color;
        while blocks != 0 {
            let i = blocks.trailing_zeros() as usize;
            blocks &= blocks - 1;
            let (bx, by) = ((i % 4 * 4) as f32, (i / 4 * 4) as f32);
            let dx = lane_x + (x0 + bx - splat.x);
            let dy = lane_y + (y0 + by - splat.y);
            let t = tile.transmittance.block(simd, i);
            let (raw_alpha, seen, u) = splat_alpha(simd, splat, dx, dy, t);
            let alpha = seen.select(raw_alpha.min(ALPHA_MAX), zero);
            let weight = alpha * t;
            let gradient = [
                tile.gradient[0].block(simd, i),
                tile.gradient[1].block(simd, i),
                tile.gradient[2].block(simd, i),
            ];
            let gc = gradient[2].mul_add(b, gradient[1].mul_add(g, gradient[0] * r));
            let behind = tile.behind.block(simd, i) - weight * gc;
            tile.behind.set_block(i, behind);
            let t_next = t - weight;
            tile.transmittance.set_block(i, t_next);
            let one = f32x16::splat(simd, 1.0);
            let d_alpha = t * gc - behind / (one - alpha);
            // Above the cap alpha is constant, so nothing flows through its exponent.
            let v = raw_alpha.simd_lt(ALPHA_MAX).select(alpha * d_alpha, zero);
            let (vu, vy) = (v * u, v * dy);
            sum[0] += v;
            sum[1] += vu;
            sum[2] += vy;
            sum[3] = vu.mul_add(u, sum[3]);
            sum[4] = vu.mul_add(dy, sum[4]);
            sum[5] = vy.mul_add(dy, sum[5]);
            sum[6] = weight.mul_add(gradient[0], sum[6]);
            sum[7] = weight.mul_add(gradient[1], sum[7]);
            sum[8] = weight.mul_add(gradient[2], sum[8]);
            if !t_next.simd_ge(TRANSMITTANCE_MIN).any_true() {
                alive &= !(1 << i);
            }
        }
        for (total, lanes) in moments[entry as usize].iter_mut().zip(sum) {
            *total += lanes.reduce_sum();
        }
        if alive == 0 {
            break;
        }
    }
}
