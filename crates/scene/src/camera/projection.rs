//! Direction in the camera frame <-> pixel, for every model.
//!
//! With a direction `(X, Y, Z)`, `rho = |(X, Y)|`, `theta = atan2(rho, Z)`:
//!
//! | models | image plane point |
//! |---|---|
//! | perspective (pinhole, radial, OpenCV) | `(X, Y)/Z`, then `distortion.rs` |
//! | fisheye | `theta (X, Y)/rho`, then `distortion.rs` |
//! | FOV | `(X, Y)/Z * atan(2 r tan(omega/2)) / (r omega)` (Devernay and Faugeras 2001) |
//! | division | `(X, Y)/Z = m / (1 + k |m|^2)` (Fitzgibbon 2001) |
//! | EUCM | `(X, Y) / (alpha d + (1 - alpha) Z)`, `d^2 = beta rho^2 + Z^2` (Khomutenko 2016) |
//! | equirectangular | longitude and latitude; image center = +z, right = +x, up = -y |

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

use super::distortion::{distort, is_unfolded, undistort};
use super::{Camera, CameraModel as M};

/// Below this FOV `omega` the model is a pinhole to double precision.
const OMEGA_MIN: f64 = 1e-6;

impl Camera {
    /// Where a direction of the camera frame (any length; +z forward) appears, pixels.
    ///
    /// `None` when the model does not image it: behind a perspective camera, outside the domain
    /// of the equations, or beyond a fold of the distortion polynomial. The pixel may lie
    /// outside the image.
    ///
    /// # Panics
    /// When the number of parameters is not the model's.
    pub fn pixel_from_direction(&self, direction: DVec3) -> Option<DVec2> {
        let Some([fx, fy, cx, cy]) = self.affine() else {
            return equirectangular_pixel(direction, self.params[0], self.params[1]);
        };
        let m = self.plane_from_direction(direction)?;
        let pixel = DVec2::new(fx * m.x + cx, fy * m.y + cy);
        pixel.is_finite().then_some(pixel)
    }

    /// The unit direction in the camera frame that is imaged at a pixel.
    ///
    /// `None` when no direction is: the inverse does not converge (1e-10 of a focal length), or
    /// the pixel lies outside the image circle of the model.
    ///
    /// # Panics
    /// When the number of parameters is not the model's.
    pub fn direction_from_pixel(&self, pixel: DVec2) -> Option<DVec3> {
        let Some([fx, fy, cx, cy]) = self.affine() else {
            return equirectangular_direction(pixel, self.params[0], self.params[1]);
        };
        let m = DVec2::new((pixel.x - cx) / fx, (pixel.y - cy) / fy);
        self.direction_from_plane(m)?.try_normalize()
    }

    fn plane_from_direction(&self, d: DVec3) -> Option<DVec2> {
        let k = self.distortion_params();
        let xy = d.truncate();
        let rho = xy.length();
        match self.model {
            M::Eucm => {
                let (alpha, beta) = (k[0], k[1]);
                let reach = (beta * rho * rho + d.z * d.z).sqrt();
                let depth = alpha * reach + (1.0 - alpha) * d.z;
                // The second condition keeps rays that the inverse maps back (unit-sphere bound).
                let bound =
                    if alpha <= 0.5 { alpha / (1.0 - alpha) } else { (1.0 - alpha) / alpha };
                (depth > 0.0 && d.z > -bound * reach).then(|| xy / depth)
            }
            M::SimpleDivision | M::Division => {
                // rho/Z = r / (1 + k r^2), the root that is rho/Z for k -> 0.
                let discriminant = d.z * d.z - 4.0 * k[0] * rho * rho;
                let depth = d.z + discriminant.max(0.0).sqrt();
                (discriminant >= 0.0 && depth > 0.0).then(|| xy * (2.0 / depth))
            }
            M::Fov => {
                let m = perspective(d)?;
                let r = m.length();
                if k[0].abs() < OMEGA_MIN || r < 1e-12 {
                    return Some(m * fov_center_scale(k[0]));
                }
                Some(m * ((2.0 * r * (0.5 * k[0]).tan()).atan() / (r * k[0])))
            }
            model => {
                let m = if is_fisheye(model) {
                    // At the axis theta/rho is 1/Z.
                    let theta = rho.atan2(d.z);
                    if rho > 1e-12 * d.z.abs() { xy * (theta / rho) } else { perspective(d)? }
                } else {
                    perspective(d)?
                };
                is_unfolded(model, k, m).then(|| distort(model, k, m))
            }
        }
    }

