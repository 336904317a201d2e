//! Ten thousand layers, the near plane, a million Gaussians in one place.

use std::time::{Duration, Instant};

use motes_raster::reference::{ReferenceGaussians, render_reference};
use motes_raster::{
    Antialias, Frame, GaussianGradients, Modifiers, Planes, RenderOptions, ViewTransform, render,
};
use motes_scene::{Gaussians, Pinhole, Pose};

const CAMERA: Pinhole = Pinhole { fx: 20.0, fy: 20.0, cx: 4.0, cy: 3.0, width: 8, height: 6 };

/// `count` layers at depths from 2 to 4, wider than the image.
fn layers(count: usize, opacity_logit: f32) -> Gaussians {
    let mut g = Gaussians::empty(0);
    for i in 0..count {
        let t = i as f32 / count as f32;
        g.means.push([0.1 * (i as f32).sin(), 0.1 * (i as f32).cos(), 2.0 + 2.0 * t]);
        g.rotations.push([1.0, 0.0, 0.0, 0.0]);
        g.log_scales.push([-0.2, -0.1, -3.0]);
        g.opacity_logits.push(opacity_logit + (i as f32 * 0.7).sin());
        g.sh.extend([t, 1.0 - t, (i as f32 * 0.3).sin()]);
    }
    g
}

fn view() -> ViewTransform {
    ViewTransform::new(&CAMERA, &Pose::IDENTITY)
}

#[test]
fn ten_thousand_layers_agree_with_double_precision() {
    for (logit, tolerance) in [(-4.5, 1e-4), (-2.0, 1e-4), (3.0, 1e-4)] {
        let g = layers(10_000, logit);
        let mut frame = Frame::new();
        let options = RenderOptions::default();
        let got = frame.forward(&g, &view(), &Modifiers::default(), &options).to_image(0, 4);
        let reference = ReferenceGaussians::new(&g);
        let expected =
            render_reference(&reference, &CAMERA, &Pose::IDENTITY, [0.0; 3], Antialias::Classic);
        for (e, g) in expected.iter().flatten().zip(&got.data) {
            assert!((e - f64::from(*g)).abs() < tolerance, "logit {logit}: {e} {g}");
        }
    }
}

#[test]
fn gradients_through_ten_thousand_layers_agree_with_differences() {
    let g = layers(10_000, -4.0);
    let options = RenderOptions { background: [0.3, 0.6, 0.1], ..RenderOptions::default() };
    let mut frame = Frame::new();
    frame.forward(&g, &view(), &Modifiers::default(), &options);
    let weight = |i: usize| (i * 7919 % 1009) as f32 / 1009.0 - 0.4;
    let mut gradient = Planes::new(CAMERA.width, CAMERA.height, 4);
    for c in 0..4 {
        for y in 0..CAMERA.height {
            for x in 0..CAMERA.width {
                gradient.row_mut(c, y)[x] = weight(4 * (y * CAMERA.width + x) + c);
            }
        }
    }
    let mut got = GaussianGradients::default();
    frame.backward(&g, &Modifiers::default(), &options, &gradient, &mut got);
    let loss = |g: &ReferenceGaussians| -> f64 {
        let background = [0.3, 0.6, 0.1].map(|v: f32| f64::from(v));
        render_reference(g, &CAMERA, &Pose::IDENTITY, background, Antialias::Classic)
            .iter()
            .flatten()
            .enumerate()
            .map(|(i, v)| v * f64::from(weight(i)))
            .sum()
    };
    let reference = ReferenceGaussians::new(&g);
    let (mut error, mut norm) = (0.0, 0.0);
    // The layers that light reaches: all of the first hundreds, and some behind.
    for i in (0..10_000).step_by(250) {
        let side = |h: f64| {
            let mut moved = reference.clone();
            moved.opacity_logits[i] += h;
            loss(&moved)
        };
        let numeric = (side(1e-6) - side(-1e-6)) / 2e-6;
        let analytic = f64::from(got.opacity_logits[i]);
        assert!(analytic.is_finite(), "layer {i}");
        error += (analytic - numeric).powi(2);
        norm += numeric.powi(2);
    }
    assert!(norm > 1e-8, "there is a gradient: {norm:e}");
    assert!((error / norm).sqrt() < 1e-2, "relative error {:e}", (error / norm).sqrt());
}

#[test]
fn the_near_plane_divides_what_is_drawn_from_what_is_not() {
    let options = RenderOptions { near: 1.0, ..RenderOptions::default() };
    for (z, drawn) in [
        (-1e8f32, false),
        (-1.0, false),
        (0.0, false),
        (1e-9, false),
        (1.0, false),
        (1.000_001, true),
        (10.0, true),
        (1e8, true),
    ] {
        let g = Gaussians {
            means: vec![[0.0, 0.0, z]],
            rotations: vec![[1.0, 0.0, 0.0, 0.0]],
            log_scales: vec![[(0.1 * z.abs().max(1e-3)).ln(); 3]],
            opacity_logits: vec![4.0],
            sh_degree: 0,
            sh: vec![1.0; 3],
            extra: Vec::new(),
        };
        let picture = render(&g, &CAMERA, &Pose::IDENTITY, &options);
        let brightest = picture.color.data.iter().copied().fold(0.0, f32::max);
        assert_eq!(brightest > 0.5, drawn, "z = {z}: {brightest}");
    }
}

#[test]
fn a_million_coincident_gaussians_cost_seconds() {
    let n = 1_000_000;
    let g = Gaussians {
        means: vec![[0.0, 0.0, 3.0]; n],
        rotations: vec![[1.0, 0.0, 0.0, 0.0]; n],
        log_scales: vec![[-3.0; 3]; n],
        opacity_logits: vec![-4.0; n],
        sh_degree: 0,
        sh: vec![0.3; 3 * n],
        extra: Vec::new(),
    };
    let start = Instant::now();
    let mut frame = Frame::new();
    let options = RenderOptions::default();
    let image = frame.forward(&g, &view(), &Modifiers::default(), &options).clone();
    let mut gradients = GaussianGradients::default();
    frame.backward(&g, &Modifiers::default(), &options, &image, &mut gradients);
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
    assert!(image.data.iter().all(|v| v.is_finite()));
    assert!(gradients.means.as_flattened().iter().all(|v| v.is_finite()));
    assert!(gradients.opacity_logits[0] != 0.0 && gradients.opacity_logits[n - 1] == 0.0);
}
