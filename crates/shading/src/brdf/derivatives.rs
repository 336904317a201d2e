//! `f_r (n · w_i)⁺` with its derivatives, for fits.
//!
//! Everything is a function of `μ_i = n · w_i`, `μ_o = n · w_o`, `μ_h = n · h` and of constants
//! of the pair of directions, so `∂/∂n = ∂/∂μ_i w_i + ∂/∂μ_o w_o + ∂/∂μ_h h`. That gradient is not
//! projected on the sphere of unit normals: a caller that moves along it projects and normalizes.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::albedo::Sloped;
use super::fast::burley;
use super::{Brdf, BrdfValue, DIELECTRIC_F0, Lobes, MIN_ALPHA, albedo_table};

/// Value and derivatives of `f_r (n · w_i)⁺`, per channel.
#[derive(Clone, Copy, Debug, Default)]
pub struct BrdfDerivatives {
    /// The value, as [`Brdf::eval_pdf`] gives it.
    pub value: BrdfValue,
    /// `∂/∂base_color` of the same channel (channels do not mix).
    pub by_base_color: Vec3,
    /// `∂/∂roughness`; that of the microfacet lobe is 0 below the floor of its width.
    pub by_roughness: Vec3,
    /// `∂/∂metallic`.
    pub by_metallic: Vec3,
    /// `∂/∂n`: entry `[channel]` is a world vector.
    pub by_normal: [Vec3; 3],
}

/// A [`Brdf`] with what its derivatives share for all directions of light.
#[derive(Clone, Copy, Debug)]
pub struct DifferentiableBrdf {
    brdf: Brdf,
    /// `(E, S)` at the viewer.
    viewer: Sloped<Vec2>,
    /// `1 - (E_avg, S_avg)` and the averages' derivatives by roughness.
    lost: Vec2,
    averages_by_roughness: Vec2,
    /// `F_ms` and its derivatives by `F_0` and by `E_avg`.
    f_ms: Vec3,
    f_ms_by_f0: Vec3,
    f_ms_by_e: Vec3,
    /// `∂alpha²/∂roughness`.
    a_by_roughness: f32,
}

/// A coupling factor times `μ_i / π`, with derivatives.
#[derive(Clone, Copy)]
struct Coupling {
    value: f32,
    by_roughness: f32,
    by_mu_i: f32,
    by_mu_o: f32,
}

impl Brdf {
    /// Prepares derivatives for many directions of light.
    pub fn differentiable(self) -> DifferentiableBrdf {
        let roughness = self.material.roughness;
        let mut out = DifferentiableBrdf {
            brdf: self,
            viewer: Sloped::default(),
            lost: Vec2::ONE,
            averages_by_roughness: Vec2::ZERO,
            f_ms: Vec3::ZERO,
            f_ms_by_f0: Vec3::ZERO,
            f_ms_by_e: Vec3::ZERO,
            a_by_roughness: 0.0,
        };
        let Some(rows) = &self.rows else {
            return out;
        };
        let table = albedo_table();
        let [e_avg, s_avg] = table.averages(f64::from(roughness));
        let [e_by, s_by] = table.averages_by_roughness(f64::from(roughness));
        let lost = 1.0 - e_avg;
        out.viewer = rows.sloped(self.mu_o);
        out.lost = Vec2::new(lost as f32, (1.0 - s_avg) as f32);
        out.averages_by_roughness = Vec2::new(e_by as f32, s_by as f32);
        for k in 0..3 {
            // F_avg² e / (1 - F_avg (1 - e)) and its derivatives by F_avg and e.
            let f_avg = (20.0 * f64::from(self.f0[k]) + 1.0) / 21.0;
            let rest = 1.0 - f_avg * lost;
            out.f_ms[k] = (f_avg * f_avg * e_avg / rest) as f32;
            let by_avg = f_avg * e_avg * (2.0 - f_avg * lost) / (rest * rest);
            out.f_ms_by_f0[k] = (by_avg * 20.0 / 21.0) as f32;
            out.f_ms_by_e[k] = (f_avg * f_avg * (1.0 - f_avg) / (rest * rest)) as f32;
        }
        if roughness * roughness > MIN_ALPHA as f32 {
            out.a_by_roughness = 4.0 * roughness.powi(3);
        }
        out
    }

    /// [`DifferentiableBrdf::eval`] for a single direction.
    pub fn eval_with_derivatives(&self, to_light: Vec3) -> BrdfDerivatives {
        self.differentiable().eval(to_light)
    }
}

impl DifferentiableBrdf {
    /// The BRDF itself.
    pub fn brdf(&self) -> &Brdf {
        &self.brdf
    }

