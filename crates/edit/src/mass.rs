//! How much of a Gaussian there is: optical depths add where layers overlap.

use glam::DVec3;
use motes_math::sigmoid::sigmoid;

/// Opacities beyond have a depth that rounding decides.
pub(crate) const MOST_OPAQUE: f64 = 0.999;

/// Optical depth of a peak.
pub(crate) fn optical_depth(opacity_logit: f32) -> f64 {
    -(1.0 - f64::from(sigmoid(opacity_logit)).min(MOST_OPAQUE)).ln()
}

/// Mean projected area up to a constant.
pub(crate) fn projected_area(s: DVec3) -> f64 {
    (s.x * s.y + s.y * s.z + s.z * s.x) / 3.0
}
