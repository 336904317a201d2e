//! Color of the sun's disc through the atmosphere, one spectrum per call.
//!
//! `L(λ) = B(λ, 5778 K) τ_Rayleigh τ_aerosol τ_ozone`, each `τ = exp(-coefficient · air mass)`,
//! integrated with the CIE 1931 observer. Transmittances: Preetham, Shirley & Smits 1999,
//! appendix; air mass: Kasten & Young 1989; observer: the analytic fits of Wyman, Sloan &
//! Shirley (JCGT 2013); ozone's Chappuis band as one Gaussian. Approximated: a black body instead of the
//! measured spectrum (a few percent in the blue), no limb darkening, no water vapour (infrared).

use glam::{DMat3, DVec3};

/// Linear Rec. 709 radiance of the disc, in watts per square meter and steradian weighted by
/// the observer (times 683 it is luminance), for an elevation in radians (0 to π/2) and a
/// turbidity, of whose haze the share `forward_scatter` stays with the sun.
pub(super) fn sun_radiance(elevation: f64, turbidity: f64, forward_scatter: f64) -> DVec3 {
    let mass = air_mass(elevation);
    // Ångström's coefficient from turbidity (Preetham et al. 1999).
    let beta = (0.046_08 * turbidity - 0.045_86).max(0.0) * (1.0 - forward_scatter);
    let mut xyz = DVec3::ZERO;
    let step = 5.0;
    for i in 0..=90 {
        let nm = 380.0 + step * f64::from(i);
        let um = nm * 1e-3;
        let rayleigh = 0.008_735 * um.powf(-4.08);
        let aerosol = beta * um.powf(-1.3);
        let transmittance = (-(rayleigh + aerosol + ozone(nm)) * mass).exp();
        xyz += observer(nm) * (black_body(nm) * transmittance * step);
    }
    // IEC 61966-2-1. A low sun leaves the gamut: its blue may fall below 0.
    let rgb_from_xyz = DMat3::from_cols(
        DVec3::new(3.240_97, -0.969_244, 0.055_63),
        DVec3::new(-1.537_383, 1.875_968, -0.203_977),
        DVec3::new(-0.498_611, 0.041_555, 1.056_972),
    );
    (rgb_from_xyz * xyz).max(DVec3::ZERO)
}

/// Relative optical air mass: 1 at the zenith, 38 at the horizon.
fn air_mass(elevation: f64) -> f64 {
    let degrees = elevation.to_degrees();
    1.0 / (elevation.sin() + 0.505_72 * (degrees + 6.079_95).powf(-1.636_4))
}

/// Planck's law at 5778 K, in W / (m² sr nm).
fn black_body(nm: f64) -> f64 {
    let m = nm * 1e-9;
    let (h, c, k) = (6.626_070_15e-34, 2.997_924_58e8, 1.380_649e-23);
    2.0 * h * c * c / m.powi(5) / ((h * c / (m * k * 5778.0)).exp() - 1.0) * 1e-9
}

/// Optical depth of 3.5 mm of ozone at normal incidence: peak 0.125 / cm near 600 nm.
fn ozone(nm: f64) -> f64 {
    0.35 * 0.125 * (-0.5 * ((nm - 600.0) / 48.0).powi(2)).exp()
}

/// CIE 1931 x̄, ȳ, z̄.
fn observer(nm: f64) -> DVec3 {
    let g = |mean: f64, below: f64, above: f64| {
        let sigma = if nm < mean { below } else { above };
        (-0.5 * ((nm - mean) / sigma).powi(2)).exp()
    };
    DVec3::new(
        1.056 * g(599.8, 37.9, 31.0) + 0.362 * g(442.0, 16.0, 26.7) - 0.065 * g(501.1, 20.4, 26.2),
        0.821 * g(568.8, 46.9, 40.5) + 0.286 * g(530.9, 16.3, 31.1),
        1.217 * g(437.0, 11.8, 36.0) + 0.681 * g(459.0, 26.0, 13.8),
    )
}

#[cfg(test)]
mod tests {
    use motes_math::luminance::luminance_f64;

    use super::*;

    #[test]
    fn illuminance_is_that_of_a_clear_day() {
        // Above the atmosphere 133 klx (solar constant of illuminance, within the black body's 5 %).
        let solid_angle = 6.8e-5;
        let luminance = |c: DVec3| 683.0 * luminance_f64(c);
        let clear = luminance(sun_radiance(1.2, 2.0, 0.0)) * solid_angle;
        assert!((80_000.0..115_000.0).contains(&clear), "{clear} lx at 69 degrees");
        // Published luminance of the solar disc at noon: 1.6e9 cd / m².
        assert!((1.2e9..1.8e9).contains(&(clear / solid_angle)));
    }

    #[test]
    fn the_lower_the_redder_and_the_dimmer() {
        let mut last = sun_radiance(1.5, 3.0, 0.0);
        for degrees in [60.0f64, 30.0, 15.0, 8.0, 4.0, 2.0, 0.0] {
            let c = sun_radiance(degrees.to_radians(), 3.0, 0.0);
            assert!(c.is_finite() && c.x > 0.0 && c.x < last.x, "{degrees} degrees: {c}");
            assert!(c.z / c.x < last.z / last.x || c.z == 0.0, "{degrees} degrees: {c}");
            last = c;
        }
    }
}
