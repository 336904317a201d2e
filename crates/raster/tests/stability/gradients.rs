//! Gradients of random extreme scenes against differences of the f64 reference.

use std::sync::Mutex;

use motes_raster::reference::{ReferenceGaussians, render_reference};
use motes_raster::{
    Antialias, Frame, GaussianGradients, Modifiers, Planes, RenderOptions, ViewTransform,
};
use motes_scene::{ImageF32, Pinhole, Pose};
use motes_testkit::{ExtremeScene, check_property, extreme_scenes};
use proptest::prelude::*;

use super::against_reference::{cut_off_pixels, report_distribution};

const BACKGROUND: [f32; 3] = [0.3, 0.1, 0.6];
const CLASSES: [&str; 5] = ["means", "rotations", "log_scales", "opacity_logits", "sh"];

/// A loss that is linear in the pixels that no cut-off passes.
struct Loss {
    camera: Pinhole,
    pose: Pose,
    weights: ImageF32,
}

impl Loss {
    fn new(scene: &ExtremeScene) -> Self {
        let (camera, pose) = (scene.camera(), scene.pose());
        let skip = cut_off_pixels(scene);
        let weight = |i: usize| match skip[i / 4] {
            true => 0.0,
            false => (i * 7919 % 1009) as f32 / 1009.0 - 0.4,
        };
        let data = (0..4 * skip.len()).map(weight).collect();
        Self { camera, pose, weights: ImageF32::from_data(camera.width, camera.height, 4, data) }
    }

    fn value(&self, g: &ReferenceGaussians) -> f64 {
        let background = BACKGROUND.map(f64::from);
        let image = render_reference(g, &self.camera, &self.pose, background, Antialias::Classic);
        image.iter().flatten().zip(&self.weights.data).map(|(v, &w)| v * f64::from(w)).sum()
    }

    /// Central difference; `None` where two steps disagree, because a cut-off lies between them.
    fn difference(&self, g: &ReferenceGaussians, parameter: &Parameter, step: f64) -> Option<f64> {
        let slope = |h: f64| {
            let side = |h: f64| {
                let mut moved = g.clone();
                *parameter.of(&mut moved) += h;
                self.value(&moved)
            };
            (side(h) - side(-h)) / (2.0 * h)
        };
        let (a, b) = (slope(step), slope(3.0 * step));
        let noise = 1e-14 * self.value(g).abs().max(1.0) / step;
        ((a - b).abs() <= 1e-5 * a.abs().max(b.abs()) + 100.0 * noise).then_some(a)
    }

    fn gradients(&self, scene: &ExtremeScene) -> GaussianGradients {
        let gaussians = scene.gaussians();
        let options = RenderOptions { background: BACKGROUND, ..RenderOptions::default() };
        let view = ViewTransform::new(&self.camera, &self.pose);
        let mut frame = Frame::new();
        frame.forward(&gaussians, &view, &Modifiers::default(), &options);
        let mut gradient = Planes::new(self.camera.width, self.camera.height, 4);
        for c in 0..4 {
            gradient.set_plane(c, &self.weights, c);
        }
        let mut out = GaussianGradients::default();
        frame.backward(&gaussians, &Modifiers::default(), &options, &gradient, &mut out);
        out
    }
}

struct Parameter {
    class: usize,
    row: usize,
    column: usize,
}

impl Parameter {
    fn of<'a>(&self, g: &'a mut ReferenceGaussians) -> &'a mut f64 {
        let (row, column) = (self.row, self.column);
        match self.class {
            0 => &mut g.means[row][column],
            1 => &mut g.rotations[row][column],
            2 => &mut g.log_scales[row][column],
            3 => &mut g.opacity_logits[row],
            _ => {
                let stride = g.sh.len() / g.means.len();
                &mut g.sh[row * stride + column]
            }
        }
    }

    fn got(&self, g: &GaussianGradients) -> f64 {
        let (row, column) = (self.row, self.column);
        f64::from(match self.class {
            0 => g.means[row][column],
            1 => g.rotations[row][column],
            2 => g.log_scales[row][column],
            3 => g.opacity_logits[row],
            _ => g.sh[row * (g.sh.len() / g.means.len()) + column],
        })
    }
}

/// Norm of the difference and of the gradient of one class, every entry in units of what moves the
/// Gaussian by about its own size.
#[derive(Clone, Copy, Debug, Default)]
struct ClassError {
    difference: f64,
    norm: f64,
}

fn gradient_errors(scene: &ExtremeScene) -> [ClassError; 5] {
    let loss = Loss::new(scene);
    let got = loss.gradients(scene);
    let reference = ReferenceGaussians::new(&scene.gaussians());
    std::array::from_fn(|class| {
        let columns = [3, 4, 3, 1, 3][class];
        let mut sums = [0.0; 2];
        for row in 0..scene.gaussians.len() {
            let unit = natural_unit(scene, &reference, class, row);
            for column in 0..columns {
                let parameter = Parameter { class, row, column };
                let analytic = parameter.got(&got) * unit;
                if !analytic.is_finite() {
                    return ClassError { difference: f64::INFINITY, norm: 1.0 };
                }
                if let Some(numeric) = loss.difference(&reference, &parameter, 1e-6 * unit) {
                    sums[0] += (analytic - numeric * unit).powi(2);
                    sums[1] += (numeric * unit).powi(2);
                }
            }
        }
        ClassError { difference: sums[0].sqrt(), norm: sums[1].sqrt() }
    })
}

/// A step of each parameter that matters about equally.
fn natural_unit(scene: &ExtremeScene, g: &ReferenceGaussians, class: usize, row: usize) -> f64 {
    match class {
        // One pixel at the depth of the Gaussian.
        0 => {
            let p = scene.pose().transform_point(g.means[row].into());
            p.z.abs().max(1e-12) / scene.camera().fx
        }
        // The whole quaternion, or for a needle longer than the image what moves its end by that.
        1 => {
            let norm = g.rotations[row].iter().map(|q| q * q).sum::<f64>().sqrt().max(1e-3);
            norm * (40.0 / 10f64.powf(scene.gaussians[row].log10_pixels)).min(1.0)
        }
        _ => 1.0,
    }
}

/// Bound of every class's error over the norm of the whole gradient.
const BOUND: f64 = 1e-2;
/// Below this the differences themselves are rounding.
const FLOOR: f64 = 1e-6;

#[test]
fn gradients_of_extreme_scenes_agree_with_double_precision() {
    let relative = Mutex::new(Vec::new());
    check_property(500, &extreme_scenes(4), |scene| {
        let errors = gradient_errors(&scene);
        let whole = errors.iter().map(|e| e.norm * e.norm).sum::<f64>().sqrt();
        if whole > FLOOR {
            for (class, error) in CLASSES.iter().zip(errors) {
                let share = error.difference / whole;
                prop_assert!(share < BOUND, "{class}: {share:e} of {errors:?}");
            }
            relative.lock().unwrap().push(errors.map(|e| e.difference / whole));
        }
        Ok(())
    });
    for (c, class) in CLASSES.iter().enumerate() {
        report_distribution(class, relative.lock().unwrap().iter().map(|e| e[c]).collect());
    }
}
