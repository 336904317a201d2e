//! Every parameter changes what it says, and forward and backward agree on it.

use motes_raster::reference::{Cutoffs, Order, ReferenceGaussians, render_reference_in};
use motes_raster::{
    Accumulation, Antialias, Frame, GaussianGradients, Modifiers, Planes, RasterParameters,
    RenderOptions, SimdLevel, Sorting, ViewTransform,
};
use motes_scene::{Gaussians, Pinhole, Pose};
use motes_testkit::{check_gradient, orbit_pose, random_gaussians, small_camera};

const BACKGROUND: [f32; 3] = [0.3, 0.1, 0.6];

struct Scene {
    gaussians: Gaussians,
    camera: Pinhole,
    pose: Pose,
}

impl Scene {
    fn new(n: usize, size: [usize; 2]) -> Self {
        Self {
            gaussians: random_gaussians(9, n, 1),
            camera: small_camera(size[0], size[1]),
            pose: orbit_pose(0.4),
        }
    }

    fn options(parameters: RasterParameters) -> RenderOptions {
        RenderOptions { background: BACKGROUND, parameters, ..RenderOptions::default() }
    }

    fn image(&self, parameters: RasterParameters) -> Vec<f32> {
        let view = ViewTransform::new(&self.camera, &self.pose);
        let mut frame = Frame::new();
        let options = Self::options(parameters);
        frame.forward(&self.gaussians, &view, &Modifiers::default(), &options).to_image(0, 4).data
    }

    /// A loss that is linear in the image: its gradient by the image is the weight.
    fn weight(i: usize) -> f32 {
        ((i * 7919 % 1009) as f32 / 1009.0 - 0.4) * 0.1
    }

    fn gradients(&self, parameters: RasterParameters) -> GaussianGradients {
        let (w, h) = (self.camera.width, self.camera.height);
        let view = ViewTransform::new(&self.camera, &self.pose);
        let (modifiers, options) = (Modifiers::default(), Self::options(parameters));
        let mut frame = Frame::new();
        frame.forward(&self.gaussians, &view, &modifiers, &options);
        let mut gradient = Planes::new(w, h, 4);
        let weights = (0..w * h * 4).map(Self::weight).collect();
        let weights = motes_scene::ImageF32::from_data(w, h, 4, weights);
        for c in 0..4 {
            gradient.set_plane(c, &weights, c);
        }
        let mut got = GaussianGradients::default();
        frame.backward(&self.gaussians, &modifiers, &options, &gradient, &mut got);
        got
    }

    fn reference(&self, g: &ReferenceGaussians, parameters: &RasterParameters) -> Vec<[f64; 4]> {
        let cutoffs = Cutoffs {
            alpha: f64::from(parameters.alpha_min),
            transmittance: f64::from(parameters.transmittance_min),
            sigmas: parameters.extent_sigmas.map_or(f64::INFINITY, f64::from),
        };
        let order = match parameters.sort {
            Sorting::Global => Order::Centers,
            Sorting::Tile => Order::Squares(parameters.tile_size.into()),
            Sorting::Pixel => Order::Squares(1),
        };
        let (camera, pose) = (&self.camera, &self.pose);
        let background = BACKGROUND.map(f64::from);
        render_reference_in(g, camera, pose, background, Antialias::Classic, cutoffs, order)
    }

    /// Root mean square difference from the reference with the same parameters.
    fn image_error(&self, parameters: RasterParameters) -> f64 {
        let got = self.image(parameters);
        let expected = self.reference(&ReferenceGaussians::new(&self.gaussians), &parameters);
        let pairs = expected.iter().flatten().zip(&got);
        let sum: f64 = pairs.map(|(e, &g)| (e - f64::from(g)).powi(2)).sum();
        (sum / got.len() as f64).sqrt()
    }

