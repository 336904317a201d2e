//! What a ray meets: an interface, triangle meshes, and analytic shapes as ground truth.

mod analytic;
mod mesh;
mod offset;
mod packet;
mod wide;

use glam::Vec3;

pub use analytic::{Plane, Shapes, Sphere};
pub use mesh::{BuildQuality, MeshError, MeshTracer, TriangleMesh};
pub use offset::offset_origin;

/// A half-open piece of a line: points `origin + t direction` with `t_min <= t < t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, world.
    pub origin: Vec3,
    /// Unit vector, world.
    pub direction: Vec3,
    /// Nearer hits do not count; world units, not negative.
    pub t_min: f32,
    /// Farther hits do not count; may be infinite.
    pub t_max: f32,
}

impl Ray {
    /// A ray without an end.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// The point at distance `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// What a ray met first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, world units.
    pub distance: f32,
    /// Index of the triangle in the mesh as it was given, or of the shape.
    pub primitive: u32,
    /// Weights of the second and third corner of a triangle; 0 for shapes.
    pub barycentrics: [f32; 2],
    /// Unit normal of the surface, world; for a triangle by the order of its corners.
    pub geometric_normal: Vec3,
}

/// Geometry that rays can meet. Rays with a part that is not finite, other than `t_max`, meet nothing.
pub trait Tracer: Sync {
    /// The nearest surface.
    fn closest_hit(&self, ray: &Ray) -> Option<Hit>;

    /// Whether there is any surface: cheaper than the nearest one.
    fn occluded(&self, ray: &Ray) -> bool;
}

/// Nothing at all: every ray escapes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Empty;

impl Tracer for Empty {
    fn closest_hit(&self, _: &Ray) -> Option<Hit> {
        None
    }

    fn occluded(&self, _: &Ray) -> bool {
        false
    }
}
