//! An environment as real spherical harmonics of degree 4, and the irradiance they give.
//!
//! `L_k = ∫ L Y_k dw` in world axes, `k = l² + l + m` as everywhere in motes. A cosine lobe scales band
//! `l` by `A_l = π, 2π/3, π/4, 0, -π/24` (Ramamoorthi & Hanrahan 2001), so nine coefficients hold
//! irradiance to about 1 % of any light, and the fourth degree to a fraction of that.

use glam::DVec3;
use motes_math::sh::sh_basis_f64;

use super::reference::bilinear;
use super::{Environment, EnvironmentMap, direction_from_uv};

/// Coefficients `[k]`, RGB.
pub type Harmonics = [DVec3; 25];

/// Rows that a small map is divided into, so that products with `Y_k` are integrated well.
const MIN_ROWS: usize = 128;

impl EnvironmentMap {
    /// Projection of the bilinear map by a midpoint rule, at least 128 x 256 points.
    pub fn harmonics(&self) -> Harmonics {
        let (width, height) = self.size();
        let (rows, columns) =
            (height * MIN_ROWS.div_ceil(height), width * (2 * MIN_ROWS).div_ceil(width));
        let mut sums = [DVec3::ZERO; 25];
        for y in 0..rows {
            let solid_angle = super::map::row_solid_angle(y, rows) / columns as f64;
            for x in 0..columns {
                let (u, v) = ((x as f64 + 0.5) / columns as f64, (y as f64 + 0.5) / rows as f64);
                let d = self.orientation().world_from_map(direction_from_uv(u, v));
                let radiance = bilinear(self, u, v).truncate();
                add(&mut sums, d, radiance * solid_angle);
            }
        }
        sums
    }
}

impl Environment {
    /// Projection of all lights; the sun is a point to harmonics of this degree.
    pub fn harmonics(&self) -> Harmonics {
        let mut sums = self.map().map_or([DVec3::ZERO; 25], EnvironmentMap::harmonics);
        if let Some(sun) = self.sun() {
            let flux = sun.radiance.as_dvec3() * sun.solid_angle();
            add(&mut sums, sun.to_sun().as_dvec3().normalize(), flux);
        }
        sums
    }
}

fn add(sums: &mut Harmonics, d: DVec3, flux: DVec3) {
    let mut basis = [0.0; 25];
    sh_basis_f64(4, d.to_array(), &mut basis);
    for (sum, y) in sums.iter_mut().zip(basis) {
        *sum += flux * y;
    }
}

/// `∫ L (n · w)⁺ dw` of the light, for the unit vector `normal`.
pub fn irradiance(harmonics: &Harmonics, normal: DVec3) -> DVec3 {
    use std::f64::consts::PI;
    const BANDS: [f64; 5] = [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0];
    let mut basis = [0.0; 25];
    sh_basis_f64(4, normal.to_array(), &mut basis);
    let band = |k: usize| BANDS[(k as f64).sqrt() as usize];
    harmonics.iter().zip(basis).enumerate().map(|(k, (l, y))| *l * (band(k) * y)).sum()
}
