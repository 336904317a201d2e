//! Points of the surface with the radiances that the photos show of them.

use std::collections::{HashMap, HashSet};

use glam::Vec3;

use super::photo::Photo;
use super::traced_surface::{PixelHit, TracedSurface, ViewRays};

/// What one photo shows of a point.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Index of the photo.
    pub photo: u32,
    /// The light it was taken under.
    pub light: u32,
    /// Unit vector toward the camera.
    pub to_viewer: Vec3,
    /// Linear, photo units.
    pub radiance: Vec3,
    /// 0 to 1; below 1 at grazing angles.
    pub weight: f32,
}

/// A point of the surface.
#[derive(Clone, Debug)]
pub struct Sample {
    /// World.
    pub position: Vec3,
    /// Unit shading normal.
    pub normal: Vec3,
    /// Unit normal of its triangle.
    pub geometric_normal: Vec3,
    /// The triangle.
    pub triangle: u32,
    /// The flat piece it lies on, where the normal is exact; 0 for none.
    pub sheet: u32,
    /// What is seen of it.
    pub observations: Vec<Observation>,
}

impl Sample {
    /// A point at the origin that faces z and belongs to no flat piece.
    #[cfg(test)]
    pub(crate) fn facing_z(observations: Vec<Observation>) -> Self {
        let (normal, position) = (Vec3::Z, Vec3::ZERO);
        Self { position, normal, geometric_normal: normal, triangle: 0, sheet: 0, observations }
    }

    /// Radiance under one light that is little touched by highlights; none when no photo under it shows the point.
    pub fn body_radiance(&self, light: usize) -> Option<Vec3> {
        let of_light = self.observations.iter().filter(|o| o.light as usize == light);
        body_radiance(&mut of_light.copied().collect::<Vec<_>>())
    }
}

/// Radiance that is little touched by highlights: the weighted mean of the darker half of the observations, by luminance;
/// none when there are none. Sorts them.
pub(crate) fn body_radiance(observations: &mut [Observation]) -> Option<Vec3> {
    observations.sort_by(|a, b| luminance(a.radiance).total_cmp(&luminance(b.radiance)));
    let half = &observations[..observations.len().div_ceil(2)];
    let weight: f32 = half.iter().map(|o| o.weight).sum();
    let sum: Vec3 = half.iter().map(|o| o.radiance * o.weight).sum();
    (!half.is_empty()).then(|| sum / weight.max(1e-6))
}

pub(crate) use motes_math::luminance::luminance;

/// A photo with its rays and hits.
#[derive(Debug)]
pub struct SeenView<'a> {
    /// The photo.
    pub photo: &'a Photo,
    /// Its rays.
    pub rays: ViewRays,
    /// First hit per pixel.
    pub hits: Vec<PixelHit>,
}

impl<'a> SeenView<'a> {
    /// Traces all pixels.
    pub fn new(photo: &'a Photo, scene: &TracedSurface) -> Self {
        let rays = ViewRays::new(photo);
        let hits = rays.hits(scene);
        Self { photo, rays, hits }
    }

    /// Index of the pixel that a point falls in, the nearest at the border; none behind the camera.
    pub(crate) fn pixel_at(&self, position: Vec3) -> Option<usize> {
        let (x, y, _) = self.rays.project(position)?;
        let (w, h) = (self.photo.camera.width, self.photo.camera.height);
        Some((y as usize).min(h - 1) * w + (x as usize).min(w - 1))
    }

    /// The pixel that shows a point; none where it is hidden, out of the picture or seen at more than 78 degrees from its
    /// normal. It may be clipped.
    pub(crate) fn shown_at(&self, position: Vec3, normal: Vec3) -> Option<usize> {
        let (x, y, z) = self.rays.project(position)?;
        let pixel = self.rays.pixel(x, y)?;
        let (_, cosine) = self.facing(position, normal)?;
        ((self.hits[pixel].depth - z).abs() < self.depth_tolerance(z, cosine)).then_some(pixel)
    }

    /// Unit vector toward the camera and its cosine with the normal; none beyond 78 degrees.
    fn facing(&self, position: Vec3, normal: Vec3) -> Option<(Vec3, f32)> {
        let to_viewer = (self.rays.eye - position).normalize_or_zero();
        let cosine = normal.dot(to_viewer);
        (cosine > 0.2).then_some((to_viewer, cosine))
    }

    /// How far the depth of a pixel may be from that of a point it shows.
    fn depth_tolerance(&self, z: f32, cosine: f32) -> f32 {
        // A slanted surface changes depth by this much over two pixels.
        let slope = 2.0 * z / self.photo.camera.fx as f32 * (1.0 / cosine);
        slope + 4e-3 * z
    }

    /// What the photo shows of a point; none where it is hidden, too near to an edge in depth, masked, clipped
    /// or seen at more than 78 degrees from its normal.
    pub fn observe(&self, index: usize, position: Vec3, normal: Vec3) -> Option<Observation> {
        let (x, y, z) = self.rays.project(position)?;
        let (w, h) = (self.photo.camera.width, self.photo.camera.height);
        let (fx, fy) = (x - 0.5, y - 0.5);
        if !(fx >= 0.0 && fy >= 0.0 && fx < (w - 1) as f32 && fy < (h - 1) as f32) {
            return None;
        }
        let (to_viewer, cosine) = self.facing(position, normal)?;
        let (x0, y0) = (fx as usize, fy as usize);
        let (s, t) = (fx - x0 as f32, fy - y0 as f32);
        let tolerance = self.depth_tolerance(z, cosine);
        let mut radiance = Vec3::ZERO;
        for (dx, dy, weight) in [
            (0, 0, (1.0 - s) * (1.0 - t)),
            (1, 0, s * (1.0 - t)),
            (0, 1, (1.0 - s) * t),
            (1, 1, s * t),
        ] {
            let i = (y0 + dy) * w + x0 + dx;
            if !((self.hits[i].depth - z).abs() < tolerance && self.photo.usable[i]) {
                return None;
            }
            radiance += self.photo.radiance_linear.at(i) * weight;
        }
        let weight = ((cosine - 0.2) / 0.3).clamp(0.05, 1.0);
        let light = self.photo.light as u32;
        Some(Observation { photo: index as u32, light, to_viewer, radiance, weight })
    }
}

