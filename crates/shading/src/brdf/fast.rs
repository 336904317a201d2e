//! The BRDF in f32 for one viewer and one surface point: what does not depend on `w_i` is
//! computed once, an evaluation is a handful of products and one table look-up.

use motes_math::luminance::luminance;
use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::albedo::{Rows, multiple_scattering_fresnel};
use super::{DIELECTRIC_F0, Lobes, MIN_ALPHA, Material, albedo_table};
use crate::frame::Frame;

/// `f_r (n · w_i)⁺`, per steradian.
#[derive(Clone, Copy, Debug, Default)]
pub struct BrdfValue {
    /// Diffuse part.
    pub diffuse: Vec3,
    /// Specular part, single and multiple scattering.
    pub specular: Vec3,
}

impl BrdfValue {
    /// Both parts.
    #[inline]
    pub fn total(&self) -> Vec3 {
        self.diffuse + self.specular
    }
}

/// A material seen from one direction at one point.
///
/// When the normal faces away from the viewer, the point reflects nothing and samples nothing.
#[derive(Clone, Copy, Debug)]
pub struct Brdf {
    pub(super) material: Material,
    pub(super) normal: Vec3,
    pub(super) to_viewer: Vec3,
    /// `n · w_o`.
    pub(super) mu_o: f32,
    /// `alpha²`.
    pub(super) a: f32,
    alpha: f32,
    /// `L(μ_o)`.
    pub(super) root_o: f32,
    pub(super) f0: Vec3,
    pub(super) rows: Option<Rows<'static>>,
    /// The factor of `1 - S(w_i)` (Lambert: of 1, Burley: of `F(μ_i) F(μ_o)`).
    diffuse: Vec3,
    /// The factor of `1 - E(w_i)`.
    multiple: Vec3,
    specular_probability: f32,
    frame: Frame,
}

impl Brdf {
    /// Prepares `material` at a point with unit `normal`, seen along the unit vector `to_viewer`.
    #[inline]
    pub fn new(material: &Material, normal: Vec3, to_viewer: Vec3) -> Self {
        let mu_o = normal.dot(to_viewer).min(1.0);
        let base = material.base_color_linear;
        let mut brdf = Self {
            material: *material,
            normal,
            to_viewer,
            mu_o,
            a: 1.0,
            alpha: 1.0,
            root_o: 1.0,
            f0: Vec3::ZERO,
            rows: None,
            diffuse: base * FRAC_1_PI,
            multiple: Vec3::ZERO,
            specular_probability: 0.0,
            frame: Frame::from_normal(normal),
        };
        if material.lobes != Lobes::Lambert && mu_o > 0.0 {
            brdf.prepare_specular(base);
        }
        brdf
    }

    fn prepare_specular(&mut self, base: Vec3) {
        let (roughness, metallic) = (self.material.roughness, self.material.metallic);
        let table = albedo_table();
        let rows = table.rows(roughness);
        let [e_avg, s_avg] = table.averages(f64::from(roughness));
        let e_s = rows.at(self.mu_o);
        self.rows = Some(rows);
        self.alpha = (roughness * roughness).max(MIN_ALPHA as f32);
        self.a = self.alpha * self.alpha;
        self.root_o = (self.a + (1.0 - self.a) * self.mu_o * self.mu_o).sqrt();
        let dielectric = DIELECTRIC_F0 as f32;
        self.f0 = Vec3::splat(dielectric).lerp(base, metallic);
        self.diffuse *= 1.0 - metallic;
        if self.material.lobes == Lobes::Principled {
            self.diffuse *= (1.0 - e_s.y) / (1.0 - s_avg as f32);
        }
        let f_ms = |f0: f32| multiple_scattering_fresnel(f64::from(f0), e_avg) as f32;
        self.multiple = Vec3::from(self.f0.to_array().map(f_ms))
            * ((1.0 - e_s.x) * FRAC_1_PI / (1.0 - e_avg) as f32);
        // The same shares as `reference::Material::specular_probability`.
        let s = e_s.y;
        let specular = s + (1.0 - s) * (luminance(self.f0) - dielectric) / (1.0 - dielectric);
        let diffuse = (1.0 - metallic) * luminance(base) * (1.0 - s);
        let share = specular * e_s.x / (specular + diffuse).max(1e-6);
        self.specular_probability = share.clamp(0.1, 0.9);
    }

    /// The shading normal.
    #[inline]
    pub fn normal(&self) -> Vec3 {
        self.normal
    }

    /// The direction toward the viewer.
    #[inline]
    pub fn to_viewer(&self) -> Vec3 {
        self.to_viewer
    }

