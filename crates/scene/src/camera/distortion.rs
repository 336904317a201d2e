//! Distortions of an image plane, and their inverse.
//!
//! A point `m = (x, y)` of the plane is where the ray meets it before distortion: `x = X/Z` for
//! a perspective lens, `theta * (X, Y)/|(X, Y)|` (angle from the axis) for a fisheye lens. The
//! lens moves it to `m_d = d(m)`; focal lengths and principal point then make pixels of `m_d`.
//! `r^2 = x^2 + y^2`.
//!
//! | form | `d(m)` |
//! |---|---|
//! | radial | `m (1 + k1 r^2 + k2 r^4 + ...)` |
//! | tangential | `+ (2 p1 x y + p2 (r^2 + 2 x^2), 2 p2 x y + p1 (r^2 + 2 y^2))` |
//! | rational | radial with a divisor `1 + k4 r^2 + k5 r^4 + k6 r^6` |
//! | thin prism | `+ (sx1 r^2, sy1 r^2)` |
//!
//! Sources: Brown 1971; OpenCV `calib3d`; Kannala and Brandt 2006 (fisheye); COLMAP
//! `sensor/models.h` for the order and the grouping of the parameters.

use glam::{DMat2, DVec2};

use super::CameraModel as M;

/// `a[0] s + a[1] s^2 + ...`
fn series(a: &[f64], s: f64) -> f64 {
    a.iter().rev().fold(0.0, |sum, &c| (sum + c) * s)
}

fn tangential(m: DVec2, p1: f64, p2: f64) -> DVec2 {
    let (xx, yy, xy) = (m.x * m.x, m.y * m.y, m.x * m.y);
    let rr = xx + yy;
    DVec2::new(2.0 * p1 * xy + p2 * (rr + 2.0 * xx), 2.0 * p2 * xy + p1 * (rr + 2.0 * yy))
}

/// Maps an undistorted plane point to the distorted one. `k` are the parameters after focal
/// lengths and principal point. Models without a polynomial distortion return `m`.
pub(super) fn distort(model: M, k: &[f64], m: DVec2) -> DVec2 {
    let rr = m.length_squared();
    match model {
        M::SimpleRadial
        | M::Radial
        | M::SimpleRadialFisheye
        | M::RadialFisheye
        | M::OpencvFisheye => m * (1.0 + series(k, rr)),
        M::Opencv => m * (1.0 + series(&k[..2], rr)) + tangential(m, k[2], k[3]),
        M::FullOpencv => {
            let numerator = 1.0 + series(&[k[0], k[1], k[4]], rr);
            m * (numerator / (1.0 + series(&k[5..8], rr))) + tangential(m, k[2], k[3])
        }
        M::ThinPrismFisheye => {
            let radial = 1.0 + series(&[k[0], k[1], k[4], k[5]], rr);
            m * radial + tangential(m, k[2], k[3]) + DVec2::new(k[6], k[7]) * rr
        }
        M::RadTanThinPrismFisheye => {
            // Here the tangential and prism terms act on the radially distorted point, and p0
            // is the coefficient of x (the other models' p2).
            let q = m * (1.0 + series(&k[..6], rr));
            let qq = q.length_squared();
            let prism = DVec2::new(series(&k[8..10], qq), series(&k[10..12], qq));
            q + tangential(q, k[7], k[6]) + prism
        }
        _ => m,
    }
}

/// Derivative of [`distort`]; central differences, whose error (about 1e-10) is far below what
/// Newton's method and the fold test need.
fn jacobian(model: M, k: &[f64], m: DVec2) -> DMat2 {
    let h = 1e-6 * (1.0 + m.length());
    let column =
        |step: DVec2| (distort(model, k, m + step) - distort(model, k, m - step)) * (0.5 / h);
    DMat2::from_cols(column(DVec2::X * h), column(DVec2::Y * h))
}

/// Whether the lens still maps the neighborhood of `m` without folding it over. A polynomial
/// fitted to a photo may turn back outside the photo; pixels beyond the fold are not an image of `m`.
pub(super) fn is_unfolded(model: M, k: &[f64], m: DVec2) -> bool {
    k.iter().all(|&c| c == 0.0) || jacobian(model, k, m).determinant() > 0.0
}

/// Solves `distort(m) = target` by damped Newton steps from `m = target`; `None` without
/// convergence to 1e-10 (plane units) or when the solution lies beyond a fold.
pub(super) fn undistort(model: M, k: &[f64], target: DVec2) -> Option<DVec2> {
    let mut m = target;
    let mut residual = distort(model, k, m) - target;
    for _ in 0..50 {
        if residual.length_squared() < 1e-26 {
            break;
        }
        let slope = jacobian(model, k, m);
        let step = slope.inverse() * residual;
        if !step.is_finite() {
            return None;
        }
        let mut fraction = 1.0;
        loop {
            let next = m - step * fraction;
            let next_residual = distort(model, k, next) - target;
            // Positive comparison: a NaN is not an improvement.
            if next_residual.length_squared() < residual.length_squared() {
                (m, residual) = (next, next_residual);
                break;
            }
            fraction *= 0.5;
            if fraction < 1e-4 {
                // No descent left: at the rounding floor, or stuck.
                let done = residual.length() < 1e-10 && is_unfolded(model, k, m);
                return done.then_some(m);
            }
        }
    }
    (residual.length() < 1e-10 && is_unfolded(model, k, m)).then_some(m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fold_has_no_inverse_beyond_it() {
        // r (1 - 0.1 r^2) turns back at r = sqrt(10/3), where it reaches 1.217.
        let (model, k) = (M::SimpleRadial, [-0.1]);
        let inside = undistort(model, &k, DVec2::new(1.2, 0.0)).unwrap();
        assert!((distort(model, &k, inside).x - 1.2).abs() < 1e-10 && inside.x < 1.826);
        assert_eq!(undistort(model, &k, DVec2::new(1.3, 0.0)), None);
        assert!(!is_unfolded(model, &k, DVec2::new(2.0, 0.0)));
    }

    #[test]
    fn no_distortion_is_the_identity() {
        let m = DVec2::new(0.3, -0.9);
        assert_eq!(undistort(M::Opencv, &[0.0; 4], m), Some(m));
    }
}
