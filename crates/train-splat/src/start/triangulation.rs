//! Points from keypoints that match over several photos.

use glam::{DMat3, DVec2, DVec3};
use motes_math::disjoint_sets::DisjointSets;
use motes_scene::SparsePoints;
use rayon::prelude::*;

use super::matching::guided;
use super::neighbors::camera_spacing;
use super::view::View;

/// Photos that a photo is matched with.
pub(super) const NEIGHBORS: usize = 8;
/// Centers closer than this share of the spacing of the cameras are in one place.
const ONE_PLACE: f64 = 1e-3;
/// Largest distance between a keypoint and the projection of its point, pixels.
const REPROJECTION: f64 = 1.5;
/// Smallest widest angle between the rays of a point, radians.
const MIN_ANGLE: f64 = 0.02;
/// Photos that must agree about a point. With few photos two have to do.
const WITNESSES: usize = 3;
const FEW_VIEWS: usize = 6;
/// Steps of Gauss-Newton.
const STEPS: usize = 4;

/// One sighting: photo and keypoint.
type Sighting = (u32, u32);

/// Points that the photos agree about, colored by the photo that sees them largest.
/// `near` names the photos that each may match.
pub(super) fn triangulate(views: &[View], near: &[Vec<usize>]) -> SparsePoints {
    let mut pairs: Vec<(usize, usize)> = near
        .iter()
        .enumerate()
        .flat_map(|(i, others)| others.iter().map(move |&k| (i.min(k), i.max(k))))
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    let one_place = ONE_PLACE * camera_spacing(views);
    let matches: Vec<Vec<(u32, u32)>> = pairs
        .par_iter()
        .with_max_len(1)
        .map(|&(a, b)| guided(&views[a], &views[b], one_place))
        .collect();
    let witnesses = if views.len() < FEW_VIEWS { 2 } else { WITNESSES };
    let points: Vec<Option<(DVec3, [u8; 3])>> =
        tracks(views, &pairs, &matches).par_iter().map(|t| point(views, t, witnesses)).collect();
    let mut out = SparsePoints::default();
    for (position, color) in points.into_iter().flatten() {
        out.positions.push(position.as_vec3().to_array());
        out.colors.push(color);
    }
    out
}

/// Sets of keypoints joined by matches.
fn tracks(
    views: &[View],
    pairs: &[(usize, usize)],
    matches: &[Vec<(u32, u32)>],
) -> Vec<Vec<Sighting>> {
    let mut first = Vec::with_capacity(views.len());
    let mut count = 0;
    for view in views {
        first.push(count);
        count += view.keypoints.len();
    }
    let mut sets = DisjointSets::new(count);
    for (&(a, b), matches) in pairs.iter().zip(matches) {
        for &(i, j) in matches {
            sets.join(first[a] as u32 + i, first[b] as u32 + j);
        }
    }
    let leader = sets.labels();
    let mut tracks: Vec<Vec<Sighting>> = vec![Vec::new(); count];
    for (v, view) in views.iter().enumerate() {
        for k in 0..view.keypoints.len() {
            tracks[leader[first[v] + k] as usize].push((v as u32, k as u32));
        }
    }
    tracks.retain(|track| track.len() > 1);
    tracks
}

/// A ray through a keypoint.
struct Ray {
    view: u32,
    pixel: DVec2,
    direction: DVec3,
    scale: f32,
}

/// The point that most sightings of a track agree about.
fn point(views: &[View], track: &[Sighting], witnesses: usize) -> Option<(DVec3, [u8; 3])> {
    let rays: Vec<Ray> = track
        .iter()
        .map(|&(v, k)| {
            let (view, keypoint) = (&views[v as usize], &views[v as usize].keypoints[k as usize]);
            let (x, y) = (f64::from(keypoint.x), f64::from(keypoint.y));
            let (pixel, direction) = (DVec2::new(x, y), view.ray(x, y).normalize());
            Ray { view: v, pixel, direction, scale: keypoint.scale }
        })
        .collect();
    let mut best: Vec<usize> = Vec::new();
    for (a, b) in seed_pairs(&rays) {
        let Some(seed) = midpoint(views, &rays[a], &rays[b]) else { continue };
        let agreeing = inliers(views, &rays, seed, 2.0 * REPROJECTION);
        if agreeing.len() > best.len() {
            best = agreeing;
        }
    }
    if best.len() < witnesses {
        return None;
    }
    let position = refined(views, &rays, &best)?;
    let agreeing = inliers(views, &rays, position, REPROJECTION);
    let wide = agreeing.iter().any(|&a| {
        agreeing.iter().any(|&b| rays[a].direction.angle_between(rays[b].direction) > MIN_ANGLE)
    });
    if agreeing.len() < witnesses || !wide || !position.is_finite() {
        return None;
    }
    let largest = agreeing.into_iter().max_by(|&a, &b| rays[a].scale.total_cmp(&rays[b].scale))?;
    let Ray { view, pixel, .. } = &rays[largest];
    Some((position, views[*view as usize].color(pixel.x as f32, pixel.y as f32)))
}

