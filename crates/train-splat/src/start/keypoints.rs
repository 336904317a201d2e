//! Keypoints of a photo: extrema of the difference of Gaussians, with a histogram of gradients that
//! tells them apart (Lowe 2004; square roots of the bins after Arandjelović and Zisserman 2012).

use std::f32::consts::TAU;

use super::scale_space::{Gray, LEVELS, Octave, octaves, sigma_of};

/// Smallest difference at an extremum, of a range of 1; a third of Lowe's, for dull surfaces.
const MIN_CONTRAST: f32 = 0.004;
/// Largest ratio of the principal curvatures: an edge is sharp across and blurred along.
const MAX_CURVATURE_RATIO: f32 = 10.0;
/// Cells per side of the descriptor, and directions per cell.
const CELLS: usize = 4;
const DIRECTIONS: usize = 8;
/// Length of a descriptor.
pub(super) const LENGTH: usize = CELLS * CELLS * DIRECTIONS;
/// Width of a cell over the scale of the keypoint.
const CELL_SCALES: f32 = 3.0;
/// Bins of the histogram that finds the orientation.
const ORIENTATION_BINS: usize = 36;
/// The photo is divided into so many cells per side, which share the keypoints evenly.
const GRID: usize = 8;

/// A place that other photos of the same surface show again.
#[derive(Clone, Debug)]
pub(super) struct Keypoint {
    /// Pixels; the center of the first pixel is (0.5, 0.5).
    pub(super) x: f32,
    pub(super) y: f32,
    /// Standard deviation of the blob, pixels.
    pub(super) scale: f32,
    /// Main direction of its gradients, radians.
    pub(super) angle: f32,
    strength: f32,
    pub(super) descriptor: [u8; LENGTH],
}

/// Square of the distance of two descriptors; equal ones have 0, unrelated ones about 65,000.
pub(super) fn descriptor_distance(a: &[u8; LENGTH], b: &[u8; LENGTH]) -> u32 {
    a.iter().zip(b).map(|(&a, &b)| (i32::from(a) - i32::from(b)).pow(2)).sum::<i32>() as u32
}

/// Up to about `most` keypoints where `counts` holds, spread over the photo.
pub(super) fn keypoints(
    photo: &Gray,
    most: usize,
    counts: impl Fn(usize, usize) -> bool,
) -> Vec<Keypoint> {
    let mut found = Vec::new();
    for octave in octaves(photo) {
        for level in 1..=LEVELS {
            extrema(&octave, level, &counts, photo, &mut found);
        }
    }
    // Strongest first in every cell of a grid: one textured corner must not take all.
    found.sort_by(|a, b| {
        b.strength.total_cmp(&a.strength).then(a.y.total_cmp(&b.y)).then(a.x.total_cmp(&b.x))
    });
    let share = most.div_ceil(GRID * GRID).max(1);
    let cell = |v: f32, side: usize| ((v / side as f32 * GRID as f32) as usize).min(GRID - 1);
    let mut taken = [0usize; GRID * GRID];
    let (mut kept, mut rest) = (Vec::new(), Vec::new());
    for keypoint in found {
        let count =
            &mut taken[cell(keypoint.y, photo.height) * GRID + cell(keypoint.x, photo.width)];
        *count += 1;
        if *count <= share { &mut kept } else { &mut rest }.push(keypoint);
    }
    let room = most.saturating_sub(kept.len());
    kept.extend(rest.into_iter().take(room));
    kept
}

fn extrema(
    octave: &Octave,
    level: usize,
    counts: &impl Fn(usize, usize) -> bool,
    photo: &Gray,
    found: &mut Vec<Keypoint>,
) {
    let d = &octave.differences[level];
    for y in 1..d.height.saturating_sub(1) {
        for x in 1..d.width.saturating_sub(1) {
            let value = d.at(x, y);
            if value.abs() < 0.7 * MIN_CONTRAST || !is_extremum(octave, level, x, y) {
                continue;
            }
            let Some(peak) = refined(octave, level, x, y) else { continue };
            // Halving keeps every second sample: sample 0 of every octave is pixel 0.
            let (px, py) = (peak.x * octave.step + 0.5, peak.y * octave.step + 0.5);
            let inside = px >= 0.0
                && py >= 0.0
                && px < photo.width as f32
                && py < photo.height as f32
                && counts(px as usize, py as usize);
            if !inside {
                continue;
            }
            let sigma = sigma_of(peak.level);
            let image = &octave.levels[level];
            let Some(angle) = orientation(image, peak.x, peak.y, sigma) else { continue };
            let Some(descriptor) = descriptor(image, peak.x, peak.y, sigma, angle) else {
                continue;
            };
            let (scale, strength) = (sigma * octave.step, peak.value.abs());
            found.push(Keypoint { x: px, y: py, scale, angle, strength, descriptor });
        }
    }
}

