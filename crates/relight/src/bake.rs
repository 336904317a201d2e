//! Colors of the Gaussians under a light, as spherical harmonics that every viewer shows.
//!
//! A Gaussian takes the outgoing radiance of the surface point it stands for, seen from `K` directions `v_k`
//! over the hemisphere of its normal. Diffuse and indirect light are one value (the mean); specular light
//! follows the direction. `encode` is the sRGB curve with clipping, as the colors of a splat are
//! sRGB-encoded:
//!
//! ```text
//! c_k = encode(L_o(v_k)),   sh = argmin Σ_k w_k (0.5 + Σ_j Y_j(-v_k) sh_j - c_k)² + λ Σ_{j>0} sh_j²
//! ```
//!
//! with `w_k` the cosine to the normal, the area that is seen. Specular light is fitted by harmonics on its own first, in
//! linear values: that averages its noise.
//!
//! Views from behind, where no radiance is known, are bound by `λ` alone.

use crate::options::BakeOptions;
use std::f32::consts::TAU;

use glam::Vec3;
use motes_math::sh::{MAX_SH_DEGREE, sh_basis, sh_coefficients};
use motes_scene::Gaussians;
use motes_shading::frame::Frame;
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};
use motes_shading::tracing::{Hit, Ray};
use rayon::prelude::*;

use crate::relighter::Relighter;
use crate::surface_point::surface_point;
use motes_math::srgb;

/// Ridge on bands above 0, relative to the number of directions. It costs fit where it is
/// large and rings behind the hemisphere where it is small.
const RIDGE: f64 = 2e-3;
/// Keeps these random numbers apart from those of pixels and vertices.
const FIRST_ITEM: u64 = 1 << 50;

impl Relighter<'_> {
    /// The Gaussians with baked colors; shape, opacity and extra columns stay.
    pub fn bake(&self, options: &BakeOptions) -> Gaussians {
        let mut baked = self.scene.gaussians.with_sh_degree(options.sh_degree);
        let rows: Vec<u32> = (0..baked.len() as u32).collect();
        baked.sh = self.bake_rows(&rows, options);
        baked
    }

    /// Spherical harmonics of the Gaussians of `rows` under the light, `[rows, K, 3]`.
    pub fn bake_rows(&self, rows: &[u32], options: &BakeOptions) -> Vec<f32> {
        let scene = self.scene;
        let l_hit = |_: &Ray, hit: &Hit| self.cache.at(scene, hit);
        let (light, brdf) = self.options.samples();
        let integration = IntegrationOptions {
            // A quarter for each of many directions: their sum has more than a pixel.
            light_samples: (light / 4).max(4),
            brdf_samples: brdf.max(4),
            ray_bias: scene.ray_bias,
            seed: self.seed,
            ..IntegrationOptions::default()
        };
        let indirect = (!self.cache.is_empty()).then_some(&l_hit as _);
        let shader =
            Shader::new(self.light, &scene.tracer, indirect, integration).with_emitters(self.lamps);
        let k = sh_coefficients(options.sh_degree);
        let mut baked = vec![0.0; rows.len() * 3 * k];
        baked.par_chunks_mut(3 * k).zip(rows).with_min_len(64).for_each(|(sh, row)| {
            let i = *row as usize;
            let mut observations = Vec::with_capacity(options.bake_directions as usize);
            let (position, normal) = surface_point(scene, i);
            let m = &scene.materials;
            let base = Vec3::from(m.base_color_linear[i]);
            let material = scene.material(base, m.roughness[i], m.metallic[i]);
            let mut even = Vec3::ZERO;
            for d in 0..options.bake_directions {
                let to_viewer = direction(normal, d, options.bake_directions);
                let point = SurfacePoint {
                    position,
                    geometric_normal: normal,
                    shading_normal: normal,
                    to_viewer,
                    material,
                };
                let item = FIRST_ITEM + (i as u64) * 256 + u64::from(d);
                let shaded = shader.shade_point(&point, item);
                even += shaded.diffuse + shaded.indirect;
                observations.push((to_viewer, shaded.specular, normal.dot(to_viewer)));
            }
            even /= options.bake_directions as f32;
            let local = scene.local_log_factor.as_ref().map_or(Vec3::ZERO, |l| l[i]);
            let local = (local * self.local_share).map(f32::exp);
            let is_off = self.off.get(i).is_some_and(Option::is_some);
            let factor = |basis: &[f32; 25]| match &scene.residual {
                Some(of_scene) if self.residual_share > 0.0 && !is_off => {
                    of_scene.factor(i, basis, self.residual_share)
                }
                _ => Vec3::ONE,
            };
            let sky = self.land.as_ref().map_or(0.0, |land| 1.0 - land.share[i]);
            let shown = |to_viewer: Vec3, basis: &[f32; 25], model: Vec3| {
                let model = model * local * factor(basis);
                let land = self.ratio.as_ref().map_or(model, |ratio| {
                    let shown = ratio.color(scene, i, basis);
                    shown.lerp(model, ratio.believed(ratio.model_share[i], model, shown))
                });
                if sky > 0.0 {
                    land.lerp(self.light.radiance_pdf(-to_viewer).0.min(Vec3::ONE), sky)
                } else {
                    land
                }
            };
            fit(options.sh_degree, &observations, even, &shown, sh);
        });
        baked
    }
}

/// Direction `d` of `n` on the hemisphere: a spiral of equal solid angles from the pole to 6 degrees
/// above the horizon.
fn direction(normal: Vec3, d: u32, n: u32) -> Vec3 {
    const GOLDEN: f32 = 0.618_034;
    let z = 1.0 - 0.9 * (d as f32 + 0.5) / n as f32;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * (d as f32 * GOLDEN).fract()).sin_cos();
    Frame::from_normal(normal).world_from_local(Vec3::new(r * cos, r * sin, z)).normalize()
}

