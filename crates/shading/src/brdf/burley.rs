//! Burley's diffuse lobe, as other renderers' `principled` has it (Burley 2012).
//!
//! `f_diffuse = (1 - m) b / π F(μ_i) F(μ_o)`, `F(μ) = 1 + (F_90 - 1)(1 - μ)⁵`, `F_90 = 1/2 + 2 roughness (w_o · h)²`. Symmetric,
//! but at grazing angles a white one reflects more than it gets.

use super::coated::{Angles, Coat, CoatF64, DiffuseLobe};

/// The diffuse lobe of [`super::Lobes::Burley`].
#[derive(Clone, Copy, Debug)]
pub struct Burley {
    roughness: f32,
    mu_o: f32,
}

impl DiffuseLobe for Burley {
    const FURNACE_ERROR: f64 = f64::INFINITY;

    #[inline]
    fn prepare(roughness: f32, coat: &Coat) -> (Self, f32) {
        (Self { roughness, mu_o: coat.mu_o }, 1.0)
    }

    #[inline]
    fn factor(&self, angles: &Angles) -> f32 {
        let rise = 2.0 * self.roughness * angles.half * angles.half - 0.5;
        let (ci, co) = (1.0 - angles.mu_i, (1.0 - self.mu_o).max(0.0));
        let (i4, o4) = (ci * ci * (ci * ci), co * co * (co * co));
        (1.0 + rise * i4 * ci) * (1.0 + rise * o4 * co)
    }

    fn reference(roughness: f64, coat: &CoatF64) -> f64 {
        let f90 = 0.5 + 2.0 * roughness * coat.half.powi(2);
        let f = |mu: f64| 1.0 + (f90 - 1.0) * (1.0 - mu).max(0.0).powi(5);
        f(coat.mu_i) * f(coat.mu_o)
    }
}
