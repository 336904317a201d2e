//! What was not seen, completed smoothly.
//!
//! Minimizes `Σ w_i (x_i - d_i)² Ω_i + ∫ |∇x|²` on the sphere, `d` the known values with weights `w` from 0 to 1: a harmonic function between
//! the known values, so it stays within their range. Pyramid and relaxation: means go down to the coarsest level ("pull"), and every
//! finer level starts from the coarser one ("push") and is relaxed by Jacobi's iteration. On a lat-long grid of equal steps the
//! edges of the gradient weigh `1 / sin θ` along a row and `sin θ` across rows.

use std::f64::consts::PI;

use motes_scene::ImageF32;
use rayon::prelude::*;

use crate::sphere::texel_solid_angle;

/// How strongly known values hold against the neighbors.
const HOLD: f32 = 50.0;
/// Relaxations per level; each level of the pyramid leaves only its own detail to be smoothed.
const RELAXATIONS: usize = 24;
/// Largest weight of an edge, at the poles.
const LARGEST_EDGE: f32 = 16.0;

struct Level {
    width: usize,
    height: usize,
    values: Vec<[f32; 3]>,
    weights: Vec<f32>,
}

/// The map with unknown texels filled. `known` has a weight per texel, 0 (unknown) to 1 (kept as it is).
/// A map of which nothing is known becomes black. Values that are not finite count as unknown.
///
/// # Panics
/// When `known` has another size than the map, or the map not 3 channels.
pub fn fill(map: &ImageF32, known: &[f32]) -> ImageF32 {
    assert_eq!((map.channels, map.pixel_count()), (3, known.len()), "a weight per texel of RGB");
    let mut levels = vec![finest(map, known)];
    while levels[levels.len() - 1].height > 1 {
        let coarser = pull(&levels[levels.len() - 1]);
        levels.push(coarser);
    }
    let mut solved: Option<Level> = None;
    for level in levels.into_iter().rev() {
        let start = match &solved {
            Some(coarser) => push(coarser, level.width, level.height),
            None => level.values.clone(),
        };
        solved = Some(relax(level, start));
    }
    let Some(solved) = solved else { return map.clone() };
    let mut out = map.clone();
    for (i, pixel) in out.data.chunks_exact_mut(3).enumerate() {
        let w = if pixel.iter().all(|v| v.is_finite()) { known[i].clamp(0.0, 1.0) } else { 0.0 };
        for (value, x) in pixel.iter_mut().zip(solved.values[i]) {
            *value = if w > 0.0 { w * *value + (1.0 - w) * x } else { x };
        }
    }
    out
}

fn finest(map: &ImageF32, known: &[f32]) -> Level {
    let is_finite = |p: &[f32]| p.iter().all(|v| v.is_finite());
    let pixels = map.data.chunks_exact(3);
    let values =
        pixels.clone().map(|p| if is_finite(p) { [p[0], p[1], p[2]] } else { [0.0; 3] }).collect();
    let weight = |(p, w): (&[f32], &f32)| if is_finite(p) { w.clamp(0.0, 1.0) } else { 0.0 };
    let weights = pixels.zip(known).map(weight).collect();
    Level { width: map.width, height: map.height, values, weights }
}

fn pull(fine: &Level) -> Level {
    let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
    let mut level = Level { width, height, values: Vec::new(), weights: Vec::new() };
    for y in 0..height {
        for x in 0..width {
            let (mut sum, mut weight, mut area) = ([0.0f64; 3], 0.0, 0.0);
            for fy in 2 * y..(2 * y + 2).min(fine.height) {
                let omega = texel_solid_angle(fy, fine.width, fine.height);
                for fx in 2 * x..(2 * x + 2).min(fine.width) {
                    let i = fy * fine.width + fx;
                    let w = omega * f64::from(fine.weights[i]);
                    (0..3).for_each(|c| sum[c] += w * f64::from(fine.values[i][c]));
                    weight += w;
                    area += omega;
                }
            }
            let mean = sum.map(|s| if weight > 0.0 { (s / weight) as f32 } else { 0.0 });
            level.values.push(mean);
            level.weights.push((weight / area) as f32);
        }
    }
    level
}

