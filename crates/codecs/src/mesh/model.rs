//! A mesh, and what its points are made of.

use std::path::Path;

use glam::{DVec3, Vec3};
use motes_formats::error::{FormatError, Result};
use motes_scene::Surface;

use super::texture::{Look, TextureUse};

/// Most samples along a side of the square that a texture is averaged over.
const MOST_SAMPLES: f64 = 8.0;
/// Samples of a triangle that say what a ray sees of its texture.
const BAKED_SAMPLES: usize = 12;
/// Roughness of a mesh that does not say.
pub(crate) const ROUGHNESS: f32 = 0.6;
/// Reflectance of a mesh that does not say.
pub(crate) const GRAY: [f32; 3] = [0.5; 3];

/// A mesh with the material of every point; `V` vertices, `T` triangles.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Geometry; the material at its vertices is what textures multiply.
    pub surface: Surface,
    /// Texture coordinates of two sets, origin at the top left, `[V]` each or empty.
    pub uvs: [Vec<[f32; 2]>; 2],
    /// Index into [`Self::looks`] per triangle, `[T]`.
    pub look_of: Vec<u32>,
    /// Textures and transparency.
    pub looks: Vec<Look>,
    /// Its direction up, unit.
    pub up: DVec3,
}

impl Mesh {
    /// A mesh without textures.
    pub fn plain(surface: Surface, up: DVec3) -> Self {
        let look_of = vec![0; surface.triangles.len()];
        Self { surface, uvs: Default::default(), look_of, looks: vec![Look::default()], up }
    }

    /// Material of the point of a triangle with these barycentric weights; textures are averaged over a square of `side` world
    /// units around it.
    pub fn material_at(&self, triangle: usize, weights: [f64; 3], side: f64) -> PointMaterial {
        material_at(self, triangle, weights, side)
    }

    /// Texture coordinates of corners as a texture uses them.
    fn uv_of(&self, texture: &TextureUse, corners: [u32; 3]) -> Option<[[f64; 2]; 3]> {
        let set = &self.uvs[texture.set.min(1)];
        (!set.is_empty()).then(|| corners.map(|v| set[v as usize].map(f64::from)))
    }

    fn places_of(&self, corners: [u32; 3]) -> [DVec3; 3] {
        corners.map(|v| Vec3::from(self.surface.vertices[v as usize]).as_dvec3())
    }

    /// The surface with the textures averaged at its vertices: what rays that bounce see of them.
    pub fn baked_surface(&self) -> Surface {
        baked_surface(self)
    }
}

/// Barycentric `u, v` of the i-th point of the R2 sequence (Roberts 2018), folded into the triangle.
pub fn barycentrics(i: usize) -> [f64; 2] {
    /// Reciprocals of the plastic number and its square.
    const STEP: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053_3];
    let [u, v] = STEP.map(|s| (0.5 + s * i as f64).fract());
    if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] }
}

/// What a point is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointMaterial {
    /// Linear, 0 to 1.
    pub base_color_linear: [f32; 3],
    /// Perceptual, 0 to 1.
    pub roughness: f32,
    /// 0 to 1.
    pub metallic: f32,
    /// 0 (nothing there) to 1.
    pub opacity: f32,
}

/// Points of a square around a point of a triangle, pulled back into it; `densest` are pixels per world unit.
fn footprint(
    mesh: &Mesh,
    corners: [u32; 3],
    weights: [f64; 3],
    side: f64,
    densest: f64,
) -> Vec<[f64; 3]> {
    let n = (side * densest).ceil().clamp(1.0, MOST_SAMPLES) as i32;
    if n == 1 {
        return vec![weights];
    }
    let at = mesh.places_of(corners);
    let lengths = [at[0].distance(at[1]), at[0].distance(at[2])].map(|l| side / l.max(1e-300));
    let step = |k: i32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
    let mut points = Vec::with_capacity((n * n) as usize);
    for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
        let u = (weights[1] + step(i) * lengths[0]).max(0.0);
        let v = (weights[2] + step(j) * lengths[1]).max(0.0);
        let over = (u + v).max(1.0);
        points.push([1.0 - (u + v) / over, u / over, v / over]);
    }
    points
}

