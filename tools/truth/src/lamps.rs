//! Light sources inside a scene: light that is not at infinity.

use std::f32::consts::{PI, TAU};

use glam::Vec3;
use motes_shading::tracing::TriangleMesh;

use crate::shapes::{Shape, SmoothMesh, vertex_normals};

/// A diffuse emitter of one radiance.
#[derive(Clone, Copy, Debug)]
pub struct Lamp {
    /// Name in the documents.
    pub name: &'static str,
    /// Where it is and how large.
    pub shape: LampShape,
    /// Linear.
    pub radiance: Vec3,
}

/// Lengths as the scene's.
#[derive(Clone, Copy, Debug)]
pub enum LampShape {
    /// A sphere.
    Ball {
        /// Middle.
        center: Vec3,
        /// Radius.
        radius: f32,
    },
    /// A parallelogram that shines where `along` x `up` points.
    Pane {
        /// A corner.
        corner: Vec3,
        /// One side.
        along: Vec3,
        /// The other.
        up: Vec3,
    },
}

/// A point of a lamp.
#[derive(Clone, Copy, Debug)]
pub struct LampPoint {
    /// Where.
    pub position: Vec3,
    /// Unit, toward what it shines at.
    pub normal: Vec3,
    /// Area of the lamp: one over the density of its points.
    pub area: f32,
}

/// Triangles of a ball are inside it: shadow rays to its points end this share before them.
pub const SHORT: f32 = 0.02;

impl Lamp {
    /// In world units.
    pub fn placed(self, unit: f32, origin: Vec3) -> Self {
        let shape = match self.shape {
            LampShape::Ball { center, radius } => {
                LampShape::Ball { center: center * unit + origin, radius: radius * unit }
            }
            LampShape::Pane { corner, along, up } => LampShape::Pane {
                corner: corner * unit + origin,
                along: along * unit,
                up: up * unit,
            },
        };
        Self { shape, ..self }
    }

    /// A point, spread evenly over the area, from two numbers in [0, 1).
    pub fn point(&self, u: [f32; 2]) -> LampPoint {
        match self.shape {
            LampShape::Ball { center, radius } => {
                let z = 1.0 - 2.0 * u[0];
                let (sin, cos) = (TAU * u[1]).sin_cos();
                let r = (1.0 - z * z).max(0.0).sqrt();
                let normal = Vec3::new(r * cos, r * sin, z);
                LampPoint {
                    position: center + normal * radius,
                    normal,
                    area: 4.0 * PI * radius * radius,
                }
            }
            LampShape::Pane { corner, along, up } => {
                let across = along.cross(up);
                LampPoint {
                    position: corner + along * u[0] + up * u[1],
                    normal: across.normalize_or(Vec3::Z),
                    area: across.length(),
                }
            }
        }
    }

    /// What rays meet.
    pub fn mesh(&self) -> SmoothMesh {
        match self.shape {
            LampShape::Ball { center, radius } => {
                let axes = Vec3::splat(radius);
                let ball = Shape::Superquadric { axes, vertical: 1.0, horizontal: 1.0 };
                let mut smooth = ball.mesh(24);
                smooth.mesh.vertices.iter_mut().for_each(|v| *v += center);
                smooth
            }
            LampShape::Pane { corner, along, up } => parallelogram(corner, along, up),
        }
    }
}

/// Two triangles whose front is where `along` x `up` points.
pub fn parallelogram(corner: Vec3, along: Vec3, up: Vec3) -> SmoothMesh {
    let vertices = vec![corner, corner + along, corner + along + up, corner + up];
    let mesh = TriangleMesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] };
    let normals = vertex_normals(&mesh);
    SmoothMesh { mesh, normals }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_lamp_lie_on_it_and_face_away_from_its_middle() {
        let ball = LampShape::Ball { center: Vec3::X, radius: 0.5 };
        let pane = LampShape::Pane { corner: Vec3::ZERO, along: Vec3::X * 2.0, up: Vec3::Y * 3.0 };
        let lamp = |shape| Lamp { name: "lamp", shape, radiance: Vec3::ONE }.placed(2.0, Vec3::Z);
        for i in 0..16u8 {
            let u = [f32::from(i % 4) / 4.0, f32::from(i / 4) / 4.0];
            let p = lamp(ball).point(u);
            assert!(((p.position - Vec3::new(2.0, 0.0, 1.0)).length() - 1.0).abs() < 1e-5);
            assert!((p.area - 4.0 * PI).abs() < 1e-4);
            let p = lamp(pane).point(u);
            assert!(p.position.z == 1.0 && p.normal == Vec3::Z && (p.area - 24.0).abs() < 1e-4);
        }
    }
}
