//! Camera paths: between two views, an orbit around what the cameras look at, a spiral in front
//! of it. Pure geometry on poses; every pose here is a `camera_from_world`.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};
use thiserror::Error;

use crate::Pose;

/// Why no path could be laid through a set of cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum CameraPathError {
    /// A path around the cameras needs at least two of them.
    #[error("a path around the cameras needs at least two views")]
    TooFewCameras,
    /// The optical axes are parallel, or meet behind the cameras.
    #[error("the cameras do not look at a common point, so there is nothing to circle")]
    NoCommonPoint,
    /// All cameras stand on the axis that the orbit would turn around.
    #[error("the cameras stand straight above or below what they look at: an orbit has no radius")]
    NoRadius,
    /// The viewing directions cancel out: a spiral in front of the scene has no front.
    #[error("the cameras look in opposite directions, so the scene has no front to spiral before")]
    NoFront,
}

fn forward_in_world(camera_from_world: &Pose) -> DVec3 {
    camera_from_world.rotation.conjugate() * DVec3::Z
}

/// The point nearest, in the least-squares sense, to all optical axes; world units.
///
/// # Errors
/// When there are fewer than two cameras, the axes are parallel, or the point lies behind most
/// of the cameras.
pub fn common_point(cameras: &[Pose]) -> Result<DVec3, CameraPathError> {
    if cameras.len() < 2 {
        return Err(CameraPathError::TooFewCameras);
    }
    // Squared distance of p to the line (c, d) is |(I - d dᵀ)(p - c)|²; the sum over the lines
    // is a quadratic whose minimum solves (Σ P) p = Σ P c with P = I - d dᵀ.
    let mut normal_matrix = DMat3::ZERO;
    let mut right_side = DVec3::ZERO;
    for camera in cameras {
        let direction = forward_in_world(camera);
        let projector = DMat3::IDENTITY
            - DMat3::from_cols(
                direction * direction.x,
                direction * direction.y,
                direction * direction.z,
            );
        normal_matrix += projector;
        right_side += projector * camera.center_in_world();
    }
    // The determinant of Σ P / n is the spread of the directions: 0 when they are parallel,
    // about angle²/2 for a small common angle. 1e-5 is a spread of about a quarter of a degree.
    let n = cameras.len() as f64;
    if (normal_matrix * (1.0 / n)).determinant() < 1e-5 {
        return Err(CameraPathError::NoCommonPoint);
    }
    let point = normal_matrix.inverse() * right_side;
    let in_front = cameras.iter().filter(|c| c.transform_point(point).z > 0.0).count();
    if 2 * in_front > cameras.len() { Ok(point) } else { Err(CameraPathError::NoCommonPoint) }
}

/// The direction that is up in the pictures on average, unit length.
///
/// People hold cameras level, so up is nearly at right angles to every camera's x axis; that
/// refines the plain mean of the cameras' up vectors, which leans forward or back when all
/// photos were taken from one side looking down.
pub fn mean_up(cameras: &[Pose]) -> Option<DVec3> {
    let up_sum: DVec3 = cameras.iter().map(|c| c.rotation.conjugate() * DVec3::NEG_Y).sum();
    let mut up = up_sum.try_normalize()?;
    let mut right_axes = DMat3::ZERO;
    for camera in cameras {
        let right = camera.rotation.conjugate() * DVec3::X;
        right_axes += DMat3::from_cols(right * right.x, right * right.y, right * right.z);
    }
    // Inverse iteration toward the direction with the least Σ (right · up)². The shift keeps
    // the plain mean when all right axes agree and say nothing about the other two directions.
    let shifted = right_axes * (1.0 / cameras.len() as f64) + DMat3::IDENTITY * 1e-3;
    let inverse = shifted.inverse();
    for _ in 0..3 {
        up = (inverse * up).try_normalize()?;
    }
    Some(up)
}

/// `frames` poses from one view to the other, both ends included.
pub fn between(camera_a_from_world: &Pose, camera_b_from_world: &Pose, frames: usize) -> Vec<Pose> {
    let last = frames.saturating_sub(1).max(1) as f64;
    (0..frames)
        .map(|i| Pose::between(camera_a_from_world, camera_b_from_world, i as f64 / last))
        .collect()
}

