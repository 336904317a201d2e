//! Images of random extreme scenes: single precision against the f64 reference.

use std::sync::Mutex;

use motes_raster::reference::{Cutoffs, ReferenceGaussians, render_reference_with};
use motes_raster::{Antialias, Frame, Modifiers, RenderOptions, ViewTransform};
use motes_testkit::{ExtremeScene, check_property, extreme_scenes};
use proptest::prelude::*;

/// Differences of one scene.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ImageErrors {
    /// Root mean square over pixels that no cut-off passes, over the brightest color.
    pub(crate) rms: f64,
    /// Largest anywhere, over the brightest color.
    pub(crate) worst: f64,
}

/// The reference with the cut-offs moved by a part in a thousand either way.
pub(crate) fn cut_off_pixels(scene: &ExtremeScene) -> Vec<bool> {
    let render = |factor: f64| {
        let model = Cutoffs::default();
        let cutoffs = Cutoffs {
            alpha: model.alpha * factor,
            transmittance: model.transmittance * factor,
            ..model
        };
        render_reference_with(
            &ReferenceGaussians::new(&scene.gaussians()),
            &scene.camera(),
            &scene.pose(),
            [0.2, 0.5, 0.9],
            Antialias::Classic,
            cutoffs,
        )
    };
    render(0.999).iter().zip(render(1.001)).map(|(a, b)| *a != b).collect()
}

pub(crate) fn image_errors(scene: &ExtremeScene) -> ImageErrors {
    let gaussians = scene.gaussians();
    let (camera, pose) = (scene.camera(), scene.pose());
    let options = RenderOptions { background: [0.2, 0.5, 0.9], ..RenderOptions::default() };
    let view = ViewTransform::new(&camera, &pose);
    let mut frame = Frame::new();
    let got = frame.forward(&gaussians, &view, &Modifiers::default(), &options).to_image(0, 4);
    let expected = render_reference_with(
        &ReferenceGaussians::new(&gaussians),
        &camera,
        &pose,
        [0.2, 0.5, 0.9].map(|v: f64| f64::from(v as f32)),
        Antialias::Classic,
        Cutoffs::default(),
    );
    let brightest = expected.iter().flatten().fold(1.0f64, |m, v| m.max(v.abs()));
    let mut errors = ImageErrors::default();
    let (mut sum, mut count) = (0.0, 0usize);
    let skip = cut_off_pixels(scene);
    for ((e, g), skip) in expected.iter().zip(got.data.chunks_exact(4)).zip(skip) {
        for (e, g) in e.iter().zip(g) {
            let d = (e - f64::from(*g)).abs() / brightest;
            errors.worst = errors.worst.max(if d.is_nan() { f64::INFINITY } else { d });
            if !skip {
                sum += d * d;
                count += 1;
            }
        }
    }
    errors.rms = (sum / count.max(1) as f64).sqrt();
    errors
}

/// Prints quantiles: the numbers of `docs/benchmarks/numerics.md`, seen with `--nocapture`.
#[expect(clippy::print_stderr, reason = "measuring is what it is for")]
pub(crate) fn report_distribution(name: &str, mut values: Vec<f64>) {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values.get(((values.len() as f64 - 1.0) * share) as usize);
    eprintln!("{name}: {} cases, quantiles 0.5 0.9 0.99 0.999 1:", values.len());
    for share in [0.5, 0.9, 0.99, 0.999, 1.0] {
        eprintln!("  {:.1e}", at(share).copied().unwrap_or(f64::NAN));
    }
}

#[test]
fn images_of_extreme_scenes_agree_with_double_precision() {
    let all = Mutex::new(Vec::new());
    check_property(1000, &extreme_scenes(8), |scene| {
        let errors = image_errors(&scene);
        prop_assert!(errors.rms < 1e-4, "{errors:?}");
        // Where a cut-off passes, one contribution at the limit of visibility may differ.
        prop_assert!(errors.worst < 5e-3, "{errors:?}");
        all.lock().unwrap().push(errors);
        Ok(())
    });
    report_distribution("image rms", all.lock().unwrap().iter().map(|e| e.rms).collect());
    report_distribution("image worst", all.lock().unwrap().iter().map(|e| e.worst).collect());
}
