//! Light that the surface sends on: outgoing diffuse radiance at its vertices under one light.
//!
//! ```text
//! B_0 = albedo / π ∫ L V (n · w) dw           direct light, by samples
//! B_k = B_0 + albedo / π ∫ B_{k-1}(hit) (n · w) dw      where rays of the cosine lobe are blocked
//! ```
//!
//! A view that meets a vertex's triangle takes the interpolated `B`: as if everything it does not
//! see directly were diffuse. A metal's albedo is its base color.
//!
//! Approximated by the parameter `--light-spacing`: vertices of one cell of a grid whose normals point
//! the same way share the light that falls on them. Every vertex keeps its own albedo.

use std::collections::HashMap;

use glam::Vec3;
use motes_scene::Surface;
use motes_shading::environment::Environment;
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};
use motes_shading::tracing::{Hit, Ray};
use rayon::prelude::*;

use crate::lamps::Lights;
use crate::scene::RelightScene;
use crate::surface_point::white_vertex;

/// Keeps the random numbers of the passes apart from those of pixels.
const FIRST_ITEM: u64 = 1 << 40;

/// Outgoing radiance per vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct RadianceCache {
    outgoing: Vec<Vec3>,
}

impl RadianceCache {
    /// Gathers `bounces - 1` times from itself; `samples` directions each, one point per cell of
    /// `spacing` median edges. No bounce, no cache.
    pub(crate) fn new(
        scene: &RelightScene,
        light: &Lights<'_>,
        bounces: u32,
        samples: u32,
        spacing: f32,
        seed: u64,
    ) -> Self {
        if bounces == 0 || (light.environment.is_black() && light.lamps.is_none()) {
            return Self::default();
        }
        let surface = &scene.surface;
        let shared = Shared::new(surface, spacing * scene.median_edge());
        let points: Vec<SurfacePoint> =
            shared.chosen.iter().map(|i| white_vertex(surface, *i as usize)).collect();
        let options = IntegrationOptions {
            light_samples: samples,
            brdf_samples: samples / 4,
            ray_bias: scene.ray_bias,
            seed,
            ..IntegrationOptions::default()
        };
        let shader =
            Shader::new(light.environment, &scene.tracer, None, options).with_emitters(light.lamps);
        let direct: Vec<Vec3> =
            shader.shade(&points, FIRST_ITEM).iter().map(|s| s.total()).collect();
        let albedo =
            |i: usize| Vec3::from(surface.base_color_linear[i]).clamp(Vec3::ZERO, Vec3::ONE);
        let reflect = |light: &[Vec3]| -> Vec<Vec3> {
            shared
                .of_vertex
                .iter()
                .enumerate()
                .map(|(i, k)| light[*k as usize] * albedo(i))
                .collect()
        };
        let mut cache = Self { outgoing: reflect(&direct) };
        let darkness = Environment::default();
        for pass in 1..u64::from(bounces) {
            let l_hit = |_: &Ray, hit: &Hit| cache.at(scene, hit);
            let options = IntegrationOptions {
                light_samples: 0,
                brdf_samples: samples.div_ceil(2),
                ..options
            };
            let shader = Shader::new(&darkness, &scene.tracer, Some(&l_hit), options);
            let gathered = shader.shade(&points, (pass + 1) * FIRST_ITEM);
            let sum: Vec<Vec3> =
                direct.par_iter().zip(&gathered).map(|(d, g)| *d + g.indirect).collect();
            cache = Self { outgoing: reflect(&sum) };
        }
        cache
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.outgoing.is_empty()
    }

    /// What the surface sends from where a ray met it.
    #[inline]
    pub(crate) fn at(&self, scene: &RelightScene, hit: &Hit) -> Vec3 {
        let [a, b, c] =
            scene.surface.triangles[hit.primitive as usize].map(|v| self.outgoing[v as usize]);
        let [u, v] = hit.barycentrics;
        a * (1.0 - u - v) + b * u + c * v
    }
}

/// Vertices that stand for others.
struct Shared {
    /// Vertices where light is computed.
    chosen: Vec<u32>,
    /// For every vertex, which of them it takes its light from.
    of_vertex: Vec<u32>,
}

impl Shared {
    /// The first vertex of every cell of `cell` world units and of every main direction of the normal;
    /// every vertex on its own when `cell` is not a length.
    fn new(surface: &Surface, cell: f32) -> Self {
        let count = surface.vertices.len() as u32;
        if !(cell > 0.0 && cell.is_finite()) {
            return Self { chosen: (0..count).collect(), of_vertex: (0..count).collect() };
        }
        let mut chosen = Vec::new();
        let mut first: HashMap<([i32; 3], u8), u32> = HashMap::new();
        let of_vertex = (0..count)
            .map(|i| {
                let vertex = surface.vertices[i as usize];
                let place = if vertex.iter().all(|v| v.is_finite()) {
                    vertex.map(|v| (v / cell).floor() as i32)
                } else {
                    // With its like only.
                    [i32::MIN; 3]
                };
                *first.entry((place, side(surface.normals[i as usize]))).or_insert_with(|| {
                    chosen.push(i);
                    chosen.len() as u32 - 1
                })
            })
            .collect();
        Self { chosen, of_vertex }
    }
}

/// Which of the six axes a normal is nearest to.
fn side(normal: [f32; 3]) -> u8 {
    let [x, y, z] = normal.map(f32::abs);
    let axis = if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    };
    2 * axis as u8 + u8::from(normal[axis] < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sheets back to back of `n` x `n` vertices, one unit apart, and a vertex that is nowhere.
    fn sheets(n: usize) -> Surface {
        let mut surface = Surface::default();
        for side in [1.0, -1.0] {
            for i in 0..n * n {
                surface.vertices.push([(i % n) as f32, (i / n) as f32, 0.0]);
                surface.normals.push([0.0, 0.0, side]);
            }
        }
        surface.vertices.push([f32::NAN; 3]);
        surface.normals.push([f32::NAN; 3]);
        surface
    }

    #[test]
    fn vertices_of_a_cell_share_a_point_and_the_back_has_its_own() {
        let surface = sheets(12);
        let shared = Shared::new(&surface, 3.0);
        assert_eq!(shared.chosen.len(), 2 * 16 + 1);
        assert_eq!(shared.of_vertex.len(), surface.vertices.len());
        for (i, k) in shared.of_vertex.iter().enumerate().take(2 * 144) {
            let chosen = shared.chosen[*k as usize] as usize;
            let apart = Vec3::from(surface.vertices[i]) - Vec3::from(surface.vertices[chosen]);
            assert!(apart.abs().max_element() < 3.0, "{i}: {apart}");
            assert_eq!(surface.normals[i], surface.normals[chosen]);
        }
        for cell in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let own = Shared::new(&surface, cell);
            assert_eq!(own.chosen.len(), surface.vertices.len());
            assert_eq!(own.chosen, own.of_vertex);
        }
    }
}