/// `frames` poses on a closed circle around the [`common_point`], level with respect to
/// [`mean_up`], at the cameras' mean distance from that axis and mean height, starting beside
/// the first camera and turning counter-clockwise seen from above.
///
/// # Errors
/// When the cameras do not look at a common point or all stand on the axis.
pub fn orbit(cameras: &[Pose], frames: usize) -> Result<Vec<Pose>, CameraPathError> {
    let target = common_point(cameras)?;
    let up = mean_up(cameras).ok_or(CameraPathError::NoCommonPoint)?;
    let n = cameras.len() as f64;
    let offsets: Vec<DVec3> = cameras.iter().map(|c| c.center_in_world() - target).collect();
    let height = offsets.iter().map(|o| o.dot(up)).sum::<f64>() / n;
    let level = |o: &DVec3| *o - up * o.dot(up);
    let radius = offsets.iter().map(|o| level(o).length()).sum::<f64>() / n;
    let x_axis = offsets.iter().find_map(|o| level(o).try_normalize());
    let x_axis =
        x_axis.filter(|_| radius > 1e-6 * height.abs()).ok_or(CameraPathError::NoRadius)?;
    let y_axis = up.cross(x_axis);
    (0..frames)
        .map(|i| {
            let angle = TAU * i as f64 / frames as f64;
            let sideways = (x_axis * angle.cos() + y_axis * angle.sin()) * radius;
            Pose::look_at(target + sideways + up * height, target, up)
                .ok_or(CameraPathError::NoRadius)
        })
        .collect()
}

/// `frames` poses on a closed two-turn spiral in front of the scene, looking at a fixed point:
/// the path for photos that were all taken from one side.
///
/// The amplitudes along the mean camera's axes are the 90th percentiles of the cameras' own
/// offsets. `focus_distance` (world units, in front of the mean camera) is used when the
/// optical axes are parallel; otherwise the common point sets it.
///
/// # Errors
/// When there are fewer than two cameras or they look in opposite directions.
pub fn spiral(
    cameras: &[Pose],
    focus_distance: Option<f64>,
    frames: usize,
) -> Result<Vec<Pose>, CameraPathError> {
    if cameras.len() < 2 {
        return Err(CameraPathError::TooFewCameras);
    }
    let n = cameras.len() as f64;
    let center = cameras.iter().map(Pose::center_in_world).sum::<DVec3>() / n;
    let forward_sum = cameras.iter().map(forward_in_world).sum::<DVec3>() / n;
    if forward_sum.length() < 0.5 {
        return Err(CameraPathError::NoFront);
    }
    let forward = forward_sum.normalize();
    let up = mean_up(cameras).ok_or(CameraPathError::NoFront)?;
    let mean = Pose::look_at(center, center + forward, up).ok_or(CameraPathError::NoFront)?;

    let offsets: Vec<DVec3> =
        cameras.iter().map(|c| mean.transform_point(c.center_in_world())).collect();
    let amplitude = DVec3::from_array(
        [0, 1, 2].map(|axis| percentile_90(offsets.iter().map(|o| o[axis].abs()).collect())),
    );
    let focus = match common_point(cameras) {
        Ok(point) => mean.transform_point(point).z,
        // With parallel axes any distance well beyond the path's own size keeps it in view.
        Err(_) => focus_distance.unwrap_or(4.0 * amplitude.length().max(1e-6)),
    };
    let world_from_mean = mean.inverse();
    let target = world_from_mean.transform_point(DVec3::Z * focus);
    (0..frames)
        .map(|i| {
            let turn = TAU * i as f64 / frames as f64;
            let offset = amplitude * DVec3::new((2.0 * turn).cos(), (2.0 * turn).sin(), turn.sin());
            let eye = world_from_mean.transform_point(offset);
            Pose::look_at(eye, target, up).ok_or(CameraPathError::NoFront)
        })
        .collect()
}

