//! A diffuse lobe under the GGX lobes, in f64 and in f32.
//!
//! In f32, what does not depend on `w_i` is computed once per viewer and point; an evaluation is a handful of products and one
//! table look-up.

use std::f32::consts::{FRAC_1_PI, TAU};
use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};
use motes_math::luminance::{luminance, luminance_f64};

use super::albedo::{Rows, multiple_scattering_fresnel};
use super::lambert::{cosine_direction, cosine_direction_f64};
use super::microfacet::{
    alpha, distribution, reflection_pdf, sample_visible_normal, schlick, visibility,
};
use super::model::{BrdfValue, Model};
use super::reference::{self, Value};
use super::{DIELECTRIC_F0, MIN_ALPHA, Material, albedo_table};
use crate::frame::Frame;

/// The diffuse lobe of a [`Coated`] material: the factor that stands beside `(1 - m) b / π`. It does not depend on base color
/// or metallic, and is symmetric in `w_i` and `w_o`.
pub trait DiffuseLobe: Copy {
    /// As [`Model::FURNACE_ERROR`].
    const FURNACE_ERROR: f64;

    /// What does not depend on the light, and a factor that does not either.
    fn prepare(roughness: f32, coat: &Coat) -> (Self, f32);

    /// The rest of the factor.
    fn factor(&self, angles: &Angles) -> f32;

    /// The whole factor in f64: the definition.
    fn reference(roughness: f64, coat: &CoatF64) -> f64;
}

/// The coat as the viewer sees it.
#[derive(Clone, Copy, Debug)]
pub struct Coat {
    /// `n · w_o`.
    pub mu_o: f32,
    /// `S(μ_o)`: directional albedo of the specular lobes of a dielectric.
    pub albedo_o: f32,
    /// `S_avg`: its mean over the hemisphere, weighted by the cosine.
    pub albedo_avg: f32,
}

/// A direction of light over the coat.
#[derive(Clone, Copy, Debug)]
pub struct Angles {
    /// `n · w_i`.
    pub mu_i: f32,
    /// `w_o · h`.
    pub half: f32,
    /// `w_i · w_o`.
    pub to_light_dot_to_viewer: f32,
    /// `1 - S(μ_i)`.
    pub transmission_i: f32,
}

/// Both directions over the coat, in f64.
#[derive(Clone, Copy, Debug)]
pub struct CoatF64 {
    /// `n · w_i`.
    pub mu_i: f64,
    /// `n · w_o`.
    pub mu_o: f64,
    /// `w_o · h`.
    pub half: f64,
    /// `w_i · w_o`.
    pub to_light_dot_to_viewer: f64,
    /// `S(μ_i)`.
    pub albedo_i: f64,
    /// `S(μ_o)`.
    pub albedo_o: f64,
    /// `S_avg`.
    pub albedo_avg: f64,
}

/// A diffuse lobe under the GGX lobes, prepared for one viewer and point.
#[derive(Clone, Copy, Debug)]
pub struct Coated<D> {
    normal: Vec3,
    to_viewer: Vec3,
    /// `n · w_o`.
    mu_o: f32,
    /// `alpha²`.
    a: f32,
    alpha: f32,
    /// `L(μ_o)`.
    root_o: f32,
    f0: Vec3,
    /// None where the normal faces away: nothing is prepared.
    lobe: Option<(D, Rows<'static>)>,
    /// The factor of [`DiffuseLobe::factor`].
    diffuse: Vec3,
    /// The factor of `1 - E(w_i)`.
    multiple: Vec3,
    specular_probability: f32,
    frame: Frame,
}

/// What depends on the direction of light but on neither base color nor metallic.
#[derive(Clone, Copy, Debug)]
struct Factors {
    /// `n · w_i`.
    mu_i: f32,
    /// `D(h)`.
    distribution: f32,
    /// `D(h) V`.
    single: f32,
    /// Schlick's `(1 - w_o · h)⁵`.
    fresnel: f32,
    /// `1 - E(μ_i)`.
    multiple: f32,
    /// Of the diffuse lobe, with the cosine.
    diffuse: f32,
}

impl<D: DiffuseLobe> Coated<D> {
    fn prepare(&mut self, material: &Material) {
        let base = material.base_color_linear;
        let (roughness, metallic) = (material.roughness, material.metallic);
        let table = albedo_table();
        let rows = table.rows(roughness);
        let [e_avg, s_avg] = table.averages(f64::from(roughness));
        let e_s = rows.at(self.mu_o);
        self.alpha = (roughness * roughness).max(MIN_ALPHA as f32);
        self.a = self.alpha * self.alpha;
        self.root_o = (self.a + (1.0 - self.a) * self.mu_o * self.mu_o).sqrt();
        let dielectric = DIELECTRIC_F0 as f32;
        self.f0 = Vec3::splat(dielectric).lerp(base, metallic);
        self.diffuse *= 1.0 - metallic;
        let coat = Coat { mu_o: self.mu_o, albedo_o: e_s.y, albedo_avg: s_avg as f32 };
        let (lobe, factor) = D::prepare(roughness, &coat);
        self.lobe = Some((lobe, rows));
        self.diffuse *= factor;
        let f_ms = |f0: f32| multiple_scattering_fresnel(f64::from(f0), e_avg) as f32;
        self.multiple = Vec3::from(self.f0.to_array().map(f_ms))
            * ((1.0 - e_s.x) * FRAC_1_PI / (1.0 - e_avg) as f32);
        // The same shares as `specular_probability`.
        let s = e_s.y;
        let specular = s + (1.0 - s) * (luminance(self.f0) - dielectric) / (1.0 - dielectric);
        let diffuse = (1.0 - metallic) * luminance(base) * (1.0 - s);
        let share = specular * e_s.x / (specular + diffuse).max(1e-6);
        self.specular_probability = share.clamp(0.1, 0.9);
    }