    fn direction_from_plane(&self, m: DVec2) -> Option<DVec3> {
        let k = self.distortion_params();
        let rr = m.length_squared();
        match self.model {
            M::Eucm => {
                let (alpha, beta) = (k[0], k[1]);
                let under_root = 1.0 - (2.0 * alpha - 1.0) * beta * rr;
                let z = (1.0 - beta * alpha * alpha * rr)
                    / (alpha * under_root.max(0.0).sqrt() + 1.0 - alpha);
                (under_root >= 0.0 && z.is_finite()).then(|| m.extend(z))
            }
            M::SimpleDivision | M::Division => {
                // Past r = 1/sqrt|k| (k > 0) the mapping folds.
                (k[0] * rr < 1.0).then(|| m.extend(1.0 + k[0] * rr))
            }
            M::Fov => {
                let r = rr.sqrt();
                if k[0].abs() < OMEGA_MIN || r < 1e-12 {
                    return Some((m / fov_center_scale(k[0])).extend(1.0));
                }
                let angle = r * k[0].abs();
                let scale = angle.tan() / (2.0 * r * (0.5 * k[0].abs()).tan());
                (angle < FRAC_PI_2).then(|| (m * scale).extend(1.0))
            }
            model => {
                let m = undistort(model, k, m)?;
                if !is_fisheye(model) {
                    return Some(m.extend(1.0));
                }
                let theta = m.length();
                let sine_over_theta = if theta > 1e-12 { theta.sin() / theta } else { 1.0 };
                (theta < PI).then(|| (m * sine_over_theta).extend(theta.cos()))
            }
        }
    }
}

fn is_fisheye(model: M) -> bool {
    matches!(
        model,
        M::OpencvFisheye
            | M::SimpleRadialFisheye
            | M::RadialFisheye
            | M::ThinPrismFisheye
            | M::RadTanThinPrismFisheye
            | M::SimpleFisheye
            | M::Fisheye
    )
}

/// The limit of the FOV model's scale on the axis, `2 tan(omega/2) / omega`.
fn fov_center_scale(omega: f64) -> f64 {
    if omega.abs() < OMEGA_MIN { 1.0 } else { 2.0 * (0.5 * omega).tan() / omega }
}

fn perspective(d: DVec3) -> Option<DVec2> {
    (d.z > 0.0).then(|| d.truncate() / d.z)
}

fn equirectangular_pixel(d: DVec3, width: f64, height: f64) -> Option<DVec2> {
    let unit = d.try_normalize()?;
    let longitude = unit.x.atan2(unit.z);
    let latitude = (-unit.y).clamp(-1.0, 1.0).asin();
    Some(DVec2::new(width * (longitude / (2.0 * PI) + 0.5), height * (0.5 - latitude / PI)))
}

fn equirectangular_direction(pixel: DVec2, width: f64, height: f64) -> Option<DVec3> {
    let longitude = 2.0 * PI * (pixel.x / width - 0.5);
    let latitude = PI * (0.5 - pixel.y / height);
    let inside = latitude.abs() <= FRAC_PI_2 && longitude.is_finite();
    inside.then(|| {
        let (sin, cos) = latitude.sin_cos();
        DVec3::new(cos * longitude.sin(), -sin, cos * longitude.cos())
    })
}

#[cfg(test)]
#[path = "projection_tests.rs"]
mod tests;
