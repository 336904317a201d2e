//! Color correction for comparisons: the affine map of RGB that fits one image to another best.

use glam::{DMat4, DVec4};

/// Least-squares `M` (3×4, row per output channel) with `to ≈ M (r, g, b, 1)`.
///
/// `from` and `to` are interleaved RGB of equal length; only pixels whose `weights` entry is
/// positive count (`None`: all). A small ridge toward the identity keeps images of one color
/// solvable. Double precision.
pub fn fit_affine_rgb(from: &[f32], to: &[f32], weights: Option<&[f32]>) -> [[f64; 4]; 3] {
    let mut normal = DMat4::ZERO;
    let mut rhs = [DVec4::ZERO; 3];
    let mut count = 0.0f64;
    for (i, (p, q)) in from.chunks_exact(3).zip(to.chunks_exact(3)).enumerate() {
        let weight = weights.map_or(1.0, |w| f64::from(w[i]));
        if !(weight > 0.0) {
            continue;
        }
        count += weight;
        let x = DVec4::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]), 1.0);
        normal += DMat4::from_cols(x * x.x, x * x.y, x * x.z, x * x.w) * weight;
        for (rhs, &target) in rhs.iter_mut().zip(q) {
            *rhs += x * (f64::from(target) * weight);
        }
    }
    let ridge = 1e-6 * count.max(1.0);
    let solve = (normal + DMat4::from_diagonal(DVec4::splat(ridge))).inverse();
    std::array::from_fn(|c| {
        let mut identity = DVec4::ZERO;
        identity[c] = ridge;
        (solve * (rhs[c] + identity)).to_array()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recovers_a_known_map() {
        let truth = [[0.9, 0.1, 0.0, 0.02], [0.0, 1.1, -0.05, 0.0], [0.05, 0.0, 0.8, -0.01]];
        let from: Vec<f32> = (0..300).map(|i| ((i * 37) % 97) as f32 / 97.0).collect();
        let to: Vec<f32> = from
            .chunks_exact(3)
            .flat_map(|p| {
                truth.map(|m| {
                    (m[0] * f64::from(p[0])
                        + m[1] * f64::from(p[1])
                        + m[2] * f64::from(p[2])
                        + m[3]) as f32
                })
            })
            .collect();
        let fitted = fit_affine_rgb(&from, &to, None);
        for (f, t) in fitted.iter().flatten().zip(truth.iter().flatten()) {
            assert!((f - t).abs() < 1e-3, "{fitted:?}");
        }
    }

    #[test]
    fn one_color_stays_finite() {
        let fitted = fit_affine_rgb(&[0.5; 30], &[0.25; 30], None);
        let mapped: f64 = fitted[0][..3].iter().sum::<f64>() * 0.5 + fitted[0][3];
        assert!((mapped - 0.25).abs() < 1e-3);
    }
}
