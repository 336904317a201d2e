//! The plane that carries the photos best.

use glam::Vec3;
use rayon::prelude::*;

use super::super::planes::Plane;
use super::{BESIDE, Witnesses};

/// Pixels between the patches that a plane is fitted by, and how many there must be.
const STRIDE: usize = 8;
const LEAST_PATCHES: usize = 10;
/// First step of the search, voxels, and rounds of half the step each.
const STEP: f32 = 2.0;
const ROUNDS: usize = 4;
/// Gain of the mean squared difference that is worth a step: where there is no texture, a plane stays. Share of the comparisons that must be left.
const LEAST_GAIN: f64 = 1e-7;
const LEAST_SEEN: f64 = 0.9;
/// Standard errors of the mean gain that a step must exceed.
const SURE: f64 = 3.0;

/// Moves a plane, and turns it about the middle of what lies on it, to where the photos agree best. The median depth of Gaussians lies up to a
/// voxel behind a plane of little texture, and all photos share that error.
pub(in super::super) fn fitted(plane: Plane, witnesses: &Witnesses<'_>) -> Plane {
    let mut held = witnesses.held(&plane, STRIDE);
    for (i, held) in held.iter_mut().enumerate() {
        held.retain(|&at| witnesses.is_clear(&plane, i, at));
    }
    let places: Vec<Vec3> = held
        .iter()
        .zip(witnesses.views)
        .zip(witnesses.maps)
        .flat_map(|((held, view), map)| {
            held.iter().map(|&[x, y]| view.place([x, y], map.depth[y * view.width + x]))
        })
        .collect();
    if places.len() < LEAST_PATCHES {
        return plane;
    }
    let middle = places.iter().sum::<Vec3>() / places.len() as f32;
    let along = plane.normal.any_orthonormal_vector();
    let axes = [along, plane.normal.cross(along)];
    let spread = axes.map(|axis| {
        let squares: f32 = places.iter().map(|p| (*p - middle).dot(axis).powi(2)).sum();
        (squares / places.len() as f32).sqrt().max(witnesses.voxel)
    });
    let foot = middle - plane.normal * plane.height(middle);
    // Rise at the middle, and from there to one standard deviation along each axis.
    let moved = |[rise, along, across]: [f32; 3]| {
        let tilt = axes[0] * (along / spread[0]) + axes[1] * (across / spread[1]);
        let normal = (plane.normal - tilt).normalize();
        Plane { normal, offset: normal.dot(foot + plane.normal * rise) }
    };
    // Per patch and photo that it is compared with.
    let costs = |plane: &Plane| -> Vec<Option<f32>> {
        let of = |i: usize| {
            let of = |&at: &[usize; 2]| {
                let patch = witnesses.patches(plane, i, at).map(|p| p[0]);
                let against =
                    |&j: &usize| patch.as_ref().and_then(|p| witnesses.difference(p, j, &BESIDE));
                witnesses.partners[i].iter().map(against).collect::<Vec<_>>()
            };
            held[i].iter().flat_map(of).collect::<Vec<_>>()
        };
        let all: Vec<_> = (0..held.len()).into_par_iter().with_max_len(1).map(of).collect();
        all.concat()
    };
    let mut best = ([0.0f32; 3], costs(&plane));
    let mut step = STEP * witnesses.voxel;
    for _ in 0..ROUNDS {
        for (k, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
            let mut tried = best.0;
            tried[k] += sign * step;
            let costs = costs(&moved(tried));
            if is_better(&costs, &best.1) {
                best = (tried, costs);
            }
        }
        step *= 0.5;
    }
    moved(best.0)
}

/// Whether differences are smaller than those before by more than chance, and no fewer photos can be asked.
fn is_better(costs: &[Option<f32>], before: &[Option<f32>]) -> bool {
    let seen = |costs: &[Option<f32>]| costs.iter().flatten().count() as f64;
    if !(seen(costs) > LEAST_SEEN * seen(before)) {
        return false;
    }
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for (a, b) in costs.iter().zip(before) {
        if let (Some(a), Some(b)) = (a, b) {
            let gain = f64::from(b - a);
            n += 1.0;
            sum += gain;
            squares += gain * gain;
        }
    }
    let mean = sum / n;
    let deviation = ((squares / n - mean * mean).max(0.0) / n).sqrt();
    mean > LEAST_GAIN.max(SURE * deviation)
}
