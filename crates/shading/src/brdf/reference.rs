//! The BRDF in f64, one expression per equation of the parent module.

use motes_math::luminance::luminance_f64;
use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::albedo::multiple_scattering_fresnel;
use super::microfacet::{
    alpha, distribution, reflection_pdf, sample_visible_normal, schlick, visibility,
};
use super::{DIELECTRIC_F0, Lobes, albedo_table};
use crate::frame::FrameF64;

/// [`super::Material`] in f64.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// Linear base color, 0 to 1.
    pub base_color_linear: DVec3,
    /// Perceptual roughness, 0 to 1.
    pub roughness: f64,
    /// 0 for a dielectric, 1 for a metal.
    pub metallic: f64,
    /// Which lobes exist.
    pub lobes: Lobes,
}

impl From<super::Material> for Material {
    fn from(m: super::Material) -> Self {
        Self {
            base_color_linear: m.base_color_linear.as_dvec3(),
            roughness: f64::from(m.roughness),
            metallic: f64::from(m.metallic),
            lobes: m.lobes,
        }
    }
}

/// `f_r` of the diffuse and of the specular lobes, per steradian.
#[derive(Clone, Copy, Debug, Default)]
pub struct Value {
    /// Diffuse part.
    pub diffuse: DVec3,
    /// Specular part, single and multiple scattering.
    pub specular: DVec3,
}

impl Value {
    /// Both parts.
    pub fn total(&self) -> DVec3 {
        self.diffuse + self.specular
    }
}

impl Material {
    /// `F_0` per channel.
    pub fn f0(&self) -> DVec3 {
        DVec3::splat(DIELECTRIC_F0).lerp(self.base_color_linear, self.metallic)
    }

    /// `f_r(w_i, w_o)` in world, `normal` and both directions unit vectors; 0 when either
    /// direction is below the surface.
    pub fn eval(&self, normal: DVec3, to_light: DVec3, to_viewer: DVec3) -> Value {
        let frame = FrameF64::from_normal(normal);
        let (w_i, w_o) = (frame.local_from_world(to_light), frame.local_from_world(to_viewer));
        if !(w_i.z > 0.0 && w_o.z > 0.0) {
            return Value::default();
        }
        if self.lobes == Lobes::Lambert {
            return Value { diffuse: self.base_color_linear / PI, specular: DVec3::ZERO };
        }
        let table = albedo_table();
        let [e_o, s_o] = table.at(w_o.z, self.roughness);
        let [e_i, s_i] = table.at(w_i.z, self.roughness);
        let [e_avg, s_avg] = table.averages(self.roughness);

        let alpha = alpha(self.roughness);
        let h = (w_i + w_o).normalize();
        let single = distribution(alpha, h) * visibility(alpha, w_i.z, w_o.z);
        let multiple = (1.0 - e_o) * (1.0 - e_i) / (PI * (1.0 - e_avg));
        let specular = |f0: f64| {
            single * schlick(f0, w_o.dot(h)) + multiple * multiple_scattering_fresnel(f0, e_avg)
        };
        let coupling = match self.lobes {
            Lobes::Burley => {
                let f90 = 0.5 + 2.0 * self.roughness * w_o.dot(h).powi(2);
                let f = |mu: f64| 1.0 + (f90 - 1.0) * (1.0 - mu).max(0.0).powi(5);
                f(w_i.z) * f(w_o.z)
            }
            _ => (1.0 - s_o) * (1.0 - s_i) / (1.0 - s_avg),
        };
        Value {
            diffuse: (1.0 - self.metallic) * self.base_color_linear / PI * coupling,
            specular: DVec3::from(self.f0().to_array().map(specular)),
        }
    }

    /// Probability of sampling the microfacet lobe rather than the cosine lobe, about in
    /// proportion to their albedos as seen from the cosine `mu`. Any value would be unbiased.
    pub fn specular_probability(&self, mu: f64) -> f64 {
        if self.lobes == Lobes::Lambert {
            return 0.0;
        }
        // The specular albedo is S at F_0 = 0.04 and 1 at F_0 = 1, nearly linear between.
        // The share E of it is the microfacet lobe, the rest is flat enough for the cosine lobe.
        let [e, s] = albedo_table().at(mu.max(0.0), self.roughness);
        let f0 = luminance_f64(self.f0());
        let specular = s + (1.0 - s) * (f0 - DIELECTRIC_F0) / (1.0 - DIELECTRIC_F0);
        let diffuse = (1.0 - self.metallic) * luminance_f64(self.base_color_linear) * (1.0 - s);
        // Neither lobe starves: the light between them would be noise.
        (specular * e / (specular + diffuse).max(1e-6)).clamp(0.1, 0.9)
    }

    /// Density per steradian of [`Self::sample`]; 0 below the surface.
    pub fn pdf(&self, normal: DVec3, to_light: DVec3, to_viewer: DVec3) -> f64 {
        let frame = FrameF64::from_normal(normal);
        let (w_i, w_o) = (frame.local_from_world(to_light), frame.local_from_world(to_viewer));
        if !(w_i.z > 0.0 && w_o.z > 0.0) {
            return 0.0;
        }
        let p = self.specular_probability(w_o.z);
        p * reflection_pdf(alpha(self.roughness), w_i, w_o) + (1.0 - p) * w_i.z / PI
    }

    /// A direction toward the light; `u` in [0, 1)³, the first chooses the lobe. None when the
    /// sampled microfacet reflects into the surface: that share of the density is lost, as
    /// [`Self::pdf`] says.
    pub fn sample(&self, normal: DVec3, to_viewer: DVec3, u: [f64; 3]) -> Option<DVec3> {
        let frame = FrameF64::from_normal(normal);
        let w_o = frame.local_from_world(to_viewer);
        if !(w_o.z > 0.0) {
            return None;
        }
        let w_i = if u[0] < self.specular_probability(w_o.z) {
            let h = sample_visible_normal(alpha(self.roughness), w_o, [u[1], u[2]]);
            2.0 * w_o.dot(h) * h - w_o
        } else {
            let (r, phi) = (u[1].sqrt(), TAU * u[2]);
            DVec3::new(r * phi.cos(), r * phi.sin(), (1.0 - u[1]).max(0.0).sqrt())
        };
        (w_i.z > 0.0).then(|| frame.world_from_local(w_i))
    }
}
