//! Diffuse reflection under an energy-conserving specular coat (Kelemen & Szirmay-Kalos 2001).
//!
//! `f_diffuse = (1 - m) b / π (1 - S(μ_o)) (1 - S(μ_i)) / (1 - S_avg)`: what the coat reflects does not reach the base, and what
//! leaves the base passes the coat again. Symmetric, and white reflects all light.

use super::coated::{Angles, Coat, CoatF64, DiffuseLobe};

/// The diffuse lobe of [`super::Lobes::Principled`].
#[derive(Clone, Copy, Debug)]
pub struct EnergyConserving;

impl DiffuseLobe for EnergyConserving {
    const FURNACE_ERROR: f64 = 0.006;

    #[inline]
    fn prepare(_roughness: f32, coat: &Coat) -> (Self, f32) {
        (Self, (1.0 - coat.albedo_o) / (1.0 - coat.albedo_avg))
    }

    #[inline]
    fn factor(&self, angles: &Angles) -> f32 {
        angles.transmission_i
    }

    fn reference(_roughness: f64, coat: &CoatF64) -> f64 {
        (1.0 - coat.albedo_o) * (1.0 - coat.albedo_i) / (1.0 - coat.albedo_avg)
    }
}
