//! How well the photos agree about a small piece of surface.
//!
//! A patch of the tangent plane at a vertex is looked up in the photos that see it; each copy is
//! freed of brightness and contrast. `f_i` are the copies as unit vectors, `m = sum_i w_i f_i`,
//! `c_i` the correlation of `f_i` with the others' mean. The score is the weighted mean of `c_i`:
//! 1 where all photos show the same, about 0 where the piece is in the wrong place. Photos that
//! disagree with the rest (a highlight, something in front) lose weight
//! (after Furukawa & Ponce 2010; Vu et al. 2012).

use fearless_simd::{Simd, dispatch, f32x8, prelude::*};
use glam::Vec3;

use super::silhouettes::median_distance;
use super::simd::level;
use super::view::View;

/// Samples along the side of a patch.
const SIDE: usize = 7;
const SAMPLES: usize = SIDE * SIDE;
const LANES: usize = 8;
/// Samples with padding to whole vectors. Padding looks at the middle of the patch and counts for 0.
const PADDED: usize = SAMPLES.next_multiple_of(LANES);
/// Photos per patch at most: those that see it most nearly face on.
pub(super) const MOST_VIEWS: usize = 10;
/// Standard deviation of a patch below which it shows nothing, in units of perceived brightness.
const LEAST_CONTRAST: f32 = 0.006;

/// One value per sample.
type Samples = [f32; PADDED];

/// Steps of each sample from the middle, along and across, the sum of their squares, and 1 for a sample, 0 for padding.
const STEPS: [Samples; 4] = steps();

const fn steps() -> [Samples; 4] {
    let mut out = [[0.0; PADDED]; 4];
    let half = (SIDE / 2) as f32;
    let mut k = 0;
    while k < SAMPLES {
        let (i, j) = ((k % SIDE) as f32 - half, (k / SIDE) as f32 - half);
        (out[0][k], out[1][k], out[2][k], out[3][k]) = (i, j, i * i + j * j, 1.0);
        k += 1;
    }
    out
}

/// A square of the tangent plane, bent; `along` and `across` are the steps between samples, and a
/// sample `(i, j)` steps away is lifted by `(i^2 + j^2) lift`: a flat patch on a round thing would lie
/// inside of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    pub(super) center: Vec3,
    pub(super) along: Vec3,
    pub(super) across: Vec3,
    pub(super) lift: Vec3,
}

/// Agreement of the photos about a patch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Agreement {
    /// -1 to 1.
    pub(super) score: f32,
    /// Sum of the weights of the photos that take part.
    pub(super) photos: f32,
    /// Spread of the brightness of the patch over the photos that take part, 0 to 1: median distance from the median.
    pub(super) spread: f32,
}

#[inline(always)]
fn load<S: Simd>(simd: S, values: &Samples, at: usize) -> f32x8<S> {
    f32x8::from_slice(simd, &values[at..at + LANES])
}

/// Sum of products; lanes are added in order, so that every instruction set gives the same bits.
#[inline(always)]
fn dot<S: Simd>(simd: S, a: &Samples, b: &Samples) -> f32 {
    let mut sum = f32x8::splat(simd, 0.0);
    for at in (0..PADDED).step_by(LANES) {
        sum += load(simd, a, at) * load(simd, b, at);
    }
    let mut lanes = [0.0f32; LANES];
    sum.store_slice(&mut lanes);
    lanes.iter().sum()
}

/// Coordinates of the samples, pixels from the middle of the first pixel; `None` where one is behind the camera or outside of the picture.
#[inline(always)]
fn places<S: Simd>(simd: S, view: &View, patch: &Patch) -> Option<[Samples; 2]> {
    let q = view.image_of(patch.center - view.center);
    let [a, b, c] = [patch.along, patch.across, patch.lift].map(|d| view.image_of(d));
    let (right, bottom) = ((view.width - 1) as f32, (view.height - 1) as f32);
    let mut out = [[0.0; PADDED]; 2];
    for at in (0..PADDED).step_by(LANES) {
        let [i, j, r] = [0, 1, 2].map(|k: usize| load(simd, &STEPS[k], at));
        let x = i * a.x + j * b.x + r * c.x + q.x;
        let y = i * a.y + j * b.y + r * c.y + q.y;
        let z = i * a.z + j * b.z + r * c.z + q.z;
        let (x, y) = (x / z - 0.5, y / z - 0.5);
        let inside = z.simd_gt(1e-6)
            & x.simd_ge(0.0)
            & y.simd_ge(0.0)
            & x.simd_lt(right)
            & y.simd_lt(bottom);
        if !inside.all_true() {
            return None;
        }
        x.store_slice(&mut out[0][at..at + LANES]);
        y.store_slice(&mut out[1][at..at + LANES]);
    }
    Some(out)
}

