//! The plane that things stand on.
//!
//! RANSAC (Fischler and Bolles 1981) over the middles of superpixels, then least squares on those near it.

use glam::{DMat3, DVec3, Vec3};
use motes_math::median::upper_median;
use motes_math::rng::keyed_rng;
use rand::RngExt as _;

use crate::view_data::Segment;

/// A plane with matter on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupportPlane {
    /// Unit, away from the matter below: toward the cameras.
    pub normal: Vec3,
    /// `normal . x = offset` on the plane.
    pub offset: f32,
    /// Robust standard deviation of what was taken for the plane, world units.
    pub noise: f32,
}

/// Tries; 400 find a plane of a fifth of the points with a chance of 96 %.
const TRIES: u64 = 400;
/// Share of the area that a plane needs.
const LEAST_SHARE: f32 = 0.2;
/// Of a superpixel's side: what is nearer counts as on the plane.
const NEAR: f32 = 0.5;
/// However little the plane scatters, superpixels at its rim do.
const LEAST_NEAR: f32 = 0.05;
/// Cosine between the normals of a superpixel and of the plane that it is of.
const FACING: f64 = 0.7;
/// The same for a superpixel that lies on a plane already found: a side that is steeper is the foot of something that stands there.
const LYING: f32 = 0.5;

impl SupportPlane {
    /// Height above the plane, world units.
    pub fn height(&self, point: Vec3) -> f32 {
        self.normal.dot(point) - self.offset
    }

    /// Height up to which a superpixel of this width may lie within `sides` of its sides of the plane.
    pub(crate) fn reach(&self, sides: f32, width: f32) -> f32 {
        sides * width + 2.5 * self.noise
    }

    /// Whether a superpixel is of the plane, 0 to 1. `width` is its side: a small step above the plane
    /// is seen only where pixels are fine enough.
    pub(crate) fn membership(&self, point: Vec3, width: f32) -> f32 {
        let unit = (2.5 * self.noise).max(0.35 * width);
        (-(self.height(point) / unit).powi(2)).exp()
    }

    /// Whether a superpixel faces as the plane does; otherwise it is the foot of something that stands there, however low it lies.
    pub(crate) fn is_faced_by(&self, s: &Segment) -> bool {
        self.normal.dot(s.normal.into()) > LYING
    }

    /// Whether a superpixel is rather of the plane than not.
    pub(crate) fn holds(&self, s: &Segment) -> bool {
        s.width > 0.0 && self.membership(s.point.into(), s.width) > 0.5
    }

    /// Finds the plane that most of the area lies on; `None` when there is none of a fifth of it.
    pub(crate) fn find(segments: &[&Segment], cameras: &[DVec3]) -> Option<Self> {
        let valid: Vec<&Segment> = segments.iter().copied().filter(|s| s.width > 0.0).collect();
        let found = largest(&valid, cameras)?;
        let total = area(&valid);
        // What carries things has next to nothing below it.
        let below = found.area_behind(&valid);
        (found.area >= LEAST_SHARE * total && below <= 0.5 * found.area).then_some(found.plane)
    }
}

/// A plane and the area that lies on it, pixels.
pub(crate) struct Found {
    pub(crate) plane: SupportPlane,
    pub(crate) area: f32,
    normal: DVec3,
    offset: f64,
}

impl Found {
    /// The area more than two superpixel sides behind it.
    pub(crate) fn area_behind(&self, segments: &[&Segment]) -> f32 {
        let height = |s: &Segment| self.normal.dot(Vec3::from(s.point).as_dvec3()) - self.offset;
        let behind = segments.iter().filter(|s| height(s) < -2.0 * f64::from(s.width));
        behind.map(|s| s.area_px).sum()
    }
}

/// Sum of the areas, pixels.
pub(crate) fn area(segments: &[&Segment]) -> f32 {
    segments.iter().map(|s| s.area_px).sum()
}

