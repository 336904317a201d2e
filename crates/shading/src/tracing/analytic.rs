//! Spheres and planes by their formulas, in f64: what meshes are compared with.

use glam::{DVec3, Vec3};

use super::{Hit, Ray, Tracer};

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Center, world.
    pub center: DVec3,
    /// Radius, world units.
    pub radius: f64,
}

/// An infinite plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Any point of it.
    pub point: DVec3,
    /// Unit normal.
    pub normal: DVec3,
}

/// Spheres, then planes; the index of a shape counts both.
#[derive(Clone, Debug, Default)]
pub struct Shapes {
    /// Spheres.
    pub spheres: Vec<Sphere>,
    /// Planes.
    pub planes: Vec<Plane>,
}

impl Shapes {
    fn hits(&self, ray: &Ray) -> impl Iterator<Item = (f64, usize, DVec3)> {
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let range = f64::from(ray.t_min)..f64::from(ray.t_max);
        let spheres = self.spheres.iter().enumerate().flat_map(move |(i, s)| {
            let oc = o - s.center;
            // The distance of closest approach, as a vector: no digits lost far away.
            let b = -oc.dot(d);
            let nearest = oc + b * d;
            let half_chord = (s.radius * s.radius - nearest.length_squared()).sqrt();
            [b - half_chord, b + half_chord].map(|t| (t, i, (oc + t * d) / s.radius))
        });
        let first_plane = self.spheres.len();
        let planes = self.planes.iter().enumerate().map(move |(i, p)| {
            ((p.point - o).dot(p.normal) / d.dot(p.normal), first_plane + i, p.normal)
        });
        // Misses are NaN or infinite: in no range.
        spheres.chain(planes).filter(move |(t, ..)| range.contains(t))
    }
}

impl Tracer for Shapes {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let (t, shape, normal) = self.hits(ray).min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Hit {
            distance: t as f32,
            primitive: shape as u32,
            barycentrics: [0.0; 2],
            geometric_normal: normal.as_vec3().normalize_or(Vec3::Z),
        })
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.hits(ray).next().is_some()
    }
}