    /// Relative error of the gradients by means, log scales and opacity logits against central
    /// differences of the reference with the same parameters.
    fn gradient_error(&self, parameters: RasterParameters) -> f64 {
        let got = self.gradients(parameters);
        let reference = ReferenceGaussians::new(&self.gaussians);
        let n = self.gaussians.len();
        let loss = |g: &ReferenceGaussians| -> f64 {
            let image = self.reference(g, &parameters);
            let values = image.iter().flatten().enumerate();
            values.map(|(i, v)| v * f64::from(Self::weight(i))).sum()
        };
        let slope = |set: &dyn Fn(&mut ReferenceGaussians, f64)| {
            let side = |h: f64| {
                let mut moved = reference.clone();
                set(&mut moved, h);
                loss(&moved)
            };
            (side(1e-7) - side(-1e-7)) / 2e-7
        };
        let mut errors = 0.0f64;
        let mut compare = |analytic: Vec<f64>, numeric: Vec<f64>| {
            errors = errors.max(check_gradient(&analytic, &numeric).relative_error);
        };
        let wide = |values: &[f32]| -> Vec<f64> { values.iter().map(|&v| f64::from(v)).collect() };
        let means = (0..3 * n).map(|k| slope(&|g, h| g.means[k / 3][k % 3] += h)).collect();
        compare(wide(got.means.as_flattened()), means);
        let scales = (0..3 * n).map(|k| slope(&|g, h| g.log_scales[k / 3][k % 3] += h)).collect();
        compare(wide(got.log_scales.as_flattened()), scales);
        let opacities = (0..n).map(|k| slope(&|g, h| g.opacity_logits[k] += h)).collect();
        compare(wide(&got.opacity_logits), opacities);
        errors
    }
}

