//! The logistic function and its inverse, safe at both ends.

/// `1 / (1 + exp(-x))`; exact 0 and 1 only where single precision has nothing between.
#[inline]
pub fn sigmoid(x: f32) -> f32 {
    // exp of a non-positive number cannot overflow, whichever sign x has.
    let e = (-x.abs()).exp();
    if x >= 0.0 { 1.0 / (1.0 + e) } else { e / (1.0 + e) }
}

/// Logit of a probability, clamped to [1e-6, 1 - 1e-6] first.
#[inline]
pub fn logit(p: f32) -> f32 {
    let p = p.clamp(1e-6, 1.0 - 1e-6);
    (p / (1.0 - p)).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_and_limits() {
        for p in [1e-4f32, 0.1, 0.5, 0.9, 0.999] {
            assert!((sigmoid(logit(p)) - p).abs() < 1e-6);
        }
        assert_eq!(sigmoid(1e4), 1.0);
        assert_eq!(sigmoid(-1e4), 0.0);
        assert_eq!(sigmoid(f32::INFINITY), 1.0);
        assert_eq!(sigmoid(f32::NEG_INFINITY), 0.0);
        assert!(logit(0.0).is_finite() && logit(1.0).is_finite());
    }
}
