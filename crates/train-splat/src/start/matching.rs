//! Matches of keypoints between two photos, with and without the poses' help.

use glam::DVec2;

use super::keypoints::{Keypoint, descriptor_distance};
use super::view::{TwoViews, View};

/// Pixels that a match may lie off its epipolar line.
const OFF_LINE: f32 = 1.5;
/// Largest ratio of the scales of two matching keypoints.
const SCALE_RATIO: f32 = 2.0;
/// Squared descriptor distance from which two keypoints look different.
const DIFFERENT: u32 = 20_000;
/// The second best candidate must be this much worse, squared distances: on the line there are few
/// candidates, so one that looks alike is enough to doubt both.
const GUIDED_RATIO: f32 = 0.72;
/// The same over the whole photo (Lowe's 0.8, squared).
const FREE_RATIO: f32 = 0.64;

/// The two best candidates of a keypoint.
#[derive(Clone, Copy)]
struct Best {
    distance: u32,
    index: u32,
    second: u32,
}

impl Best {
    const NONE: Self = Self { distance: u32::MAX, index: u32::MAX, second: u32::MAX };

    fn offer(&mut self, distance: u32, index: usize) {
        if distance < self.distance {
            *self = Self { distance, index: index as u32, second: self.distance };
        } else if distance < self.second {
            self.second = distance;
        }
    }

    fn is_clear(&self, ratio: f32) -> bool {
        self.distance < DIFFERENT && (self.distance as f32) < ratio * self.second as f32
    }
}

/// Pairs of keypoints that are each other's clear best.
fn mutual(of_a: &[Best], of_b: &[Best], ratio: f32) -> Vec<(u32, u32)> {
    let clear = of_a.iter().enumerate().filter(|(_, best)| best.is_clear(ratio));
    clear
        .filter(|(a, best)| {
            let back = &of_b[best.index as usize];
            back.index as usize == *a && back.is_clear(ratio)
        })
        .map(|(a, best)| (a as u32, best.index))
        .collect()
}

/// Matches that lie where the poses say they may.
pub(super) fn guided(a: &View, b: &View, one_place: f64) -> Vec<(u32, u32)> {
    let geometry = TwoViews::new(a, b, one_place);
    let mut of_a = vec![Best::NONE; a.keypoints.len()];
    let mut of_b = vec![Best::NONE; b.keypoints.len()];
    let xs: Vec<f32> = b.keypoints.iter().map(|k| k.x).collect();
    let ys: Vec<f32> = b.keypoints.iter().map(|k| k.y).collect();
    let mut near = Vec::new();
    for (i, p) in a.keypoints.iter().enumerate() {
        candidates(&geometry, p, &xs, &ys, &mut near);
        for &j in &near {
            let q = &b.keypoints[j as usize];
            if !alike_in_scale(p, q) {
                continue;
            }
            let distance = descriptor_distance(&p.descriptor, &q.descriptor);
            of_a[i].offer(distance, j as usize);
            of_b[j as usize].offer(distance, i);
        }
    }
    mutual(&of_a, &of_b, GUIDED_RATIO)
}

/// Indices of the keypoints near the epipolar line (or the one place) of `p`.
fn candidates(geometry: &TwoViews, p: &Keypoint, xs: &[f32], ys: &[f32], near: &mut Vec<u32>) {
    near.clear();
    let pixel = DVec2::new(f64::from(p.x), f64::from(p.y));
    match geometry {
        TwoViews::Epipolar(fundamental) => {
            let line = *fundamental * pixel.extend(1.0);
            let line = (line / line.truncate().length().max(1e-300)).as_vec3();
            for (j, (x, y)) in xs.iter().zip(ys).enumerate() {
                if (line.x * x + line.y * y + line.z).abs() <= OFF_LINE {
                    near.push(j as u32);
                }
            }
        }
        TwoViews::Rotation(_) => {
            for (j, (&x, &y)) in xs.iter().zip(ys).enumerate() {
                let q = DVec2::new(f64::from(x), f64::from(y));
                if geometry.distance(pixel, q) <= f64::from(OFF_LINE) {
                    near.push(j as u32);
                }
            }
        }
    }
}

fn alike_in_scale(a: &Keypoint, b: &Keypoint) -> bool {
    a.scale < SCALE_RATIO * b.scale && b.scale < SCALE_RATIO * a.scale
}

/// Matches by looks alone, of at most `most` keypoints per photo.
pub(super) fn free(a: &View, b: &View, most: usize) -> Vec<(u32, u32)> {
    let (a, b) = (first(&a.keypoints, most), first(&b.keypoints, most));
    let mut of_a = vec![Best::NONE; a.len()];
    let mut of_b = vec![Best::NONE; b.len()];
    for (i, p) in a.iter().enumerate() {
        for (j, q) in b.iter().enumerate() {
            let distance = descriptor_distance(&p.descriptor, &q.descriptor);
            of_a[i].offer(distance, j);
            of_b[j].offer(distance, i);
        }
    }
    mutual(&of_a, &of_b, FREE_RATIO)
}

fn first(keypoints: &[Keypoint], most: usize) -> &[Keypoint] {
    &keypoints[..keypoints.len().min(most)]
}
