//! `λ_scale (mean_p log (L_p / S_p) - log anchor)²`: the scale, which the photos do not tell, is that of usual base colors. Under a sky that
//! photos show clipped the light is at least as bright as they show, and what is darker than usual costs nothing.

use glam::Vec3;

use super::prior::{LightPrior, Lighting, PointSum, Slopes};
use crate::steps::light::cost::SolveOptions;

pub(super) struct TypicalBaseColor;

impl LightPrior for TypicalBaseColor {
    fn name(&self) -> &'static str {
        "typical-base-color"
    }

    fn about(&self) -> &'static str {
        "the mean base color is the usual one"
    }

    fn flag(&self) -> Option<&'static str> {
        Some("--weight-albedo-range")
    }

    fn weight(&self, options: &SolveOptions) -> f32 {
        options.scale
    }

    fn add_points(&self, light: &Lighting<'_>, weight: f32, sum: &mut PointSum) {
        let n = light.log_base.len().max(1) as f32;
        // One number for all channels: the color of the light is the business of `white_light`.
        let mean = light.log_base.iter().map(|b| b.element_sum() / 3.0).sum::<f32>() / n;
        let off = mean - light.options.typical_base_color.ln();
        if off < 0.0 && light.sources.sky_is_clipped {
            return;
        }
        sum.cost += f64::from(weight * off * off);
        sum.by_log_base.push(Slopes::Even(Vec3::splat(2.0 * weight * off / (3.0 * n))));
    }
}
