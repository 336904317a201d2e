//! What is preferred or forbidden whatever the photos say: faint, small, compact Gaussians.

use motes_math::sigmoid::sigmoid;
use motes_raster::GaussianGradients;
use motes_scene::Gaussians;
use rayon::prelude::*;

use crate::plan::Plan;

/// Gaussians per task.
const CHUNK: usize = 8192;

/// Adds the gradients of `weight · mean opacity` and `weight · mean scale / extent`.
pub(crate) fn add_gradients(
    plan: &Plan,
    extent: f64,
    gaussians: &Gaussians,
    gradients: &mut GaussianGradients,
) {
    let n = gaussians.len().max(1) as f32;
    if plan.opacity_weight > 0.0 {
        let weight = plan.opacity_weight / n;
        for (d, &logit) in gradients.opacity_logits.iter_mut().zip(&gaussians.opacity_logits) {
            let o = sigmoid(logit);
            *d += weight * o * (1.0 - o);
        }
    }
    if plan.scale_weight > 0.0 {
        let weight = plan.scale_weight / (3.0 * n * extent as f32);
        for (d, s) in gradients.log_scales.iter_mut().zip(&gaussians.log_scales) {
            for (d, s) in d.iter_mut().zip(s) {
                *d += weight * s.exp();
            }
        }
    }
}

/// Keeps scales within 1e-7 to 10 times the extent, and the longest axis within the plan's ratio
/// of the middle one: a needle that points at a camera explains one photo and spoils the others.
pub(crate) fn limit_shapes(plan: &Plan, extent: f64, gaussians: &mut Gaussians) {
    let (low, high) = ((extent * 1e-7).ln() as f32, (extent * 10.0).ln() as f32);
    let ratio = plan.max_anisotropy.max(1.0).ln();
    gaussians.log_scales.par_iter_mut().with_min_len(CHUNK).for_each(|s| {
        let [a, b, c] = *s;
        let middle = a.max(b).min(a.min(b).max(c));
        for s in s.iter_mut() {
            *s = s.min(middle + ratio).clamp(low, high);
        }
    });
}

#[cfg(test)]
mod tests {
    use motes_testkit::random_gaussians;

    use super::*;
    use crate::FitOptions;

    fn plan() -> Plan {
        let options = FitOptions {
            opacity_weight: Some(0.3),
            scale_weight: Some(0.7),
            max_anisotropy: Some(4.0),
            ..FitOptions::default()
        };
        Plan::new(&options, 20).unwrap()
    }

    #[test]
    fn gradients_match_finite_differences() {
        let (plan, extent, n) = (plan(), 2.0, 5);
        let gaussians = random_gaussians(1, n, 0);
        let prior = |g: &Gaussians| -> f64 {
            let opacity: f64 = g.opacity_logits.iter().map(|&l| f64::from(sigmoid(l))).sum();
            let scale: f64 = g.log_scales.iter().flatten().map(|&s| f64::from(s).exp()).sum();
            0.3f32 as f64 * opacity / n as f64 + 0.7f32 as f64 * scale / (3.0 * n as f64 * extent)
        };
        let mut got = GaussianGradients::default();
        got.reset(&gaussians);
        add_gradients(&plan, extent, &gaussians, &mut got);
        let h = 1e-2f32;
        for i in 0..n {
            let side = |step: f32| {
                let mut g = gaussians.clone();
                g.opacity_logits[i] += step;
                prior(&g)
            };
            let numeric = (side(h) - side(-h)) / f64::from(2.0 * h);
            assert!((numeric - f64::from(got.opacity_logits[i])).abs() < 1e-4 * numeric.abs());
            for k in 0..3 {
                let side = |step: f32| {
                    let mut g = gaussians.clone();
                    g.log_scales[i][k] += step;
                    prior(&g)
                };
                let numeric = (side(h) - side(-h)) / f64::from(2.0 * h);
                assert!((numeric - f64::from(got.log_scales[i][k])).abs() < 1e-4 * numeric.abs());
            }
        }
    }

    #[test]
    fn needles_are_cut_and_disks_kept() {
        let mut g = random_gaussians(1, 3, 0);
        g.log_scales = vec![[0.0, -3.0, -3.0], [-1.0, -1.0, -9.0], [90.0, 90.0, -90.0]];
        limit_shapes(&plan(), 1.0, &mut g);
        assert_eq!(g.log_scales[0], [-3.0 + 4f32.ln(), -3.0, -3.0]);
        assert_eq!(g.log_scales[1], [-1.0, -1.0, -9.0]);
        assert_eq!(g.log_scales[2], [10f32.ln(), 10f32.ln(), (1e-7f64).ln() as f32]);
    }
}