/// The plane that most of the area of segments lies on, the cameras before it.
pub(crate) fn largest(valid: &[&Segment], cameras: &[DVec3]) -> Option<Found> {
    if valid.len() < 3 || cameras.is_empty() {
        return None;
    }
    // A sample keeps this fast on many views; the refinement sees all.
    let stride = valid.len().div_ceil(4000);
    let sample: Vec<&Segment> = valid.iter().copied().step_by(stride).collect();
    let mut rng = keyed_rng(0, 0x706c_616e, 0);
    let mut best: Option<(f32, DVec3, f64)> = None;
    for _ in 0..TRIES {
        let mut pick = || Vec3::from(sample[rng.random_range(0..sample.len())].point).as_dvec3();
        let (a, b, c) = (pick(), pick(), pick());
        let Some(normal) = (b - a).cross(c - a).try_normalize() else {
            continue;
        };
        let offset = normal.dot(a);
        // MSAC (Torr and Zisserman 2000): the nearer, the more; and only what faces the same way.
        let score: f32 = sample
            .iter()
            .map(|s| s.area_px * (1.0 - deviation(s, normal, offset, NEAR).powi(2)).max(0.0))
            .sum();
        if best.is_none_or(|(top, _, _)| score > top) {
            best = Some((score, normal, offset));
        }
    }
    let (_, normal, offset) = best?;
    let (mut normal, mut offset, noise) = refined(valid, normal, offset)?;
    let near = valid.iter().filter(|s| deviation(s, normal, offset, NEAR) < 1.0);
    let area: f32 = near.map(|s| s.area_px).sum();
    let middle = cameras.iter().sum::<DVec3>() / cameras.len() as f64;
    if normal.dot(middle) < offset {
        (normal, offset) = (-normal, -offset);
    }
    let plane =
        SupportPlane { normal: normal.as_vec3(), offset: offset as f32, noise: noise as f32 };
    Some(Found { plane, area, normal, offset })
}

/// Least squares on what is near a plane, closing in on it: unit normal, offset, and robust standard deviation.
pub(crate) fn refined(
    valid: &[&Segment],
    mut normal: DVec3,
    mut offset: f64,
) -> Option<(DVec3, f64, f64)> {
    let mut noise = 0.0;
    let mut widths = NEAR;
    for _ in 0..8 {
        let near: Vec<&Segment> =
            valid.iter().copied().filter(|s| deviation(s, normal, offset, widths) < 1.0).collect();
        (normal, offset) = fit(&near)?;
        let height = |s: &&Segment| normal.dot(Vec3::from(s.point).as_dvec3()) - offset;
        let mut residuals: Vec<f64> = near.iter().map(|s| height(s).abs()).collect();
        noise = 1.4826 * upper_median(&mut residuals, f64::total_cmp)?;
        let mut in_widths: Vec<f32> =
            near.iter().map(|s| height(s).abs() as f32 / s.width).collect();
        // Closer in, down to what the plane itself scatters.
        let scatter = 1.4826 * upper_median(&mut in_widths, f32::total_cmp)?;
        widths = (0.7 * widths).max(3.0 * scatter).clamp(LEAST_NEAR, NEAR);
    }
    Some((normal, offset, noise))
}

/// Distance from a plane in units of `widths` sides of the superpixel; infinite where it faces another way.
pub(crate) fn deviation(s: &Segment, normal: DVec3, offset: f64, widths: f32) -> f32 {
    if !(Vec3::from(s.normal).as_dvec3().dot(normal).abs() > FACING) {
        return f32::INFINITY;
    }
    let height = normal.dot(Vec3::from(s.point).as_dvec3()) - offset;
    height.abs() as f32 / (widths * s.width)
}

/// Plane of least squared distance, each superpixel weighted by area over width squared, so that near
/// and far views of a place count alike.
fn fit(segments: &[&Segment]) -> Option<(DVec3, f64)> {
    let weight = |s: &Segment| 1.0 / f64::from(s.width).powi(2);
    let total: f64 = segments.iter().map(|s| weight(s)).sum();
    let point = |s: &Segment| Vec3::from(s.point).as_dvec3();
    let middle = segments.iter().map(|s| point(s) * weight(s)).sum::<DVec3>() / total;
    let mut covariance = DMat3::ZERO;
    for s in segments {
        let d = point(s) - middle;
        covariance += DMat3::from_cols(d * d.x, d * d.y, d * d.z) * (weight(s) / total);
    }
    // The axis of least variance, by inverse iteration.
    let trace = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
    let shifted = covariance + DMat3::from_diagonal(DVec3::splat(1e-9 * trace));
    if !(shifted.determinant() > 0.0) {
        return None;
    }
    let inverse = shifted.inverse();
    let mut normal = DVec3::new(0.577, 0.578, 0.579);
    for _ in 0..60 {
        normal = (inverse * normal).try_normalize()?;
    }
    Some((normal, normal.dot(middle)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_foot_is_not_of_the_plane() {
        let plane = SupportPlane { normal: Vec3::Z, offset: 1.0, noise: 0.01 };
        let facing =
            |normal: [f32; 3]| plane.is_faced_by(&Segment { normal, ..Segment::default() });
        assert!(facing([0.0, 0.0, 1.0]) && facing([0.6, 0.0, 0.8]));
        assert!(!facing([1.0, 0.0, 0.0]) && !facing([0.0, 0.0, -1.0]));
    }
}
