//! The plane that an object stood on.

use glam::{DMat3, DVec3, Vec3};
use motes_math::rng::keyed_rng;
use rand::RngExt;
use rayon::prelude::*;

/// Triples of points that are tried.
const TRIALS: usize = 512;
/// Points that vote.
const MAX_VOTERS: usize = 4096;
/// Points of the object that tell which side it is on.
const MAX_OBJECT_VOTERS: usize = 512;
/// This share of the object must be on one side.
const ONE_SIDE: f64 = 0.9;
/// All but this share of the object reaches no farther below the plane than [`SUNK`].
const FOOT: f64 = 0.02;
/// Share of the object's size.
const SUNK: f64 = 0.03;
/// A plane needs this share of the points around the object.
pub(super) const LEAST_SHARE: f64 = 0.3;
/// Points farther from the object than this share of its size count less than half.
const BESIDE: f64 = 0.1;
/// A plane farther below nine tenths of the object by this share of its size counts `1 / e` as much: what stands on a slab does
/// not stand on the lawn around.
const STANDING: f64 = 0.1;
const PURPOSE: u64 = 0x5355_5050;

/// What points around an object say of the plane it stands on.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Say {
    /// Those near it say more, and planes far below it are less likely.
    Beside,
    /// All the same.
    Alike,
}

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
    (least_share, say): (f64, Say),
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
    let is_on = |n: DVec3, c: DVec3, p: &DVec3| n.dot(*p - c).abs() <= tolerance;
    let step = object.len().div_ceil(MAX_OBJECT_VOTERS).max(1);
    let object: Vec<DVec3> = object.iter().step_by(step).map(|p| p.as_dvec3()).collect();
    let extent = extent(&object).max(tolerance);
    // What an object stands on is beside it; the floor under a table is farther off.
    let beside = |p: &DVec3| {
        let square = object.iter().map(|o| o.distance_squared(*p)).fold(f64::INFINITY, f64::min);
        1.0 / (1.0 + square / (BESIDE * extent).powi(2))
    };
    let weight = |p: &DVec3| match say {
        Say::Beside => beside(p),
        Say::Alike => 1.0,
    };
    let weights: Vec<f64> = points.par_iter().map(weight).collect();
    let least = least_share * weights.iter().sum::<f64>();
    let mut best: Option<(f64, DVec3, DVec3)> = None;
    for _ in 0..TRIALS {
        let [a, b, c] = [0; 3].map(|_| points[rng.random_range(0..points.len())]);
        let Some(n) = (b - a).cross(c - a).try_normalize() else { continue };
        let own = points.iter().zip(&weights).filter(|(p, _)| is_on(n, a, p));
        let votes: f64 = own.map(|(_, w)| w).sum();
        if votes < least || best.is_some_and(|(most, ..)| votes <= most) {
            continue;
        }
        // What stands on a table is over the floor as well.
        let Some(gap) = gap(&object, (n, a), tolerance, SUNK * extent) else { continue };
        let score = match say {
            Say::Beside => votes * (-gap / (STANDING * extent)).exp(),
            Say::Alike => votes,
        };
        if best.is_none_or(|(most, ..)| score > most) {
            best = Some((score, n, a));
        }
    }
    let (_, mut normal, mut center) = best?;
    for _ in 0..3 {
        let inliers: Vec<DVec3> =
            points.iter().copied().filter(|p| is_on(normal, center, p)).collect();
        (normal, center) = least_squares(&inliers, normal)?;
    }
    let object_center = object.iter().sum::<DVec3>() / object.len() as f64;
    if normal.dot(object_center - center) < 0.0 {
        normal = -normal;
    }
    Some(Plane::new(normal, center))
}

/// How far nine tenths of an object are from a plane, given by a normal and a point; none where it passes through the object, or
/// where the object's foot is farther than `sunk` below: then it is a face of the object, or the top of a thing beside it, but not what
/// it stands on.
fn gap(object: &[DVec3], (n, through): (DVec3, DVec3), tolerance: f64, sunk: f64) -> Option<f64> {
    let mut heights: Vec<f64> = object.iter().map(|p| n.dot(*p - through)).collect();
    heights.sort_by(f64::total_cmp);
    let at = |share: f64| heights[(share * (heights.len() - 1) as f64) as usize];
    let sides = [[at(1.0 - ONE_SIDE), at(FOOT)], [-at(ONE_SIDE), -at(1.0 - FOOT)]];
    let stands = |[most, foot]: &[f64; 2]| *most > -tolerance && *foot > -tolerance - sunk;
    let [most, _] = sides.into_iter().find(stands)?;
    Some(most.max(0.0))
}

/// Diagonal of the box around points.
fn extent(points: &[DVec3]) -> f64 {
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    (high - low).length()
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
        let object: Vec<Vec3> = (1..=50).map(|k| tilted(0.0, 0.0, 0.02 * k as f32)).collect();
        let plane =
            support_plane(&around, &object, 0.01, (LEAST_SHARE, Say::Beside), 0).expect("a plane");
        let truth = Vec3::new(-0.2, 0.0, 1.0).normalize();
        assert!(plane.normal.dot(truth) > 0.999_95, "{plane:?}");
        assert!(plane.height(object[49]) > 0.9, "{plane:?}");
        let x = tilted(0.3, -0.4, 0.0);
        assert!((plane.point(plane.flat(x)) - x).length() < 3e-3);
        // A larger floor below the table is not what the object stands on.
        around.extend((0..1200).map(|_| tilted(2.0 * random(), 2.0 * random(), -2.0)));
        let plane = support_plane(&around, &object, 0.01, (0.2, Say::Beside), 0).expect("a plane");
        assert!(plane.height(tilted(0.0, 0.0, 0.0)).abs() < 0.01, "{plane:?}");
        // Nor is a blanket beside it that its feet are below.
        around.extend((0..2400).map(|_| tilted(random(), random(), 0.12)));
        let plane = support_plane(&around, &object, 0.01, (0.1, Say::Beside), 0).expect("a plane");
        assert!(plane.height(tilted(0.0, 0.0, 0.0)).abs() < 0.01, "{plane:?}");
        assert_eq!(support_plane(&around[..2], &object, 0.01, (LEAST_SHARE, Say::Beside), 0), None);
        assert_eq!(
            support_plane(&[Vec3::ONE; 50], &object, 0.01, (LEAST_SHARE, Say::Beside), 0),
            None
        );
    }
}
