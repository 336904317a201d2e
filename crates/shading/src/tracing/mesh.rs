//! Triangle meshes under a bounding volume hierarchy.
//!
//! The tree is `obvhs`' eight-wide compressed one (Ylitie, Karras & Laine 2017), built by
//! parallel locally ordered clustering and reinsertion (Meister & Bittner). Inside, coordinates
//! are centred and scaled by a power of two to a box of about 1000, where the tree's fixed tolerances
//! are far below a triangle whatever unit the world has.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::RayHit;
use obvhs::{Boundable, BvhBuildParams};
use thiserror::Error;

use super::triangle::Triangle;
use super::{Hit, Ray, Tracer};

/// Why a mesh cannot be traced.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum MeshError {
    /// A corner that is no vertex.
    #[error("triangle {triangle} refers to vertex {vertex}, the mesh has {vertices}")]
    Index {
        /// Which triangle.
        triangle: usize,
        /// Its corner.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// More than the tree can number.
    #[error("{0} triangles are more than a tree can hold (2^30)")]
    TooMany(usize),
}

/// Triangles that share vertices.
#[derive(Clone, Debug, Default)]
pub struct TriangleMesh {
    /// Positions, world.
    pub vertices: Vec<Vec3>,
    /// Three vertices each; the normal follows the right-hand rule.
    pub triangles: Vec<[u32; 3]>,
}

/// How much time goes into the tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildQuality {
    /// For meshes that change every few rays.
    Fast,
    /// Default.
    #[default]
    Balanced,
    /// More reinsertion; for many rays.
    High,
}

/// A mesh that rays can meet.
#[derive(Clone, Debug)]
pub struct MeshTracer {
    tree: CwBvh,
    /// In the order of the leaves, internal coordinates.
    triangles: Vec<Triangle>,
    centre: Vec3,
    scale: f32,
    skipped: usize,
}

impl MeshTracer {
    /// Builds the tree. Triangles without area or with corners that are not finite are skipped and
    /// counted; a mesh without triangles lets every ray pass.
    ///
    /// # Errors
    /// When a triangle refers to a vertex that does not exist.
    pub fn new(mesh: &TriangleMesh, quality: BuildQuality) -> Result<Self, MeshError> {
        let corners = gather(mesh)?;
        let usable: Vec<u32> = (0..corners.len() as u32)
            .filter(|&i| {
                let [a, b, c] = corners[i as usize];
                let finite = a.is_finite() && b.is_finite() && c.is_finite();
                finite && (b - a).as_dvec3().cross((c - a).as_dvec3()).length_squared() > 0.0
            })
            .collect();
        let (centre, scale) = frame(usable.iter().flat_map(|&i| corners[i as usize]));
        let inner = |p: Vec3| (p - centre) * scale;
        let boxes: Vec<Padded> = usable
            .iter()
            .map(|&i| Padded(corners[i as usize].map(|p| Vec3A::from(inner(p)))))
            .collect();
        let tree = if boxes.is_empty() {
            CwBvh::default()
        } else {
            let parameters = match quality {
                BuildQuality::Fast => BvhBuildParams::fast_build(),
                BuildQuality::Balanced => BvhBuildParams::medium_build(),
                BuildQuality::High => BvhBuildParams::slow_build(),
            };
            build_cwbvh(&boxes, parameters, &mut Duration::default())
        };
        let triangles = tree
            .primitive_indices
            .iter()
            .map(|&i| {
                let index = usable[i as usize];
                Triangle::new(corners[index as usize].map(inner), index)
            })
            .collect();
        let skipped = corners.len() - usable.len();
        Ok(Self { tree, triangles, centre, scale, skipped })
    }

    /// Triangles that no ray can meet: without area, or not finite.
    pub fn skipped(&self) -> usize {
        self.skipped
    }

    #[inline]
    fn inner(&self, ray: &Ray) -> Option<obvhs::ray::Ray> {
        let usable = ray.origin.is_finite() && ray.direction.is_finite() && ray.t_min < ray.t_max;
        (usable && !self.triangles.is_empty()).then(|| {
            obvhs::ray::Ray::new(
                Vec3A::from((ray.origin - self.centre) * self.scale),
                // The tree takes -0 for positive and divides by it as negative; + 0 makes it +0.
                Vec3A::from(ray.direction + Vec3::ZERO),
                ray.t_min * self.scale,
                ray.t_max * self.scale,
            )
        })
    }
}

impl Tracer for MeshTracer {
    #[inline]
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let inner = self.inner(ray)?;
        let (origin, direction) = (Vec3::from(inner.origin), Vec3::from(inner.direction));
        let mut weights = [0.0; 2];
        let mut hit = RayHit::none();
        self.tree.ray_traverse(inner, &mut hit, |ray, i| {
            match self.triangles[i].intersect(origin, direction, ray.tmin, ray.tmax) {
                Some((t, w)) => {
                    weights = w;
                    t
                }
                None => f32::INFINITY,
            }
        });
        if !(hit.t < f32::INFINITY) {
            return None;
        }
        let triangle = &self.triangles[hit.primitive_id as usize];
        Some(Hit {
            distance: hit.t / self.scale,
            primitive: triangle.index,
            barycentrics: weights,
            geometric_normal: triangle.normal().normalize_or(-ray.direction),
        })
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        let Some(inner) = self.inner(ray) else {
            return false;
        };
        let (origin, direction) = (Vec3::from(inner.origin), Vec3::from(inner.direction));
        !self.tree.ray_traverse_miss(inner, |ray, i| {
            self.triangles[i]
                .intersect(origin, direction, ray.tmin, ray.tmax)
                .map_or(f32::INFINITY, |(t, _)| t)
        })
    }
}

/// Boxes reach this far over their triangle: the tree's slab tests round by a quarter of it,
/// and a box without thickness would be missed.
const PADDING: f32 = 5e-4;

/// Corners of a triangle, internal coordinates.
struct Padded([Vec3A; 3]);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        let [a, b, c] = self.0;
        Aabb { min: a.min(b).min(c) - PADDING, max: a.max(b).max(c) + PADDING }
    }
}

fn gather(mesh: &TriangleMesh) -> Result<Vec<[Vec3; 3]>, MeshError> {
    if mesh.triangles.len() > 1 << 30 {
        return Err(MeshError::TooMany(mesh.triangles.len()));
    }
    let vertices = mesh.vertices.len();
    let corner = |triangle: usize, vertex: u32| {
        let position = mesh.vertices.get(vertex as usize).copied();
        position.ok_or(MeshError::Index { triangle, vertex, vertices })
    };
    let of =
        |(i, t): (usize, &[u32; 3])| Ok([corner(i, t[0])?, corner(i, t[1])?, corner(i, t[2])?]);
    mesh.triangles.iter().enumerate().map(of).collect()
}

/// Centre of the box of `points`, and the power of two that makes it about 1000 long.
fn frame(points: impl Iterator<Item = Vec3>) -> (Vec3, f32) {
    let (low, high) = points
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let length = (high - low).max_element();
    if !(length > 0.0 && length.is_finite()) {
        return (Vec3::ZERO, 1.0);
    }
    (0.5 * low + 0.5 * high, (1000.0 / length).log2().round().clamp(-100.0, 100.0).exp2())
}
