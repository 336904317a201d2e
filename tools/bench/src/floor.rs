//! The floor: what the arithmetic of the tile kernels costs when nothing else is in the way.
//!
//! The same operations per (pixel, splat) pair as the kernels of `motes-raster`, written down a
//! second time over 64 splats and one tile of 16 × 16 pixels that all stay in the first-level
//! cache: no lists, no masks of blocks, no test whether a block is finished, no packing of splats,
//! no sums over lanes, every lane useful. What a pair must compute is in: offsets, exponent,
//! comparison with the cut-offs, polynomial, compositing, gradient moments, and the loads and
//! stores that the order of the loops asks for (forward: the state of a block stays in registers;
//! backward: the moments of a splat do). A real scene adds what lists and blocks cost.

use std::array::from_fn;
use std::hint::black_box;

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use crate::clock::fastest_ns;

const SPLATS: usize = 64;
const PIXELS: usize = 256;

#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Splat {
    e_in_block: [f32; 16],
    d_in_block: [f32; 16],
    e_of_block: [f32; 16],
    d_of_row: [f32; 4],
    base: f32,
    limit: f32,
    color: [f32; 3],
}

#[derive(Clone)]
#[repr(C, align(64))]
struct Plane([f32; PIXELS]);

impl Plane {
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, lane: usize) -> S::f32s {
        S::f32s::from_slice(simd, &self.0[lane..lane + S::f32s::LEN])
    }

    #[inline(always)]
    fn store<S: Simd>(&mut self, lane: usize, value: S::f32s) {
        value.store_slice(&mut self.0[lane..lane + S::f32s::LEN]);
    }
}

/// Nanoseconds per pair: forward, backward.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub(crate) struct Floor {
    pub(crate) forward_ns: f64,
    pub(crate) backward_ns: f64,
}

/// Measures both floors with the instructions of `level`.
pub(crate) fn measure(level: Level) -> Floor {
    let splats: Vec<Splat> = (0..SPLATS)
        .map(|i| {
            let f = i as f32;
            // Wide and faint: every lane is seen and no pixel is ever finished.
            let (sa, sb, sd) = (0.02, 0.003, 0.015);
            let e0 = -sa * (8.0 + (f * 0.7).sin() * 6.0);
            let d0 = -sd * (8.0 + (f * 1.3).cos() * 6.0);
            // Of the pixel, of the column and of the row `i`; four of each make a block and a tile.
            let center = |i: usize| i as f32 + 0.5;
            let corner = |i: usize| 4.0 * i as f32;
            Splat {
                e_in_block: from_fn(|i| sa * center(i % 4) + sb * center(i / 4)),
                d_in_block: from_fn(|i| sd * center(i / 4)),
                e_of_block: from_fn(|i| sa * corner(i / 4) + sb * corner(i % 4) + e0),
                d_of_row: from_fn(|i| sd * corner(i) + d0),
                base: 0.7,
                limit: 0.999,
                color: [0.5, 0.4, 0.3],
            }
        })
        .collect();
    let pairs = (SPLATS * PIXELS) as f64;
    let mut planes: [Plane; 5] = from_fn(|_| Plane([0.0; PIXELS]));
    let mut state = planes.clone();
    let forward = || {
        planes[3].0.fill(1.0);
        let splats = black_box(&splats[..]);
        dispatch!(level, simd => forward(simd, splats, &mut planes));
        black_box(&planes);
    };
    let forward_ns = fastest_ns(forward) / pairs;
    let backward = || {
        state[3].0.fill(0.1);
        state[4].0.fill(1.0);
        let splats = black_box(&splats[..]);
        black_box(dispatch!(level, simd => backward(simd, splats, &mut state)));
        black_box(&state);
    };
    Floor { forward_ns, backward_ns: fastest_ns(backward) / pairs }
}

const EXP2: [f32; 6] =
    [1.0, -0.693_143_7, 0.240_180_14, -0.055_297_36, 0.009_205_798, -0.000_944_903_7];

#[inline(always)]
fn exp2<S: Simd>(simd: S, y: S::f32s) -> S::f32s {
    let mut r = S::f32s::simd_from(simd, EXP2[5]);
    for k in (0..5).rev() {
        r = r.mul_add(y, EXP2[k]);
    }
    let r2 = r * r;
    let r4 = r2 * r2;
    r4 * r4
}

/// `E` and `D` of some lanes.
#[inline(always)]
fn offsets<S: Simd>(simd: S, s: &Splat, lane: usize) -> (S::f32s, S::f32s) {
    let (block, at) = (lane / 16, lane % 16);
    let in_block = |values: &[f32; 16]| S::f32s::from_slice(simd, &values[at..at + S::f32s::LEN]);
    let e = in_block(&s.e_in_block) + s.e_of_block[block];
    (e, in_block(&s.d_in_block) + s.d_of_row[block % 4])
}

#[inline(always)]
fn forward<S: Simd>(simd: S, splats: &[Splat], planes: &mut [Plane; 5]) {
    let zero = S::f32s::simd_from(simd, 0.0);
    for lane in (0..PIXELS).step_by(S::f32s::LEN) {
        let [mut r, mut g, mut b] = [zero; 3];
        let mut t = planes[3].load(simd, lane);
        for s in splats {
            let (e, d) = offsets(simd, s, lane);
            let depth = e.mul_add(e, d.mul_add(d, s.base));
            let seen = depth.simd_le(s.limit) & t.simd_ge(1e-4);
            let weight = seen.select(exp2(simd, depth).min(0.99) * t, zero);
            r = weight.mul_add(s.color[0], r);
            g = weight.mul_add(s.color[1], g);
            b = weight.mul_add(s.color[2], b);
            t -= weight;
        }
        for (plane, value) in planes.iter_mut().zip([r, g, b, t]) {
            plane.store::<S>(lane, value);
        }
    }
}

#[inline(always)]
fn backward<S: Simd>(simd: S, splats: &[Splat], planes: &mut [Plane; 5]) -> f32 {
    let zero = S::f32s::simd_from(simd, 0.0);
    let one = S::f32s::simd_from(simd, 1.0);
    let mut all = zero;
    for s in splats {
        let mut sum = [zero; 9];
        for lane in (0..PIXELS).step_by(S::f32s::LEN) {
            let (e, d) = offsets(simd, s, lane);
            let depth = e.mul_add(e, d.mul_add(d, s.base));
            let t = planes[4].load(simd, lane);
            let seen = depth.simd_le(s.limit) & t.simd_ge(1e-4);
            let raw = exp2(simd, depth);
            let alpha = seen.select(raw.min(0.99), zero);
            let weight = alpha * t;
            let gr = planes[0].load(simd, lane);
            let gg = planes[1].load(simd, lane);
            let gb = planes[2].load(simd, lane);
            let gc = gb.mul_add(s.color[2], gg.mul_add(s.color[1], gr * s.color[0]));
            let own = weight * gc;
            let behind = planes[3].load(simd, lane) - own;
            planes[3].store::<S>(lane, behind);
            planes[4].store::<S>(lane, t - weight);
            let v = own - behind * (alpha / (one - alpha));
            let v = raw.simd_lt(0.99).select(v, zero);
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
        }
        // One addition each, so that nothing is optimized away.
        for lanes in sum {
            all += lanes;
        }
    }
    all.reduce_sum()
}
