//! Triangle meshes under a bounding volume hierarchy.
//!
//! A binary tree by parallel locally ordered clustering and reinsertion (Meister & Bittner 2018,
//! the crate `obvhs`), made eight wide for traversal. Inside, coordinates are centered and scaled by
//! a power of two to a box of about 1000, so that tolerances are far below a triangle whatever unit
//! the world has.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use motes_scene::Surface;
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use thiserror::Error;

use super::wide::{InnerRay, WideTree};
use super::{Hit, Ray, Tracer};

/// Why a mesh cannot be traced.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum MeshError {
    /// A corner that is not a vertex.
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

impl From<&Surface> for TriangleMesh {
    fn from(surface: &Surface) -> Self {
        let vertices = surface.vertices.iter().map(|v| Vec3::from(*v)).collect();
        Self { vertices, triangles: surface.triangles.clone() }
    }
}

impl TriangleMesh {
    /// Layers nearer behind each other than so many times [`Self::roughness`] are one surface, reconstructed twice or torn: see
    /// [`MeshTracer::one_sided_within`].
    pub const LAYERS: f32 = 8.0;

    /// Median length of the first edges of up to 20 000 triangles, world units; 0 without a finite one.
    ///
    /// # Panics
    /// When a triangle refers to a vertex that does not exist.
    pub fn median_edge(&self) -> f32 {
        let step = self.triangles.len().div_ceil(20_000).max(1);
        let mut edges: Vec<f32> = self
            .triangles
            .iter()
            .step_by(step)
            .map(|t| self.vertices[t[0] as usize].distance(self.vertices[t[1] as usize]))
            .filter(|e| e.is_finite())
            .collect();
        edges.sort_by(f32::total_cmp);
        edges.get(edges.len() / 2).copied().unwrap_or(0.0)
    }

    /// Length of the diagonal of the box around its finite vertices, world units; infinite without any.
    pub fn diagonal(&self) -> f32 {
        let finite = self.vertices.iter().filter(|v| v.is_finite());
        let (low, high) =
            finite.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        (high - low).length()
    }

    /// How far off a reconstructed surface may be, world units: half its median edge, at most a thousandth of its diagonal, since
    /// few large triangles say nothing about how fine a mesh is; 0 without a finite extent.
    ///
    /// # Panics
    /// As [`Self::median_edge`].
    pub fn roughness(&self) -> f32 {
        let diagonal = self.diagonal();
        if diagonal.is_finite() { (0.5 * self.median_edge()).min(1e-3 * diagonal) } else { 0.0 }
    }
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
    tree: WideTree,
    /// Unit normals, by index in the mesh.
    normals: Vec<Vec3>,
    center: Vec3,
    scale: f32,
    skipped: usize,
    one_sided_within: f32,
}

impl MeshTracer {
    /// Builds the tree. Triangles without area or with corners that are not finite are skipped and
    /// counted; a mesh without triangles lets every ray pass.
    ///
    /// # Errors
    /// When a triangle refers to a vertex that does not exist.
    pub fn new(mesh: &TriangleMesh, quality: BuildQuality) -> Result<Self, MeshError> {
        Self::of_some(mesh, quality, |_| true)
    }

