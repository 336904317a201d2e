//! Planes above the floor that things stand on: a table top, a seat, a shelf.
//!
//! Parallel to the support plane, above it, and large. One is support only for what stands on it: whoever clicks
//! a leg of a table, or the table top itself, means the table.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use motes_math::median::upper_median;

use crate::plane::{SupportPlane, area, deviation, refined};
use crate::view_data::Segment;

/// Planes looked for at most.
const MOST: usize = 3;
/// Share of the area that each needs. Tops of boxes have less in captures of several things.
const LEAST_SHARE: f32 = 0.1;
/// Cosine of the angle to the support plane: 10 degrees.
const PARALLEL: f32 = 0.985;
/// Superpixels this many sides above a plane are above it.
const ABOVE: f32 = 2.0;
/// Directions in the plane that its outline is bounded in.
const DIRECTIONS: usize = 16;
/// What is connected is connected by cells of so many sides of a superpixel.
const CELL: f32 = 3.0;
/// Share of the superpixels beyond each bound: single ones stray.
const OUTER: f32 = 0.02;

/// A plane above the support plane, and its outline as slabs in directions within it.
#[derive(Clone, Debug)]
pub(crate) struct RaisedSupport {
    plane: SupportPlane,
    outline: Vec<(Vec3, f32, f32)>,
}

impl RaisedSupport {
    /// Those above `floor`, the largest first.
    pub(crate) fn find(segments: &[&Segment], floor: &SupportPlane) -> Vec<Self> {
        let drawn: Vec<&Segment> = segments.iter().copied().filter(|s| s.width > 0.0).collect();
        let total = area(&drawn);
        let mut left: Vec<&Segment> =
            segments.iter().copied().filter(|s| is_above(floor, s)).collect();
        let mut found = Vec::new();
        while found.len() < MOST {
            let Some(plane) = largest(&left, floor) else { break };
            let (on, rest): (Vec<&Segment>, Vec<&Segment>) =
                left.into_iter().partition(|s| plane.holds(s));
            if !(area(&on) >= LEAST_SHARE * total) {
                break;
            }
            left = rest;
            let piece = largest_piece(&on, plane.normal);
            if plane.normal.dot(floor.normal) > PARALLEL && area(&piece) >= LEAST_SHARE * total {
                found.push(Self { plane, outline: outline(&piece, plane.normal) });
            }
        }
        found
    }

    /// Whether a superpixel lies above the plane and within its outline.
    pub(crate) fn carries(&self, s: &Segment) -> bool {
        is_above(&self.plane, s) && self.is_within(s)
    }

    /// Whether a superpixel is of the plane.
    pub(crate) fn holds(&self, s: &Segment) -> bool {
        self.plane.holds(s) && self.is_within(s)
    }

    /// Whether a superpixel of the plane faces another way: the foot of something that stands on it.
    pub(crate) fn holds_foot(&self, s: &Segment) -> bool {
        self.holds(s) && !self.plane.is_faced_by(s)
    }

    /// Whether a superpixel is so low above the plane that what it belongs to rests there.
    pub(crate) fn is_near(&self, s: &Segment, sides: f32) -> bool {
        let height = self.plane.height(s.point.into());
        height.abs() < self.plane.reach(sides, s.width) && self.is_within(s)
    }

    fn is_within(&self, s: &Segment) -> bool {
        let p = Vec3::from(s.point);
        self.outline.iter().all(|(d, low, high)| (*low..=*high).contains(&d.dot(p)))
    }
}

/// The largest connected piece of what lies on a plane: what has its height elsewhere is something else.
fn largest_piece<'a>(on: &[&'a Segment], normal: Vec3) -> Vec<&'a Segment> {
    let mut widths: Vec<f32> = on.iter().map(|s| s.width).collect();
    let Some(width) = upper_median(&mut widths, f32::total_cmp) else { return Vec::new() };
    let (u, v) = normal.any_orthonormal_pair();
    let cell_of = |s: &Segment| {
        let at = |axis: Vec3| (axis.dot(s.point.into()) / (CELL * width)).floor() as i32;
        (at(u), at(v))
    };
    let mut left: BTreeMap<(i32, i32), Vec<&Segment>> = BTreeMap::new();
    on.iter().for_each(|s| left.entry(cell_of(s)).or_default().push(s));
    let mut best = Vec::new();
    while let Some((cell, first)) = left.pop_first() {
        let (mut piece, mut open) = (first, vec![cell]);
        while let Some((x, y)) = open.pop() {
            for beside in (-1..=1)
                .flat_map(|i| (-1..=1).map(move |j| (x.saturating_add(i), y.saturating_add(j))))
            {
                if let Some(more) = left.remove(&beside) {
                    piece.extend(more);
                    open.push(beside);
                }
            }
        }
        if area(&piece) > area(&best) {
            best = piece;
        }
    }
    best
}

fn is_above(plane: &SupportPlane, s: &Segment) -> bool {
    s.width > 0.0 && plane.height(s.point.into()) > plane.reach(ABOVE, s.width)
}

/// The plane parallel to the floor that most of the area lies on.
fn largest(left: &[&Segment], floor: &SupportPlane) -> Option<SupportPlane> {
    if left.len() < 3 {
        return None;
    }
    let normal = floor.normal.as_dvec3();
    // Every level is one try; a sample of them is enough, and of what it is judged by.
    let sample: Vec<&Segment> = left.iter().copied().step_by(left.len().div_ceil(2000)).collect();
    let height = |s: &Segment| normal.dot(Vec3::from(s.point).as_dvec3());
    let score = |offset: f64| -> f32 {
        let near = |s: &&Segment| (1.0 - deviation(s, normal, offset, 0.5).powi(2)).max(0.0);
        sample.iter().map(|s| s.area_px * near(s)).sum()
    };
    let tries = sample.iter().step_by(sample.len().div_ceil(400)).map(|s| height(s));
    let tried: Vec<(f32, f64)> = tries.map(|offset| (score(offset), offset)).collect();
    let best = tried.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a })?;
    let (normal, offset, noise) = refined(left, normal, best.1)?;
    let sign = if normal.dot(floor.normal.as_dvec3()) < 0.0 { -1.0 } else { 1.0 };
    let normal: DVec3 = sign * normal;
    let offset = (sign * offset) as f32;
    Some(SupportPlane { normal: normal.as_vec3(), offset, noise: noise as f32 })
}

fn outline(on: &[&Segment], normal: Vec3) -> Vec<(Vec3, f32, f32)> {
    let (u, v) = normal.any_orthonormal_pair();
    let last = on.len().saturating_sub(1);
    let outer = (OUTER * last as f32) as usize;
    (0..DIRECTIONS)
        .map(|k| {
            let (sin, cos) = (std::f32::consts::PI * k as f32 / DIRECTIONS as f32).sin_cos();
            let direction = u * cos + v * sin;
            let mut along: Vec<f32> = on.iter().map(|s| direction.dot(s.point.into())).collect();
            along.sort_unstable_by(f32::total_cmp);
            (direction, along[outer], along[last - outer])
        })
        .collect()
}

#[cfg(test)]
mod tests;
