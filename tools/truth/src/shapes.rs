//! Closed surfaces from their parameters, as meshes with smooth normals.

use std::f32::consts::{PI, TAU};

use glam::{Quat, Vec3};
use motes_math::rng::keyed_rng;
use motes_shading::tracing::TriangleMesh;
use rand::RngExt;

use crate::texture::fractal;

/// A shape about the origin, about one unit large.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// `|x|^(2/e) ...`: exponents of the vertical and the horizontal profile; 1 a sphere, 0.3 a
    /// rounded cube, above 1 pinched (Barr 1981).
    Superquadric {
        /// Half axes.
        axes: Vec3,
        /// Of the vertical profile.
        vertical: f32,
        /// Of the horizontal profile.
        horizontal: f32,
    },
    /// A ring about z.
    Torus {
        /// Radius of the ring.
        ring: f32,
        /// Radius of the tube.
        tube: f32,
    },
    /// A cylinder about z with round ends.
    Capsule {
        /// Radius.
        radius: f32,
        /// Half the length between the centers of the ends.
        half_length: f32,
    },
    /// A sphere with waves of a share `amplitude` of its radius.
    Lumpy {
        /// Radius.
        radius: f32,
        /// Height of the waves over the radius.
        amplitude: f32,
        /// Waves around.
        waves: f32,
    },
    /// A closed tube along a trefoil knot.
    Knot {
        /// Size of the knot.
        size: f32,
        /// Radius of the tube.
        tube: f32,
    },
    /// A body of revolution about z with a belly and a neck.
    Vase {
        /// Largest radius.
        radius: f32,
        /// Half the height.
        half_height: f32,
    },
    /// A pillow or a heap of cloth: a soft block with folds.
    Cloth {
        /// Half axes.
        axes: Vec3,
        /// Height of the folds.
        wrinkles: f32,
    },
    /// Flat leaves strewn in a ball.
    Leaves {
        /// Of the ball.
        radius: f32,
        /// Length of a leaf.
        leaf: f32,
        /// How many.
        count: u16,
    },
}

/// A mesh with unit normals at its vertices.
#[derive(Clone, Debug, Default)]
pub struct SmoothMesh {
    /// Triangles, counter-clockwise seen from outside.
    pub mesh: TriangleMesh,
    /// One per vertex.
    pub normals: Vec<Vec3>,
}

impl Shape {
    /// The surface over a grid of `2 n` by `n` steps.
    pub fn mesh(&self, n: u32) -> SmoothMesh {
        match *self {
            Self::Torus { ring, tube } => revolve(2 * n, n, true, |u, v| {
                let r = ring + tube * v.cos();
                Vec3::new(r * u.cos(), r * u.sin(), tube * v.sin())
            }),
            Self::Knot { size, tube } => revolve(3 * n, n / 2, true, |u, v| {
                let at = |t: f32| {
                    let r = 2.0 + (3.0 * t).cos();
                    Vec3::new(r * (2.0 * t).cos(), r * (2.0 * t).sin(), (3.0 * t).sin())
                        * (size / 3.0)
                };
                let tangent = (at(u + 1e-2) - at(u - 1e-2)).normalize();
                let side = tangent.cross(Vec3::Z).normalize();
                let (sin, cos) = v.sin_cos();
                at(u) + (side * cos + side.cross(tangent) * sin) * tube
            }),
            Self::Leaves { radius, leaf, count } => leaves(radius, leaf, count),
            _ => revolve(2 * n, n, false, |u, v| self.on_sphere(u, v)),
        }
    }

    /// For shapes like a sphere: longitude `u`, latitude `v` from -π/2 to π/2.
    fn on_sphere(&self, u: f32, v: f32) -> Vec3 {
        let d = Vec3::new(v.cos() * u.cos(), v.cos() * u.sin(), v.sin());
        match *self {
            Self::Superquadric { axes, vertical, horizontal } => {
                // Rounding at the poles would grow under a small exponent.
                let power = |x: f32, e: f32| {
                    if x.abs() < 1e-6 { 0.0 } else { x.signum() * x.abs().powf(e) }
                };
                let r = power(v.cos(), vertical);
                let x = r * power(u.cos(), horizontal);
                axes * Vec3::new(x, r * power(u.sin(), horizontal), power(v.sin(), vertical))
            }
            Self::Capsule { radius, half_length } => {
                d * radius + Vec3::Z * half_length.copysign(d.z)
            }
            Self::Lumpy { radius, amplitude, waves } => {
                let q = d * waves;
                let bump =
                    (q.x + 0.5).sin() * (q.y - 0.3).cos() + 0.6 * (1.3 * q.z + 0.7 * q.x).sin();
                d * (radius * (1.0 + amplitude * bump))
            }
            Self::Vase { radius, half_height } => {
                let t = v.sin();
                // Flat ends of a smooth profile: wide below the middle, narrow at the neck.
                let belly = 0.62 + 0.38 * (2.6 * (t + 0.25)).cos() - 0.16 * t;
                let end = (1.0 - t.powi(16)).max(0.0).sqrt();
                let r = radius * belly.max(0.25) * end;
                Vec3::new(r * u.cos(), r * u.sin(), half_height * t)
            }
            Self::Cloth { axes, wrinkles } => {
                let soft = |x: f32| x.signum() * x.abs().powf(0.5);
                let r = soft(v.cos());
                let p = axes * Vec3::new(r * soft(u.cos()), r * soft(u.sin()), soft(v.sin()));
                // Ridges of two noises (Musgrave 1994) are folds.
                let ridge = |q: Vec3| 1.0 - (2.0 * fractal(q, 2) - 1.0).abs() * 2.0;
                let fold = ridge(p * 9.0) + 0.5 * ridge(p * 19.0 + Vec3::splat(4.0));
                p + d * (wrinkles * fold)
            }
            Self::Torus { .. } | Self::Knot { .. } | Self::Leaves { .. } => d,
        }
    }
}

