use motes_math::rng::keyed_rng;
use rand::RngExt;

use super::*;

const W: usize = 64;
const H: usize = 48;

/// A gray photo and a rendering that differs from it by noise of `sigma`, blurred over `reach` pixels.
fn noisy(sigma: f32, reach: usize, seed: u64) -> (Planes, Target) {
    let mut rng = keyed_rng(seed, 1, 2);
    let mut render = Planes::new(W, H, 4);
    for c in 0..3 {
        for y in 0..H {
            let raw: Vec<f32> = (0..W + reach)
                .map(|_| (rng.random::<f32>() - 0.5) * sigma * 12f32.sqrt())
                .collect();
            for (x, out) in render.row_mut(c, y).iter_mut().enumerate() {
                let sum: f32 = raw[x..x + reach].iter().sum();
                *out = 100.0 / 255.0 + sum / (reach as f32).sqrt();
            }
        }
    }
    let target =
        Target { width: W, height: H, rgb: vec![100; 3 * W * H], weight: None, alpha: None };
    (render, target)
}

fn residuals(sigma: f32, reach: usize, seed: u64) -> Residuals {
    let (render, target) = noisy(sigma, reach, seed);
    let mut r = Residuals::default();
    r.add(&render, 1.0, &target, Colors::Raw);
    r
}

#[test]
fn white_noise_counts_fully_and_smooth_noise_less() {
    let white = residuals(0.05, 1, 1);
    assert!((white.correlation() - 1.0).abs() < 0.2, "{}", white.correlation());
    // A running mean over m values has the autocorrelation 1 - lag/m: τ is m.
    let smooth = residuals(0.05, 6, 1);
    assert!((smooth.correlation() - 6.0).abs() < 1.2, "{}", smooth.correlation());
    assert!((white.psnr() - 26.02).abs() < 0.2, "{}", white.psnr());
}

#[test]
fn evidence_is_the_likelihood_ratio_of_gaussian_residuals() {
    let (worse, better) = (residuals(0.06, 1, 1), residuals(0.05, 1, 2));
    let evidence = Evidence::new(&worse, &better, 21.0, 3.0);
    let n = (3 * W * H) as f64 * 7.0;
    let expected = n * 1.2f64.ln();
    assert!((evidence.nats / expected - 1.0).abs() < 0.2, "{} {expected}", evidence.nats);
    assert!(evidence.exceeds(evidence.cost(60, 1.0)));
    assert!(evidence.exceeds(evidence.cost(0, 4.0)));
    assert!(!evidence.exceeds(evidence.nats));
}

#[test]
fn equal_models_do_not_pay_and_their_difference_is_within_the_error() {
    let mut inside = 0;
    for seed in 0..40 {
        let (a, b) = (residuals(0.05, 3, 2 * seed), residuals(0.05, 3, 2 * seed + 1));
        let evidence = Evidence::new(&a, &b, 1.0, 1.0);
        assert!(!evidence.exceeds(evidence.cost(20, 1.0)));
        inside += usize::from(evidence.nats.abs() < evidence.error);
    }
    // One standard error: 68 % of 40, within four binomial deviations.
    assert!((15..40).contains(&inside), "{inside} of 40");
}

#[test]
fn corrected_colors_forgive_a_gain_and_raw_ones_do_not() {
    let (mut render, mut target) = noisy(0.02, 1, 5);
    for (i, v) in target.rgb.iter_mut().enumerate() {
        *v = (60 + i % 90) as u8;
    }
    for c in 0..3 {
        for y in 0..H {
            let photo = target.row(c, y).to_vec();
            for (out, p) in render.row_mut(c, y).iter_mut().zip(photo) {
                *out = 0.7 * f32::from(p) / 255.0 + 0.05;
            }
        }
    }
    let score = |colors| {
        let mut r = Residuals::default();
        r.add(&render, 1.0, &target, colors);
        r.psnr()
    };
    assert!(score(Colors::Raw) < 25.0);
    assert!(score(Colors::Corrected) > 60.0);
}

#[test]
fn degenerate_residuals_decide_nothing() {
    let none = Residuals::default();
    let evidence = Evidence::new(&none, &none, 1.0, 1.0);
    assert!(!evidence.exceeds(0.0));
    assert!(affine(std::iter::empty()) == (1.0, 0.0));
}