    /// None where either side is below the surface.
    #[inline]
    fn factors_at(&self, to_light: Vec3) -> Option<Factors> {
        let mu_i = self.normal.dot(to_light).min(1.0);
        let (lobe, rows) = self.lobe.as_ref().filter(|_| mu_i > 0.0)?;
        let h = (to_light + self.to_viewer).normalize();
        let d = self.distribution(h);
        let root_i = (self.a + (1.0 - self.a) * mu_i * mu_i).sqrt();
        let v = 0.5 / (self.mu_o * root_i + mu_i * self.root_o);
        let c = (1.0 - self.to_viewer.dot(h)).clamp(0.0, 1.0);
        let rest = Vec2::ONE - rows.at(mu_i);
        let angles = Angles {
            mu_i,
            half: 1.0 - c,
            to_light_dot_to_viewer: to_light.dot(self.to_viewer),
            transmission_i: rest.y,
        };
        Some(Factors {
            mu_i,
            distribution: d,
            single: d * v,
            fresnel: c * c * (c * c) * c,
            multiple: rest.x,
            diffuse: lobe.factor(&angles) * mu_i,
        })
    }

    #[inline]
    fn value(&self, factors: &Factors) -> BrdfValue {
        let fresnel = self.f0 + (Vec3::ONE - self.f0) * factors.fresnel;
        BrdfValue {
            diffuse: self.diffuse * factors.diffuse,
            specular: (fresnel * factors.single + self.multiple * factors.multiple) * factors.mu_i,
        }
    }

    /// `D(h)`; `sin²` comes from a cross product, as narrow lobes need.
    #[inline]
    fn distribution(&self, h: Vec3) -> f32 {
        let mu_h = self.normal.dot(h);
        let d = self.normal.cross(h).length_squared() + self.a * mu_h * mu_h;
        self.a * FRAC_1_PI / (d * d)
    }
}

impl<D: DiffuseLobe> Model for Coated<D> {
    const FURNACE_ERROR: f64 = D::FURNACE_ERROR;

    #[inline]
    fn new(material: &Material, normal: Vec3, to_viewer: Vec3) -> Self {
        let mu_o = normal.dot(to_viewer).min(1.0);
        let mut model = Self {
            normal,
            to_viewer,
            mu_o,
            a: 1.0,
            alpha: 1.0,
            root_o: 1.0,
            f0: Vec3::ZERO,
            lobe: None,
            diffuse: material.base_color_linear * FRAC_1_PI,
            multiple: Vec3::ZERO,
            specular_probability: 0.0,
            frame: Frame::from_normal(normal),
        };
        if mu_o > 0.0 {
            model.prepare(material);
        }
        model
    }

    fn normal(&self) -> Vec3 {
        self.normal
    }

    #[inline]
    fn faces_away(&self) -> bool {
        !(self.mu_o > 0.0)
    }

