//! Surfaces that shine: light that is near.
//!
//! ```text
//! L_emitted(x, w_o) = ∫ f_r(w, w_o) (n · w)⁺ L_e(y) V(x, y) |n_y · w| / |x - y|² dA(y)
//! ```
//!
//! Triangles of a mesh send the same radiance in all directions, from both sides: of a lamp that is seen from above only the upper
//! half is there, and the light that it sends down comes out of it all the same. A point on them is drawn by
//! `p(y) = P(triangle) / area`, with `P` in proportion to power (Shirley, Wang & Zimmerman 1996), which as a density of
//! directions is `p(w) = p(y) |x - y|² / |n_y · w|`.

use glam::Vec3;
use motes_math::luminance::luminance;

use crate::alias::AliasTable;
use crate::sampling::unit_f32;
use crate::tracing::{Ray, TriangleMesh, offset_origin};

/// Marks a triangle that does not shine.
const DARK: u32 = u32::MAX;

/// Triangles of a mesh that shine.
#[derive(Clone, Debug)]
pub struct Emitters {
    triangles: Vec<Emitter>,
    table: AliasTable,
    /// Per triangle of the mesh.
    of_primitive: Vec<u32>,
}

/// A triangle that shines.
#[derive(Clone, Copy, Debug)]
struct Emitter {
    corner: Vec3,
    sides: [Vec3; 2],
    normal: Vec3,
    radiance: Vec3,
    /// Of a point, per area.
    density: f32,
}

/// A direction toward an emitter.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSample {
    /// Unit vector toward the point on the emitter, world.
    pub to_light: Vec3,
    /// How far it is, world units.
    pub distance: f32,
    /// What it sends, linear.
    pub radiance: Vec3,
    /// Density of the direction, per steradian, over all emitters.
    pub pdf: f32,
}

/// Shadow rays end this share of their length before the emitter: its own bumps must not hide it.
const SHORT: f32 = 0.02;

impl EmitterSample {
    /// The ray that is blocked where something hides the sample from a point of a surface; `bias` is how far rays start off
    /// the surface, world units.
    #[inline]
    pub fn shadow_ray(&self, position: Vec3, geometric_normal: Vec3, bias: f32) -> Ray {
        let origin = offset_origin(position, geometric_normal, self.to_light, bias);
        Ray { t_max: self.distance * (1.0 - SHORT) - bias, ..Ray::new(origin, self.to_light) }
    }
}

impl Emitters {
    /// Triangles of `mesh` whose three corners have an `emission` above 0, `[V]`, linear radiance; each sends the mean of
    /// its corners. None where nothing shines.
    pub fn new(mesh: &TriangleMesh, emission: &[Vec3]) -> Option<Self> {
        let shines = |v: u32| emission.get(v as usize).is_some_and(|e| e.max_element() > 0.0);
        let mut of_primitive = vec![DARK; mesh.triangles.len()];
        let (mut triangles, mut powers) = (Vec::new(), Vec::new());
        for (primitive, corners) in mesh.triangles.iter().enumerate() {
            if !corners.iter().all(|&v| shines(v)) {
                continue;
            }
            let [a, b, c] = corners.map(|v| mesh.vertices[v as usize]);
            let sides = [b - a, c - a];
            let across = sides[0].cross(sides[1]);
            let area = 0.5 * across.length();
            let radiance = corners.iter().map(|&v| emission[v as usize]).sum::<Vec3>() / 3.0;
            if !(area > 0.0 && area.is_finite() && radiance.is_finite()) {
                continue;
            }
            of_primitive[primitive] = triangles.len() as u32;
            powers.push(area * luminance(radiance).max(1e-9));
            let (normal, density) = (across / (2.0 * area), 1.0 / area);
            triangles.push(Emitter { corner: a, sides, normal, radiance, density });
        }
        let table = AliasTable::new(&powers)?;
        let total: f64 = powers.iter().map(|&p| f64::from(p)).sum();
        for (triangle, power) in triangles.iter_mut().zip(&powers) {
            triangle.density *= (f64::from(*power) / total) as f32;
        }
        Some(Self { triangles, table, of_primitive })
    }

    /// Number of triangles that shine.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Never: without a triangle that shines there are no emitters.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// What a triangle of the mesh sends, linear; 0 where it is dark.
    #[inline]
    pub fn radiance(&self, primitive: u32) -> Vec3 {
        match self.of_primitive.get(primitive as usize) {
            Some(&e) if e != DARK => self.triangles[e as usize].radiance,
            _ => Vec3::ZERO,
        }
    }

    /// Whether this triangle of the mesh shines.
    #[inline]
    pub fn shines(&self, primitive: u32) -> bool {
        self.of_primitive.get(primitive as usize).is_some_and(|&e| e != DARK)
    }

    /// What a triangle of the mesh sends against the unit vector `toward` it, and the density with which [`Self::sample`]
    /// draws that direction from `distance` away, per steradian; none where it is dark or seen edge-on.
    #[inline]
    pub fn radiance_pdf(&self, primitive: u32, toward: Vec3, distance: f32) -> Option<(Vec3, f32)> {
        let emitter = match self.of_primitive.get(primitive as usize) {
            Some(&e) if e != DARK => &self.triangles[e as usize],
            _ => return None,
        };
        let cosine = emitter.normal.dot(toward).abs();
        let pdf = emitter.density * distance * distance / cosine;
        (cosine > 0.0 && pdf.is_finite()).then_some((emitter.radiance, pdf))
    }

    /// A direction from `position` toward an emitter; `u` are fractions of 2³². None where the point drawn is seen
    /// edge-on.
    #[inline]
    pub fn sample(&self, position: Vec3, u: [u32; 3]) -> Option<EmitterSample> {
        let emitter = &self.triangles[self.table.pick(u[0])];
        // Evenly over the triangle: Turk 1990.
        let root = unit_f32(u[1]).sqrt();
        let (s, t) = (root * (1.0 - unit_f32(u[2])), root * unit_f32(u[2]));
        let offset = emitter.corner + emitter.sides[0] * s + emitter.sides[1] * t - position;
        let distance = offset.length();
        let to_light = offset / distance;
        let cosine = emitter.normal.dot(to_light).abs();
        let pdf = emitter.density * distance * distance / cosine;
        let usable = cosine > 0.0 && pdf > 0.0 && pdf.is_finite();
        usable.then_some(EmitterSample { to_light, distance, radiance: emitter.radiance, pdf })
    }
}