fn is_extremum(octave: &Octave, level: usize, x: usize, y: usize) -> bool {
    let value = octave.differences[level].at(x, y);
    let sign = value.signum();
    octave.differences[level - 1..=level + 1].iter().enumerate().all(|(l, d)| {
        (y - 1..=y + 1).all(|v| {
            (x - 1..=x + 1)
                .all(|u| (l == 1 && v == y && u == x) || sign * d.at(u, v) < sign * value)
        })
    })
}

/// Place and value of the extremum of the parabola through the samples.
struct Peak {
    x: f32,
    y: f32,
    level: f32,
    value: f32,
}

fn refined(octave: &Octave, level: usize, x: usize, y: usize) -> Option<Peak> {
    let d = |l: i32, dx: i32, dy: i32| -> f32 {
        octave.differences[(level as i32 + l) as usize]
            .at((x as i32 + dx) as usize, (y as i32 + dy) as usize)
    };
    let center = d(0, 0, 0);
    let (xx, yy) =
        (d(0, 1, 0) + d(0, -1, 0) - 2.0 * center, d(0, 0, 1) + d(0, 0, -1) - 2.0 * center);
    let xy = 0.25 * (d(0, 1, 1) + d(0, -1, -1) - d(0, 1, -1) - d(0, -1, 1));
    let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
    let bound = (MAX_CURVATURE_RATIO + 1.0).powi(2) / MAX_CURVATURE_RATIO;
    if !(determinant > 0.0) || trace * trace > bound * determinant {
        return None;
    }
    let hessian = glam::Mat3::from_cols_array_2d(&[
        [xx, xy, 0.25 * (d(1, 1, 0) + d(-1, -1, 0) - d(1, -1, 0) - d(-1, 1, 0))],
        [xy, yy, 0.25 * (d(1, 0, 1) + d(-1, 0, -1) - d(1, 0, -1) - d(-1, 0, 1))],
        [
            0.25 * (d(1, 1, 0) + d(-1, -1, 0) - d(1, -1, 0) - d(-1, 1, 0)),
            0.25 * (d(1, 0, 1) + d(-1, 0, -1) - d(1, 0, -1) - d(-1, 0, 1)),
            d(1, 0, 0) + d(-1, 0, 0) - 2.0 * center,
        ],
    ]);
    let slope = 0.5
        * glam::Vec3::new(
            d(0, 1, 0) - d(0, -1, 0),
            d(0, 0, 1) - d(0, 0, -1),
            d(1, 0, 0) - d(-1, 0, 0),
        );
    if hessian.determinant().abs() < 1e-18 {
        return None;
    }
    let offset = -(hessian.inverse() * slope);
    let value = center + 0.5 * slope.dot(offset);
    // Beyond the neighboring samples the parabola says nothing; a little is left to noise.
    let near = offset.abs().max_element() < 0.8;
    (near && value.abs() >= MIN_CONTRAST).then_some(Peak {
        x: x as f32 + offset.x,
        y: y as f32 + offset.y,
        level: level as f32 + offset.z,
        value,
    })
}

/// Gradient of a level at a sample inside its border.
#[inline]
fn gradient(image: &Gray, x: usize, y: usize) -> (f32, f32) {
    (image.at(x + 1, y) - image.at(x - 1, y), image.at(x, y + 1) - image.at(x, y - 1))
}

/// The samples within `radius` of a place, without the border.
fn window(image: &Gray, x: f32, y: f32, radius: f32) -> [std::ops::Range<usize>; 2] {
    let range = |center: f32, side: usize| {
        let low = (center - radius).ceil().max(1.0) as usize;
        low..((center + radius).floor().max(0.0) as usize + 1).min(side - 1)
    };
    [range(x, image.width), range(y, image.height)]
}