    #[inline]
    fn eval_pdf(&self, to_light: Vec3) -> (BrdfValue, f32) {
        let Some(factors) = self.factors_at(to_light) else {
            return (BrdfValue::default(), 0.0);
        };
        let p = self.specular_probability;
        let reflection = factors.distribution / (2.0 * (self.mu_o + self.root_o));
        (self.value(&factors), p * reflection + (1.0 - p) * factors.mu_i * FRAC_1_PI)
    }

    #[inline]
    fn eval_alike<const N: usize>(models: &[Self; N], to_light: Vec3) -> [BrdfValue; N] {
        let factors = models.first().and_then(|model| model.factors_at(to_light));
        models.each_ref().map(|model| factors.map(|f| model.value(&f)).unwrap_or_default())
    }

    /// The first number chooses the lobe.
    #[inline]
    fn sample(&self, u: [f32; 3]) -> Option<Vec3> {
        if self.faces_away() {
            return None;
        }
        let phi = TAU * u[1];
        if u[0] < self.specular_probability {
            let (sin, cos) = phi.sin_cos();
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
            let w_i = cosine_direction(phi, u[2]);
            (w_i.z > 0.0).then(|| self.frame.world_from_local(w_i))
        }
    }

    fn factors(material: &Material) -> [Vec3; 2] {
        let (b, m) = (material.base_color_linear, material.metallic);
        [b * (1.0 - m), Vec3::splat(DIELECTRIC_F0 as f32).lerp(b, m)]
    }

    fn eval_reference(material: &reference::Material, w_i: DVec3, w_o: DVec3) -> Value {
        let roughness = material.roughness;
        let table = albedo_table();
        let [e_o, s_o] = table.at(w_o.z, roughness);
        let [e_i, s_i] = table.at(w_i.z, roughness);
        let [e_avg, s_avg] = table.averages(roughness);

        let alpha = alpha(roughness);
        let h = (w_i + w_o).normalize();
        let single = distribution(alpha, h) * visibility(alpha, w_i.z, w_o.z);
        let multiple = (1.0 - e_o) * (1.0 - e_i) / (PI * (1.0 - e_avg));
        let specular = |f0: f64| {
            single * schlick(f0, w_o.dot(h)) + multiple * multiple_scattering_fresnel(f0, e_avg)
        };
        let coat = CoatF64 {
            mu_i: w_i.z,
            mu_o: w_o.z,
            half: w_o.dot(h),
            to_light_dot_to_viewer: w_i.dot(w_o),
            albedo_i: s_i,
            albedo_o: s_o,
            albedo_avg: s_avg,
        };
        let base = (1.0 - material.metallic) * material.base_color_linear / PI;
        Value {
            diffuse: base * D::reference(roughness, &coat),
            specular: DVec3::from(material.f0().to_array().map(specular)),
        }
    }

    fn pdf_reference(material: &reference::Material, w_i: DVec3, w_o: DVec3) -> f64 {
        let p = specular_probability(material, w_o.z);
        p * reflection_pdf(alpha(material.roughness), w_i, w_o) + (1.0 - p) * w_i.z / PI
    }

    /// The first number chooses the lobe.
    fn sample_reference(material: &reference::Material, w_o: DVec3, u: [f64; 3]) -> DVec3 {
        if u[0] < specular_probability(material, w_o.z) {
            let h = sample_visible_normal(alpha(material.roughness), w_o, [u[1], u[2]]);
            return 2.0 * w_o.dot(h) * h - w_o;
        }
        cosine_direction_f64(u[1], u[2])
    }
}

/// Probability of sampling the microfacet lobe rather than the cosine lobe, about in proportion to their albedos as seen from
/// the cosine `mu`. Any value would be unbiased.
fn specular_probability(material: &reference::Material, mu: f64) -> f64 {
    // The specular albedo is S at F_0 = 0.04 and 1 at F_0 = 1, nearly linear between.
    // The share E of it is the microfacet lobe, the rest is flat enough for the cosine lobe.
    let [e, s] = albedo_table().at(mu.max(0.0), material.roughness);
    let f0 = luminance_f64(material.f0());
    let specular = s + (1.0 - s) * (f0 - DIELECTRIC_F0) / (1.0 - DIELECTRIC_F0);
    let diffuse = (1.0 - material.metallic) * luminance_f64(material.base_color_linear) * (1.0 - s);
    // Neither lobe starves: the light between them would be noise.
    (specular * e / (specular + diffuse).max(1e-6)).clamp(0.1, 0.9)
}