fn material_at(mesh: &Mesh, triangle: usize, weights: [f64; 3], side: f64) -> PointMaterial {
    let corners = mesh.surface.triangles[triangle];
    let look = &mesh.looks[mesh.look_of[triangle] as usize];
    let densest = look
        .textures()
        .map(|t| t.density(mesh.uv_of(t, corners), mesh.places_of(corners)))
        .fold(0.0, f64::max);
    let points = footprint(mesh, corners, weights, side, densest);
    mixed(mesh, corners, look, weights, &points)
}

/// The material of the vertices at `weights`, times the textures over `points`.
fn mixed(
    mesh: &Mesh,
    corners: [u32; 3],
    look: &Look,
    weights: [f64; 3],
    points: &[[f64; 3]],
) -> PointMaterial {
    let s = &mesh.surface;
    let at = |of: &dyn Fn(usize) -> f32| -> f32 {
        (0..3).map(|k| f64::from(of(corners[k] as usize)) * weights[k]).sum::<f64>() as f32
    };
    let mut base = [0, 1, 2].map(|c| at(&|v| s.base_color_linear[v][c]));
    let (mut roughness, mut metallic) = (at(&|v| s.roughness[v]), at(&|v| s.metallic[v]));
    let mut coverage = 1.0 - look.transparency;
    if let Some(texture) = &look.base_color {
        let [r, g, b, a] = texture.mean(mesh.uv_of(texture, corners), points, true);
        base = [base[0] * r, base[1] * g, base[2] * b];
        coverage *= a;
    }
    if let Some(texture) = &look.metallic_roughness {
        let [_, g, b, _] = texture.mean(mesh.uv_of(texture, corners), points, false);
        (roughness, metallic) = (roughness * g, metallic * b);
    }
    if let Some(texture) = &look.roughness {
        roughness *= texture.mean(mesh.uv_of(texture, corners), points, false)[0];
    }
    if let Some(texture) = &look.metallic {
        metallic *= texture.mean(mesh.uv_of(texture, corners), points, false)[0];
    }
    let opacity = match look.cutoff {
        _ if look.opaque => 1.0,
        Some(cutoff) => f32::from(u8::from(coverage >= cutoff)),
        None => coverage,
    };
    // What is not a number is nothing.
    let unit = |v: f32| if v > 0.0 { v.min(1.0) } else { 0.0 };
    PointMaterial {
        base_color_linear: base.map(unit),
        roughness: unit(roughness),
        metallic: unit(metallic),
        opacity: unit(opacity),
    }
}

fn baked_surface(mesh: &Mesh) -> Surface {
    let mut surface = mesh.surface.clone();
    if !mesh.looks.iter().any(|look| look.textures().next().is_some()) {
        return surface;
    }
    let mut sums = vec![([0.0f64; 5], 0.0f64); surface.vertices.len()];
    let points: Vec<[f64; 3]> = (0..BAKED_SAMPLES)
        .map(|i| {
            let [u, v] = barycentrics(i);
            [1.0 - u - v, u, v]
        })
        .collect();
    for (t, corners) in mesh.surface.triangles.iter().enumerate() {
        let look = &mesh.looks[mesh.look_of[t] as usize];
        if look.textures().next().is_none() {
            continue;
        }
        let [a, b, c] = mesh.places_of(*corners);
        let area = (b - a).cross(c - a).length();
        let area = if area > 0.0 && area.is_finite() { area } else { 1e-300 };
        let whole = mixed(mesh, *corners, look, [1.0 / 3.0; 3], &points);
        let [r, g, b] = whole.base_color_linear;
        for v in corners {
            let (sum, weight) = &mut sums[*v as usize];
            for (sum, value) in sum.iter_mut().zip([r, g, b, whole.roughness, whole.metallic]) {
                *sum += area * f64::from(value);
            }
            *weight += area;
        }
    }
    for (v, (sum, weight)) in sums.iter().enumerate().filter(|(_, s)| s.1 > 0.0) {
        let [r, g, b, roughness, metallic] = sum.map(|x| (x / weight) as f32);
        surface.base_color_linear[v] = [r, g, b];
        (surface.roughness[v], surface.metallic[v]) = (roughness, metallic);
    }
    surface
}

/// A vertex that is not where numbers end.
pub(crate) fn finite_vertices(surface: &Surface, path: &Path) -> Result<()> {
    let broken = surface.vertices.iter().position(|v| !v.iter().all(|x| x.is_finite()));
    match broken {
        None => Ok(()),
        Some(row) => {
            let cause = format!("the position is {:?}", surface.vertices[row]);
            Err(FormatError::invalid(path, format!("vertex {row}"), cause))
        }
    }
}
