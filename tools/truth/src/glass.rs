//! Thin glass: panes and blown vessels, which reflect and let light pass without bending it.

use glam::Vec3;

/// Index of refraction of window glass.
const INDEX: f32 = 1.5;
/// Panes that a ray passes; the next one is as opaque as paint.
pub(crate) const MOST_PANES: u32 = 8;

/// Share that a pane reflects at the cosine of the angle to its normal: both faces, and everything that goes back and forth between
/// them (Pharr, Jakob & Humphreys 2023, thin dielectric). Not polarized.
pub fn pane_reflectance(cosine: f32) -> f32 {
    let cos_i = cosine.abs().min(1.0);
    let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (INDEX * INDEX)).sqrt();
    let across = (cos_i - INDEX * cos_t) / (cos_i + INDEX * cos_t);
    let along = (INDEX * cos_i - cos_t) / (INDEX * cos_i + cos_t);
    let face = 0.5 * (across * across + along * along);
    2.0 * face / (1.0 + face)
}

/// Share that a pane of a tint lets pass.
pub fn pane_transmittance(cosine: f32, tint: Vec3) -> Vec3 {
    tint * (1.0 - pane_reflectance(cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pane_reflects_eight_percent_straight_on_and_all_at_the_rim() {
        // Two faces of 4 %, less what goes back and forth.
        assert!((pane_reflectance(1.0) - 0.0769).abs() < 1e-3, "{}", pane_reflectance(1.0));
        assert!(pane_reflectance(0.0) > 0.9999);
        let steps: Vec<f32> = (0..=20).map(|i| pane_reflectance(i as f32 / 20.0)).collect();
        assert!(steps.windows(2).all(|pair| pair[0] >= pair[1]), "{steps:?}");
    }

    #[test]
    fn clear_glass_keeps_all_light() {
        for i in 0..=10 {
            let cosine = i as f32 / 10.0;
            let kept = pane_reflectance(cosine) + pane_transmittance(cosine, Vec3::ONE).x;
            assert!((kept - 1.0).abs() < 1e-6, "{cosine}: {kept}");
        }
    }
}