    /// Whether the normal faces away from the viewer.
    #[inline]
    pub fn faces_away(&self) -> bool {
        !(self.mu_o > 0.0)
    }

    /// `f_r (n · w_i)⁺` and the density of [`Self::sample`] at the unit vector `to_light`.
    #[inline]
    pub fn eval_pdf(&self, to_light: Vec3) -> (BrdfValue, f32) {
        let mu_i = self.normal.dot(to_light).min(1.0);
        if !(mu_i > 0.0 && self.mu_o > 0.0) {
            return (BrdfValue::default(), 0.0);
        }
        let Some(rows) = &self.rows else {
            let value = BrdfValue { diffuse: self.diffuse * mu_i, specular: Vec3::ZERO };
            return (value, mu_i * FRAC_1_PI);
        };
        let h = (to_light + self.to_viewer).normalize();
        let d = self.distribution(h);
        let root_i = (self.a + (1.0 - self.a) * mu_i * mu_i).sqrt();
        let v = 0.5 / (self.mu_o * root_i + mu_i * self.root_o);
        let c = (1.0 - self.to_viewer.dot(h)).clamp(0.0, 1.0);
        let w = c * c * (c * c) * c;
        let fresnel = self.f0 + (Vec3::ONE - self.f0) * w;
        let rest = Vec2::ONE - rows.at(mu_i);
        let coupling = match self.material.lobes {
            Lobes::Burley => burley(self.material.roughness, 1.0 - c, mu_i, self.mu_o)[0],
            _ => rest.y,
        };
        let value = BrdfValue {
            diffuse: self.diffuse * (coupling * mu_i),
            specular: (fresnel * (d * v) + self.multiple * rest.x) * mu_i,
        };
        let p = self.specular_probability;
        let reflection = d / (2.0 * (self.mu_o + self.root_o));
        (value, p * reflection + (1.0 - p) * mu_i * FRAC_1_PI)
    }

    /// `D(h)`; `sin²` comes from a cross product, as narrow lobes need.
    #[inline]
    pub(super) fn distribution(&self, h: Vec3) -> f32 {
        let mu_h = self.normal.dot(h);
        let d = self.normal.cross(h).length_squared() + self.a * mu_h * mu_h;
        self.a * FRAC_1_PI / (d * d)
    }

    /// A direction toward the light; `u` in [0, 1)³, the first chooses the lobe. None when the
    /// sampled microfacet reflects into the surface, or the point faces away.
    #[inline]
    pub fn sample(&self, u: [f32; 3]) -> Option<Vec3> {
        if self.faces_away() {
            return None;
        }
        let phi = TAU * u[1];
        let (sin, cos) = phi.sin_cos();
        if u[0] < self.specular_probability {
            let w_o = self.frame.local_from_world(self.to_viewer);
            let stretched = Vec3::new(self.alpha * w_o.x, self.alpha * w_o.y, w_o.z).normalize();
            let z = (1.0 - u[2]) * (1.0 + stretched.z) - stretched.z;
            let r = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
            let h = Vec3::new(r * cos, r * sin, z) + stretched;
            let h = Vec3::new(self.alpha * h.x, self.alpha * h.y, h.z.max(0.0));
            let h = h.normalize_or(Vec3::Z);
            let w_i = h * (2.0 * w_o.dot(h)) - w_o;
            (w_i.z > 0.0).then(|| self.frame.world_from_local(w_i).normalize())
        } else {
            let r = u[2].sqrt();
            let w_i = Vec3::new(r * cos, r * sin, (1.0 - u[2]).max(0.0).sqrt());
            (w_i.z > 0.0).then(|| self.frame.world_from_local(w_i))
        }
    }
}

/// `F(μ_i) F(μ_o)` of Burley's diffuse lobe and its derivatives by roughness, `μ_i` and `μ_o`;
/// `cos = w_o · h`.
#[inline]
pub(super) fn burley(roughness: f32, cos: f32, mu_i: f32, mu_o: f32) -> [f32; 4] {
    let rise = 2.0 * roughness * cos * cos - 0.5;
    let (ci, co) = (1.0 - mu_i, (1.0 - mu_o).max(0.0));
    let (i4, o4) = (ci * ci * (ci * ci), co * co * (co * co));
    let (fi, fo) = (1.0 + rise * i4 * ci, 1.0 + rise * o4 * co);
    let by_roughness = 2.0 * cos * cos * (i4 * ci * fo + o4 * co * fi);
    [fi * fo, by_roughness, -5.0 * rise * i4 * fo, -5.0 * rise * o4 * fi]
}
