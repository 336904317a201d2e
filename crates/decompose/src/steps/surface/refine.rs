//! Moves the surface to where the photos agree best.
//!
//! Each vertex tries displacements along its normal and keeps the best with a confidence; a thin
//! plate ([`ThinPlate`]) carries the surface between the confident ones. Few rounds with a closing
//! range; between them visibility and normals are renewed.

use glam::{Vec2, Vec3};
use motes_shading::tracing::{MeshTracer, Ray, Tracer};
use rayon::prelude::*;

use super::options::Options;
use super::outlines::{Rays, outlines};
use super::patches::{Agreement, MOST_VIEWS, Patch, agreement};
use super::silhouettes::{mirror_limit, steady};
use super::smooth::ThinPlate;
use super::view::View;
use crate::mesh::{Mesh, Neighbors, averaged};

/// Cosine of the angle between normal and sight from which a photo sees a piece well enough.
const LEAST_COSINE: f32 = 0.25;
/// A ray leaves the surface by this many voxels before it can be stopped: less than that is noise.
const LEAVE: f32 = 1.5;

/// Weight of staying, beside confidences up to 1.
const HOLD: f32 = 5e-3;
/// A displacement that the plate misses by this many voxels counts for a quarter (Geman & McClure 1987).
const OUTLIER: f32 = 0.7;
/// Share of it that is left on mirrors: what no photo tells about follows the outlines.
const LEAST_HOLD: f32 = 0.02;
/// Averages over neighbors of how far the photos differ.
const SPREAD_PASSES: usize = 8;
/// Averages of the curvature that patches are bent by.
const CURVATURE_PASSES: usize = 4;
/// Lift of a sample one step away at most, voxels: a ridge of 90 degrees.
const MOST_LIFT: f32 = 0.15;
/// Solves with renewed weights, each from the last, and iterations of each: where nothing is told, as on a metal, shape comes from far away.
const ROBUST: usize = 3;
const ITERATIONS: usize = 150;

/// What the photos say about one vertex.
#[derive(Clone, Copy, Debug, Default)]
struct Finding {
    /// Displacement along the normal, unit world.
    displacement: f32,
    /// Weight of it, 0 to 1.
    confidence: f32,
    /// Agreement of the photos where the vertex is now.
    before: f32,
    /// Spread of the brightness of the photos there, 0 to 1; none where no photos agree.
    spread: Option<f32>,
}

/// Settings of one round.
pub(super) struct Round {
    /// Largest displacement, voxels.
    pub(super) range: f32,
    /// Between displacements, voxels.
    pub(super) step: f32,
    /// Between the samples of a patch, voxels.
    pub(super) spacing: f32,
    pub(super) stiffness: f32,
    /// Averages of the normals over neighbors before the patches are laid.
    pub(super) normal_passes: usize,
    pub(super) rest_passes: usize,
    pub(super) outline_weight: f32,
    pub(super) mirror_spread: f32,
}

impl Round {
    /// Every round looks less far and more finely; the first with wider patches, laid along
    /// smoother normals.
    pub(super) fn new(index: usize, options: &Options) -> Self {
        let range = options.refine_range.max(0.1) * 0.6f32.powi(index as i32);
        Self {
            range,
            step: (range / 5.0).max(0.1),
            spacing: options.patch_spacing * if index == 0 { 1.5 } else { 1.0 },
            normal_passes: 8 >> index.min(2),
            stiffness: options.refine_stiffness,
            rest_passes: options.rest_passes,
            outline_weight: options.outline_weight.max(0.0),
            mirror_spread: options.mirror_spread.max(0.0),
        }
    }
}

