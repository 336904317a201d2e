//! Removing the noise of few paths without touching texture.
//!
//! Radiance is divided by base color, so that only light is left; light is averaged over
//! neighbors on the same object with a similar normal, on the same plane, whose light differs by
//! no more than both noises explain, compared as 3 x 3 patches (non-local means with known
//! variances, Rousselle et al. 2012); then the base color comes back.

use glam::Vec3;
use motes_scene::ImageF32;
use rayon::prelude::*;

use crate::render::Buffers;

/// Neighbors to each side.
const RADIUS: isize = 4;
/// Added to base color: light on black is not infinite.
const FLOOR: f32 = 0.04;
/// Difference over its own standard deviation that still looks alike.
const TOLERANCE: f32 = 0.8;

/// Means of the paths of every pixel, and the variance of the mean (of the channels' mean).
#[derive(Clone, Debug)]
pub(crate) struct Noisy {
    /// Radiance.
    pub means: Vec<Vec3>,
    /// Variance of each mean.
    pub variances: Vec<f32>,
}

/// Denoised radiance.
pub(crate) fn denoise(noisy: &Noisy, guide: &Buffers) -> ImageF32 {
    let (w, h) = (guide.albedo.width, guide.albedo.height);
    let base: Vec<Vec3> =
        guide.albedo.data.chunks_exact(3).map(|c| Vec3::from_slice(c) + FLOOR).collect();
    let light: Vec<Vec3> = noisy.means.iter().zip(&base).map(|(l, b)| *l / *b).collect();
    let scale = |b: &Vec3| (3.0 / b.element_sum()).powi(2);
    let variance: Vec<f32> = noisy.variances.iter().zip(&base).map(|(v, b)| v * scale(b)).collect();
    let variance = smoothed(&variance, w, h);
    let gray: Vec<f32> = light.iter().map(|l| l.element_sum() / 3.0).collect();
    let at = |image: &ImageF32, i: usize| Vec3::from_slice(&image.data[3 * i..3 * i + 3]);
    // Squared difference beyond what noise explains, in units of noise, over patches.
    let patch_distance = |p: (isize, isize), q: (isize, isize)| {
        let (mut sum, mut count) = (0.0, 0.0);
        for dy in -1..=1 {
            for dx in -1..=1 {
                let index = |(x, y): (isize, isize)| {
                    let inside =
                        (0..w as isize).contains(&(x + dx)) && (0..h as isize).contains(&(y + dy));
                    inside.then(|| (y + dy) as usize * w + (x + dx) as usize)
                };
                if let (Some(a), Some(b)) = (index(p), index(q)) {
                    let (va, vb) = (variance[a], variance[b]);
                    let excess = (gray[a] - gray[b]).powi(2) - (va + va.min(vb));
                    sum += excess / (1e-7 + TOLERANCE * TOLERANCE * (va + vb));
                    count += 1.0;
                }
            }
        }
        sum / count
    };
    let rows: Vec<Vec<f32>> = (0..h)
        .into_par_iter()
        .map(|y| {
            let mut row = Vec::with_capacity(3 * w);
            for x in 0..w {
                let i = y * w + x;
                let (normal, position) = (at(&guide.normal, i), at(&guide.position, i));
                let pixel = guide.depth.data[i] / w as f32;
                let (mut sum, mut weights) = (light[i], 1.0);
                for qy in (y as isize - RADIUS).max(0)..=(y as isize + RADIUS).min(h as isize - 1) {
                    for qx in
                        (x as isize - RADIUS).max(0)..=(x as isize + RADIUS).min(w as isize - 1)
                    {
                        let j = qy as usize * w + qx as usize;
                        if j == i || guide.ids[j] != guide.ids[i] {
                            continue;
                        }
                        let turn = 1.0 - normal.dot(at(&guide.normal, j));
                        let off = normal.dot(at(&guide.position, j) - position) / pixel;
                        let geometry = turn * 60.0 + off * off * 0.5;
                        if !(geometry < 6.0) {
                            continue;
                        }
                        let look = patch_distance((x as isize, y as isize), (qx, qy)).max(0.0);
                        let weight = (-geometry - look).exp();
                        sum += light[j] * weight;
                        weights += weight;
                    }
                }
                row.extend((sum / weights * base[i]).to_array());
            }
            row
        })
        .collect();
    ImageF32::from_data(w, h, 3, rows.concat())
}

/// Means of 5 x 5: a variance of few samples is itself noise.
fn smoothed(values: &[f32], w: usize, h: usize) -> Vec<f32> {
    let span = |c: usize, n: usize| c.saturating_sub(2)..(c + 3).min(n);
    (0..w * h)
        .map(|i| {
            let (xs, ys) = (span(i % w, w), span(i / w, h));
            let count = (xs.len() * ys.len()) as f32;
            ys.flat_map(|y| xs.clone().map(move |x| values[y * w + x])).sum::<f32>() / count
        })
        .collect()
}