/// How many points of the surface are looked at, and from how many photos each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// About so many points.
    pub points: usize,
    /// At most so many observations of each; 0 for all.
    pub observations: usize,
}

/// Chooses at most about `wanted` points, evenly spread over what the photos see (denser where they see
/// finer), each with at least `min_views` observations.
pub(crate) fn choose_samples(
    scene: &TracedSurface,
    views: &[SeenView<'_>],
    wanted: usize,
    min_views: usize,
) -> Vec<Sample> {
    let pixels: usize = views.iter().map(|v| v.hits.len()).sum();
    // Each point of the surface is met by several photos: take candidates a few times over.
    let stride = ((pixels as f64 / (12.0 * wanted.max(1) as f64)).sqrt() as usize).max(1);
    let mut candidates = Vec::new();
    for (index, view) in views.iter().enumerate() {
        let w = view.photo.camera.width;
        for y in (stride / 2 + index % stride..view.photo.camera.height).step_by(stride) {
            for x in (stride / 2..w).step_by(stride) {
                let hit = &view.hits[y * w + x];
                if hit.is_hit() {
                    let d = view.rays.direction(x as f32 + 0.5, y as f32 + 0.5);
                    let (position, normal, geometric_normal) = scene.frame(hit, -d);
                    let footprint = hit.depth / view.photo.camera.fx as f32;
                    candidates.push((position, normal, geometric_normal, hit.triangle, footprint));
                }
            }
        }
    }
    let mut footprints: Vec<f32> = candidates.iter().map(|c| c.4).collect();
    footprints.sort_by(f32::total_cmp);
    let typical = footprints.get(footprints.len() / 2).copied().unwrap_or(1.0);
    // Cells a few pixels wide; coarser until few enough remain.
    let mut cell = 1.0f32;
    let kept = loop {
        let mut seen: HashSet<(i32, [i32; 3])> = HashSet::new();
        let mut kept = Vec::new();
        for (i, (p, _, _, _, footprint)) in candidates.iter().enumerate() {
            // Where photos come near, no more than where they mostly are.
            let octave = footprint.max(typical).log2().round();
            let key = (*p / (cell * octave.exp2())).round().as_ivec3().to_array();
            if seen.insert((octave as i32, key)) {
                kept.push(i);
            }
        }
        if kept.len() <= wanted || cell > 1e4 {
            break kept;
        }
        cell *= 1.1;
    };
    kept.into_iter()
        .filter_map(|i| {
            let (position, normal, geometric_normal, triangle, _) = candidates[i];
            let observations: Vec<_> = views
                .iter()
                .enumerate()
                .filter_map(|(k, v)| v.observe(k, position, normal))
                .collect();
            let sheet = scene.sheets[triangle as usize];
            (observations.len() >= min_views).then_some(Sample {
                sheet,
                position,
                normal,
                geometric_normal,
                triangle,
                observations,
            })
        })
        .collect()
}

/// Mean radiance that the photos of one light show of every vertex; where none sees it, the mean of what its
/// neighbors show, else of everything.
pub(crate) fn vertex_radiance(
    scene: &TracedSurface,
    views: &[SeenView<'_>],
    light: usize,
) -> Vec<Vec3> {
    use rayon::prelude::*;
    let surface = &scene.surface;
    let mut out: Vec<Option<Vec3>> = (0..surface.vertices.len())
        .into_par_iter()
        .map(|i| {
            let (p, n) = (Vec3::from(surface.vertices[i]), Vec3::from(surface.normals[i]));
            let of_light = views.iter().enumerate().filter(|(_, v)| v.photo.light == light);
            let seen = of_light.filter_map(|(k, v)| v.observe(k, p, n));
            let (sum, weight) =
                seen.fold((Vec3::ZERO, 0.0), |(s, w), o| (s + o.radiance * o.weight, w + o.weight));
            (weight > 0.0).then(|| sum / weight)
        })
        .collect();
    fill(&surface.triangles, &mut out);
    let (sum, n) = out.iter().flatten().fold((Vec3::ZERO, 0.0f32), |(s, n), c| (s + *c, n + 1.0));
    let mean = sum / n.max(1.0);
    out.into_iter().map(|c| c.unwrap_or(mean)).collect()
}

/// Gives vertices without a value that of their neighbors, a ring per round.
pub(crate) fn fill(triangles: &[[u32; 3]], out: &mut [Option<Vec3>]) {
    for _ in 0..64 {
        let mut sums: HashMap<u32, (Vec3, f32)> = HashMap::new();
        for triangle in triangles {
            for &to in triangle {
                if out[to as usize].is_none() {
                    for &from in triangle {
                        if let Some(c) = out[from as usize] {
                            let sum = sums.entry(to).or_default();
                            *sum = (sum.0 + c, sum.1 + 1.0);
                        }
                    }
                }
            }
        }
        if sums.is_empty() {
            break;
        }
        for (to, (sum, n)) in sums {
            out[to as usize] = Some(sum / n);
        }
    }
}
