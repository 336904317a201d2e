//! Cameras around Gaussians that come without a capture.

use std::f64::consts::TAU;

use glam::DVec3;
use motes_math::median::quantile;
use motes_math::sigmoid::sigmoid;
use motes_scene::{Gaussians, Pinhole, Pose};

use super::plan::{Frame, numbered};

/// Fainter Gaussians have no part in the center.
const LEAST_OPACITY: f32 = 0.1;
/// Share of the Gaussians that the pictures hold: the rest may be far background.
const HELD: f32 = 0.8;
/// Room around them.
const MARGIN: f64 = 1.15;
/// Vertical angle of view, degrees.
const FOV_DEG: f64 = 45.0;
/// Height of the camera over the horizon, degrees.
const ELEVATION_DEG: f64 = 20.0;
/// Pixels of a picture.
const SIZE: [usize; 2] = [960, 720];

/// `frames` views once around the median of the opaque Gaussians, at a distance from which four fifths of them fill a picture of 960 by 720
/// pixels. `up` has any length above 0. `None` where no Gaussian is opaque or `up` is no direction.
pub fn turntable(gaussians: &Gaussians, up: DVec3, frames: usize) -> Option<Vec<Frame>> {
    let up = up.try_normalize()?;
    let seen: Vec<DVec3> = (0..gaussians.len())
        .filter(|row| sigmoid(gaussians.opacity_logits[*row]) >= LEAST_OPACITY)
        .map(|row| DVec3::from_array(gaussians.means[row].map(f64::from)))
        .filter(|p| p.is_finite())
        .collect();
    let median = |k: usize| {
        let mut values: Vec<f32> = seen.iter().map(|p| p[k] as f32).collect();
        quantile(&mut values, 0.5).map(f64::from)
    };
    let center = DVec3::new(median(0)?, median(1)?, median(2)?);
    let mut distances: Vec<f32> = seen.iter().map(|p| p.distance(center) as f32).collect();
    // One point is looked at from a unit away.
    let reach = quantile(&mut distances, HELD).map(f64::from).filter(|r| *r > 0.0).unwrap_or(1.0);
    let half_fov = 0.5 * FOV_DEG.to_radians();
    let distance = MARGIN * reach / half_fov.sin();
    let [width, height] = SIZE;
    let focal = 0.5 * height as f64 / half_fov.tan();
    let (cx, cy) = (0.5 * width as f64, 0.5 * height as f64);
    let camera = Pinhole { fx: focal, fy: focal, cx, cy, width, height };
    let x = up.any_orthonormal_vector();
    let y = up.cross(x);
    let (sin, cos) = ELEVATION_DEG.to_radians().sin_cos();
    (0..frames)
        .map(|i| {
            let angle = TAU * i as f64 / frames as f64;
            let outward = (x * angle.cos() + y * angle.sin()) * cos + up * sin;
            let pose = Pose::look_at(center + outward * distance, center, up)?;
            Some(Frame { name: numbered(i), camera, camera_from_world: pose, exposure_stops: None })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_look_at_the_middle_and_strays_do_not_push_them_away() {
        let mut gaussians = motes_testkit::random_gaussians(4, 500, 0);
        gaussians.opacity_logits.fill(2.0);
        let near = turntable(&gaussians, DVec3::Z, 8).unwrap();
        for row in 0..40 {
            gaussians.means[row] = [900.0, 0.0, 0.0];
        }
        gaussians.means[40] = [f32::NAN; 3];
        let far = turntable(&gaussians, DVec3::Z, 8).unwrap();
        assert_eq!(far.len(), 8);
        for (a, b) in near.iter().zip(&far) {
            let eye = |f: &Frame| f.camera_from_world.center_in_world();
            assert!(eye(a).distance(eye(b)) < 0.3 * eye(a).length(), "{} {}", eye(a), eye(b));
            assert!(eye(a).z > 0.0, "from above");
        }
        assert_eq!(turntable(&gaussians, DVec3::ZERO, 8), None);
        assert_eq!(turntable(&Gaussians::empty(0), DVec3::Z, 8), None);
    }
}
