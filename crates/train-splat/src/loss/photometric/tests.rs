use motes_scene::ImageF32;

use super::*;
use crate::loss::photometric_reference;

fn noise(n: usize, salt: u64) -> Vec<f32> {
    let mut state = salt;
    (0..n)
        .map(|_| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        })
        .collect()
}

pub(in crate::loss) struct Case {
    pub(in crate::loss) render: ImageF32,
    pub(in crate::loss) target: Target,
    pub(in crate::loss) transform: ColorTransform,
}

fn case(width: usize, height: usize) -> Case {
    let n = width * height * 3;
    let rgb = noise(n, 3).iter().map(|v| (v * 255.0) as u8).collect();
    Case {
        render: ImageF32::from_data(width, height, 3, noise(n, 9)),
        target: Target { width, height, rgb, weight: None, alpha: None },
        transform: ColorTransform { gain: [0.9, 1.1, 1.0], offset: [0.02, -0.01, 0.0] },
    }
}

pub(in crate::loss) fn planes_of(image: &ImageF32) -> Planes {
    let mut planes = Planes::new(image.width, image.height, 4);
    for c in 0..3 {
        planes.set_plane(c, image, c);
    }
    planes
}

fn evaluate(case: &Case, background: [f32; 3]) -> (LossValue, ImageF32) {
    let planes = planes_of(&case.render);
    let mut gradient = Planes::new(case.target.width, case.target.height, 4);
    let mut loss = PhotometricLoss::new();
    let value =
        loss.evaluate(&planes, &case.target, background, case.transform, 0.2, &mut gradient);
    (value, gradient.to_image(0, 3))
}

/// The loss by its definition, with the photo made explicit.
fn definition(case: &Case, background: [f32; 3]) -> f64 {
    let (w, h) = (case.target.width, case.target.height);
    let mut x = case.render.data.clone();
    let mut y = vec![0.0; x.len()];
    for i in 0..w * h {
        for (c, &behind) in background.iter().enumerate() {
            let k = 3 * i + c;
            x[k] = x[k] * case.transform.gain[c] + case.transform.offset[c];
            y[k] = f32::from(case.target.rgb[c * w * h + i]) / 255.0;
            if let Some(alpha) = &case.target.alpha {
                let a = f32::from(alpha[i]) / 255.0;
                y[k] = y[k] * a + behind * (1.0 - a);
            }
            if case.target.weight.as_ref().is_some_and(|weight| weight[i] == 0) {
                x[k] = y[k];
            }
        }
    }
    photometric_reference(&x, &y, w, h, 0.2)
}

/// Whether `|x - y|` bends within `h` of the value: there a difference quotient means nothing.
fn is_kink(case: &Case, k: usize, h: f32) -> bool {
    let (i, c) = (k / 3, k % 3);
    let x = case.render.data[k] * case.transform.gain[c] + case.transform.offset[c];
    let y = case.target.rgb[c * case.target.width * case.target.height + i];
    case.target.alpha.is_none() && (x - f32::from(y) / 255.0).abs() < h
}

pub(in crate::loss) fn cases() -> Vec<Case> {
    let mut masked = case(37, 41);
    masked.target.weight =
        Some((0..37 * 41).map(|i| if i % 5 == 0 || i < 300 { 0 } else { 255 }).collect());
    let mut transparent = case(20, 33);
    transparent.target.alpha = Some((0..20 * 33).map(|i| (i * 3) as u8).collect());
    vec![case(64, 32), case(50, 70), case(3, 2), masked, transparent]
}

#[test]
fn value_matches_the_definition() {
    for case in cases() {
        let background = [0.3, 0.6, 0.1];
        let (value, _) = evaluate(&case, background);
        let expected = definition(&case, background);
        assert!((value.loss - expected).abs() < 2e-6, "{} {expected}", value.loss);
    }
}

#[test]
fn gradient_matches_finite_differences() {
    for mut case in cases() {
        let background = [0.3, 0.6, 0.1];
        let (value, gradient) = evaluate(&case, background);
        let n = case.render.data.len();
        let h = 1e-3;
        for k in (0..n).step_by(n / 40 + 1) {
            let keep = case.render.data[k];
            if is_kink(&case, k, 2.0 * h) {
                continue;
            }
            case.render.data[k] = keep + h;
            let plus = definition(&case, background);
            case.render.data[k] = keep - h;
            let minus = definition(&case, background);
            case.render.data[k] = keep;
            let numeric = (plus - minus) / f64::from(2.0 * h);
            let got = f64::from(gradient.data[k]);
            let scale = 1.0 / n as f64;
            assert!(
                (got - numeric).abs() < 2e-2 * scale + 0.02 * numeric.abs(),
                "{k}: {got} {numeric}"
            );
        }
        for c in 0..3 {
            for (offset, got) in [(false, value.d_gain[c]), (true, value.d_offset[c])] {
                let mut side = |step: f32| {
                    let keep = case.transform;
                    let field =
                        if offset { &mut case.transform.offset } else { &mut case.transform.gain };
                    field[c] += step;
                    let loss = definition(&case, background);
                    case.transform = keep;
                    loss
                };
                let numeric = (side(1e-3) - side(-1e-3)) / 2e-3;
                assert!((got - numeric).abs() < 0.02 * numeric.abs() + 2e-3, "{got} {numeric}");
            }
        }
    }
}
