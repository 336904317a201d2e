//! Shading of a view's buffers, and the light without the material it fell on.
//!
//! `L_o = k_d E_d + k_s E_s + k_i E_i` with `k_d = (1 - m) b`, `k_s = 0.04 (1 - m) + m b`,
//! `k_i = k_d + k_s`: the factors that the texture of a material enters by. What is left changes slowly
//! over a surface, so filters work on `E`, and the texture passes them untouched.

use glam::Vec3;
use motes_shading::brdf::{Material, Model, WithModel, with_model};
use motes_shading::emitters::Emitters;
use motes_shading::environment::Environment;
use motes_shading::integrate::{IntegrationOptions, Shaded, Shader};
use motes_shading::tracing::{Hit, MeshTracer, Ray};
use rayon::prelude::*;

use crate::g_buffer::GBuffer;
use crate::radiance_cache::RadianceCache;
use crate::scene::RelightScene;

/// No factor is smaller: light on black matter must not become infinite.
const LEAST_FACTOR: f32 = 1e-3;
/// Least pixels per task; the result does not depend on it.
const CHUNK: usize = 64;
/// Pixels per side of a tile that is shaded in one go.
const TILE: usize = 24;

/// Light on the material of a pixel, or the factors of that material.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Parts {
    pub(crate) diffuse: Vec3,
    pub(crate) specular: Vec3,
    pub(crate) indirect: Vec3,
}

/// Light of a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lit {
    pub(crate) parts: Parts,
    pub(crate) visibility: f32,
    /// Of the sum of the parts, mean of the channels.
    pub(crate) variance: f32,
}

/// [`Model::factors`] of a material.
struct Factors<'a>(&'a Material);

impl WithModel for Factors<'_> {
    type Output = [Vec3; 2];

    fn run<M: Model>(self) -> [Vec3; 2] {
        M::factors(self.0)
    }
}

impl Parts {
    /// The factors by which the texture enters.
    pub(crate) fn factors(material: &Material) -> Self {
        let least = Vec3::splat(LEAST_FACTOR);
        let [diffuse, specular] = with_model(material.lobes, Factors(material));
        Self {
            diffuse: diffuse.max(least),
            specular: specular.max(least),
            indirect: (diffuse + specular).max(least),
        }
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        Self {
            diffuse: self.diffuse * other.diffuse,
            specular: self.specular * other.specular,
            indirect: self.indirect * other.indirect,
        }
    }

    pub(crate) fn over(&self, other: &Self) -> Self {
        Self {
            diffuse: self.diffuse / other.diffuse,
            specular: self.specular / other.specular,
            indirect: self.indirect / other.indirect,
        }
    }

    pub(crate) fn scaled(&self, factor: Vec3) -> Self {
        self.times(&Self { diffuse: factor, specular: factor, indirect: factor })
    }

    /// The parts of which the sum goes `share` of the way to `color`.
    pub(crate) fn toward(&self, color: Vec3, share: f32) -> Self {
        let total = self.total();
        let wanted = total.lerp(color, share);
        let factor = (wanted / total.max(Vec3::splat(LEAST_FACTOR))).max(Vec3::ZERO);
        let scaled = self.scaled(factor);
        // Where there is hardly any light to scale, the rest is diffuse.
        Self { diffuse: scaled.diffuse + (wanted - scaled.total()).max(Vec3::ZERO), ..scaled }
    }

    pub(crate) fn total(&self) -> Vec3 {
        self.diffuse + self.specular + self.indirect
    }
}

/// Least share of the model in what is shown, and what the number of directions is divided by: noise is seen as far as the model is.
const SHARES: [(f32, u32); 3] = [(0.5, 1), (0.125, 4), (0.0, 16)];

/// Directions per pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Samples {
    pub(crate) light: u32,
    pub(crate) brdf: u32,
}

/// A scene and its light, ready to shade pixels.
pub(crate) struct Shading<'a> {
    pub(crate) scene: &'a RelightScene,
    pub(crate) light: &'a Environment,
    pub(crate) lamps: Option<&'a Emitters>,
    pub(crate) cache: &'a RadianceCache,
    pub(crate) seed: u64,
}

