//! What matter that left hid from all sides.
//!
//! A scene does not say where its cameras were, but where a body shut out nearly the whole sky no camera saw anything:
//! under a box, inside of a boulder. What a splat holds there was never compared with a photo.

use std::f32::consts::TAU;
use std::num::NonZero;

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use motes_scene::Surface;
use motes_shading::tracing::{BuildQuality, MeshTracer, Ray, Tracer as _, TriangleMesh};
use relight::RelightScene;

/// Directions over the half of the sphere around the normal, as dense as the cosine: few cameras look along the ground, and
/// the surface of an object ends a little above it.
const DIRECTIONS: usize = 64;
/// A point is hidden when no more of them reach past what left: under a round table, farther from its edge than 1.4 times its
/// height. Where less light than that came in, a splat holds little but what the object threw back, and dividing by so
/// little light makes stains of it.
const MOST_OPEN: usize = 22;
/// A Gaussian belongs to a surface that is nearer than this many half edges of the mesh.
const ORPHAN_REACH: f32 = 6.0;

/// The triangles that left.
pub(super) struct Cover {
    tracer: MeshTracer,
    low: Vec3,
    high: Vec3,
    /// Rays start this far off a point, world units.
    bias: f32,
}

impl Cover {
    /// Of the triangles that have a corner which left; none when nothing did.
    pub(super) fn new(before: &RelightScene, left: impl Fn(u32) -> bool) -> Option<Self> {
        let surface = before.surface();
        let touched = |corners: &&[u32; 3]| corners.iter().any(|v| left(*v));
        let triangles: Vec<[u32; 3]> = surface.triangles.iter().filter(touched).copied().collect();
        let vertices: Vec<Vec3> = surface.vertices.iter().map(|v| Vec3::from(*v)).collect();
        let corners = triangles.iter().flatten().map(|v| vertices[*v as usize]);
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        corners.filter(|p| p.is_finite()).for_each(|p| (low, high) = (low.min(p), high.max(p)));
        let mesh = TriangleMesh { vertices, triangles };
        let tracer = MeshTracer::new(&mesh, BuildQuality::Balanced).ok()?;
        low.cmple(high).all().then(|| Self { tracer, low, high, bias: before.ray_bias() })
    }

    /// Whether what left hid a point from nearly everywhere on the side of `normal`.
    pub(super) fn hides(&self, p: Vec3, normal: Vec3) -> bool {
        // Far beyond the foot of a mesh, which often ends above the ground since no camera saw it, nothing is asked.
        if !self.is_near(p, 0.5 * (self.high - self.low).length()) {
            return false;
        }
        let (u, v) = normal.any_orthonormal_pair();
        let mut open = 0;
        for d in 0..DIRECTIONS {
            let r = ((d as f32 + 0.5) / DIRECTIONS as f32).sqrt();
            let z = (1.0 - r * r).max(0.0).sqrt();
            // The golden section spreads points evenly (Vogel 1979).
            let (sin, cos) = (TAU * (d as f32 * 0.618_034).fract()).sin_cos();
            let direction = u * (r * cos) + v * (r * sin) + normal * z;
            let ray = Ray { t_min: self.bias, ..Ray::new(p, direction) };
            open += usize::from(!self.tracer.occluded(&ray));
            if open > MOST_OPEN {
                return false;
            }
        }
        true
    }

    /// Whether what left was straight above a point.
    pub(super) fn is_over(&self, p: Vec3, up: Vec3) -> bool {
        self.tracer.occluded(&Ray { t_min: 1e-3 * self.bias, ..Ray::new(p, up) })
    }

    /// Whether a point is close to what left.
    fn is_near(&self, p: Vec3, margin: f32) -> bool {
        let margin = Vec3::splat(margin);
        p.cmpge(self.low - margin).all() && p.cmple(self.high + margin).all()
    }
}

/// Gaussians that belong to what left although nobody selected them: close to its surface and to no other.
#[derive(Debug)]
pub(super) struct Orphans {
    left: ImmutableKdTree<f32, 3>,
    stayed: Option<ImmutableKdTree<f32, 3>>,
    reach: f32,
}

impl Orphans {
    /// By the vertices that left and those that stayed.
    pub(super) fn new(
        cover: &Cover,
        surface: &Surface,
        left: impl Fn(u32) -> bool,
        stayed: impl Fn(u32) -> bool,
    ) -> Option<Self> {
        let reach = ORPHAN_REACH * cover.bias;
        let tree = |wanted: &dyn Fn(u32) -> bool| {
            let points: Vec<[f32; 3]> = (0..surface.vertices.len() as u32)
                .filter(|v| wanted(*v))
                .map(|v| surface.vertices[v as usize])
                .filter(|p| cover.is_near(Vec3::from(*p), 4.0 * reach))
                .collect();
            if points.is_empty() { None } else { ImmutableKdTree::new_from_slice(&points).ok() }
        };
        Some(Self { left: tree(&left)?, stayed: tree(&stayed), reach })
    }

    /// Whether a point is one.
    pub(super) fn contains(&self, p: Vec3) -> bool {
        let distance = |tree: &ImmutableKdTree<f32, 3>| {
            let found = tree
                .query(&p.to_array())
                .nearest_n::<SquaredEuclidean<f32>>(NonZero::<usize>::MIN)
                .execute();
            found.first().map_or(f32::INFINITY, |n| n.distance.sqrt())
        };
        if !p.is_finite() {
            return false;
        }
        let left = distance(&self.left);
        left <= self.reach
            && self.stayed.as_ref().map_or(f32::INFINITY, distance) > self.reach.max(2.0 * left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_what_is_under_a_wide_table_is_hidden() {
        let under_table = |half: f32| {
            let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
            let vertices = corners.map(|(x, y)| Vec3::new(x, y, 1.0)).to_vec();
            let (low, high) = (vertices[0], vertices[2]);
            let mesh = TriangleMesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] };
            let tracer = MeshTracer::new(&mesh, BuildQuality::Balanced).unwrap();
            let cover = Cover { tracer, low, high, bias: 0.01 };
            [0.0, 0.9 * half].map(|x| cover.hides(Vec3::new(x, 0.0, 0.01), Vec3::Z))
        };
        // A fifth of what a lamp in all the sky sends gets under the wider one, nearly half under the other.
        assert_eq!(under_table(2.0), [true, false]);
        assert_eq!(under_table(1.0), [false, false]);
    }
}
