//! Comparing analytic with numeric gradients.

/// How two gradient vectors agree.
#[derive(Clone, Copy, Debug)]
pub struct GradientCheck {
    /// `|a - n| / |n|`
    pub relative_error: f64,
    /// Cosine of the angle between them.
    pub cosine: f64,
    /// `Σ (a - n) / Σ |n|`: a wrong constant factor shows here even when single entries are noisy.
    pub signed_bias: f64,
}

/// Compares an analytic gradient with a numeric one.
pub fn check_gradient(analytic: &[f64], numeric: &[f64]) -> GradientCheck {
    assert_eq!(analytic.len(), numeric.len(), "gradient lengths");
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let difference: Vec<f64> = analytic.iter().zip(numeric).map(|(a, n)| a - n).collect();
    let norm = dot(numeric, numeric).sqrt();
    GradientCheck {
        relative_error: dot(&difference, &difference).sqrt() / norm,
        cosine: dot(analytic, numeric) / (norm * dot(analytic, analytic).sqrt()),
        signed_bias: difference.iter().sum::<f64>() / numeric.iter().map(|n| n.abs()).sum::<f64>(),
    }
}