    /// Of the triangles that `meets` is true for, under the numbers that they have in the mesh.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_some(
        mesh: &TriangleMesh,
        quality: BuildQuality,
        meets: impl Fn(u32) -> bool,
    ) -> Result<Self, MeshError> {
        let corners = gather(mesh)?;
        let wanted: Vec<u32> = (0..corners.len() as u32).filter(|&i| meets(i)).collect();
        let usable: Vec<u32> = wanted
            .iter()
            .copied()
            .filter(|&i| {
                let [a, b, c] = corners[i as usize];
                let finite = a.is_finite() && b.is_finite() && c.is_finite();
                finite && (b - a).as_dvec3().cross((c - a).as_dvec3()).length_squared() > 0.0
            })
            .collect();
        let (center, scale) = frame(usable.iter().flat_map(|&i| corners[i as usize]));
        let inner = |p: Vec3| (p - center) * scale;
        let tree = if usable.is_empty() {
            WideTree::default()
        } else {
            let parameters = match quality {
                BuildQuality::Fast => BvhBuildParams::fast_build(),
                BuildQuality::Balanced => BvhBuildParams::medium_build(),
                BuildQuality::High => BvhBuildParams::slow_build(),
            };
            // The wide tree fills its own leaves.
            let parameters = BvhBuildParams { max_prims_per_leaf: 1, ..parameters };
            // Boxes go before the wide tree comes, and triangles come one by one: all at once take more than the tree itself.
            let boxes: Vec<Padded> =
                usable.iter().map(|&i| Padded::around(corners[i as usize].map(inner))).collect();
            let binary = build_bvh2(&boxes, parameters, &mut Duration::default());
            drop(boxes);
            WideTree::new(&binary, |k| {
                let i = usable[k as usize];
                (corners[i as usize].map(inner), i)
            })
        };
        let normal = |[a, b, c]: &[Vec3; 3]| {
            (*b - *a).as_dvec3().cross((*c - *a).as_dvec3()).normalize_or_zero().as_vec3()
        };
        let normals = corners.iter().map(normal).collect();
        let skipped = wanted.len() - usable.len();
        Ok(Self { tree, normals, center, scale, skipped, one_sided_within: 0.0 })
    }

    /// Lets rays pass that start less than `distance` (world units) behind a triangle, on the side that its normal turns away from.
    ///
    /// A ray that leaves a closed surface meets the front of others. A back so near belongs to a second layer of a surface that was
    /// reconstructed twice, or to its torn rim, and would throw a shadow onto the first.
    pub fn one_sided_within(self, distance: f32) -> Self {
        Self { one_sided_within: distance.max(0.0), ..self }
    }

    /// Triangles that no ray can meet: without area, or not finite.
    pub fn skipped(&self) -> usize {
        self.skipped
    }

    /// Unit normal of a triangle by the order of its corners; 0 without area.
    ///
    /// # Panics
    /// When the mesh has no such triangle.
    #[inline]
    pub fn geometric_normal(&self, triangle: u32) -> Vec3 {
        self.normals[triangle as usize]
    }

    #[inline]
    fn inner(&self, ray: &Ray) -> Option<InnerRay> {
        let usable = ray.origin.is_finite() && ray.direction.is_finite() && ray.t_min < ray.t_max;
        (usable && !self.tree.is_empty()).then(|| InnerRay {
            origin: (ray.origin - self.center) * self.scale,
            direction: ray.direction,
            t_min: ray.t_min * self.scale,
            t_max: ray.t_max * self.scale,
            one_sided_within: self.one_sided_within * self.scale,
        })
    }
}

impl Tracer for MeshTracer {
    #[inline]
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.tree.nearest(&self.inner(ray)?)?;
        Some(Hit {
            distance: hit.distance / self.scale,
            primitive: hit.index,
            barycentrics: hit.weights,
            geometric_normal: self.normals[hit.index as usize],
        })
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        self.inner(ray).is_some_and(|ray| self.tree.occluded(&ray))
    }
}

/// Boxes reach this far over their triangle: four times the rounding of a slab test at the far
/// end of the scene.
const PADDING: f32 = 5e-4;

/// Box around a triangle, internal coordinates.
struct Padded(Aabb);

impl Padded {
    fn around(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners.map(Vec3A::from);
        Self(Aabb { min: a.min(b).min(c) - PADDING, max: a.max(b).max(c) + PADDING })
    }
}

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
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

/// Center of the box of `points`, and the power of two that makes it about 1000 long.
fn frame(points: impl Iterator<Item = Vec3>) -> (Vec3, f32) {
    let (low, high) = points
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let length = (high - low).max_element();
    if !(length > 0.0 && length.is_finite()) {
        return (Vec3::ZERO, 1.0);
    }
    (0.5 * low + 0.5 * high, (1000.0 / length).log2().round().clamp(-100.0, 100.0).exp2())
}
