//! Dominant planes: the table, the floor, a wall.

use glam::Vec3;
use motes_math::rng::keyed_rng;
use rand::RngExt;
use rayon::prelude::*;

use super::splat_depth::DepthMap;
use super::view::View;

/// `normal · x = offset`, the normal out of the matter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) normal: Vec3,
    pub(super) offset: f32,
}

impl Plane {
    #[inline]
    pub(super) fn height(&self, p: Vec3) -> f32 {
        self.normal.dot(p) - self.offset
    }

    /// Depth at which a ray of a view, 1 along its axis, meets the front of the plane.
    #[inline]
    pub(super) fn depth(&self, view: &View, ray: Vec3) -> Option<f32> {
        let (height, slope) = (self.height(view.center), self.normal.dot(ray));
        // From below there is nothing to see of it.
        let depth = -height / slope;
        (height > 0.0 && slope < 0.0 && depth.is_finite()).then_some(depth)
    }
}

/// Planes tried per search.
const TRIES: u64 = 400;
/// Samples that a plane is judged by while searching.
const SAMPLE: usize = 8000;
/// Cosine of the angle up to which a normal agrees with a plane (45 degrees: depth maps of Gaussians are rough).
const AGREE: f32 = 0.7;
const PURPOSE: u64 = 0x9_1a7e;

/// A sample of the seen surface.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// Width of its pixel, unit world.
    pub(super) footprint: f32,
}

impl Plane {
    /// Whether a sample lies on the plane.
    #[inline]
    pub(super) fn holds(&self, s: &Sample, tolerance: f32, voxel: f32) -> bool {
        let reach = reach(tolerance, s.footprint, voxel);
        self.height(s.position).abs() <= reach && s.normal.dot(self.normal) >= AGREE
    }

    /// Whether no more than a share of the samples lies behind the plane.
    pub(super) fn bounds(
        &self,
        samples: &[Sample],
        share: f32,
        tolerance: f32,
        voxel: f32,
    ) -> bool {
        let is_behind =
            |s: &&Sample| self.height(s.position) < -reach(tolerance, s.footprint, voxel);
        let behind = samples.iter().filter(is_behind).count() as f32;
        behind <= share * samples.len() as f32
    }
}

/// How far from a plane a pixel lies on it: `tolerance` (unit world), or that many voxels of its own footprint.
#[inline]
pub(super) fn reach(tolerance: f32, footprint: f32, voxel: f32) -> f32 {
    tolerance * (footprint / voxel).max(1.0)
}

/// Samples of every `stride`-th pixel of the depth maps.
pub(super) fn samples(views: &[View], maps: &[DepthMap], stride: usize) -> Vec<Sample> {
    // Differences over five pixels: depth maps of Gaussians are bumpy.
    const REACH: usize = 5;
    let of = |(view, map): (&View, &DepthMap)| {
        let mut out = Vec::new();
        let point = |x: usize, y: usize| {
            let z = map.depth[y * view.width + x];
            (z > 0.0).then(|| view.place([x, y], z))
        };
        for y in (REACH..view.height.saturating_sub(REACH)).step_by(stride) {
            for x in (REACH..view.width.saturating_sub(REACH)).step_by(stride) {
                let around = [(x + REACH, y), (x - REACH, y), (x, y + REACH), (x, y - REACH)];
                let [Some(a), Some(b), Some(c), Some(d)] = around.map(|(x, y)| point(x, y)) else {
                    continue;
                };
                let Some(position) = point(x, y) else { continue };
                // x right and y down: the cross product of left and down looks at the camera.
                let Some(normal) = (c - d).cross(a - b).try_normalize() else { continue };
                let z = map.depth[y * view.width + x];
                out.push(Sample {
                    position,
                    normal: -normal_away(normal, view, position),
                    footprint: z * view.footprint(),
                });
            }
        }
        out
    };
    let all: Vec<Vec<Sample>> = views.par_iter().zip(maps).with_max_len(1).map(of).collect();
    all.concat()
}

