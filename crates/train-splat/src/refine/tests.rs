use motes_testkit::random_gaussians;

use super::*;

fn limits(target: usize) -> RefineLimits {
    RefineLimits { target, prune_opacity: 0.005, max_scale: 10.0, min_pull: 0.0 }
}

fn stats(n: usize, pulled: &[usize]) -> RefineStats {
    let mut stats = RefineStats::zeros(n);
    for &i in pulled {
        stats.pull[i] = 1.0 + i as f32;
        stats.seen[i] = 1;
    }
    stats
}

/// Mass-weighted mean and covariance of rows of equal opacity.
fn mean_and_covariance(g: &Gaussians, rows: &[usize]) -> (Vec3, Mat3) {
    let count = rows.len() as f32;
    let mean = rows.iter().map(|&i| Vec3::from(g.means[i])).sum::<Vec3>() / count;
    let mut covariance = Mat3::ZERO;
    for &i in rows {
        let [w, x, y, z] = g.rotations[i];
        let axes = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
        let variance = (Vec3::from(g.log_scales[i]) * 2.0).exp();
        let d = Vec3::from(g.means[i]) - mean;
        let spread = Mat3::from_cols(d * d.x, d * d.y, d * d.z);
        covariance +=
            (axes * Mat3::from_diagonal(variance) * axes.transpose() + spread) * (1.0 / count);
    }
    (mean, covariance)
}

#[test]
fn halves_keep_mean_covariance_and_coverage() {
    for seed in 0..20 {
        let mut g = random_gaussians(seed, 1, 1);
        let before = mean_and_covariance(&g, &[0]);
        let opacity = sigmoid(g.opacity_logits[0]);
        let mut moments = Moments::zeros(&g);
        refine(&mut g, &mut moments, &mut stats(1, &[0]), &limits(2), &[]);
        assert_eq!(g.len(), 2);
        let after = mean_and_covariance(&g, &[0, 1]);
        assert!((before.0 - after.0).length() < 1e-6);
        let size = before.1.to_cols_array().iter().fold(0.0f32, |m, v| m.max(v.abs()));
        for (a, b) in before.1.to_cols_array().iter().zip(after.1.to_cols_array()) {
            assert!((a - b).abs() < 1e-4 * size, "{a} {b}");
        }
        let half = sigmoid(g.opacity_logits[0]);
        assert!((1.0 - (1.0 - half).powi(2) - opacity).abs() < 1e-5);
    }
}

#[test]
fn the_target_is_met_and_the_most_pulled_are_divided() {
    let mut g = random_gaussians(1, 50, 2);
    let mut moments = Moments::zeros(&g);
    moments.first.opacity_logits = (0..50).map(|i| i as f32).collect();
    let mut s = stats(50, &(0..50).collect::<Vec<_>>());
    let counts = refine(&mut g, &mut moments, &mut s, &limits(60), &[]);
    assert_eq!(counts, RefineCounts { pruned: 0, divided: 10 });
    assert!(g.is_consistent() && g.len() == 60 && s == RefineStats::zeros(60));
    assert_eq!(moments.first.sh.len(), g.sh.len());
    // Rows 40..50 were pulled most: they and their halves start from fresh moments.
    assert_eq!(moments.first.opacity_logits[39], 39.0);
    assert!(moments.first.opacity_logits[40..].iter().all(|&m| m == 0.0));
}

#[test]
fn faint_and_huge_gaussians_go() {
    let mut g = random_gaussians(2, 10, 0);
    g.opacity_logits[3] = -20.0;
    g.log_scales[7] = [-3.0, 5.0, -3.0];
    g.opacity_logits[8] = f32::NAN;
    let mut moments = Moments::zeros(&g);
    let counts = refine(&mut g, &mut moments, &mut stats(10, &[3, 7]), &limits(10), &[]);
    assert_eq!(counts, RefineCounts { pruned: 3, divided: 0 });
    assert_eq!(g.len(), 7);
}

#[test]
fn what_no_view_needs_goes() {
    let mut g = random_gaussians(2, 4, 0);
    let mut moments = Moments::zeros(&g);
    let kept = g.means[2];
    let unneeded = [true, false, false, true];
    let counts = refine(&mut g, &mut moments, &mut stats(4, &[]), &limits(2), &unneeded);
    assert_eq!((counts.pruned, g.len(), g.means[1]), (2, 2, kept));
}
