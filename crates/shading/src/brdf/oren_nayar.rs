//! Rough diffuse reflection under the energy-conserving coat of [`super::principled`]: clay, plaster, cloth and dust look
//! flatter than Lambert, brighter toward the light.
//!
//! The energy-preserving Oren–Nayar model (Portsmouth, Kutz & Hill 2025), with the roughness of the material:
//!
//! ```text
//! f_diffuse = (1 - m) b / π (f_single + f_multiple) (1 - S(μ_o)) (1 - S(μ_i)) / (1 - S_avg)
//! f_single   = A (1 + r s / t)             s = w_i · w_o - μ_i μ_o,  t = max(μ_i, μ_o) if s > 0, else 1
//! f_multiple = (1 - E(μ_i)) (1 - E(μ_o)) / (1 - E_avg)                A = 1 / (1 + (1/2 - 2/3π) r)
//! ```
//!
//! `E` is the directional albedo of `f_single`. The published `f_multiple` is tinted by each bounce, a power series in `b`; here
//! it has the color of the first, so that the lobe stays proportional to base color as [`super::Model`] asks. White is the same.

use super::coated::{Angles, Coat, CoatF64, DiffuseLobe};

/// `1/2 - 2/(3π)`: what single scattering loses at normal incidence.
const NORMAL_LOSS: f64 = 0.287_793_409_210_806_2;
/// `2/3 - 28/(15π)`, the same on average over a hemisphere.
const MEAN_LOSS: f64 = 0.072_488_212_456_923_94;
/// `G(μ) / π` as a polynomial of `1 - μ`, powers 1 to 4, of the paper.
const G_OVER_PI: [f64; 4] = [0.057_108_528_9, 0.491_881_867, -0.332_181_442, 0.071_442_995_3];
/// No less energy is missing: divisors stay positive.
const LEAST: f64 = 1e-7;

/// The diffuse lobe of [`super::Lobes::OrenNayar`].
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    roughness: f32,
    /// `A`.
    scale: f32,
    mu_o: f32,
    /// `(1 - E(μ_o)) / (1 - E_avg)`.
    multiple: f32,
}

impl DiffuseLobe for OrenNayar {
    // The coupling is exact for a lobe that does not depend on the direction of light; this one does a little.
    const FURNACE_ERROR: f64 = 0.011;

    #[inline]
    fn prepare(roughness: f32, coat: &Coat) -> (Self, f32) {
        let r = f64::from(roughness);
        let multiple = (1.0 - albedo(f64::from(coat.mu_o), r)).max(LEAST) / missing_on_average(r);
        let lobe =
            Self { roughness, scale: scale(r) as f32, mu_o: coat.mu_o, multiple: multiple as f32 };
        (lobe, (1.0 - coat.albedo_o) / (1.0 - coat.albedo_avg))
    }

    #[inline]
    fn factor(&self, angles: &Angles) -> f32 {
        let (mu_i, r) = (angles.mu_i, self.roughness);
        let s = angles.to_light_dot_to_viewer - mu_i * self.mu_o;
        let s_over_t = if s > 0.0 { s / mu_i.max(self.mu_o) } else { s };
        let c = 1.0 - mu_i;
        let [a, b, d, e] = G_OVER_PI.map(|g| g as f32);
        let g = c * (a + c * (b + c * (d + c * e)));
        let missing = (1.0 - self.scale * (1.0 + r * g)).max(LEAST as f32);
        (self.scale * (1.0 + r * s_over_t) + missing * self.multiple) * angles.transmission_i
    }

    fn reference(roughness: f64, coat: &CoatF64) -> f64 {
        let r = roughness;
        let s = coat.to_light_dot_to_viewer - coat.mu_i * coat.mu_o;
        let t = if s > 0.0 { coat.mu_i.max(coat.mu_o) } else { 1.0 };
        let single = scale(r) * (1.0 + r * s / t);
        let missing = |mu: f64| (1.0 - albedo(mu, r)).max(LEAST);
        let multiple = missing(coat.mu_i) * missing(coat.mu_o) / missing_on_average(r);
        let coupling = (1.0 - coat.albedo_o) * (1.0 - coat.albedo_i) / (1.0 - coat.albedo_avg);
        (single + multiple) * coupling
    }
}

fn scale(r: f64) -> f64 {
    1.0 / (1.0 + NORMAL_LOSS * r)
}

/// `E(μ)`.
fn albedo(mu: f64, r: f64) -> f64 {
    let c = 1.0 - mu;
    let [a, b, d, e] = G_OVER_PI;
    scale(r) * (1.0 + r * c * (a + c * (b + c * (d + c * e))))
}

/// `1 - E_avg`.
fn missing_on_average(r: f64) -> f64 {
    (1.0 - scale(r) * (1.0 + MEAN_LOSS * r)).max(LEAST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_those_of_the_model() {
        let pi = std::f64::consts::PI;
        assert!((NORMAL_LOSS - (0.5 - 2.0 / (3.0 * pi))).abs() < 1e-15);
        assert!((MEAN_LOSS - (2.0 / 3.0 - 28.0 / (15.0 * pi))).abs() < 1e-15);
    }

    #[test]
    fn the_albedo_is_the_integral_of_single_scattering() {
        let (n, r) = (400, 0.8);
        for mu_o in [0.1, 0.5, 0.95f64] {
            let sin_o = (1.0 - mu_o * mu_o).sqrt();
            let mut sum = 0.0;
            for i in 0..n {
                let mu_i = (f64::from(i) + 0.5) / f64::from(n);
                for j in 0..n {
                    let phi = std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(n);
                    let s = sin_o * (1.0 - mu_i * mu_i).sqrt() * phi.cos();
                    let t = if s > 0.0 { mu_i.max(mu_o) } else { 1.0 };
                    sum += 2.0 * mu_i * scale(r) * (1.0 + r * s / t);
                }
            }
            let integral = sum / f64::from(n * n);
            assert!((integral - albedo(mu_o, r)).abs() < 2e-3, "{mu_o}: {integral}");
        }
    }
}
