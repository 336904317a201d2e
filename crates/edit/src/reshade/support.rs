//! The plane that an object stood on.

use glam::{DMat3, DVec3, Vec3};
use motes_math::rng::keyed_rng;
use rand::RngExt;

/// Triples of points that are tried.
const TRIALS: usize = 512;
/// Points that vote.
const MAX_VOTERS: usize = 4096;
/// Points of the object that tell which side it is on.
const MAX_OBJECT_VOTERS: usize = 512;
/// This share of the object must be on one side.
const ONE_SIDE: f64 = 0.9;
/// A plane needs this share of the points around the object.
pub(super) const LEAST_SHARE: f64 = 0.3;
const PURPOSE: u64 = 0x5355_5050;

/// A plane `n · x = offset`; `n` points to the side of the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) normal: Vec3,
    pub(super) offset: f32,
    /// Unit vectors that span it: `u x v = n`.
    pub(super) axes: [Vec3; 2],
}

impl Plane {
    pub(super) fn new(normal: DVec3, through: DVec3) -> Self {
        let n = normal.as_vec3().normalize();
        let (u, v) = n.any_orthonormal_pair();
        Self { normal: n, offset: normal.normalize().dot(through) as f32, axes: [u, v] }
    }

    /// Signed distance.
    pub(super) fn height(&self, x: Vec3) -> f32 {
        self.normal.dot(x) - self.offset
    }

    /// Coordinates along the axes.
    pub(super) fn flat(&self, x: Vec3) -> [f32; 2] {
        self.axes.map(|a| a.dot(x))
    }

    /// The point of the plane with these coordinates.
    pub(super) fn point(&self, [u, v]: [f32; 2]) -> Vec3 {
        self.axes[0] * u + self.axes[1] * v + self.normal * self.offset
    }
}

/// The plane that most of `around` lie on within `tolerance`, world units, of those that have nine tenths of `object` on
/// one side: its front. None when no plane has `least_share` of them.
pub(super) fn support_plane(
    around: &[Vec3],
    object: &[Vec3],
    tolerance: f32,
    least_share: f64,
    seed: u64,
) -> Option<Plane> {
    let step = around.len().div_ceil(MAX_VOTERS).max(1);
    let points: Vec<DVec3> =
        around.iter().filter(|p| p.is_finite()).step_by(step).map(|p| p.as_dvec3()).collect();
    if points.len() < 3 || object.is_empty() {
        return None;
    }
    let tolerance = f64::from(tolerance);
    let mut rng = keyed_rng(seed, PURPOSE, 0);
    let near =
        |n: DVec3, c: DVec3| points.iter().filter(move |p| n.dot(**p - c).abs() <= tolerance);
    let step = object.len().div_ceil(MAX_OBJECT_VOTERS).max(1);
    let object: Vec<DVec3> = object.iter().step_by(step).map(|p| p.as_dvec3()).collect();
    // A plane through the object is one of its faces, or a neighbor's, but not what it stands on.
    let beside = |n: DVec3, c: DVec3| {
        let front = object.iter().filter(|p| n.dot(**p - c) > -tolerance).count();
        let back = object.iter().filter(|p| n.dot(**p - c) < tolerance).count();
        front.max(back) as f64 >= ONE_SIDE * object.len() as f64
    };
    let mut best: Option<(usize, DVec3, DVec3)> = None;
    for _ in 0..TRIALS {
        let [a, b, c] = [0; 3].map(|_| points[rng.random_range(0..points.len())]);
        let Some(n) = (b - a).cross(c - a).try_normalize() else { continue };
        let votes = near(n, a).count();
        if best.is_none_or(|(most, ..)| votes > most) && beside(n, a) {
            best = Some((votes, n, a));
        }
    }
    let (votes, mut normal, mut center) = best?;
    if (votes as f64) < least_share * points.len() as f64 {
        return None;
    }
    for _ in 0..3 {
        let inliers: Vec<DVec3> = near(normal, center).copied().collect();
        (normal, center) = least_squares(&inliers, normal)?;
    }
    let object_center = object.iter().sum::<DVec3>() / object.len() as f64;
    if normal.dot(object_center - center) < 0.0 {
        normal = -normal;
    }
    Some(Plane::new(normal, center))
}

/// Normal of least spread by inverse iteration, from a start that is near.
fn least_squares(points: &[DVec3], start: DVec3) -> Option<(DVec3, DVec3)> {
    let center = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let mut scatter = DMat3::ZERO;
    for p in points {
        let d = *p - center;
        scatter += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    let trace = scatter.x_axis.x + scatter.y_axis.y + scatter.z_axis.z;
    if !(trace > 0.0) {
        return None;
    }
    let inverse = (scatter + DMat3::from_diagonal(DVec3::splat(1e-9 * trace))).inverse();
    let mut n = start;
    for _ in 0..8 {
        n = (inverse * n).try_normalize()?;
    }
    (n.is_finite() && center.is_finite()).then_some((n, center))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_with_clutter_is_found() {
        let mut rng = keyed_rng(3, 0, 0);
        let mut random = || rng.random_range(-1.0f32..1.0);
        let tilted = |u: f32, v: f32, h: f32| Vec3::new(u, v, 0.2 * u + 5.0 + h);
        let mut around: Vec<Vec3> =
            (0..600).map(|_| tilted(random(), random(), 0.002 * random())).collect();
        around.extend((0..400).map(|_| tilted(random(), random(), 0.5 + 0.4 * random())));
        let object = [Vec3::new(0.0, 0.0, 6.0)];
        let plane = support_plane(&around, &object, 0.01, LEAST_SHARE, 0).expect("a plane");
        let truth = Vec3::new(-0.2, 0.0, 1.0).normalize();
        assert!(plane.normal.dot(truth) > 0.999_95, "{plane:?}");
        assert!(plane.height(object[0]) > 0.9, "{plane:?}");
        let x = tilted(0.3, -0.4, 0.0);
        assert!((plane.point(plane.flat(x)) - x).length() < 3e-3);
        assert_eq!(support_plane(&around[..2], &object, 0.01, LEAST_SHARE, 0), None);
        assert_eq!(support_plane(&[Vec3::ONE; 50], &object, 0.01, LEAST_SHARE, 0), None);
    }
}
