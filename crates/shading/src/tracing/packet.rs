//! Eight triangles and one ray, without cracks between neighbors.
//!
//! The sign of `D · ((a - b) × (a + b))` says on which side of the edge `ab` a ray through the
//! coordinate origin passes (Plücker; Davidovič et al. 2012). For the triangle across the edge
//! the same numbers come out with the opposite sign, rounding included, but round a corner all
//! signs may round the same way. So edges are widened by the rounding of that product: a leak
//! would put sunlight into a shadow, a double hit changes nothing.

use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;

use super::wide::InnerRay;

/// Triangles of a packet: the lanes of a vector.
pub(super) const LANES: usize = 8;
/// Rounding of the product of an edge and two distances, as a part of it; at most 12 half
/// units in the last place.
const ROUNDING: f32 = 4e-7;

/// Up to eight triangles; empty lanes have no extent and are never met.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Packet {
    /// `[corner][axis][lane]`.
    corners: [[[f32; LANES]; 3]; 3],
    /// Longest edge times the rounding.
    slack: [f32; LANES],
    /// Index in the mesh.
    pub(super) index: [u32; LANES],
}

/// What a packet answers: lanes that were met, their distances and the weights of the second and
/// third corner.
pub(super) struct Met {
    pub(super) lanes: u32,
    pub(super) distance: [f32; LANES],
    pub(super) weights: [[f32; LANES]; 2],
}

type Lanes3<S> = [f32x8<S>; 3];

#[inline(always)]
fn subtract<S: Simd>(a: Lanes3<S>, b: Lanes3<S>) -> Lanes3<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn add<S: Simd>(a: Lanes3<S>, b: Lanes3<S>) -> Lanes3<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn cross<S: Simd>(a: Lanes3<S>, b: Lanes3<S>) -> Lanes3<S> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn dot<S: Simd>(a: Lanes3<S>, b: Lanes3<S>) -> f32x8<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn farthest<S: Simd>(a: Lanes3<S>) -> f32x8<S> {
    a[0].abs().max(a[1].abs()).max(a[2].abs())
}

impl Packet {
    /// Of corners and indices, at most eight.
    pub(super) fn new(triangles: &[([Vec3; 3], u32)]) -> Self {
        assert!(triangles.len() <= LANES, "{} triangles", triangles.len());
        let mut packet =
            Self { corners: [[[0.0; LANES]; 3]; 3], slack: [0.0; LANES], index: [u32::MAX; LANES] };
        for (lane, ([a, b, c], index)) in triangles.iter().enumerate() {
            for (k, corner) in [a, b, c].into_iter().enumerate() {
                for axis in 0..3 {
                    packet.corners[k][axis][lane] = corner[axis];
                }
            }
            let longest = (*a - *b).length().max((*b - *c).length()).max((*c - *a).length());
            packet.slack[lane] = ROUNDING * longest;
            packet.index[lane] = *index;
        }
        packet
    }

    /// Which triangles a ray meets at `ray.t_min <= t < t_max`. Either side counts, except where the origin lies
    /// less than `ray.one_sided_within` behind a triangle. A triangle seen edge-on, to rounding, is missed.
    #[inline(always)]
    pub(super) fn meet<S: Simd>(&self, simd: S, ray: &InnerRay, t_max: f32) -> Met {
        let InnerRay { origin, direction, t_min, .. } = *ray;
        let splat = |v: f32| f32x8::splat(simd, v);
        let o = [splat(origin.x), splat(origin.y), splat(origin.z)];
        let d = [splat(direction.x), splat(direction.y), splat(direction.z)];
        let load = |k: usize| {
            let [x, y, z] = &self.corners[k];
            [f32x8::from_slice(simd, x), f32x8::from_slice(simd, y), f32x8::from_slice(simd, z)]
        };
        let a = subtract(load(0), o);
        let b = subtract(load(1), o);
        let c = subtract(load(2), o);
        let (ca, ab, bc) = (subtract(c, a), subtract(a, b), subtract(b, c));
        let u = dot(cross(ca, add(c, a)), d);
        let v = dot(cross(ab, add(a, b)), d);
        let w = dot(cross(bc, add(b, c)), d);
        let reach = farthest(a).max(farthest(b)).max(farthest(c));
        let slack = f32x8::from_slice(simd, &self.slack) * reach;
        let sum = u + v + w;
        let inside = u.min(v).min(w).simd_ge(-slack) | u.max(v).max(w).simd_le(slack);
        let normal = cross(ab, ca);
        let height = dot(a, normal);
        let t = height / dot(d, normal);
        let met = inside
            & sum.abs().simd_gt(slack * 4.0)
            & t.simd_ge(splat(t_min))
            & t.simd_lt(splat(t_max));
        let mut out = Met {
            lanes: met.to_bitmask() as u32,
            distance: [0.0; LANES],
            weights: [[0.0; LANES]; 2],
        };
        if out.lanes != 0 {
            // `normal` is against the order of the corners, so heights below 0 are those of origins behind.
            let reach = splat(ray.one_sided_within);
            let is_near = (height * height).simd_lt(reach * reach * dot(normal, normal));
            let passes = is_near & height.simd_lt(splat(0.0));
            out.lanes &= !(passes.to_bitmask() as u32);
            t.store_slice(&mut out.distance);
            (u / sum).store_slice(&mut out.weights[0]);
            (v / sum).store_slice(&mut out.weights[1]);
        }
        out
    }
}
