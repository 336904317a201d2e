//! The BRDF in f64, one expression per equation of the parent module.

use glam::DVec3;

use super::model::{Model, WithModel};
use super::{DIELECTRIC_F0, Lobes, with_model};
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
        with_model(self.lobes, Eval { material: self, w_i, w_o })
    }

    /// Density per steradian of [`Self::sample`]; 0 below the surface.
    pub fn pdf(&self, normal: DVec3, to_light: DVec3, to_viewer: DVec3) -> f64 {
        let frame = FrameF64::from_normal(normal);
        let (w_i, w_o) = (frame.local_from_world(to_light), frame.local_from_world(to_viewer));
        if !(w_i.z > 0.0 && w_o.z > 0.0) {
            return 0.0;
        }
        with_model(self.lobes, Pdf { material: self, w_i, w_o })
    }

    /// A direction toward the light; `u` in [0, 1)³. None when it goes into the surface: that share of the density is lost,
    /// as [`Self::pdf`] says.
    pub fn sample(&self, normal: DVec3, to_viewer: DVec3, u: [f64; 3]) -> Option<DVec3> {
        let frame = FrameF64::from_normal(normal);
        let w_o = frame.local_from_world(to_viewer);
        if !(w_o.z > 0.0) {
            return None;
        }
        let w_i = with_model(self.lobes, Sample { material: self, w_o, u });
        (w_i.z > 0.0).then(|| frame.world_from_local(w_i))
    }
}

struct Eval<'a> {
    material: &'a Material,
    w_i: DVec3,
    w_o: DVec3,
}

impl WithModel for Eval<'_> {
    type Output = Value;

    fn run<M: Model>(self) -> Value {
        M::eval_reference(self.material, self.w_i, self.w_o)
    }
}

struct Pdf<'a> {
    material: &'a Material,
    w_i: DVec3,
    w_o: DVec3,
}

impl WithModel for Pdf<'_> {
    type Output = f64;

    fn run<M: Model>(self) -> f64 {
        M::pdf_reference(self.material, self.w_i, self.w_o)
    }
}

struct Sample<'a> {
    material: &'a Material,
    w_o: DVec3,
    u: [f64; 3],
}

impl WithModel for Sample<'_> {
    type Output = DVec3;

    fn run<M: Model>(self) -> DVec3 {
        M::sample_reference(self.material, self.w_o, self.u)
    }
}
