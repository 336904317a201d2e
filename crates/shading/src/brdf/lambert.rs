//! `f_r = base_color / π`; roughness and metallic are ignored.

use std::f32::consts::{FRAC_1_PI, TAU};
use std::f64::consts::{PI, TAU as TAU_F64};

use glam::{DVec3, Vec3};

use super::Material;
use super::model::{BrdfValue, Model};
use super::reference::{self, Value};
use crate::frame::Frame;

/// A perfectly diffuse surface, prepared for one viewer and point.
#[derive(Clone, Copy, Debug)]
pub struct Lambert {
    normal: Vec3,
    mu_o: f32,
    diffuse: Vec3,
    frame: Frame,
}

impl Model for Lambert {
    const FURNACE_ERROR: f64 = 0.006;

    #[inline]
    fn new(material: &Material, normal: Vec3, to_viewer: Vec3) -> Self {
        let diffuse = material.base_color_linear * FRAC_1_PI;
        Self { normal, mu_o: normal.dot(to_viewer), diffuse, frame: Frame::from_normal(normal) }
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
        let mu_i = self.normal.dot(to_light).min(1.0);
        if !(mu_i > 0.0 && self.mu_o > 0.0) {
            return (BrdfValue::default(), 0.0);
        }
        let value = BrdfValue { diffuse: self.diffuse * mu_i, specular: Vec3::ZERO };
        (value, mu_i * FRAC_1_PI)
    }

    #[inline]
    fn sample(&self, u: [f32; 3]) -> Option<Vec3> {
        if self.faces_away() {
            return None;
        }
        let w_i = cosine_direction(TAU * u[1], u[2]);
        (w_i.z > 0.0).then(|| self.frame.world_from_local(w_i))
    }

    fn factors(material: &Material) -> [Vec3; 2] {
        [material.base_color_linear, Vec3::ZERO]
    }

    fn eval_reference(material: &reference::Material, _: DVec3, _: DVec3) -> Value {
        Value { diffuse: material.base_color_linear / PI, specular: DVec3::ZERO }
    }

    fn pdf_reference(_: &reference::Material, w_i: DVec3, _: DVec3) -> f64 {
        w_i.z / PI
    }

    fn sample_reference(_: &reference::Material, _: DVec3, u: [f64; 3]) -> DVec3 {
        cosine_direction_f64(u[1], u[2])
    }
}

/// A direction with the density `μ / π`; `phi` radians, `u` in [0, 1).
#[inline]
pub(super) fn cosine_direction(phi: f32, u: f32) -> Vec3 {
    let (sin, cos) = phi.sin_cos();
    let r = u.sqrt();
    Vec3::new(r * cos, r * sin, (1.0 - u).max(0.0).sqrt())
}

/// The same in f64, both numbers in [0, 1).
pub(super) fn cosine_direction_f64(u: f64, v: f64) -> DVec3 {
    let (r, phi) = (u.sqrt(), TAU_F64 * v);
    DVec3::new(r * phi.cos(), r * phi.sin(), (1.0 - u).max(0.0).sqrt())
}
