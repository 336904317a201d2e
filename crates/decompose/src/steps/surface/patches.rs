//! How well the photos agree about a small piece of surface.
//!
//! A patch of the tangent plane at a vertex is looked up in the photos that see it; each copy is
//! freed of brightness and contrast. `f_i` are the copies as unit vectors, `m = sum_i w_i f_i`,
//! `c_i` the correlation of `f_i` with the others' mean. The score is the weighted mean of `c_i`:
//! 1 where all photos show the same, about 0 where the piece is in the wrong place. Photos that
//! disagree with the rest (a highlight, something in front) lose weight
//! (after Furukawa & Ponce 2010; Vu et al. 2012).

use glam::Vec3;

use super::silhouettes::median_distance;
use super::view::View;

/// Samples along the side of a patch.
const SIDE: usize = 7;
const SAMPLES: usize = SIDE * SIDE;
/// Photos per patch at most: those that see it most nearly face on.
pub(super) const MOST_VIEWS: usize = 10;
/// Standard deviation of a patch below which it shows nothing, in units of perceived brightness.
const LEAST_CONTRAST: f32 = 0.006;

/// A square of the tangent plane, bent; `along` and `across` are the steps between samples, and a
/// sample `(i, j)` steps away is lifted by `(i^2 + j^2) lift`: a flat patch on a round thing would lie
/// inside of it.
#[derive(Clone, Copy)]
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

/// Samples of a patch in a view as a unit vector without its mean, and that mean; `None` outside of the picture, where it is flat, or
/// where much of the photo does not count.
fn look_up(view: &View, patch: &Patch) -> Option<([f32; SAMPLES], f32)> {
    let q = view.image_of(patch.center - view.center);
    let [a, b, c] = [patch.along, patch.across, patch.lift].map(|d| view.image_of(d));
    let mut values = [0.0f32; SAMPLES];
    let mut ignored = 0.0;
    let half = (SIDE / 2) as f32;
    for (k, value) in values.iter_mut().enumerate() {
        let (i, j) = ((k % SIDE) as f32 - half, (k / SIDE) as f32 - half);
        let h = q + a * i + b * j + c * (i * i + j * j);
        if !(h.z > 1e-6) {
            return None;
        }
        let s = 1.0 / h.z;
        let (luma, weight) = view.luma_at(h.x * s, h.y * s)?;
        *value = luma;
        ignored += 1.0 - weight;
    }
    if !(ignored <= 0.25 * SAMPLES as f32) {
        return None;
    }
    let mean = values.iter().sum::<f32>() / SAMPLES as f32;
    let mut squares = 0.0;
    for v in &mut values {
        *v -= mean;
        squares += *v * *v;
    }
    if !(squares > SAMPLES as f32 * LEAST_CONTRAST * LEAST_CONTRAST) {
        return None;
    }
    let scale = squares.sqrt().recip();
    Some((values.map(|v| v * scale), mean))
}

#[inline]
fn dot(a: &[f32; SAMPLES], b: &[f32; SAMPLES]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Agreement of `views` about `patch`; `None` when fewer than two can be compared.
pub(super) fn agreement(all: &[View], views: &[u16], patch: &Patch) -> Option<Agreement> {
    let mut copies = [[0.0f32; SAMPLES]; MOST_VIEWS];
    let mut means = [0.0f32; MOST_VIEWS];
    let mut n = 0;
    for &i in views.iter().take(MOST_VIEWS) {
        if let Some((values, mean)) = look_up(&all[i as usize], patch) {
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
        let mut mean = [0.0f32; SAMPLES];
        for (copy, w) in copies.iter().zip(weight) {
            mean.iter_mut().zip(copy).for_each(|(m, c)| *m += w * c);
        }
        let mm = dot(&mean, &mean);
        let (mut sum, mut total) = (0.0, 0.0);
        for (copy, w) in copies.iter().zip(&mut weight) {
            // The mean of the others: m - w f.
            let fm = dot(copy, &mean);
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