fn difference(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// The image moves from the default one by more than `change`, stays as close to the reference
/// with the same parameters as `image`, and its gradients as close to differences as `gradient`.
fn check(name: &str, parameters: RasterParameters, change: f32, image: f64, gradient: f64) {
    let scene = Scene::new(24, [44, 36]);
    let moved = difference(&scene.image(parameters), &scene.image(RasterParameters::default()));
    assert!(moved > change, "{name} changes the image by {moved:e}");
    let error = scene.image_error(parameters);
    assert!(error < image, "{name}: image error {error:e}");
    let error = scene.gradient_error(parameters);
    assert!(error < gradient, "{name}: gradient error {error:e}");
}

#[test]
fn cut_offs_move_the_image_and_the_gradients_with_it() {
    let default = RasterParameters::default();
    check("alpha-min 0.05", RasterParameters { alpha_min: 0.05, ..default }, 0.02, 2e-5, 2e-3);
    check("alpha-min 0.001", RasterParameters { alpha_min: 0.001, ..default }, 1e-3, 2e-5, 2e-3);
    check(
        "transmittance",
        RasterParameters { transmittance_min: 0.4, ..default },
        0.02,
        2e-5,
        2e-3,
    );
    check("extent", RasterParameters { extent_sigmas: Some(1.5), ..default }, 0.02, 2e-5, 2e-3);
}

#[test]
fn degrees_of_the_polynomial_have_their_errors() {
    let of = |exp_degree| RasterParameters { exp_degree, ..RasterParameters::default() };
    check("degree 4", of(4), 1e-7, 5e-5, 2e-3);
    check("degree 3", of(3), 1e-5, 1e-3, 1e-2);
    check("degree 2", of(2), 1e-4, 2e-2, 0.2);
    let scene = Scene::new(24, [44, 36]);
    let errors = [2, 3, 4, 5].map(|degree| scene.image_error(of(degree)));
    assert!(errors.windows(2).all(|w| w[0] > w[1]), "{errors:?}");
}

#[test]
fn tiles_of_every_size_give_the_same_bits() {
    let scene = Scene::new(400, [75, 53]);
    let of = |tile_size| RasterParameters { tile_size, ..RasterParameters::default() };
    let (image, gradients) = (scene.image(of(16)), scene.gradients(of(16)));
    assert!(gradients.means.iter().flatten().any(|&v| v != 0.0));
    for size in [8, 32] {
        assert!(scene.image(of(size)) == image, "tile size {size}");
        let got = scene.gradients(of(size));
        let wide = |v: &[[f32; 3]]| -> Vec<f64> {
            v.as_flattened().iter().map(|&v| f64::from(v)).collect()
        };
        let error = check_gradient(&wide(&got.means), &wide(&gradients.means)).relative_error;
        assert!(error < 1e-4, "tile size {size}: {error:e}");
    }
    let counts = [8, 16, 32].map(|size| {
        let view = ViewTransform::new(&scene.camera, &scene.pose);
        let mut frame = Frame::new();
        frame.forward(&scene.gaussians, &view, &Modifiers::default(), &Scene::options(of(size)));
        frame.stats.tile_entries
    });
    assert!(counts[0] > counts[1] && counts[1] > counts[2], "{counts:?}");
}

#[test]
fn sorting_by_tile_follows_the_ray_of_its_center() {
    let of = |tile_size| RasterParameters {
        sort: Sorting::Tile,
        tile_size,
        ..RasterParameters::default()
    };
    for size in [8, 16, 32] {
        check("sort tile", of(size), 0.02, 2e-5, 2e-3);
    }
}

#[test]
fn sorting_by_pixel_orders_every_pixel() {
    let scene = Scene::new(24, [44, 36]);
    let parameters = RasterParameters { sort: Sorting::Pixel, ..RasterParameters::default() };
    let moved = difference(&scene.image(parameters), &scene.image(RasterParameters::default()));
    assert!(moved > 0.02, "{moved:e}");
    let error = scene.image_error(parameters);
    assert!(error < 2e-5, "{error:e}");
    // With more Gaussians than the window holds, the order is mended, not perfect, but nearer to
    // that of the pixel than one order for the tile is.
    let scene = Scene::new(600, [44, 36]);
    let by_tile = RasterParameters { sort: Sorting::Tile, ..parameters };
    let order_of_pixels = scene.reference(&ReferenceGaussians::new(&scene.gaussians), &parameters);
    let rms = |image: Vec<f32>| -> f64 {
        let pairs = order_of_pixels.iter().flatten().zip(&image);
        pairs.map(|(e, &g)| (e - f64::from(g)).powi(2)).sum::<f64>().sqrt()
    };
    let (pixel, tile) = (rms(scene.image(parameters)), rms(scene.image(by_tile)));
    assert!(pixel < 0.5 * tile, "{pixel:e} {tile:e}");
}

#[test]
fn sums_in_double_precision_differ_in_the_last_digits_only() {
    let scene = Scene::new(3000, [160, 120]);
    let of = |accumulate| RasterParameters { accumulate, ..RasterParameters::default() };
    let (single, double) =
        (scene.gradients(of(Accumulation::F32)), scene.gradients(of(Accumulation::F64)));
    let wide =
        |v: &[[f32; 3]]| -> Vec<f64> { v.as_flattened().iter().map(|&v| f64::from(v)).collect() };
    let error = check_gradient(&wide(&single.means), &wide(&double.means)).relative_error;
    assert!(error > 0.0 && error < 1e-4, "{error:e}");
    let parameters = of(Accumulation::F64);
    let error = Scene::new(24, [44, 36]).gradient_error(parameters);
    assert!(error < 2e-3, "{error:e}");
}

#[test]
fn every_simd_level_of_this_machine_agrees() {
    let scene = Scene::new(300, [75, 53]);
    let of = |simd| RasterParameters { simd, ..RasterParameters::default() };
    let image = scene.image(of(SimdLevel::Best));
    let wide =
        |v: &[[f32; 3]]| -> Vec<f64> { v.as_flattened().iter().map(|&v| f64::from(v)).collect() };
    let means = wide(&scene.gradients(of(SimdLevel::Best)).means);
    for simd in [SimdLevel::Avx512, SimdLevel::Avx2, SimdLevel::Sse42, SimdLevel::Baseline] {
        if simd.level().is_none() {
            continue;
        }
        // A contribution exactly at the cut-off may flip.
        let moved = difference(&scene.image(of(simd)), &image);
        assert!(moved < 4.5e-3, "{simd:?}: {moved:e}");
        let error = check_gradient(&wide(&scene.gradients(of(simd)).means), &means).relative_error;
        assert!(error < 1e-3, "{simd:?}: {error:e}");
    }
}
