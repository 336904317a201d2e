//! The photos divided by their shading: base color per pixel.

use glam::Vec3;
use motes_math::srgb;
use motes_scene::ImageF32;
use motes_shading::brdf::Material;
use motes_shading::integrate::SurfacePoint;
use rayon::prelude::*;

use super::basis::{BasisScene, terms};
use super::vertex_materials::VertexMaterials;
use crate::observation::samples::luminance;
use crate::observation::{SeenView, TracedSurface};

/// Radiance of every pixel as a linear function of base color: `b slope + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelShading {
    /// Zero where the surface is missed.
    pub slope: Vec<Vec3>,
    /// Same.
    pub offset: Vec<Vec3>,
    /// How much of a pixel has one base color with its part, and that color.
    pub uniform: Vec<(f32, Vec3)>,
}

/// Whether a pixel with this slope tells its base color.
pub(crate) fn is_told(slope: Vec3) -> bool {
    slope.min_element() > 1e-4
}

impl PixelShading {
    /// Integrates all pixels of a view.
    pub fn integrate(
        view: &SeenView<'_>,
        index: usize,
        materials: &VertexMaterials,
        scene: &BasisScene<'_>,
    ) -> Self {
        let width = view.photo.camera.width;
        let pixels: Vec<((Vec3, Vec3), (f32, Vec3))> = scene.with_shaders(|shaders| {
            let shader = &shaders[view.photo.light];
            view.hits
                .par_iter()
                .enumerate()
                .map(|(i, hit)| {
                    if !hit.is_hit() {
                        return ((Vec3::ZERO, Vec3::ZERO), (0.0, Vec3::ZERO));
                    }
                    let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
                    let to_viewer = -view.rays.direction(x, y);
                    let (position, normal, geometric_normal) = scene.scene.frame(hit, to_viewer);
                    let corners = scene.scene.surface.triangles[hit.triangle as usize];
                    let [b, c] = hit.barycentrics;
                    let at = |of: &[f32]| {
                        let [p, q, r] = corners.map(|k| of[k as usize]);
                        p * (1.0 - b - c) + q * b + r * c
                    };
                    let metallic = at(&materials.metallic);
                    let material = Material {
                        lobes: scene.lobes,
                        ..Material::principled(Vec3::splat(0.5), at(&materials.roughness), metallic)
                    };
                    let point = SurfacePoint {
                        position,
                        geometric_normal,
                        shading_normal: normal,
                        to_viewer,
                        material,
                    };
                    let item = (index as u64) << 32 | i as u64;
                    let t = terms(shader, &point, item);
                    let specular = at(&materials.specular);
                    let slope = t.diffuse * (1.0 - metallic) + t.metal_slope * metallic;
                    let offset = t.specular * (1.0 - metallic) + t.metal_offset * metallic;
                    let color = scene.scene.interpolate(
                        hit.triangle,
                        hit.barycentrics,
                        &materials.part_color_linear,
                    );
                    ((slope, offset * specular), (at(&materials.is_uniform), color))
                })
                .collect()
        });
        let (terms, uniform): (Vec<_>, Vec<_>) = pixels.into_iter().unzip();
        let (slope, offset) = terms.into_iter().unzip();
        Self { slope, offset, uniform }
    }

    /// Multiplies the colors of whole parts by a factor per vertex.
    pub(crate) fn darken(&mut self, view: &SeenView<'_>, scene: &TracedSurface, factors: &[f32]) {
        for (hit, (_, color)) in view.hits.iter().zip(&mut self.uniform) {
            if hit.is_hit() {
                let [p, q, r] = scene.surface.triangles[hit.triangle as usize];
                let [b, c] = hit.barycentrics;
                let of = |v: u32| factors[v as usize];
                *color *= of(p) * (1.0 - b - c) + of(q) * b + of(r) * c;
            }
        }
    }

    /// Base color that explains every pixel of the photo, `[h, w, 3]`, sRGB-encoded, and its weight `[h, w, 1]`: how much
    /// an error of it shows in the sRGB-encoded photo; 0 where nothing is known.
    pub fn base_color(&self, view: &SeenView<'_>) -> (ImageF32, ImageF32) {
        let (w, h) = (view.photo.camera.width, view.photo.camera.height);
        let mut base = ImageF32::filled(w, h, 3, 0.0);
        let mut weight = ImageF32::filled(w, h, 1, 0.0);
        for i in 0..w * h {
            let radiance = Vec3::from_slice(&view.photo.radiance_linear.data[3 * i..3 * i + 3]);
            let slope = self.slope[i];
            if !is_told(slope) {
                continue;
            }
            let b = ((radiance - self.offset[i]) / slope).clamp(Vec3::splat(0.01), Vec3::ONE);
            let (share, color) = self.uniform[i];
            let b = b.lerp(color, share);
            base.data[3 * i..3 * i + 3].copy_from_slice(&b.map(srgb::encode).to_array());
            // d sRGB / d linear falls about as L^-0.58.
            let l = luminance(slope * b + self.offset[i]).max(0.01);
            let gain = luminance(slope) * (l / luminance(b)).powf(-0.58);
            weight.data[i] = view.photo.weight.data[i] * (gain * gain).min(4.0);
        }
        (base, weight)
    }

    /// The picture of base colors `[h, w, 3]`, linear, under this shading, linear.
    pub fn relit(&self, base: &ImageF32) -> ImageF32 {
        let mut out = base.clone();
        for (i, pixel) in out.data.chunks_exact_mut(3).enumerate() {
            let radiance = Vec3::from_slice(pixel) * self.slope[i] + self.offset[i];
            pixel.copy_from_slice(&radiance.to_array());
        }
        out
    }
}
