//! The plane that carries the photos best.

use glam::Vec3;
use rayon::prelude::*;

use super::super::planes::Plane;
use super::Witnesses;

/// Pixels between the patches that a plane is fitted by, and how many there must be.
const STRIDE: usize = 8;
const LEAST_PATCHES: usize = 10;
/// First step of the search, voxels, and rounds of half the step each.
const STEP: f32 = 2.0;
const ROUNDS: usize = 4;
/// Gain of the mean squared difference that is worth a step: where there is no texture, a plane stays. Share of the comparisons that must be left.
const LEAST_GAIN: f64 = 1e-7;
const LEAST_SEEN: f64 = 0.9;

/// Moves a plane, and turns it about the middle of what lies on it, to where the photos agree best. The median depth of Gaussians lies up to a
/// voxel behind a plane of little texture, and all photos share that error.
pub(in super::super) fn fitted(plane: Plane, witnesses: &Witnesses<'_>) -> Plane {
    let held = witnesses.held(&plane, STRIDE);
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
    // Mean over the pairs of photos that show a patch, and their number.
    let cost = |plane: &Plane| -> (f64, usize) {
        let of = |i: usize| {
            let patches =
                held[i].iter().filter_map(|&at| Some(witnesses.patches(plane, i, at)?[0]));
            let differences = patches.flat_map(|patch| {
                witnesses.partners[i].iter().filter_map(move |&j| witnesses.difference(&patch, j))
            });
            differences.fold((0.0, 0), |(sum, n), d| (sum + f64::from(d), n + 1))
        };
        let all: Vec<(f64, usize)> =
            (0..held.len()).into_par_iter().with_max_len(1).map(of).collect();
        let (sum, count) = all.into_iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        (sum / count.max(1) as f64, count)
    };
    let (first, count) = cost(&plane);
    let mut best = ([0.0f32; 3], first);
    let mut step = STEP * witnesses.voxel;
    for _ in 0..ROUNDS {
        for (k, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
            let mut tried = best.0;
            tried[k] += sign * step;
            let (cost, seen) = cost(&moved(tried));
            // A plane that fewer photos can be asked about is no better.
            if cost < best.1 - LEAST_GAIN && seen as f64 > LEAST_SEEN * count as f64 {
                best = (tried, cost);
            }
        }
        step *= 0.5;
    }
    moved(best.0)
}