fn fit(
    degree: u8,
    observations: &[(Vec3, Vec3, f32)],
    even: Vec3,
    shown: &dyn Fn(Vec3, &[f32; 25], Vec3) -> Vec3,
    sh: &mut [f32],
) {
    let k = sh_coefficients(degree);
    let basis_of = |to_viewer: Vec3| {
        let mut basis = [0.0f32; 25];
        sh_basis(MAX_SH_DEGREE, (-to_viewer).to_array(), &mut basis);
        basis
    };
    let solved = |value: &dyn Fn(Vec3, &[f32; 25], Vec3) -> Vec3| {
        let mut normal_matrix = vec![0.0f64; k * k];
        let mut right = vec![[0.0f64; 3]; k];
        for (to_viewer, specular, weight) in observations {
            let basis = basis_of(*to_viewer);
            let value = value(*to_viewer, &basis, *specular).as_dvec3().to_array();
            for a in 0..k {
                for b in 0..=a {
                    normal_matrix[a * k + b] += f64::from(weight * basis[a] * basis[b]);
                }
                for (r, c) in right[a].iter_mut().zip(value) {
                    *r += f64::from(weight * basis[a]) * c;
                }
            }
        }
        let weights: f32 = observations.iter().map(|(_, _, w)| w).sum();
        for a in 0..k {
            let ridge = if a == 0 { 1e-9 } else { RIDGE };
            normal_matrix[a * k + a] += ridge * f64::from(weights);
        }
        solve(&mut normal_matrix, &mut right, k);
        right
    };
    // Noise must be averaged before the curve and the clip, which would take it for darkness.
    let specular = solved(&|_, _, specular| specular);
    let encoded = solved(&|to_viewer, basis, _| {
        let sum = |c: usize| (0..k).map(|j| basis[j] * specular[j][c] as f32).sum::<f32>().max(0.0);
        let color = shown(to_viewer, basis, even + Vec3::new(sum(0), sum(1), sum(2)));
        Vec3::from(color.to_array().map(|v| srgb::encode(v.clamp(0.0, 1.0)) - 0.5))
    });
    for (out, solved) in sh.chunks_exact_mut(3).zip(&encoded) {
        for (o, s) in out.iter_mut().zip(solved) {
            *o = *s as f32;
        }
    }
}

/// Solves `A x = b` for a symmetric positive definite `A` given by its lower triangle; `x` replaces `b`.
fn solve(a: &mut [f64], b: &mut [[f64; 3]], n: usize) {
    // Cholesky: A = L Lᵀ, L over A.
    for i in 0..n {
        for j in 0..=i {
            let mut sum = a[i * n + j];
            for k in 0..j {
                sum -= a[i * n + k] * a[j * n + k];
            }
            a[i * n + j] = if i == j { sum.max(1e-12).sqrt() } else { sum / a[j * n + j] };
        }
    }
    // Forwards with L, backwards with Lᵀ, all channels at once.
    let step = |b: &mut [[f64; 3]], i: usize, k: usize, l: f64| {
        let known = b[k];
        b[i].iter_mut().zip(known).for_each(|(v, x)| *v -= l * x);
    };
    for i in 0..n {
        for k in 0..i {
            step(b, i, k, a[i * n + k]);
        }
        b[i] = b[i].map(|v| v / a[i * n + i]);
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            step(b, i, k, a[k * n + i]);
        }
        b[i] = b[i].map(|v| v / a[i * n + i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_color_without_direction_needs_band_0_alone() {
        let observations: Vec<(Vec3, Vec3, f32)> =
            (0..32).map(|d| (direction(Vec3::Y, d, 32), Vec3::ZERO, 1.0)).collect();
        let mut sh = [0.0; 48];
        fit(3, &observations, Vec3::new(0.2, 0.5, 0.9), &|_, _, model| model, &mut sh);
        for (c, v) in [0.2, 0.5, 0.9].into_iter().enumerate() {
            let shown = 0.5 + sh[c] * motes_math::sh::SH_C0 as f32;
            assert!((shown - srgb::encode(v)).abs() < 1e-3, "{shown}");
        }
        assert!(sh[3..].iter().all(|v| v.abs() < 1e-3), "{sh:?}");
    }

    #[test]
    fn a_highlight_is_brighter_where_it_is_seen() {
        let toward = Vec3::new(0.6, 0.0, 0.8);
        let observations: Vec<(Vec3, Vec3, f32)> = (0..64)
            .map(|d| direction(Vec3::Z, d, 64))
            .map(|v| (v, Vec3::splat(0.5 * v.dot(toward).max(0.0).powi(8)), 1.0))
            .collect();
        let mut sh = [0.0; 48];
        fit(3, &observations, Vec3::splat(0.1), &|_, _, model| model, &mut sh);
        let seen = |to_viewer: Vec3| {
            let mut basis = [0.0; 25];
            sh_basis(3, (-to_viewer).to_array(), &mut basis);
            0.5 + (0..16).map(|k| basis[k] * sh[3 * k]).sum::<f32>()
        };
        let aside = Vec3::new(-0.6, 0.0, 0.8);
        assert!((seen(toward) - srgb::encode(0.6)).abs() < 0.08, "{}", seen(toward));
        assert!((seen(aside) - srgb::encode(0.1)).abs() < 0.05, "{}", seen(aside));
        assert!((0.0..1.0).contains(&seen(-Vec3::Z)), "behind: {}", seen(-Vec3::Z));
    }
}
