//! The photos divided by their shading: base color per pixel.

use glam::Vec3;
use half::f16;
use motes_math::srgb;
use motes_scene::ImageF32;
use motes_shading::brdf::Material;
use motes_shading::integrate::{Shader, SurfacePoint};
use motes_shading::tracing::MeshTracer;
use rayon::prelude::*;

use super::basis::{BasisScene, Terms, Wanted, each_term};
use super::half_pixels::HalfPixels;
use super::sparse::{Shade, Spacing, shades};
use super::vertex_materials::VertexMaterials;
use crate::observation::samples::luminance;
use crate::observation::{PixelHit, SeenView, TracedSurface};

/// Radiance of every pixel as a linear function of base color: `b slope + offset`.
///
/// A scene without gloss has no offsets and no parts of one color. Its photos are many, so what is zero everywhere is not stored, and
/// the rest in half precision.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelShading {
    slope: HalfPixels,
    /// None where all are zero.
    offset: Option<HalfPixels>,
    /// None where no pixel has any.
    uniform: Option<Uniform>,
}

/// How much of every pixel has one base color with its part, and that color.
#[derive(Clone, Debug, PartialEq)]
struct Uniform {
    share: Vec<f16>,
    color_linear: HalfPixels,
}

/// Whether a pixel with this slope tells its base color.
pub(crate) fn is_told(slope: Vec3) -> bool {
    slope.min_element() > 1e-4
}

/// Where the shading is integrated and where it is interpolated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SparsePixels {
    /// Pixels from one to the next where it is smooth; 1 integrates all.
    pub spacing: usize,
    /// Share of the brightness, and angle of the normals in radians, by which interpolation may be off.
    pub tolerance: f32,
}

/// Materials that differ by less are one.
const SAME_MATERIAL: f32 = 0.02;

/// A pixel before it is shaded.
#[derive(Clone, Copy)]
struct Seen {
    point: SurfacePoint,
    metallic: f32,
    specular: f32,
    uniform: (f32, Vec3),
}

impl Seen {
    fn of(
        view: &SeenView<'_>,
        i: usize,
        materials: &VertexMaterials,
        scene: &BasisScene<'_>,
    ) -> Option<Self> {
        let hit = &view.hits[i];
        if !hit.is_hit() {
            return None;
        }
        let width = view.photo.camera.width;
        let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let to_viewer = -view.rays.direction(x, y);
        let (position, shading_normal, geometric_normal) = scene.scene.frame(hit, to_viewer);
        let corners = scene.scene.surface.triangles[hit.triangle as usize];
        let [b, c] = hit.barycentrics();
        let at = |of: &[f32]| {
            let [p, q, r] = corners.map(|k| of[k as usize]);
            p * (1.0 - b - c) + q * b + r * c
        };
        let metallic = at(&materials.metallic);
        let material = Material {
            lobes: scene.lobes,
            ..Material::principled(Vec3::splat(0.5), at(&materials.roughness), metallic)
        };
        let point =
            SurfacePoint { position, geometric_normal, shading_normal, to_viewer, material };
        let of_part = &materials.part_color_linear;
        let color = scene.scene.interpolate(hit.triangle, hit.barycentrics(), of_part);
        let uniform = (at(&materials.is_uniform), color);
        Some(Self { point, metallic, specular: at(&materials.specular), uniform })
    }

    fn shade(&self, shader: &Shader<'_, MeshTracer>, item: u64) -> Shade {
        let (metallic, specular) = (self.metallic, self.specular);
        let wanted = Wanted { dielectric: metallic < 1.0, metal: metallic > 0.0 };
        let (mut sum, mut grays, mut squares, mut count) = (Terms::default(), 0.0, 0.0, 0.0f32);
        let slope = |t: &Terms| t.diffuse * (1.0 - metallic) + t.metal_slope * metallic;
        let offset =
            |t: &Terms| (t.specular * (1.0 - metallic) + t.metal_offset * metallic) * specular;
        let incident = shader.incident_light(&self.point, item);
        each_term(&self.point, &incident, wanted, |term| {
            sum.add(&term);
            let gray = luminance(slope(&term) * GRAY + offset(&term));
            (grays, squares) = (grays + gray, squares + gray * gray);
            count += 1.0;
        });
        let tried = incident.len().max(1) as f32;
        let variance = (squares - grays * grays / tried).max(0.0);
        Shade { slope: slope(&sum), offset: offset(&sum), gray: grays, variance }
    }

