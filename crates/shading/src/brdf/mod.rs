//! What a surface does with light: Lambert, or a principled dielectric–metal mixture.
//!
//! With base color `b`, metallic `m`, `F_0 = 0.04 (1 - m) + m b`:
//!
//! ```text
//! f_r = f_diffuse + f_single + f_multiple
//! f_single   = D(h) V(w_i, w_o) F(w_o · h)                 GGX, height-correlated Smith, Schlick
//! f_multiple = F_ms (1 - E(w_o)) (1 - E(w_i)) / (π (1 - E_avg))            Kulla & Conty 2017
//! f_diffuse  = (1 - m) b / π (1 - S(w_o)) (1 - S(w_i)) / (1 - S_avg)    Kelemen & Szirmay-Kalos 2001
//! ```
//!
//! `E` is the directional albedo of the single-bounce lobe with `F = 1`, `S` that of the whole
//! specular lobe (single and multiple) of a dielectric. Both couplings are symmetric in `w_i`
//! and `w_o` and conserve energy (with [`Lobes::Principled`]): a white dielectric and a white metal reflect all light, no
//! material reflects more. [`mod@reference`] is the definition in f64, [`Brdf`] the f32 path.
//!
//! Other diffuse lobes are [`DiffuseLobe`]s under the same specular ones, other models implement [`Model`]; both are a file,
//! named in the list below.

mod albedo;
mod burley;
mod coated;
mod lambert;
pub mod microfacet;
mod model;
mod oren_nayar;
mod principled;
pub mod reference;

use glam::Vec3;

pub use albedo::{AlbedoTable, albedo_table};
pub use burley::Burley;
pub use coated::{Angles, Coat, CoatF64, Coated, DiffuseLobe};
pub use lambert::Lambert;
pub use model::{BrdfValue, Model, WithModel};
pub use motes_scene::Lobes;
pub use oren_nayar::OrenNayar;
pub use principled::EnergyConserving;

model::models! {
    Lambert = Lambert,
    Principled = Coated<EnergyConserving>,
    Burley = Coated<Burley>,
    OrenNayar = Coated<OrenNayar>,
}

/// Reflectance of a dielectric at normal incidence: refractive index 1.5.
pub const DIELECTRIC_F0: f64 = 0.04;
/// Smallest GGX width, reached at roughness 0.032. A perfect mirror is a lobe of 0.06 degrees:
/// a fifth of the sun's radius, and as narrow as f32 half vectors resolve to four digits.
pub const MIN_ALPHA: f64 = 1e-3;

/// The material of a surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Diffuse albedo of a dielectric, `F_0` of a metal; linear, 0 to 1.
    pub base_color_linear: Vec3,
    /// Perceptual roughness, 0 to 1; the GGX width is `max(roughness², MIN_ALPHA)` (Burley 2012).
    pub roughness: f32,
    /// 0 for a dielectric, 1 for a metal; between them a mixture.
    pub metallic: f32,
    /// Which lobes exist.
    pub lobes: Lobes,
}

impl Material {
    /// A principled material with every value clamped to its range; NaN becomes 0.
    pub fn principled(base_color_linear: Vec3, roughness: f32, metallic: f32) -> Self {
        // `max` first: it turns NaN into 0, `clamp` would keep it.
        let unit = |v: f32| v.max(0.0).clamp(0.0, 1.0);
        Self {
            base_color_linear: Vec3::from(base_color_linear.to_array().map(unit)),
            roughness: unit(roughness),
            metallic: unit(metallic),
            lobes: Lobes::Principled,
        }
    }

    /// A perfectly diffuse material.
    pub fn lambert(base_color_linear: Vec3) -> Self {
        Self { lobes: Lobes::Lambert, ..Self::principled(base_color_linear, 1.0, 0.0) }
    }
}
