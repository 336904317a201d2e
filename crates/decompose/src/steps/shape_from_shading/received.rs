//! What vertices receive.

use glam::Vec3;
use motes_shading::environment::Environment;
use motes_shading::tracing::{Ray, Tracer, offset_origin};
use rayon::prelude::*;

use crate::appearance::VertexMaterials;
use crate::illumination::light_by_texels;
use crate::mesh::Neighbors;
use crate::observation::{SeenView, TracedSurface};

/// Texels along a side of the light: 6.4 degrees, and 15 where there are many vertices.
const SIDES: [usize; 2] = [12, 28];
/// Texels over all vertices from which they are larger; half of them lie over the plane of their vertex and cost a ray.
const MOST_RAYS: usize = 80_000_000;
/// Difference of the open share between neighbors at which a vertex counts half.
const UNEVEN: f32 = 0.1;

/// What the displacement is found from.
pub(crate) struct Shaded<'a> {
    pub scene: &'a TracedSurface,
    pub views: &'a [SeenView<'a>],
    pub lights: &'a [Environment],
    /// Per light and vertex; empty for nothing.
    pub vertex_radiance: &'a [Vec<Vec3>],
    pub materials: &'a VertexMaterials,
    /// Weight of smooth displacements.
    pub smoothness: f32,
    pub ray_bias: f32,
    pub seed: u64,
}

/// What vertices receive from one light.
pub(super) struct Received {
    /// Light vectors per channel (Gershun 1939): their product with the normal is the irradiance over π, as long as the normal stays
    /// near that which they were traced for.
    pub toward: Vec<[Vec3; 3]>,
    /// Share of the light over the plane of a vertex that nothing is in the way of.
    open: Vec<f32>,
}

impl Received {
    pub(super) fn trace(of: &Shaded<'_>, l: usize, normals: &[Vec3], free: &[bool]) -> Self {
        let vertices = free.iter().filter(|f| **f).count().max(1);
        let side = (MOST_RAYS / vertices).isqrt().clamp(SIDES[0], SIDES[1]);
        let texels = light_by_texels(&of.lights[l], side, of.seed);
        let bounce = of.vertex_radiance.get(l).map_or(&[][..], Vec::as_slice);
        let at = |v: usize| -> ([Vec3; 3], f32) {
            let mut toward = [Vec3::ZERO; 3];
            let (mut open, mut all) = (0.0, 0.0);
            let (position, normal) = (Vec3::from(of.scene.surface.vertices[v]), normals[v]);
            for texel in texels.iter().filter(|t| free[v] && normal.dot(t.to_light) > 0.0) {
                let origin = offset_origin(position, normal, texel.to_light, of.ray_bias);
                let hit = of.scene.tracer.closest_hit(&Ray::new(origin, texel.to_light));
                let share = texel.solid_angle / std::f32::consts::PI;
                let sky = texel.radiance.element_sum() * share * normal.dot(texel.to_light);
                all += sky;
                let radiance = match hit {
                    None => {
                        open += sky;
                        texel.radiance
                    }
                    Some(_) if bounce.is_empty() => Vec3::ZERO,
                    Some(hit) => of.scene.interpolate(hit.primitive, hit.barycentrics, bounce),
                };
                for (c, toward) in toward.iter_mut().enumerate() {
                    *toward += texel.to_light * (radiance[c] * share);
                }
            }
            (toward, if all > 0.0 { open / all } else { 0.0 })
        };
        let all: Vec<_> = (0..free.len()).into_par_iter().with_min_len(64).map(at).collect();
        let (toward, open) = all.into_iter().unzip();
        Self { toward, open }
    }

    /// 1, or less where a shadow ends: a vertex does not tell how much of it is in there.
    pub(super) fn evenness(&self, neighbors: &Neighbors) -> Vec<f32> {
        let of = |v: usize| {
            let ring = neighbors.at(v).iter().map(|&j| self.open[j as usize]);
            let own = self.open[v];
            let (low, high) = ring.fold((own, own), |(l, h), o| (l.min(o), h.max(o)));
            1.0 / (1.0 + ((high - low) / UNEVEN).powi(2))
        };
        (0..self.open.len()).map(of).collect()
    }
}
