//! `f_r (n · w_i)⁺` with its derivatives, for fits.
//!
//! Everything is a function of `μ_i = n · w_i`, `μ_o = n · w_o`, `μ_h = n · h` and of constants
//! of the pair of directions, so `∂/∂n = ∂/∂μ_i w_i + ∂/∂μ_o w_o + ∂/∂μ_h h`. That gradient is not
//! projected on the sphere of unit normals: a caller that moves along it projects and normalises.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::fast::burley;
use super::{Brdf, BrdfValue, DIELECTRIC_F0, Lobes, MIN_ALPHA, albedo_table};

/// Value and derivatives of `f_r (n · w_i)⁺`, per channel.
#[derive(Clone, Copy, Debug, Default)]
pub struct BrdfDerivatives {
    /// The value, as [`Brdf::eval_pdf`] gives it.
    pub value: BrdfValue,
    /// `∂/∂base_color` of the same channel (channels do not mix).
    pub by_base_color: Vec3,
    /// `∂/∂roughness`; 0 below the floor of the lobe's width.
    pub by_roughness: Vec3,
    /// `∂/∂metallic`.
    pub by_metallic: Vec3,
    /// `∂/∂n`: entry `[channel]` is a world vector.
    pub by_normal: [Vec3; 3],
}

impl Brdf {
    /// `f_r (n · w_i)⁺` and its derivatives; zero when either direction is below the surface.
    pub fn eval_with_derivatives(&self, to_light: Vec3) -> BrdfDerivatives {
        let (value, _) = self.eval_pdf(to_light);
        let mu_i = self.normal.dot(to_light).min(1.0);
        let mu_o = self.mu_o;
        if !(mu_i > 0.0 && mu_o > 0.0) {
            return BrdfDerivatives::default();
        }
        let base = self.material.base_color_linear;
        let Some(rows) = &self.rows else {
            let slope = FRAC_1_PI * mu_i;
            return BrdfDerivatives {
                value,
                by_base_color: Vec3::splat(slope),
                by_normal: base.to_array().map(|b| b * FRAC_1_PI * to_light),
                ..BrdfDerivatives::default()
            };
        };
        let (roughness, m) = (self.material.roughness, self.material.metallic);

        // Single scattering: T = D V μ_i, times Fresnel.
        let a = self.a;
        let h = (to_light + self.to_viewer).normalize();
        let mu_h = self.normal.dot(h);
        let d_root = self.normal.cross(h).length_squared() + a * mu_h * mu_h;
        let d = a * FRAC_1_PI / (d_root * d_root);
        let d_by_a = d / a - 2.0 * d * mu_h * mu_h / d_root;
        let d_by_mu_h = -4.0 * d * mu_h * (a - 1.0) / d_root;
        let root_i = (a + (1.0 - a) * mu_i * mu_i).sqrt();
        let root_o = self.root_o;
        let q = mu_o * root_i + mu_i * root_o;
        let v = 0.5 / q;
        let v_by_q = -v / q;
        let q_by_a =
            0.5 * (mu_o * (1.0 - mu_i * mu_i) / root_i + mu_i * (1.0 - mu_o * mu_o) / root_o);
        let q_by_mu_i = mu_o * (1.0 - a) * mu_i / root_i + root_o;
        let q_by_mu_o = root_i + mu_i * (1.0 - a) * mu_o / root_o;
        let single = d * v * mu_i;
        let above_floor = roughness * roughness > MIN_ALPHA as f32;
        let a_by_roughness = if above_floor { 4.0 * roughness.powi(3) } else { 0.0 };
        let single_by_roughness = (d_by_a * v + d * v_by_q * q_by_a) * mu_i * a_by_roughness;
        let single_by_mu_i = d * (v_by_q * q_by_mu_i * mu_i + v);
        let single_by_mu_o = d * v_by_q * q_by_mu_o * mu_i;
        let single_by_mu_h = d_by_mu_h * v * mu_i;
        let c = (1.0 - self.to_viewer.dot(h)).clamp(0.0, 1.0);
        let w = c * c * (c * c) * c;

        // Couplings: M = (1 - E_o)(1 - E_i) μ_i / (π (1 - E_avg)), K the same with S.
        let table = albedo_table();
        let averages = table.averages(f64::from(roughness));
        let e_avg = averages[0] as f32;
        let [e_lost, s_lost] = averages.map(|v| (1.0 - v) as f32);
        let [e_avg_by, s_avg_by] =
            table.averages_by_roughness(f64::from(roughness)).map(|v| v as f32);
        let (i, o) = (rows.sloped(mu_i), rows.sloped(mu_o));
        let couple = |k: usize, lost: f32, average_by: f32| {
            let (ri, ro) = (1.0 - i.value[k], 1.0 - o.value[k]);
            let scale = FRAC_1_PI / lost;
            let value = ri * ro * mu_i * scale;
            let by_roughness = -(i.by_roughness[k] * ro + o.by_roughness[k] * ri) * mu_i * scale
                + value * average_by / lost;
            let by_mu_i = (ri - i.by_mu[k] * mu_i) * ro * scale;
            let by_mu_o = -o.by_mu[k] * ri * mu_i * scale;
            [value, by_roughness, by_mu_i, by_mu_o]
        };
        let [multiple, multiple_by_r, multiple_by_i, multiple_by_o] = couple(0, e_lost, e_avg_by);
        let [coupling, coupling_by_r, coupling_by_i, coupling_by_o] = match self.material.lobes {
            Lobes::Burley => {
                let [f, by_r, by_i, by_o] = burley(roughness, 1.0 - c, mu_i, mu_o);
                [f * mu_i, by_r * mu_i, by_i * mu_i + f, by_o * mu_i].map(|v| v * FRAC_1_PI)
            }
            _ => couple(1, s_lost, s_avg_by),
        };

        let mut out = BrdfDerivatives { value, ..BrdfDerivatives::default() };
        let dielectric = DIELECTRIC_F0 as f32;
        for k in 0..3 {
            let (b, f0) = (base[k], self.f0[k]);
            let fresnel = f0 + (1.0 - f0) * w;
            let f_avg = (20.0 * f0 + 1.0) / 21.0;
            let rest = 1.0 - f_avg * (1.0 - e_avg);
            let f_ms = f_avg * f_avg * e_avg / rest;
            // d/dF_avg of F_avg² e / (1 - F_avg (1 - e)), and d/de.
            let f_ms_by_avg = f_avg * e_avg * (2.0 - f_avg * (1.0 - e_avg)) / (rest * rest);
            let f_ms_by_e = f_avg * f_avg * (1.0 - f_avg) / (rest * rest);
            let by_f0 = single * (1.0 - w) + multiple * f_ms_by_avg * (20.0 / 21.0);
            out.by_base_color[k] = by_f0 * m + (1.0 - m) * coupling;
            out.by_metallic[k] = by_f0 * (b - dielectric) - b * coupling;
            let diffuse = (1.0 - m) * b;
            out.by_roughness[k] = fresnel * single_by_roughness
                + f_ms * multiple_by_r
                + multiple * f_ms_by_e * e_avg_by
                + diffuse * coupling_by_r;
            let by_mu_i = fresnel * single_by_mu_i + f_ms * multiple_by_i + diffuse * coupling_by_i;
            let by_mu_o = fresnel * single_by_mu_o + f_ms * multiple_by_o + diffuse * coupling_by_o;
            out.by_normal[k] =
                to_light * by_mu_i + self.to_viewer * by_mu_o + h * (fresnel * single_by_mu_h);
        }
        out
    }
}
