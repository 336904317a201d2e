//! Least squares by Adam on some rows.

use glam::Vec3;
use motes_math::median::median;
use motes_raster::{Frame, GaussianGradients, Modifiers, Planes, RenderOptions};
use motes_scene::Gaussians;
use train_splat::{Moments, PhotoOrder, Rates, Update};

use super::rows::{put, rows_of};
use super::targets::Target;
use super::{RefitOptions, RefitReport};

/// Twice those of training, as some hundred steps have to do. Centers: share of the usual size of what is fitted.
const RATES: Rates = Rates {
    means: 2e-2,
    rotations: 4e-3,
    log_scales: 2e-2,
    opacity_logits: 5e-2,
    sh0: 2e-2,
    sh_rest: 1e-3,
};
/// Of the rate, at the last step.
const LAST: f32 = 0.02;
const PURPOSE: u64 = 0x5245_4649;

/// Fits `rows`, which ascend; none when the user asked to stop, and then nothing changed.
pub(super) fn fit(
    gaussians: &mut Gaussians,
    rows: &[u32],
    targets: &[Target],
    options: &RefitOptions,
    stopped: &dyn Fn() -> bool,
) -> Option<RefitReport> {
    let render = RenderOptions { antialias: options.antialias, ..RenderOptions::default() };
    let mut fit = Fit::new(gaussians, rows, targets, render);
    let believed: usize = targets.iter().map(|t| t.believed).sum();
    let pixels: usize = targets.iter().map(|t| t.weight.iter().filter(|w| **w > 0.0).count()).sum();
    let mut report = RefitReport {
        steps: options.steps,
        gaussians: rows.len(),
        views: targets.len(),
        photo_share: believed as f64 / pixels.max(1) as f64,
        residual: [fit.residual(targets), 0.0],
    };
    let mut order = PhotoOrder::new(targets.len(), options.seed, PURPOSE);
    for step in 0..options.steps {
        if stopped() {
            return None;
        }
        let Some(k) = order.at(step) else { break };
        fit.differentiate(&targets[k]);
        fit.update(LAST.powf(step as f32 / options.steps as f32), u64::from(step) + 1);
    }
    report.residual[1] = fit.residual(targets);
    put(&fit.fitted, gaussians, &fit.of_scene);
    Some(report)
}

/// What the pictures show, and buffers.
struct Fit {
    seen: Gaussians,
    /// Rows of `seen` that are fitted,
    rows: Vec<u32>,
    /// and their rows of the scene.
    of_scene: Vec<u32>,
    /// Only those rows.
    fitted: Gaussians,
    moments: Moments,
    /// World units.
    usual_size: f32,
    render: RenderOptions,
    frame: Frame,
    gradients: GaussianGradients,
}

impl Fit {
    fn new(gaussians: &Gaussians, rows: &[u32], targets: &[Target], render: RenderOptions) -> Self {
        let mut fit = Self {
            seen: Gaussians { extra: Vec::new(), ..gaussians.clone() },
            rows: Vec::new(),
            of_scene: Vec::new(),
            fitted: Gaussians::empty(gaussians.sh_degree),
            moments: Moments::default(),
            usual_size: 0.0,
            render,
            frame: Frame::new(),
            gradients: GaussianGradients::default(),
        };
        let mut is_seen = vec![false; gaussians.len()];
        for target in targets {
            fit.draw(target);
            let [width, height] = target.view.size;
            fit.backward(&Planes::new(width, height, 4));
            is_seen.iter_mut().zip(&fit.gradients.seen).for_each(|(all, one)| *all |= *one);
        }
        let kept: Vec<u32> = (0..gaussians.len() as u32).filter(|i| is_seen[*i as usize]).collect();
        fit.seen.gather(&kept);
        let is_fitted = |row: &u32| rows.binary_search(row).is_ok();
        for (i, row) in kept.iter().enumerate().filter(|(_, row)| is_fitted(row)) {
            fit.rows.push(i as u32);
            fit.of_scene.push(*row);
        }
        let size = |row: &u32| {
            let scales = gaussians.log_scales[*row as usize];
            f64::from(scales.into_iter().fold(f32::MIN, f32::max).exp())
        };
        fit.usual_size = median(rows.iter().map(size)).unwrap_or(0.0) as f32;
        fit.fitted = fit.seen.clone();
        fit.fitted.gather(&fit.rows);
        fit.moments = Moments::zeros(&fit.fitted);
        fit
    }

    fn draw(&mut self, target: &Target) -> &Planes {
        self.frame.forward(&self.seen, &target.view, &Modifiers::default(), &self.render)
    }

    fn backward(&mut self, gradient: &Planes) {
        let none = Modifiers::default();
        self.frame.backward(&self.seen, &none, &self.render, gradient, &mut self.gradients);
    }

    /// Gradient of the weighted mean squared difference from a target.
    fn differentiate(&mut self, target: &Target) {
        let [width, height] = target.view.size;
        let sum: f32 = target.weight.iter().sum();
        let mut gradient = Planes::new(width, height, 4);
        let image = self.draw(target);
        for y in 0..height {
            for c in 0..3 {
                let row = image.row(c, y);
                for (x, out) in gradient.row_mut(c, y).iter_mut().enumerate() {
                    let p = y * width + x;
                    *out = 2.0 * target.weight[p] * (row[x] - target.color[p][c]) / sum;
                }
            }
        }
        self.backward(&gradient);
    }

    /// Steps down the gradient, with rates times `share`; `step` counts from 1.
    fn update(&mut self, share: f32, step: u64) {
        let rates = Rates {
            means: RATES.means * self.usual_size * share,
            rotations: RATES.rotations * share,
            log_scales: RATES.log_scales * share,
            opacity_logits: RATES.opacity_logits * share,
            sh0: RATES.sh0 * share,
            sh_rest: RATES.sh_rest * share,
        };
        let sh_degree = self.fitted.sh_degree;
        // What a view does not show does not move.
        let update = Update { step, sh_degree, sh_every: 1, sparse: true };
        let gradients = rows_of(&self.gradients, &self.rows);
        self.moments.apply(&mut self.fitted, &gradients, &rates, &update);
        put(&self.fitted, &mut self.seen, &self.rows);
    }

    /// Root mean square difference from what photos say.
    fn residual(&mut self, targets: &[Target]) -> f64 {
        let (mut squares, mut count) = (0.0f64, 0usize);
        for target in targets {
            let image = self.draw(target).to_image(0, 3);
            for (p, color) in image.data.chunks_exact(3).enumerate() {
                if target.is_photo[p] {
                    let shown = Vec3::from_slice(color).clamp(Vec3::ZERO, Vec3::ONE);
                    squares += f64::from((shown - target.color[p]).length_squared());
                    count += 3;
                }
            }
        }
        (squares / count.max(1) as f64).sqrt()
    }
}
