//! The tiled SIMD path against the f64 reference.

use motes_raster::reference::{ReferenceGaussians, render_reference};
use motes_raster::{Antialias, Frame, Modifiers, RenderOptions, ViewTransform};
use motes_testkit::{orbit_pose, random_gaussians, small_camera};

/// Largest and root-mean-square difference of color and transmittance.
fn difference(
    n: usize,
    degree: u8,
    size: [usize; 2],
    antialias: Antialias,
    filter: f32,
) -> (f64, f64) {
    let gaussians = random_gaussians(11 + n as u64, n, degree);
    let camera = small_camera(size[0], size[1]);
    let pose = orbit_pose(0.7);
    let background = [0.2f32, 0.5, 0.9];
    let filters = vec![filter; n];
    let gains: Vec<f32> = (0..n).map(|i| if i % 7 == 3 { 0.0 } else { 1.1 }).collect();
    let modifiers = Modifiers { filter_3d: Some(&filters), opacity_gain: Some(&gains) };
    let options = RenderOptions { background, antialias, ..RenderOptions::default() };
    let mut frame = Frame::new();
    let planes =
        frame.forward(&gaussians, &ViewTransform::new(&camera, &pose), &modifiers, &options);
    let mut reference = ReferenceGaussians::new(&gaussians);
    reference.filter_3d = vec![f64::from(filter); n];
    reference.opacity_gain = gains.iter().map(|&g| f64::from(g)).collect();
    let expected =
        render_reference(&reference, &camera, &pose, background.map(f64::from), antialias);
    let got = planes.to_image(0, 4);
    let (mut worst, mut sum) = (0.0f64, 0.0f64);
    for (e, g) in expected.iter().flatten().zip(&got.data) {
        let d = (e - f64::from(*g)).abs();
        worst = worst.max(d);
        sum += d * d;
    }
    (worst, (sum / got.data.len() as f64).sqrt())
}

#[test]
fn images_agree_with_the_reference() {
    for (n, degree, size) in [
        (0, 0, [33, 20]),
        (1, 3, [64, 48]),
        (60, 0, [50, 37]),
        (300, 3, [97, 65]),
        (200, 4, [16, 16]),
    ] {
        for antialias in [Antialias::Classic, Antialias::Mip] {
            for filter in [0.0, 0.03] {
                let (worst, rms) = difference(n, degree, size, antialias, filter);
                // A contribution exactly at the 1/255 cut-off may flip: one such step at most.
                assert!(worst < 4.5e-3, "{n} {degree} {antialias:?} {filter}: worst {worst:e}");
                assert!(rms < 2e-5, "{n} {degree} {antialias:?} {filter}: rms {rms:e}");
            }
        }
    }
}

#[test]
fn a_deep_stack_of_opaque_gaussians_stops_at_the_transmittance_limit() {
    let mut gaussians = random_gaussians(5, 2000, 0);
    gaussians.opacity_logits.fill(9.0);
    gaussians.log_scales.fill([-1.0; 3]);
    let camera = small_camera(40, 40);
    let pose = orbit_pose(2.0);
    let options = RenderOptions::default();
    let mut frame = Frame::new();
    let view = ViewTransform::new(&camera, &pose);
    let got = frame.forward(&gaussians, &view, &Modifiers::default(), &options).to_image(0, 4);
    let expected = render_reference(
        &ReferenceGaussians::new(&gaussians),
        &camera,
        &pose,
        [0.0; 3],
        Antialias::Classic,
    );
    for (e, g) in expected.iter().flatten().zip(&got.data) {
        assert!((e - f64::from(*g)).abs() < 2e-4, "{e} {g}");
    }
}

#[test]
fn thread_count_does_not_change_a_bit() {
    let gaussians = random_gaussians(3, 5000, 2);
    let view = ViewTransform::new(&small_camera(160, 120), &orbit_pose(1.0));
    let options = RenderOptions::default();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut frame = Frame::new();
            let image = frame.forward(&gaussians, &view, &Modifiers::default(), &options).clone();
            let mut gradients = motes_raster::GaussianGradients::default();
            frame.backward(&gaussians, &Modifiers::default(), &options, &image, &mut gradients);
            (image.data, gradients.means, gradients.rotations, gradients.sh)
        })
    };
    let one = run(1);
    assert!(one.1.iter().flatten().any(|&v| v != 0.0));
    for threads in [2, 3] {
        assert!(run(threads) == one, "{threads} threads differ from one");
    }
}
