//! Analytic gradients against central differences of the f64 reference, per parameter class.

use motes_raster::reference::{ReferenceGaussians, render_reference};
use motes_raster::{
    Antialias, Frame, GaussianGradients, Modifiers, Planes, RenderOptions, ViewTransform,
};
use motes_scene::{ImageF32, Pinhole, Pose};
use motes_testkit::{check_gradient, orbit_pose, random_gaussians, small_camera};

const BACKGROUND: [f32; 3] = [0.3, 0.1, 0.6];

/// A loss that is linear in the image, `Σ weight · value` over color and transmittance, so that
/// its gradient by the image is `weight` itself.
fn weights(camera: &Pinhole) -> ImageF32 {
    let n = camera.width * camera.height * 4;
    let data = (0..n).map(|i| ((i * 7919 % 1009) as f32 / 1009.0 - 0.4) * 0.1).collect();
    ImageF32::from_data(camera.width, camera.height, 4, data)
}

fn loss(g: &ReferenceGaussians, camera: &Pinhole, pose: &Pose, weights: &ImageF32) -> f64 {
    let image = render_reference(g, camera, pose, BACKGROUND.map(f64::from), Antialias::Classic);
    image.iter().flatten().zip(&weights.data).map(|(v, &w)| v * f64::from(w)).sum()
}

/// Central difference by one stored value.
fn numeric(
    g: &ReferenceGaussians,
    camera: &Pinhole,
    pose: &Pose,
    w: &ImageF32,
    set: impl Fn(&mut ReferenceGaussians, f64),
) -> f64 {
    // Small enough that hardly any pixel crosses a cut-off, large enough for f64.
    let h = 1e-7;
    let side = |step: f64| {
        let mut moved = g.clone();
        set(&mut moved, step);
        loss(&moved, camera, pose, w)
    };
    (side(h) - side(-h)) / (2.0 * h)
}

struct Case {
    degree: u8,
    filter: f32,
    /// Moves the camera close, so that some Gaussians lie outside the Jacobian's bounds.
    close: bool,
}

fn check(case: &Case) {
    let n = 24;
    let gaussians = random_gaussians(2 + u64::from(case.degree), n, case.degree);
    let camera = small_camera(44, 36);
    let mut pose = orbit_pose(0.4);
    if case.close {
        pose.translation.z -= 1.6;
    }
    let weights = weights(&camera);
    let filters = vec![case.filter; n];
    let gains = vec![0.9f32; n];
    let modifiers = Modifiers { filter_3d: Some(&filters), opacity_gain: Some(&gains) };
    let options = RenderOptions { background: BACKGROUND, ..RenderOptions::default() };

    let mut frame = Frame::new();
    frame.forward(&gaussians, &ViewTransform::new(&camera, &pose), &modifiers, &options);
    let mut gradient = Planes::new(camera.width, camera.height, 4);
    for c in 0..4 {
        gradient.set_plane(c, &weights, c);
    }
    let mut got = GaussianGradients::default();
    frame.backward(&gaussians, &modifiers, &options, &gradient, &mut got);

    let mut reference = ReferenceGaussians::new(&gaussians);
    reference.filter_3d = vec![f64::from(case.filter); n];
    reference.opacity_gain = vec![f64::from(0.9f32); n];
    let diff = |set: &dyn Fn(&mut ReferenceGaussians, f64)| {
        numeric(&reference, &camera, &pose, &weights, set)
    };
    let compare = |name: &str, analytic: Vec<f64>, numeric: Vec<f64>| {
        let c = check_gradient(&analytic, &numeric);
        assert!(
            c.relative_error < 2e-3 && c.cosine > 0.99999 && c.signed_bias.abs() < 1e-3,
            "degree {} filter {} close {}: {name}: {c:?}",
            case.degree,
            case.filter,
            case.close
        );
    };
    let wide = |values: &[f32]| -> Vec<f64> { values.iter().map(|&v| f64::from(v)).collect() };
    compare(
        "means",
        wide(got.means.as_flattened()),
        (0..3 * n).map(|k| diff(&|g, h| g.means[k / 3][k % 3] += h)).collect(),
    );
    compare(
        "rotations",
        wide(got.rotations.as_flattened()),
        (0..4 * n).map(|k| diff(&|g, h| g.rotations[k / 4][k % 4] += h)).collect(),
    );
    compare(
        "log_scales",
        wide(got.log_scales.as_flattened()),
        (0..3 * n).map(|k| diff(&|g, h| g.log_scales[k / 3][k % 3] += h)).collect(),
    );
    compare(
        "opacity_logits",
        wide(&got.opacity_logits),
        (0..n).map(|k| diff(&|g, h| g.opacity_logits[k] += h)).collect(),
    );
    compare("sh", wide(&got.sh), (0..got.sh.len()).map(|k| diff(&|g, h| g.sh[k] += h)).collect());
}

#[test]
fn every_parameter_class_at_every_degree() {
    for degree in 0..=4 {
        check(&Case { degree, filter: 0.0, close: false });
    }
}

#[test]
fn with_the_3d_filter() {
    check(&Case { degree: 1, filter: 0.05, close: false });
}

#[test]
fn outside_the_bounds_of_the_jacobian() {
    check(&Case { degree: 1, filter: 0.0, close: true });
}
