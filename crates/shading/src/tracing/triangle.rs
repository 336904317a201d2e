//! A triangle and a ray, without cracks between neighbours.
//!
//! The sign of `D · ((a - b) × (a + b))` says on which side of the edge `ab` a ray through the
//! coordinate origin passes (Plücker; Davidovič et al. 2012). For the triangle across the edge
//! the same numbers come out with the opposite sign, rounding included, but round a corner all
//! signs may round the same way. So edges are widened by the rounding of that product: a leak
//! would put sunlight into a shadow, a double hit changes nothing.

use glam::Vec3;

/// Rounding of the product of an edge and two distances, as a part of it; at most 12 half
/// units in the last place.
const ROUNDING: f32 = 4e-7;

/// Three corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    corners: [Vec3; 3],
    /// Longest edge times the rounding.
    slack: f32,
    /// Index in the mesh.
    pub(super) index: u32,
}

impl Triangle {
    pub(super) fn new(corners: [Vec3; 3], index: u32) -> Self {
        let [a, b, c] = corners;
        let longest = (a - b).length().max((b - c).length()).max((c - a).length());
        Self { corners, slack: ROUNDING * longest, index }
    }

    /// Distance and weights of the second and third corner, if `t_min <= t < t_max`; either side
    /// counts. A triangle seen edge-on, to rounding, is missed.
    #[inline(always)]
    pub(super) fn intersect(
        &self,
        origin: Vec3,
        direction: Vec3,
        t_min: f32,
        t_max: f32,
    ) -> Option<(f32, [f32; 2])> {
        let [a, b, c] = self.corners.map(|p| p - origin);
        let (ca, ab, bc) = (c - a, a - b, b - c);
        let u = ca.cross(c + a).dot(direction);
        let v = ab.cross(a + b).dot(direction);
        let w = bc.cross(b + c).dot(direction);
        let slack = self.slack * a.abs().max(b.abs()).max(c.abs()).max_element();
        let sum = u + v + w;
        let inside = u.min(v).min(w) >= -slack || u.max(v).max(w) <= slack;
        if !(inside && sum.abs() > 4.0 * slack) {
            return None;
        }
        let normal = ab.cross(ca);
        let t = a.dot(normal) / direction.dot(normal);
        (t >= t_min && t < t_max).then(|| (t, [u / sum, v / sum]))
    }

    /// Right-handed normal, not normalised.
    pub(super) fn normal(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }
}