impl Shading<'_> {
    /// Light of `pixels`, in their order; those without a sight stay dark.
    pub(crate) fn shade(&self, buffer: &GBuffer, samples: Samples, pixels: &[u32]) -> Vec<Lit> {
        let l_hit = |_: &Ray, hit: &Hit| self.cache.at(self.scene, hit);
        let options = |divisor: u32| IntegrationOptions {
            light_samples: samples.light.div_ceil(divisor),
            brdf_samples: samples.brdf.div_ceil(divisor),
            ray_bias: self.scene.ray_bias,
            seed: self.seed,
            ..IntegrationOptions::default()
        };
        let shader = |divisor| -> Shader<'_, MeshTracer> {
            let indirect = (!self.cache.is_empty()).then_some(&l_hit as _);
            Shader::new(self.light, &self.scene.tracer, indirect, options(divisor))
                .with_emitters(self.lamps)
        };
        let by_share = SHARES.map(|(_, divisor)| [shader(divisor), shader(4 * divisor)]);
        let shade_pixel = |pixel: usize| -> Lit {
            let Some(sight) = &buffer.sight[pixel] else { return Lit::default() };
            let item = 4 * pixel as u64;
            let edge = buffer.edges.binary_search_by_key(&(pixel as u32), |(p, _)| *p);
            let [whole, quarter] = &by_share[level(buffer.model_share(pixel))];
            match edge {
                Ok(edge) => {
                    let sights = buffer.edges[edge].1.iter().zip(item..);
                    let seen = sights.filter_map(|(s, item)| s.as_ref().map(|s| (s, item)));
                    mean(seen.map(|(sight, item)| {
                        quarter.shade_point(&buffer.point(pixel, sight), item)
                    }))
                }
                _ => mean(std::iter::once(whole.shade_point(&buffer.point(pixel, sight), item))),
            }
        };
        let order = by_tile(pixels, buffer.width);
        let shaded: Vec<Lit> = order
            .par_iter()
            .with_min_len(CHUNK)
            .map(|k| shade_pixel(pixels[*k as usize] as usize))
            .collect();
        let mut lit = vec![Lit::default(); pixels.len()];
        for (k, shaded) in order.into_iter().zip(shaded) {
            lit[k as usize] = shaded;
        }
        lit
    }
}

/// Which of [`SHARES`] a share of the model is at least.
fn level(model_share: f32) -> usize {
    SHARES.iter().position(|(least, _)| model_share >= *least).unwrap_or(SHARES.len() - 1)
}

/// Indices of `pixels`, tile by tile: rays from one place meet the same part of the surface.
fn by_tile(pixels: &[u32], width: usize) -> Vec<u32> {
    let tile = |k: &u32| {
        let pixel = pixels[*k as usize] as usize;
        (pixel / width / TILE, pixel % width / TILE)
    };
    let mut order: Vec<u32> = (0..pixels.len() as u32).collect();
    order.sort_by_key(tile);
    order
}

fn mean(all: impl Iterator<Item = Shaded>) -> Lit {
    let (mut lit, mut count) = (Lit::default(), 0.0f32);
    for s in all {
        lit.parts.diffuse += s.diffuse;
        lit.parts.specular += s.specular;
        lit.parts.indirect += s.indirect;
        lit.visibility += s.visibility;
        lit.variance += s.variance;
        count += 1.0;
    }
    let share = 1.0 / count.max(1.0);
    let Parts { diffuse, specular, indirect } = lit.parts;
    lit.parts =
        Parts { diffuse: diffuse * share, specular: specular * share, indirect: indirect * share };
    lit.visibility *= share;
    lit.variance *= share * share;
    lit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_hardly_shown_takes_few_samples() {
        let divisor = |share: f32| SHARES[level(share)].1;
        assert_eq!([1.0, 0.5, 0.49, 0.125, 0.12, 0.0].map(divisor), [1, 1, 4, 4, 16, 16]);
        assert_eq!(divisor(f32::NAN), 16);
    }
}