    /// Whether it lies on the piece of surface between four others, of these weights.
    fn is_between(&self, corners: &[(&Self, f32); 4], tolerance: f32) -> bool {
        let same = |a: f32, b: f32| (a - b).abs() < SAME_MATERIAL;
        let is_alike = corners.iter().all(|(c, _)| {
            same(c.metallic, self.metallic)
                && same(c.specular, self.specular)
                && same(c.point.material.roughness, self.point.material.roughness)
        });
        let normal: Vec3 = corners.iter().map(|(c, w)| c.point.shading_normal * *w).sum();
        let middle: Vec3 = corners.iter().map(|(c, w)| c.point.position * *w).sum();
        let across = (corners[3].0.point.position - corners[0].0.point.position).length();
        let off = self.point.position - middle;
        is_alike
            && (normal - self.point.shading_normal).length() < tolerance
            && off.dot(self.point.geometric_normal).abs() < OFF_PLANE * across
    }
}

/// Base color that the noise of a pixel is judged with.
const GRAY: f32 = 0.35;
/// Pixels further off the plane of a cell's corners than this share of its diagonal are another piece.
const OFF_PLANE: f32 = 0.1;

impl PixelShading {
    /// Per pixel: slope and offset, zero where the surface is missed, and how much of it has one base color with its part, and that
    /// color.
    pub(crate) fn new(slope: &[Vec3], offset: &[Vec3], uniform: &[(f32, Vec3)]) -> Self {
        let stored = |values: &[Vec3]| HalfPixels::new(values.iter().copied());
        let is_glossy = offset.iter().any(|v| *v != Vec3::ZERO);
        let of_parts = || Uniform {
            share: uniform.iter().map(|(share, _)| f16::from_f32(*share)).collect(),
            color_linear: HalfPixels::new(uniform.iter().map(|(_, color)| *color)),
        };
        Self {
            slope: stored(slope),
            offset: is_glossy.then(|| stored(offset)),
            uniform: uniform.iter().any(|(share, _)| *share != 0.0).then(of_parts),
        }
    }

    /// Number of pixels.
    pub(crate) fn count(&self) -> usize {
        self.slope.count()
    }

    /// Radiance over base color of a pixel; zero where the surface is missed.
    pub(crate) fn slope(&self, i: usize) -> Vec3 {
        self.slope.at(i)
    }

    /// Radiance of a pixel that its base color has no part in.
    pub(crate) fn offset(&self, i: usize) -> Vec3 {
        self.offset.as_ref().map_or(Vec3::ZERO, |offset| offset.at(i))
    }

    /// How much of a pixel has one base color with its part, and that color.
    pub(crate) fn uniform(&self, i: usize) -> (f32, Vec3) {
        let of_part = |u: &Uniform| (u.share[i].to_f32(), u.color_linear.at(i));
        self.uniform.as_ref().map_or((0.0, Vec3::ZERO), of_part)
    }

