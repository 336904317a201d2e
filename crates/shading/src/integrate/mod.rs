//! The rendering equation at a surface point, by Monte Carlo.
//!
//! Both paths use one estimator. Of `n_l` directions from the light's density `p_l` and `n_b` from
//! the BRDF's density `p_b`, each counts with the weight of Veach & Guibas 1995:
//!
//! ```text
//! L_direct   ≈ Σ_s Σ_k  w_s f_r (n · w_k)⁺ L(w_k) V(w_k) / (n_s p_s),   s = light, BRDF
//! w_s        = (n_s p_s)^β / ((n_l p_l)^β + (n_b p_b)^β)                β = 1 balance, 2 power
//! L_indirect ≈ 1 / n_b Σ_k f_r (n · w_k)⁺ L_hit(w_k) / p_b              where a BRDF ray is blocked
//! L_emitted  ≈ Σ_s Σ_k  w_s f_r (n · w_k)⁺ L_e V(w_k) / (n_s p_s),      s = emitters, BRDF
//! ```
//!
//! `V` is 0 where a ray meets geometry or leaves below the geometric normal, else 1. `L_hit` is the
//! caller's: the radiance that the captured scene sends back along the ray.

mod fast;
mod light_pool;
pub mod reference;

use glam::Vec3;

use crate::brdf::Material;
use crate::tracing::{Hit, Ray};

pub use fast::{Incident, Shaded, Shader, Shadows};
pub(crate) use light_pool::LastPool;
pub use light_pool::LightPool;

/// A visible point of a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// World.
    pub position: Vec3,
    /// Unit normal of the geometry that rays meet; decides which side light is on.
    pub geometric_normal: Vec3,
    /// Unit normal for shading.
    pub shading_normal: Vec3,
    /// Unit vector toward the camera.
    pub to_viewer: Vec3,
    /// What it is made of.
    pub material: Material,
}

/// Weights of the two strategies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Heuristic {
    /// β = 1: nearly optimal always.
    #[default]
    Balance,
    /// β = 2: less noise where one strategy is much better.
    Power,
}

impl Heuristic {
    /// `w_s / (n_s p_s)` for `this = n_s p_s` and `other` of the other strategy; `this > 0`.
    #[inline]
    pub(crate) fn scale(self, this: f64, other: f64) -> f64 {
        match self {
            Self::Balance => 1.0 / (this + other),
            // Written with a ratio: squares of densities leave the range of f32.
            Self::Power => 1.0 / (this * (1.0 + (other / this) * (other / this))),
        }
    }
}

/// How a point is integrated.
#[derive(Clone, Copy, Debug)]
pub struct IntegrationOptions {
    /// Directions from the light, per point. Powers of two are stratified best.
    pub light_samples: u32,
    /// Directions from the BRDF, per point.
    pub brdf_samples: u32,
    /// Directions to emitters, per point, where there are any.
    pub emitter_samples: u32,
    /// Weights of the strategies.
    pub heuristic: Heuristic,
    /// How far rays start off the surface, world units, on top of rounding.
    pub ray_bias: f32,
    /// Key of all random numbers, with the item of the point.
    pub seed: u64,
}

impl Default for IntegrationOptions {
    fn default() -> Self {
        Self {
            light_samples: 64,
            brdf_samples: 16,
            emitter_samples: 16,
            heuristic: Heuristic::Balance,
            ray_bias: 0.0,
            seed: 0,
        }
    }
}

/// Radiance that a blocked ray brings back from what it met, linear.
pub type IndirectRadiance<'a> = &'a (dyn Fn(&Ray, &Hit) -> Vec3 + Sync);