/// Pairs of rays to start from: those of the widest angles; long tracks do not try all.
fn seed_pairs(rays: &[Ray]) -> Vec<(usize, usize)> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for a in 0..rays.len().min(12) {
        for b in a + 1..rays.len().min(12) {
            if rays[a].view != rays[b].view {
                pairs.push((rays[a].direction.angle_between(rays[b].direction), a, b));
            }
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    pairs.truncate(12);
    pairs.into_iter().map(|(_, a, b)| (a, b)).collect()
}

/// The middle of the shortest line between two rays, in front of both cameras.
fn midpoint(views: &[View], a: &Ray, b: &Ray) -> Option<DVec3> {
    let (ca, cb) = (views[a.view as usize].center, views[b.view as usize].center);
    let cosine = a.direction.dot(b.direction);
    let sine2 = 1.0 - cosine * cosine;
    if sine2 < 1e-6 {
        return None;
    }
    let between = cb - ca;
    let (along_a, along_b) = (between.dot(a.direction), between.dot(b.direction));
    let s = (along_a - cosine * along_b) / sine2;
    let t = (cosine * along_a - along_b) / sine2;
    (s > 0.0 && t > 0.0).then(|| 0.5 * (ca + s * a.direction + cb + t * b.direction))
}

/// Sightings that a point explains, one per photo.
fn inliers(views: &[View], rays: &[Ray], point: DVec3, within: f64) -> Vec<usize> {
    let mut found: Vec<(u32, f64, usize)> = Vec::new();
    for (i, ray) in rays.iter().enumerate() {
        let Some((pixel, _)) = views[ray.view as usize].project(point) else { continue };
        let error = pixel.distance(ray.pixel);
        if error <= within {
            found.push((ray.view, error, i));
        }
    }
    found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    found.dedup_by_key(|f| f.0);
    found.into_iter().map(|f| f.2).collect()
}

/// Least squares of the reprojection errors.
fn refined(views: &[View], rays: &[Ray], used: &[usize]) -> Option<DVec3> {
    // Start: the point nearest to all rays.
    let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for &i in used {
        let d = rays[i].direction;
        let projector = DMat3::IDENTITY - DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        normal += projector;
        right += projector * views[rays[i].view as usize].center;
    }
    if !(normal.determinant() > 1e-12) {
        return None;
    }
    let mut point = normal.inverse() * right;
    for _ in 0..STEPS {
        let (mut hessian, mut slope) = (DMat3::ZERO, DVec3::ZERO);
        for &i in used {
            let view = &views[rays[i].view as usize];
            let p = view.camera_from_world.transform_point(point);
            if !(p.z > 0.0) {
                return None;
            }
            let rotation = view.camera_from_world.rotation_matrix();
            let (fx, fy) = (view.camera.fx, view.camera.fy);
            let du = rotation.transpose() * DVec3::new(fx / p.z, 0.0, -fx * p.x / (p.z * p.z));
            let dv = rotation.transpose() * DVec3::new(0.0, fy / p.z, -fy * p.y / (p.z * p.z));
            let error =
                DVec2::new(fx * p.x / p.z + view.camera.cx, fy * p.y / p.z + view.camera.cy)
                    - rays[i].pixel;
            for (d, e) in [(du, error.x), (dv, error.y)] {
                hessian += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
                slope += d * e;
            }
        }
        let size = hessian.col(0).x + hessian.col(1).y + hessian.col(2).z;
        let damped = hessian + DMat3::from_diagonal(DVec3::splat(1e-9 * size));
        if !(damped.determinant() > 0.0) {
            return None;
        }
        point -= damped.inverse() * slope;
    }
    point.is_finite().then_some(point)
}