/// Bilinear values of a coarser level.
fn push(coarse: &Level, width: usize, height: usize) -> Vec<[f32; 3]> {
    let (cw, ch) = (coarse.width as i64, coarse.height as i64);
    let value = |x: usize, y: usize| {
        let u = (x as f64 + 0.5) / width as f64 * cw as f64 - 0.5;
        let v = (y as f64 + 0.5) / height as f64 * ch as f64 - 0.5;
        let (s, t) = ((u - u.floor()) as f32, (v - v.floor()) as f32);
        let at = |dx: i64, dy: i64| {
            let column = (u.floor() as i64 + dx).rem_euclid(cw);
            let row = (v.floor() as i64 + dy).clamp(0, ch - 1);
            coarse.values[(row * cw + column) as usize]
        };
        let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
        std::array::from_fn(|k| {
            (1.0 - t) * ((1.0 - s) * a[k] + s * b[k]) + t * ((1.0 - s) * c[k] + s * d[k])
        })
    };
    (0..height).flat_map(|y| (0..width).map(move |x| value(x, y))).collect()
}

fn relax(level: Level, start: Vec<[f32; 3]>) -> Level {
    let (w, h) = (level.width, level.height);
    let sin = |v: f64| (PI * v / h as f64).sin() as f32;
    let mut values = start;
    for _ in 0..RELAXATIONS {
        let row = |y: usize| -> Vec<[f32; 3]> {
            let along = (1.0 / sin(y as f64 + 0.5).max(1e-3)).min(LARGEST_EDGE);
            let above = if y > 0 { sin(y as f64) } else { 0.0 };
            let below = if y + 1 < h { sin(y as f64 + 1.0) } else { 0.0 };
            let omega = sin(y as f64 + 0.5);
            let texel = |x: usize| {
                let i = y * w + x;
                let (left, right) = (y * w + (x + w - 1) % w, y * w + (x + 1) % w);
                let (up, down) = (i - if y > 0 { w } else { 0 }, i + if y + 1 < h { w } else { 0 });
                let hold = HOLD * level.weights[i] * omega;
                let sum = 2.0 * along + above + below + hold;
                std::array::from_fn(|c| {
                    let around = along * (values[left][c] + values[right][c])
                        + above * values[up][c]
                        + below * values[down][c];
                    (around + hold * level.values[i][c]) / sum
                })
            };
            (0..w).map(texel).collect()
        };
        values = (0..h).into_par_iter().flat_map_iter(row).collect();
    }
    Level { values, ..level }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sky that gets brighter upward, known but for a cap around a direction and the lower part.
    fn sky(h: usize) -> (ImageF32, Vec<f32>) {
        let mut map = ImageF32::filled(2 * h, h, 3, f32::NAN);
        let mut known = vec![0.0; 2 * h * h];
        for y in 0..h {
            for x in 0..2 * h {
                let hole = y > 3 * h / 4 || (x.abs_diff(h) < h / 8 && y.abs_diff(h / 3) < h / 8);
                if !hole {
                    let v = 2.0 - y as f32 / h as f32;
                    map.pixel_mut(x, y).copy_from_slice(&[v, 0.5 * v, 0.25 * v]);
                    known[y * 2 * h + x] = 1.0;
                }
            }
        }
        (map, known)
    }

    #[test]
    fn a_hole_is_closed_smoothly_and_known_texels_stay() {
        for h in [64, 48, 30] {
            let (map, known) = sky(h);
            let full = fill(&map, &known);
            assert!(full.data.iter().all(|v| v.is_finite()));
            for (i, k) in known.iter().enumerate().filter(|(_, k)| **k == 1.0) {
                assert_eq!(full.data[3 * i], map.data[3 * i], "{i} {k}");
            }
            // The gradient around the small hole goes on inside it.
            for y in h / 3 - h / 8..h / 3 + h / 8 {
                let expected = 2.0 - y as f32 / h as f32;
                let got = full.pixel(h, y)[0];
                assert!((got - expected).abs() < 0.06, "{h} {y}: {got} {expected}");
            }
            // A harmonic function has its extremes on the rim.
            let range = 0.99..=2.01;
            assert!(full.data.chunks_exact(3).all(|p| range.contains(&p[0])));
        }
    }

    #[test]
    fn neighbors_in_the_filled_part_differ_little() {
        let (map, known) = sky(64);
        let full = fill(&map, &known);
        for y in 50..64 {
            for x in 0..128 {
                let step = (full.pixel(x, y)[0] - full.pixel((x + 1) % 128, y)[0]).abs();
                assert!(step < 0.02, "{x} {y} {step}");
            }
        }
    }

    #[test]
    fn nothing_known_is_black_and_one_texel_floods_the_sphere() {
        let map = ImageF32::filled(16, 8, 3, f32::INFINITY);
        assert!(fill(&map, &[1.0; 128]).data.iter().all(|v| *v == 0.0));
        let mut map = ImageF32::filled(16, 8, 3, 7.0);
        map.pixel_mut(3, 4).fill(0.5);
        let mut known = vec![0.0; 128];
        known[4 * 16 + 3] = 1.0;
        assert!(fill(&map, &known).data.iter().all(|v| (v - 0.5).abs() < 0.02));
    }
}