/// Photos that see each vertex, the most nearly facing first; `MOST_VIEWS` each.
fn visibility(
    mesh: &Mesh,
    normals: &[Vec3],
    tracer: &MeshTracer,
    views: &[View],
    voxel: f32,
) -> Vec<Vec<u16>> {
    let of = |v: usize| {
        let (x, n) = (mesh.vertices[v], normals[v]);
        let origin = x + n * LEAVE * voxel;
        let mut seen: Vec<(f32, u16)> = Vec::new();
        for (i, view) in views.iter().enumerate() {
            let Some(q) = view.project(x) else { continue };
            if view.pixel(q.x, q.y).is_none() {
                continue;
            }
            let to_camera = view.center - origin;
            let distance = to_camera.length();
            let direction = to_camera / distance;
            let cosine = n.dot(direction);
            if !(cosine > LEAST_COSINE) {
                continue;
            }
            let ray = Ray { t_max: distance, ..Ray::new(origin, direction) };
            if !tracer.occluded(&ray) {
                seen.push((cosine, i as u16));
            }
        }
        seen.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        seen.truncate(MOST_VIEWS);
        seen.into_iter().map(|(_, i)| i).collect()
    };
    (0..mesh.vertices.len()).into_par_iter().with_min_len(256).map(of).collect()
}

/// `n · (x_j - x) / |x_j - x|^2`, mean over the neighbors: half the mean curvature, negative where the
/// surface bulges; averaged, so that noise bends no patch.
fn curvature(mesh: &Mesh, normals: &[Vec3], neighbors: &Neighbors) -> Vec<f32> {
    let n = normals.len();
    let map = |f: &(dyn Fn(usize) -> f32 + Sync)| -> Vec<f32> {
        (0..n).into_par_iter().with_min_len(1024).map(f).collect()
    };
    let mean = map(&|v| {
        let (mut rise, mut run) = (0.0, 0.0);
        for &j in neighbors.at(v) {
            let d = mesh.vertices[j as usize] - mesh.vertices[v];
            rise += normals[v].dot(d);
            run += d.length_squared();
        }
        if run > 0.0 { rise / run } else { 0.0 }
    });
    neighbors.smoothed(mean, CURVATURE_PASSES)
}

fn find(
    views: &[View],
    seen: &[u16],
    x: Vec3,
    n: Vec3,
    curvature: f32,
    voxel: f32,
    round: &Round,
) -> Finding {
    if seen.len() < 2 {
        return Finding::default();
    }
    let along = n.any_orthonormal_vector() * voxel * round.spacing;
    let across = n.cross(along);
    let lift =
        n * (curvature * along.length_squared()).clamp(-MOST_LIFT * voxel, MOST_LIFT * voxel);
    let steps = ((round.range / round.step).round() as i32).clamp(1, 31);
    let at = |k: i32| {
        let center = x + n * (k as f32 * round.step * voxel);
        agreement(views, seen, &Patch { center, along, across, lift })
    };
    let count = (2 * steps + 1) as usize;
    let mut scores = [-1.0f32; 64];
    let mut best: Option<(usize, Agreement)> = None;
    for (k, score) in scores.iter_mut().enumerate().take(count) {
        let Some(a) = at(k as i32 - steps) else { continue };
        *score = a.score;
        if best.is_none_or(|(_, b)| a.score > b.score) {
            best = Some((k, a));
        }
    }
    let Some((k, found)) = best else { return Finding::default() };
    let before = scores[steps as usize];
    let nothing = Finding { before, spread: Some(found.spread), ..Finding::default() };
    // At the end of the range there is no maximum.
    if k == 0 || k + 1 == count {
        return nothing;
    }
    let (low, mid, high) = (scores[k - 1], scores[k], scores[k + 1]);
    let bend = 2.0 * mid - low - high;
    if !(bend > 0.0) {
        return nothing;
    }
    let offset = (0.5 * (high - low) / bend).clamp(-0.5, 0.5);
    // Fall of the score one voxel away.
    let sharp = bend / (2.0 * round.step * round.step);
    let good = ((found.score - 0.3) / 0.7).max(0.0);
    let photos = (found.photos / 3.0).min(1.0);
    Finding {
        displacement: (k as f32 - steps as f32 + offset) * round.step * voxel,
        confidence: good * good * (sharp / (sharp + 0.1)) * photos,
        ..nothing
    }
}