/// Main direction of the gradients around a keypoint, radians.
fn orientation(image: &Gray, x: f32, y: f32, sigma: f32) -> Option<f32> {
    let spread = 1.5 * sigma;
    let mut bins = [0.0f32; ORIENTATION_BINS];
    let [columns, rows] = window(image, x, y, 3.0 * spread);
    for v in rows {
        for u in columns.clone() {
            let (dx, dy) = gradient(image, u, v);
            let d2 = (u as f32 - x).powi(2) + (v as f32 - y).powi(2);
            let weight = (-0.5 * d2 / (spread * spread)).exp() * dx.hypot(dy);
            let bin = dy.atan2(dx).rem_euclid(TAU) / TAU * ORIENTATION_BINS as f32;
            bins[bin as usize % ORIENTATION_BINS] += weight;
        }
    }
    let at = |i: usize| bins[i % ORIENTATION_BINS];
    let smooth: Vec<f32> = (0..ORIENTATION_BINS)
        .map(|i| 0.25 * at(i + ORIENTATION_BINS - 1) + 0.5 * at(i) + 0.25 * at(i + 1))
        .collect();
    let best = (0..ORIENTATION_BINS).max_by(|&a, &b| smooth[a].total_cmp(&smooth[b]))?;
    if !(smooth[best] > 0.0) {
        return None;
    }
    let around = |i: usize| smooth[i % ORIENTATION_BINS];
    let (left, here, right) = (around(best + ORIENTATION_BINS - 1), smooth[best], around(best + 1));
    let bend = left + right - 2.0 * here;
    let offset = if bend < 0.0 { 0.5 * (left - right) / bend } else { 0.0 };
    Some((best as f32 + 0.5 + offset.clamp(-0.5, 0.5)) / ORIENTATION_BINS as f32 * TAU)
}

fn descriptor(image: &Gray, x: f32, y: f32, sigma: f32, angle: f32) -> Option<[u8; LENGTH]> {
    let cell = CELL_SCALES * sigma;
    let half = CELLS as f32 / 2.0;
    let (sin, cos) = angle.sin_cos();
    let mut bins = [0.0f32; LENGTH];
    let [columns, rows] = window(image, x, y, cell * (half + 0.5) * std::f32::consts::SQRT_2);
    for v in rows {
        for u in columns.clone() {
            let (ox, oy) = (u as f32 - x, v as f32 - y);
            let across = (cos * ox + sin * oy) / cell;
            let down = (-sin * ox + cos * oy) / cell;
            let (column, row) = (across + half - 0.5, down + half - 0.5);
            if column <= -1.0 || row <= -1.0 || column >= CELLS as f32 || row >= CELLS as f32 {
                continue;
            }
            let (dx, dy) = gradient(image, u, v);
            let weight =
                dx.hypot(dy) * (-(across * across + down * down) / (2.0 * half * half)).exp();
            let turn = (dy.atan2(dx) - angle).rem_euclid(TAU) / TAU * DIRECTIONS as f32;
            spread_sample(&mut bins, [column, row, turn], weight);
        }
    }
    quantized(&bins)
}

/// Adds a sample to the eight bins around it.
fn spread_sample(bins: &mut [f32; LENGTH], [column, row, turn]: [f32; 3], weight: f32) {
    let (c0, r0, t0) = (column.floor(), row.floor(), turn.floor());
    let (fc, fr, ft) = (column - c0, row - r0, turn - t0);
    for (r, wr) in [(r0 as i32, 1.0 - fr), (r0 as i32 + 1, fr)] {
        if !(0..CELLS as i32).contains(&r) {
            continue;
        }
        for (c, wc) in [(c0 as i32, 1.0 - fc), (c0 as i32 + 1, fc)] {
            if !(0..CELLS as i32).contains(&c) {
                continue;
            }
            let base = (r as usize * CELLS + c as usize) * DIRECTIONS;
            let t = t0 as usize % DIRECTIONS;
            bins[base + t] += weight * wr * wc * (1.0 - ft);
            bins[base + (t + 1) % DIRECTIONS] += weight * wr * wc * ft;
        }
    }
}

/// Square roots of the bins over their sum, in steps of 1/255.
fn quantized(bins: &[f32; LENGTH]) -> Option<[u8; LENGTH]> {
    let sum: f32 = bins.iter().sum();
    if !(sum > 0.0) {
        return None;
    }
    // No single direction may decide: shiny spots change between photos (Lowe's clamp at 0.2).
    let norm = bins.iter().map(|b| b * b).sum::<f32>().sqrt();
    let clamped = bins.map(|b| b.min(0.2 * norm));
    let sum: f32 = clamped.iter().sum();
    Some(clamped.map(|b| (255.0 * (b / sum).sqrt()).round() as u8))
}