    /// Integrates the pixels of a view.
    pub fn integrate(
        view: &SeenView<'_>,
        index: usize,
        materials: &VertexMaterials,
        scene: &BasisScene<'_>,
        pixels: SparsePixels,
    ) -> Self {
        let size = [view.photo.camera.width, view.photo.camera.height];
        let seen: Vec<Option<Seen>> = (0..view.hits.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|i| Seen::of(view, i, materials, scene))
            .collect();
        let is_between = |i: usize, corners: &[(usize, f32); 4]| match &seen[i] {
            None => corners.iter().all(|(k, _)| seen[*k].is_none()),
            Some(pixel) => {
                let [a, b, c, d] = corners.map(|(k, w)| seen[k].as_ref().map(|s| (s, w)));
                let (Some(a), Some(b), Some(c), Some(d)) = (a, b, c, d) else { return false };
                pixel.is_between(&[a, b, c, d], pixels.tolerance)
            }
        };
        let shades = scene.with_shaders(|shaders| {
            let shader = &shaders[view.photo.light];
            let shade = |i: usize| {
                let item = (index as u64) << 32 | i as u64;
                seen[i].as_ref().map_or_else(Shade::default, |seen| seen.shade(shader, item))
            };
            let spacing = Spacing { pixels: pixels.spacing, tolerance: pixels.tolerance };
            shades(size, spacing, shade, is_between)
        });
        let uniform = |seen: &Option<Seen>| seen.as_ref().map_or((0.0, Vec3::ZERO), |s| s.uniform);
        let slope: Vec<Vec3> = shades.iter().map(|s| s.slope).collect();
        let offset: Vec<Vec3> = shades.iter().map(|s| s.offset).collect();
        let uniform: Vec<(f32, Vec3)> = seen.iter().map(uniform).collect();
        Self::new(&slope, &offset, &uniform)
    }

    /// Multiplies the shading by the factor that a local light has at each pixel.
    pub(crate) fn light(&mut self, factor: impl Fn(usize) -> Vec3 + Sync) {
        let pixels = (0..self.count()).into_par_iter().with_min_len(1024);
        let factors: Vec<Vec3> = pixels.map(&factor).collect();
        for layer in std::iter::once(&mut self.slope).chain(&mut self.offset) {
            *layer = HalfPixels::new(factors.iter().enumerate().map(|(i, f)| layer.at(i) * *f));
        }
    }

    /// Multiplies the colors of whole parts by a factor per vertex.
    pub(crate) fn darken(&mut self, view: &SeenView<'_>, scene: &TracedSurface, factors: &[f32]) {
        let Some(uniform) = &mut self.uniform else { return };
        let factor = |hit: &PixelHit| {
            if !hit.is_hit() {
                return 1.0;
            }
            let [p, q, r] = scene.surface.triangles[hit.triangle as usize];
            let [b, c] = hit.barycentrics();
            let of = |v: u32| factors[v as usize];
            of(p) * (1.0 - b - c) + of(q) * b + of(r) * c
        };
        let before = &uniform.color_linear;
        let darker = view.hits.iter().enumerate().map(|(i, hit)| before.at(i) * factor(hit));
        uniform.color_linear = HalfPixels::new(darker);
    }

    /// Base color that explains every pixel of the photo, sRGB-encoded, and its weight: how much an error of it shows in the
    /// sRGB-encoded photo; 0 where nothing is known.
    pub(crate) fn base_color(&self, view: &SeenView<'_>) -> (HalfPixels, Vec<f16>) {
        let mut base = vec![Vec3::ZERO; self.count()];
        let mut weight = vec![f16::ZERO; self.count()];
        for i in 0..self.count() {
            let radiance = view.photo.radiance_linear.at(i);
            let slope = self.slope(i);
            if !(is_told(slope) && view.photo.usable[i]) {
                continue;
            }
            let b = ((radiance - self.offset(i)) / slope).clamp(Vec3::splat(0.01), Vec3::ONE);
            let (share, color) = self.uniform(i);
            let b = b.lerp(color, share);
            base[i] = b.map(srgb::encode);
            // d sRGB / d linear falls about as L^-0.58.
            let l = luminance(slope * b + self.offset(i)).max(0.01);
            let gain = luminance(slope) * (l / luminance(b)).powf(-0.58);
            weight[i] = f16::from_f32((gain * gain).min(4.0));
        }
        (HalfPixels::new(base.into_iter()), weight)
    }

    /// The picture of base colors `[h, w, 3]`, linear, under this shading, linear.
    pub fn relit(&self, base: &ImageF32) -> ImageF32 {
        let mut out = base.clone();
        for (i, pixel) in out.data.chunks_exact_mut(3).enumerate() {
            let radiance = Vec3::from_slice(pixel) * self.slope(i) + self.offset(i);
            pixel.copy_from_slice(&radiance.to_array());
        }
        out
    }
}