/// One round. Returns the mean agreement of the photos before it, over the vertices that two photos see.
pub(super) fn refine(
    mesh: &mut Mesh,
    planes: &Mesh,
    views: &[View],
    neighbors: &Neighbors,
    voxel: f32,
    round: &Round,
) -> f64 {
    let mut normals = mesh.vertex_normals();
    for _ in 0..round.normal_passes {
        normals = averaged(&normals, neighbors);
    }
    let Some(rays) = Rays::new(mesh, planes) else { return 0.0 };
    let seen = visibility(mesh, &normals, &rays.all, views, voxel);
    let bent = curvature(mesh, &normals, neighbors);
    let mut found: Vec<Finding> = (0..mesh.vertices.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|v| find(views, &seen[v], mesh.vertices[v], normals[v], bent[v], voxel, round))
        .collect();
    let told: Vec<f64> =
        found.iter().filter(|f| f.before != 0.0).map(|f| f64::from(f.before)).collect();
    let believed = steadiness(&found, neighbors, round.mirror_spread);
    for (f, s) in found.iter_mut().zip(&believed) {
        f.confidence *= s;
    }
    if round.outline_weight > 0.0 {
        let outlines = outlines(mesh, &normals, &rays, views, voxel);
        let most = round.range * voxel;
        for (f, o) in found.iter_mut().zip(&outlines) {
            let weight = round.outline_weight * o.confidence;
            let sum = f.confidence + weight;
            if weight > 0.0 && o.displacement.abs() < most {
                f.displacement = (f.confidence * f.displacement + weight * o.displacement) / sum;
                f.confidence = sum;
            }
        }
    }
    drop(rays);
    // A little hold everywhere: where no photo tells, the surface stays unless its shape pulls.
    let hold: Vec<f32> = believed.iter().map(|s| HOLD * s.max(LEAST_HOLD)).collect();
    let mut weight: Vec<f32> = found.iter().zip(&hold).map(|(f, h)| f.confidence + h).collect();
    let target: Vec<f32> = found.iter().map(|f| f.displacement).collect();
    let trust: Vec<f32> = found.iter().map(|f| f.confidence + 0.01).collect();
    let mut u = vec![0.0; found.len()];
    for _ in 0..ROBUST {
        let plate = ThinPlate {
            mesh,
            normals: &normals,
            neighbors,
            weight: &weight,
            target: &target,
            stiffness: round.stiffness,
            voxel,
            trust: &trust,
            steady: &believed,
            rest_passes: round.rest_passes,
        };
        u = plate.solve(u, ITERATIONS);
        for ((w, h), (f, u)) in weight.iter_mut().zip(&hold).zip(found.iter().zip(&u)) {
            let off = (f.displacement - u) / (OUTLIER * voxel);
            *w = f.confidence / (1.0 + off * off).powi(2) + h;
        }
    }
    let most = round.range * voxel;
    for ((x, u), n) in mesh.vertices.iter_mut().zip(u).zip(&normals) {
        *x += *n * u.clamp(-most, most);
    }
    told.iter().sum::<f64>() / told.len().max(1) as f64
}

/// How far the photos' agreement about each vertex counts, 0 to 1: little where its brightness changes from photo to photo
/// as it does on a mirror, whose picture lies behind it and would dig pits.
fn steadiness(found: &[Finding], neighbors: &Neighbors, mirror_spread: f32) -> Vec<f32> {
    if !(mirror_spread > 0.0) {
        return vec![1.0; found.len()];
    }
    let told = |f: &Finding| f.spread.map_or(Vec2::ZERO, |spread| Vec2::new(spread, 1.0));
    let sums = neighbors.smoothed(found.iter().map(told).collect(), SPREAD_PASSES);
    let limit = mirror_limit(mirror_spread, found.iter().filter_map(|f| f.spread).collect());
    let of = |s: &Vec2| if s.y > 0.0 { steady(s.x / s.y, limit) } else { 1.0 };
    sums.iter().map(of).collect()
}