fn percentile_90(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[(0.9 * (values.len() - 1) as f64).round() as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET: DVec3 = DVec3::new(1.0, -2.0, 0.5);

    /// Cameras on an arc around `TARGET`, 1.5 above it at radius 4.
    fn arc(n: usize, degrees: f64) -> Vec<Pose> {
        (0..n)
            .map(|i| {
                let angle = (degrees * i as f64 / n as f64).to_radians();
                let offset = DVec3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 1.5);
                Pose::look_at(TARGET + offset, TARGET, DVec3::Z).unwrap()
            })
            .collect()
    }

    #[test]
    fn axes_of_an_arc_meet_at_its_target() {
        for degrees in [20.0, 90.0, 360.0] {
            let point = common_point(&arc(7, degrees)).unwrap();
            assert!((point - TARGET).length() < 1e-9, "{degrees}: {point}");
        }
    }

    #[test]
    fn parallel_and_diverging_axes_have_no_common_point() {
        let parallel: Vec<Pose> = (0..4)
            .map(|i| {
                let eye = DVec3::new(i as f64, 0.0, 0.0);
                Pose::look_at(eye, eye + DVec3::Y, DVec3::Z).unwrap()
            })
            .collect();
        assert_eq!(common_point(&parallel), Err(CameraPathError::NoCommonPoint));
        let outwards: Vec<Pose> = arc(6, 360.0)
            .iter()
            .map(|pose| {
                let eye = pose.center_in_world();
                Pose::look_at(eye, eye + (eye - TARGET), DVec3::Z).unwrap()
            })
            .collect();
        assert_eq!(common_point(&outwards), Err(CameraPathError::NoCommonPoint));
        assert_eq!(common_point(&arc(1, 10.0)), Err(CameraPathError::TooFewCameras));
    }

    #[test]
    fn up_of_a_one_sided_arc_does_not_lean() {
        let cameras = arc(9, 60.0);
        let plain = cameras.iter().map(|c| c.rotation.conjugate() * DVec3::NEG_Y).sum::<DVec3>();
        let refined = mean_up(&cameras).unwrap();
        assert!(plain.normalize().angle_between(DVec3::Z).to_degrees() > 15.0);
        assert!(refined.angle_between(DVec3::Z).to_degrees() < 1.0, "{refined}");
    }

    #[test]
    fn an_orbit_keeps_distance_height_and_target() {
        let poses = orbit(&arc(12, 360.0), 8).unwrap();
        assert_eq!(poses.len(), 8);
        for pose in &poses {
            let offset = pose.center_in_world() - TARGET;
            assert!((offset.z - 1.5).abs() < 1e-9);
            assert!((offset.truncate().length() - 4.0).abs() < 1e-9);
            let seen = pose.transform_point(TARGET);
            assert!(seen.x.abs() < 1e-9 && seen.y.abs() < 1e-9 && seen.z > 0.0);
        }
        let first = poses[0].center_in_world() - arc(12, 360.0)[0].center_in_world();
        assert!(first.length() < 1e-9, "starts at the first camera");
        let turn = (poses[0].center_in_world() - TARGET).cross(poses[1].center_in_world() - TARGET);
        assert!(turn.z > 0.0, "counter-clockwise from above");
    }

    #[test]
    fn an_orbit_from_straight_above_is_refused() {
        let above: Vec<Pose> = [3.0, 4.0]
            .map(|z| Pose::look_at(TARGET + DVec3::Z * z, TARGET, DVec3::Y).unwrap())
            .to_vec();
        assert!(orbit(&above, 4).is_err());
    }

    #[test]
    fn a_spiral_stays_in_front_and_looks_at_one_point() {
        let poses = spiral(&arc(9, 60.0), None, 16).unwrap();
        assert_eq!(poses.len(), 16);
        let target = common_point(&poses).unwrap();
        for pose in &poses {
            let seen = pose.transform_point(target);
            assert!(seen.x.abs() < 1e-6 && seen.y.abs() < 1e-6 && seen.z > 1.0, "{seen}");
        }
        assert_eq!(spiral(&arc(8, 360.0), None, 4), Err(CameraPathError::NoFront));
    }

    #[test]
    fn between_has_both_ends() {
        let cameras = arc(4, 90.0);
        let poses = between(&cameras[0], &cameras[3], 5);
        assert!((poses[0].center_in_world() - cameras[0].center_in_world()).length() < 1e-12);
        assert!((poses[4].center_in_world() - cameras[3].center_in_world()).length() < 1e-12);
        assert_eq!(between(&cameras[0], &cameras[3], 1).len(), 1);
        assert!(between(&cameras[0], &cameras[3], 0).is_empty());
    }
}
