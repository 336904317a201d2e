//! What a point would mirror in every direction.

use glam::Vec3;
use motes_shading::brdf::microfacet;
use motes_shading::environment::Environment;
use motes_shading::tracing::{Ray, Tracer};
use rayon::prelude::*;

use crate::illumination::{Octahedron, light_by_texels};
use crate::observation::TracedSurface;

/// Directions along a side: 6.4 degrees apart.
const SIDE: usize = 28;
/// Weights of a lobe below this share of its peak are left out.
const LEAST_WEIGHT: f32 = 2e-3;
/// Directions farther than this behind a point's plane are never mirrored by a normal near its own (cosine).
const BEHIND: f32 = -0.7;

/// A point of metal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    pub(super) part: u32,
}

/// Radiance that comes to points from every direction of the square, blurred by a lobe.
pub(super) struct Mirrored {
    square: Octahedron,
    stored: Vec<Vec3>,
}

/// The same as it comes.
pub(super) struct Incoming {
    square: Octahedron,
    directions: usize,
    /// `[P, D]`.
    radiance: Vec<Vec3>,
}

impl Mirrored {
    /// Radiance of point `p` toward a viewer, per reflectance, when its mirror direction is `d`.
    #[inline]
    pub(super) fn look_up(&self, p: usize, d: Vec3) -> Vec3 {
        let n = self.square.stored();
        self.square.look_up(&self.stored[p * n..(p + 1) * n], d)
    }
}

impl Incoming {
    /// Traces one ray per direction and point. What rays bring back from the surface is `bounce` per vertex; all radiances
    /// are multiplied by `scale`.
    pub(super) fn trace(
        scene: &TracedSurface,
        light: &Environment,
        bounce: &[Vec3],
        points: &[Point],
        scale: f32,
        ray_bias: f32,
        seed: u64,
    ) -> Self {
        let square = Octahedron { side: SIDE };
        let sky: Vec<Vec3> =
            light_by_texels(light, SIDE, seed).iter().map(|texel| texel.radiance).collect();
        let directions: Vec<Vec3> = square.centers().collect();
        let of = |point: &Point| -> Vec<Vec3> {
            let origin = point.position + point.normal * ray_bias;
            let along = |(&d, &sky): (&Vec3, &Vec3)| {
                let hit = if d.dot(point.normal) < BEHIND {
                    None
                } else {
                    scene.tracer.closest_hit(&Ray::new(origin, d))
                };
                let radiance = match hit {
                    None => sky,
                    Some(_) if bounce.is_empty() => Vec3::ZERO,
                    Some(hit) => scene.interpolate(hit.primitive, hit.barycentrics, bounce),
                };
                radiance * scale
            };
            directions.iter().zip(&sky).map(along).collect()
        };
        let radiance: Vec<Vec<Vec3>> = points.par_iter().with_min_len(8).map(of).collect();
        Self { square, directions: directions.len(), radiance: radiance.concat() }
    }

    /// What a lobe of this roughness makes of it.
    pub(super) fn blurred(&self, roughness: f32) -> Mirrored {
        let lobe = Lobe::new(&self.square, roughness);
        let of = |seen: &[Vec3]| self.square.with_rim(&lobe.blurred(seen));
        let chunks = self.radiance.par_chunks(self.directions.max(1)).with_min_len(8);
        let stored: Vec<Vec<Vec3>> = chunks.map(of).collect();
        Mirrored { square: self.square, stored: stored.concat() }
    }
}

/// Weights of the directions around every direction: the share of each that a lobe about it reflects, looked at straight
/// (as split-sum pre-filtering has it; Karis 2013).
struct Lobe {
    rows: Vec<Vec<(u32, f32)>>,
}

impl Lobe {
    fn new(square: &Octahedron, roughness: f32) -> Self {
        let alpha2 = (microfacet::alpha(f64::from(roughness)) as f32).powi(2);
        let (directions, areas) = (square.centers().collect::<Vec<_>>(), square.solid_angles());
        let row = |r: &Vec3| {
            let weight = |d: &Vec3, area: f32| {
                let cos = r.dot(*d);
                let half2 = 0.5 * (1.0 + cos);
                let spread = half2 * (alpha2 - 1.0) + 1.0;
                if cos > 0.0 { cos * area / (spread * spread) } else { 0.0 }
            };
            let all: Vec<f32> = directions.iter().zip(&areas).map(|(d, a)| weight(d, *a)).collect();
            let least = LEAST_WEIGHT * all.iter().copied().fold(0.0, f32::max);
            let sum: f32 = all.iter().filter(|w| **w > least).sum();
            let kept = all.iter().enumerate().filter(|(_, w)| **w > least);
            kept.map(|(k, w)| (k as u32, w / sum)).collect()
        };
        Self { rows: directions.iter().map(row).collect() }
    }

    fn blurred(&self, values: &[Vec3]) -> Vec<Vec3> {
        let of = |row: &Vec<(u32, f32)>| row.iter().map(|&(k, w)| values[k as usize] * w).sum();
        self.rows.iter().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motes_scene::{ImageF32, Surface};
    use motes_shading::environment::{EnvironmentMap, MapOptions};

    fn scene() -> TracedSurface {
        // One large triangle below everything.
        TracedSurface::new(Surface {
            vertices: vec![[-90.0, -90.0, 0.0], [90.0, -90.0, 0.0], [0.0, 90.0, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            triangles: vec![[0, 1, 2]],
            ..Surface::default()
        })
        .unwrap()
    }

    #[test]
    fn an_even_world_is_mirrored_evenly() {
        let map = ImageF32::from_data(8, 4, 3, vec![0.7; 96]);
        let light = Environment::new(EnvironmentMap::new(&map, &MapOptions::default()).ok(), None);
        let scene = scene();
        for roughness in [0.0, 0.3, 1.0] {
            let points = [Point { position: Vec3::Z, normal: Vec3::Z, part: 0 }];
            let bounce = vec![Vec3::splat(0.7); 3];
            let incoming = Incoming::trace(&scene, &light, &bounce, &points, 1.0, 1e-3, 1);
            let mirrored = incoming.blurred(roughness);
            for d in [Vec3::Z, Vec3::X, Vec3::new(0.6, 0.0, -0.8), Vec3::new(-0.48, 0.6, 0.64)] {
                let l = mirrored.look_up(0, d);
                assert!((l - 0.7).abs().max_element() < 2e-3, "{roughness} {d} {l}");
            }
        }
    }
}
