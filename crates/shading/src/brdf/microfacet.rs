//! The GGX microfacet distribution in f64, isotropic, in the local frame (normal = z).
//!
//! `a = alpha²` throughout. Walter et al. 2007 (distribution), Heitz 2014 (masking-shadowing),
//! Heitz 2018 and Dupuy & Benyoub 2023 (sampling the normals that the viewer sees).

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::MIN_ALPHA;

/// GGX width of a perceptual roughness (Burley 2012), with the documented floor.
pub fn alpha(roughness: f64) -> f64 {
    (roughness * roughness).max(MIN_ALPHA)
}

/// `D(h) = a / (π (1 + cos²θ_h (a - 1))²)`, per steradian; 0 below the surface.
///
/// `1 - cos²` is written as `x² + y²`: for narrow lobes it is all that counts.
pub fn distribution(alpha: f64, h: DVec3) -> f64 {
    if !(h.z > 0.0) {
        return 0.0;
    }
    let a = alpha * alpha;
    let d = h.x * h.x + h.y * h.y + a * h.z * h.z;
    a / (PI * d * d)
}

/// `L(μ) = √(a + (1 - a) μ²)`, which the masking functions share.
fn root(alpha: f64, mu: f64) -> f64 {
    let a = alpha * alpha;
    (a + (1.0 - a) * mu * mu).sqrt()
}

/// Masking `G_1 = 2 μ / (μ + L(μ))`: the share of a facet's area that a viewer at `μ > 0` sees.
pub fn masking(alpha: f64, mu: f64) -> f64 {
    2.0 * mu / (mu + root(alpha, mu))
}

/// `V = G_2 / (4 μ_i μ_o)` with height-correlated masking and shadowing (Heitz 2014, eq. 99).
pub fn visibility(alpha: f64, mu_i: f64, mu_o: f64) -> f64 {
    0.5 / (mu_o * root(alpha, mu_i) + mu_i * root(alpha, mu_o))
}

/// Schlick's Fresnel term with `F_90 = 1`.
pub fn schlick(f0: f64, cos: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cos).clamp(0.0, 1.0).powi(5)
}

/// A microfacet normal with the density `G_1(w_o) (w_o · h)⁺ D(h) / μ_o`, by spherical caps
/// (Dupuy & Benyoub 2023). `to_viewer.z > 0`; `u` in [0, 1)².
pub fn sample_visible_normal(alpha: f64, to_viewer: DVec3, u: [f64; 2]) -> DVec3 {
    let stretched = stretched(alpha, to_viewer);
    let phi = TAU * u[0];
    visible_normal(alpha, stretched, [phi.cos(), phi.sin()], cap(stretched, u[1]))
}

/// The viewer in the space where the visible normals are a spherical cap.
pub(super) fn stretched(alpha: f64, to_viewer: DVec3) -> DVec3 {
    DVec3::new(alpha * to_viewer.x, alpha * to_viewer.y, to_viewer.z).normalize()
}

/// Radius and height of the circle of the cap that `u` in [0, 1) picks.
pub(super) fn cap(stretched: DVec3, u: f64) -> [f64; 2] {
    let z = (1.0 - u) * (1.0 + stretched.z) - stretched.z;
    [(1.0 - z * z).clamp(0.0, 1.0).sqrt(), z]
}

/// The normal at an azimuth, given by its cosine and sine, of a circle of the cap.
#[inline]
pub(super) fn visible_normal(
    alpha: f64,
    stretched: DVec3,
    [cos, sin]: [f64; 2],
    [r, z]: [f64; 2],
) -> DVec3 {
    let h = DVec3::new(r * cos, r * sin, z) + stretched;
    DVec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize_or(DVec3::Z)
}

/// Density per steradian of `w_i`, the reflection of `w_o` about a sampled visible normal:
/// `G_1(w_o) D(h) / (4 μ_o) = D(h) / (2 (μ_o + L(μ_o)))`. Also defined for `w_i` below the horizon,
/// where such reflections go too.
pub fn reflection_pdf(alpha: f64, to_light: DVec3, to_viewer: DVec3) -> f64 {
    let h = (to_light + to_viewer).normalize_or_zero();
    distribution(alpha, h) / (2.0 * (to_viewer.z + root(alpha, to_viewer.z)))
}