/// `n` or `-n`, whichever looks away from the camera.
fn normal_away(n: Vec3, view: &View, p: Vec3) -> Vec3 {
    if n.dot(p - view.center) >= 0.0 { n } else { -n }
}

/// The planes that hold at least `share` of the samples each, largest first (RANSAC, Fischler &
/// Bolles 1981, then least squares on the inliers); `tolerance` is the distance of an inlier.
pub(super) fn dominant_planes(
    samples: &[Sample],
    tolerance: f32,
    voxel: f32,
    share: f32,
    most: usize,
) -> Vec<Plane> {
    let mut left = samples.to_vec();
    let mut planes = Vec::new();
    while planes.len() < most {
        let Some(plane) = best_plane(&left, tolerance, voxel, planes.len() as u64) else { break };
        let before = left.len();
        left.retain(|s| !plane.holds(s, tolerance, voxel));
        let held = before - left.len();
        if !(held as f32 >= share * samples.len() as f32 && held >= 100) {
            break;
        }
        planes.push(plane);
    }
    planes
}

fn best_plane(left: &[Sample], tolerance: f32, voxel: f32, round: u64) -> Option<Plane> {
    if left.len() < 3 {
        return None;
    }
    let sample: Vec<Sample> = left.iter().copied().step_by(left.len().div_ceil(SAMPLE)).collect();
    let count = |plane: &Plane| sample.iter().filter(|s| plane.holds(s, tolerance, voxel)).count();
    let tried: Vec<(usize, Plane)> = (0..TRIES)
        .into_par_iter()
        .filter_map(|i| {
            let mut rng = keyed_rng(PURPOSE, round, i);
            let [a, b, c] = [0; 3].map(|_| {
                sample[(rng.random::<f32>() * sample.len() as f32) as usize % sample.len()]
            });
            let normal = (b.position - a.position).cross(c.position - a.position);
            let normal = normal.try_normalize()?;
            // Out is where the cameras are.
            let normal = if normal.dot(a.normal) < 0.0 { -normal } else { normal };
            let plane = Plane { normal, offset: normal.dot(a.position) };
            Some((count(&plane), plane))
        })
        .collect();
    let (_, mut best) = tried.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a })?;
    // The tolerance closes around the plane: what lies on things upon it pulls no more.
    for shrink in [1.0, 1.0, 0.7, 0.5, 0.5] {
        let held = left.iter().filter(|s| best.holds(s, tolerance * shrink, voxel));
        best = least_squares(&held.map(|s| s.position).collect::<Vec<_>>(), best)?;
    }
    Some(best)
}

/// Plane of least squared distances, on the side of `before`.
pub(super) fn least_squares(points: &[Vec3], before: Plane) -> Option<Plane> {
    if points.len() < 3 {
        return None;
    }
    let n = points.len() as f64;
    let mean = points.iter().map(|p| p.as_dvec3()).sum::<glam::DVec3>() / n;
    // Heights over the plane before as a linear function of the place within it.
    let normal = before.normal.as_dvec3();
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let (mut uu, mut uv, mut vv, mut uh, mut vh) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for p in points {
        let d = p.as_dvec3() - mean;
        let (a, b, h) = (d.dot(u), d.dot(v), d.dot(normal));
        uu += a * a;
        uv += a * b;
        vv += b * b;
        uh += a * h;
        vh += b * h;
    }
    let det = uu * vv - uv * uv;
    if !(det > 1e-9 * (uu + vv).powi(2)) {
        return None;
    }
    let (a, b) = ((vv * uh - uv * vh) / det, (uu * vh - uv * uh) / det);
    let normal = (normal - u * a - v * b).normalize();
    Some(Plane { normal: normal.as_vec3(), offset: normal.dot(mean) as f32 })
}