    /// `f_r (n · w_i)⁺` and its derivatives; zero when either direction is below the surface.
    #[inline]
    pub fn eval(&self, to_light: Vec3) -> BrdfDerivatives {
        let brdf = &self.brdf;
        let mu_i = brdf.normal.dot(to_light).min(1.0);
        let mu_o = brdf.mu_o;
        if !(mu_i > 0.0 && mu_o > 0.0) {
            return BrdfDerivatives::default();
        }
        let base = brdf.material.base_color_linear;
        let Some(rows) = &brdf.rows else {
            return lambert(base, mu_i, to_light);
        };
        let m = brdf.material.metallic;

        // Single scattering: T = D V μ_i, times Fresnel.
        let a = brdf.a;
        let h = (to_light + brdf.to_viewer).normalize();
        let mu_h = brdf.normal.dot(h);
        let d_root = brdf.normal.cross(h).length_squared() + a * mu_h * mu_h;
        let inverse = 1.0 / d_root;
        let d = a * FRAC_1_PI * inverse * inverse;
        let d_by_a = FRAC_1_PI * inverse * inverse - 2.0 * d * mu_h * mu_h * inverse;
        let d_by_mu_h = -4.0 * d * mu_h * (a - 1.0) * inverse;
        let root_i = (a + (1.0 - a) * mu_i * mu_i).sqrt();
        let root_o = brdf.root_o;
        let v = 0.5 / (mu_o * root_i + mu_i * root_o);
        let v_by_q = -2.0 * v * v;
        let q_by_a =
            0.5 * (mu_o * (1.0 - mu_i * mu_i) / root_i + mu_i * (1.0 - mu_o * mu_o) / root_o);
        let q_by_mu_i = mu_o * (1.0 - a) * mu_i / root_i + root_o;
        let q_by_mu_o = root_i + mu_i * (1.0 - a) * mu_o / root_o;
        let single = d * v * mu_i;
        let single_by_roughness = (d_by_a * v + d * v_by_q * q_by_a) * mu_i * self.a_by_roughness;
        let single_by_mu_i = d * (v_by_q * q_by_mu_i * mu_i + v);
        let single_by_mu_o = d * v_by_q * q_by_mu_o * mu_i;
        let single_by_mu_h = d_by_mu_h * v * mu_i;
        let c = (1.0 - brdf.to_viewer.dot(h)).clamp(0.0, 1.0);
        let w = c * c * (c * c) * c;

        let light = rows.sloped(mu_i);
        let multiple = self.couple(0, &light, mu_i);
        let coupling = match brdf.material.lobes {
            Lobes::Burley => {
                let [f, by_r, by_i, by_o] = burley(brdf.material.roughness, 1.0 - c, mu_i, mu_o);
                Coupling {
                    value: f * mu_i * FRAC_1_PI,
                    by_roughness: by_r * mu_i * FRAC_1_PI,
                    by_mu_i: (by_i * mu_i + f) * FRAC_1_PI,
                    by_mu_o: by_o * mu_i * FRAC_1_PI,
                }
            }
            _ => self.couple(1, &light, mu_i),
        };

        let fresnel = brdf.f0 + (Vec3::ONE - brdf.f0) * w;
        let diffuse = base * (1.0 - m);
        let by_f0 = Vec3::splat(single * (1.0 - w)) + self.f_ms_by_f0 * multiple.value;
        let by_mu_i =
            fresnel * single_by_mu_i + self.f_ms * multiple.by_mu_i + diffuse * coupling.by_mu_i;
        let by_mu_o =
            fresnel * single_by_mu_o + self.f_ms * multiple.by_mu_o + diffuse * coupling.by_mu_o;
        let by_mu_h = fresnel * single_by_mu_h;
        let normal =
            |k: usize| to_light * by_mu_i[k] + brdf.to_viewer * by_mu_o[k] + h * by_mu_h[k];
        BrdfDerivatives {
            value: BrdfValue {
                diffuse: diffuse * coupling.value,
                specular: fresnel * single + self.f_ms * multiple.value,
            },
            by_base_color: by_f0 * m + (1.0 - m) * coupling.value,
            by_roughness: fresnel * single_by_roughness
                + self.f_ms * multiple.by_roughness
                + self.f_ms_by_e * (multiple.value * self.averages_by_roughness.x)
                + diffuse * coupling.by_roughness,
            by_metallic: by_f0 * (base - Vec3::splat(DIELECTRIC_F0 as f32)) - base * coupling.value,
            by_normal: [normal(0), normal(1), normal(2)],
        }
    }

    /// `(1 - X_o)(1 - X_i) μ_i / (π (1 - X_avg))` for `X` = `E` (0) or `S` (1).
    #[inline]
    fn couple(&self, k: usize, light: &Sloped<Vec2>, mu_i: f32) -> Coupling {
        let (i, o, lost) = (light, &self.viewer, self.lost[k]);
        let (rest_i, rest_o) = (1.0 - i.value[k], 1.0 - o.value[k]);
        let scale = FRAC_1_PI / lost;
        let value = rest_i * rest_o * mu_i * scale;
        let by_rests = i.by_roughness[k] * rest_o + o.by_roughness[k] * rest_i;
        Coupling {
            value,
            by_roughness: value * self.averages_by_roughness[k] / lost - by_rests * mu_i * scale,
            by_mu_i: (rest_i - i.by_mu[k] * mu_i) * rest_o * scale,
            by_mu_o: -o.by_mu[k] * rest_i * mu_i * scale,
        }
    }
}

fn lambert(base: Vec3, mu_i: f32, to_light: Vec3) -> BrdfDerivatives {
    BrdfDerivatives {
        value: BrdfValue { diffuse: base * (FRAC_1_PI * mu_i), specular: Vec3::ZERO },
        by_base_color: Vec3::splat(FRAC_1_PI * mu_i),
        by_normal: base.to_array().map(|b| to_light * (b * FRAC_1_PI)),
        ..BrdfDerivatives::default()
    }
}