/// Flat octahedra at places and with turns that their number decides.
fn leaves(radius: f32, leaf: f32, count: u16) -> SmoothMesh {
    let mut all = SmoothMesh::default();
    for i in 0..u64::from(count) {
        let mut rng = keyed_rng(i, 0x1eaf, u64::from(count));
        let mut within = || Vec3::from_array([(); 3].map(|()| 2.0 * rng.random::<f32>() - 1.0));
        // More of them near the outside, as light wants it.
        let place = within();
        let place = place.normalize_or(Vec3::Z) * (radius * place.length().min(1.0).sqrt());
        let turn = Quat::from_scaled_axis(within() * PI);
        let size = leaf * (0.75 + 0.25 * within().x);
        let corner = |axis: Vec3| place + turn * (axis * size);
        let vertices = [Vec3::X, Vec3::Y * 0.5, Vec3::Z * 0.04]
            .into_iter()
            .flat_map(|axis| [corner(axis), corner(-axis)])
            .collect();
        let mut triangles = Vec::with_capacity(8);
        for (x, y, z) in (0..8u32).map(|k| (k & 1, k >> 1 & 1, k >> 2)) {
            let [a, b, c] = [x, 2 + y, 4 + z];
            // A mirror image turns the other way.
            triangles.push(if (x + y + z) % 2 == 0 { [a, b, c] } else { [b, a, c] });
        }
        let one = TriangleMesh { vertices, triangles };
        let first = all.mesh.vertices.len() as u32;
        all.normals.extend(vertex_normals(&one));
        all.mesh.triangles.extend(one.triangles.iter().map(|t| t.map(|v| v + first)));
        all.mesh.vertices.extend(one.vertices);
    }
    all
}

/// A grid over (u, v), u around, v around too (`closed`) or from pole to pole.
fn revolve(nu: u32, nv: u32, closed: bool, at: impl Fn(f32, f32) -> Vec3) -> SmoothMesh {
    let mut mesh = TriangleMesh::default();
    let rows = if closed { nv } else { nv + 1 };
    for j in 0..rows {
        let s = j as f32 / nv as f32;
        let v = if closed { TAU * s } else { PI * (s - 0.5) };
        for i in 0..nu {
            // A pole is one point, whatever rounding makes of its cosine.
            let pole = !closed && (j == 0 || j == nv);
            mesh.vertices.push(at(if pole { 0.0 } else { TAU * i as f32 / nu as f32 }, v));
        }
    }
    for j in 0..nv {
        let above = if closed { (j + 1) % nv } else { j + 1 };
        for i in 0..nu {
            let next = (i + 1) % nu;
            let [a, b, c, d] = [j * nu + i, j * nu + next, above * nu + i, above * nu + next];
            mesh.triangles.push([a, b, d]);
            mesh.triangles.push([a, d, c]);
        }
    }
    let normals = vertex_normals(&mesh);
    SmoothMesh { mesh, normals }
}

/// Normals of vertices: of the triangles around, by area; vertices at one place share theirs.
pub fn vertex_normals(mesh: &TriangleMesh) -> Vec<Vec3> {
    let mut by_place = std::collections::HashMap::new();
    let key = |p: Vec3| (p * 1e5).round().as_ivec3();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.vertices[i as usize]);
        let n = (b - a).cross(c - a);
        for p in [a, b, c] {
            *by_place.entry(key(p)).or_insert(Vec3::ZERO) += n;
        }
    }
    mesh.vertices.iter().map(|&p| by_place[&key(p)].normalize_or(Vec3::Z)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_is_closed_and_faces_outwards() {
        for shape in [
            Shape::Superquadric { axes: Vec3::ONE, vertical: 0.3, horizontal: 0.4 },
            Shape::Torus { ring: 0.7, tube: 0.2 },
            Shape::Capsule { radius: 0.3, half_length: 0.4 },
            Shape::Lumpy { radius: 0.5, amplitude: 0.1, waves: 4.0 },
            Shape::Knot { size: 0.6, tube: 0.12 },
            Shape::Vase { radius: 0.4, half_height: 0.6 },
            Shape::Cloth { axes: Vec3::new(0.4, 0.5, 0.2), wrinkles: 0.02 },
            Shape::Leaves { radius: 0.6, leaf: 0.2, count: 400 },
        ] {
            let SmoothMesh { mesh, normals } = shape.mesh(48);
            let corner = |i: u32| mesh.vertices[i as usize].as_dvec3();
            let (mut volume, mut area, mut agree) = (0.0, glam::DVec3::ZERO, 0);
            for &[a, b, c] in &mesh.triangles {
                let n = (corner(b) - corner(a)).cross(corner(c) - corner(a));
                volume += corner(a).dot(corner(b).cross(corner(c))) / 6.0;
                area += n;
                agree += i32::from(n.as_vec3().dot(normals[a as usize]) >= 0.0);
            }
            assert!(volume > 0.02, "{shape:?}: volume {volume}");
            assert!(area.length() < 1e-4, "{shape:?}: not closed, {area}");
            assert!(agree as f64 > 0.99 * mesh.triangles.len() as f64, "{shape:?}");
        }
    }
}