/// Samples of a patch in a view as a unit vector without its mean, and that mean; `None` outside of the picture, where it is flat, or
/// where much of the photo does not count.
#[inline(always)]
fn look_up<S: Simd>(simd: S, view: &View, patch: &Patch) -> Option<(Samples, f32)> {
    let [x, y] = places(simd, view, patch)?;
    let mut corners = [[0.0f32; PADDED]; 4];
    let mut ignored = 0.0;
    for k in 0..PADDED {
        let first = y[k] as usize * view.width + x[k] as usize;
        let (top, low) = (&view.luma[first..], &view.luma[first + view.width..]);
        (corners[0][k], corners[1][k]) = (top[0], top[1]);
        (corners[2][k], corners[3][k]) = (low[0], low[1]);
        if !view.whole && k < SAMPLES {
            ignored += 1.0 - view.weight(first);
        }
    }
    if !(ignored <= 0.25 * SAMPLES as f32) {
        return None;
    }
    let mut values = [0.0; PADDED];
    for at in (0..PADDED).step_by(LANES) {
        let [x, y] = [&x, &y].map(|p| load(simd, p, at));
        let (u, v) = (x - x.floor(), y - y.floor());
        let [a, b, c, d] = [0, 1, 2, 3].map(|k: usize| load(simd, &corners[k], at));
        let (top, low) = (a + (b - a) * u, c + (d - c) * u);
        (top + (low - top) * v).store_slice(&mut values[at..at + LANES]);
    }
    let mean = dot(simd, &values, &STEPS[3]) / SAMPLES as f32;
    for at in (0..PADDED).step_by(LANES) {
        let centered = (load(simd, &values, at) - mean) * load(simd, &STEPS[3], at);
        centered.store_slice(&mut values[at..at + LANES]);
    }
    let squares = dot(simd, &values, &values);
    if !(squares > SAMPLES as f32 * LEAST_CONTRAST * LEAST_CONTRAST) {
        return None;
    }
    let scale = squares.sqrt().recip();
    Some((values.map(|v| v * scale), mean))
}

/// Agreement of `views` about `patch`; `None` when fewer than two can be compared.
pub(super) fn agreement(all: &[View], views: &[u16], patch: &Patch) -> Option<Agreement> {
    dispatch!(level(), simd => agreement_on(simd, all, views, patch))
}

#[inline(always)]
fn agreement_on<S: Simd>(simd: S, all: &[View], views: &[u16], patch: &Patch) -> Option<Agreement> {
    let mut copies = [[0.0f32; PADDED]; MOST_VIEWS];
    let mut means = [0.0f32; MOST_VIEWS];
    let mut n = 0;
    for &i in views.iter().take(MOST_VIEWS) {
        if let Some((values, mean)) = look_up(simd, &all[i as usize], patch) {
            copies[n] = values;
            means[n] = mean;
            n += 1;
        }
    }
    if n < 2 {
        return None;
    }
    let copies = &copies[..n];
    let mut weight = [1.0f32; MOST_VIEWS];
    let mut out = Agreement::default();
    for round in 0..2 {
        let mut mean = [0.0f32; PADDED];
        for (copy, w) in copies.iter().zip(weight) {
            mean.iter_mut().zip(copy).for_each(|(m, c)| *m += w * c);
        }
        let mm = dot(simd, &mean, &mean);
        let (mut sum, mut total) = (0.0, 0.0);
        for (copy, w) in copies.iter().zip(&mut weight) {
            // The mean of the others: m - w f.
            let fm = dot(simd, copy, &mean);
            let others = (mm - 2.0 * *w * fm + *w * *w).max(1e-12).sqrt();
            let c = (fm - *w) / others;
            if round == 0 {
                *w = ((c + 0.2) / 0.8).clamp(0.05, 1.0);
            }
            sum += *w * c;
            total += *w;
        }
        out = Agreement { score: sum / total, photos: total, spread: 0.0 };
    }
    out.spread = median_distance(&mut means[..n]);
    Some(out)
}

#[cfg(test)]
mod tests;
