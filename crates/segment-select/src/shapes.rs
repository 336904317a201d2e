//! Shapes in world and in views: which centers lie inside.

use glam::{DQuat, DVec3};
use motes_scene::{Gaussians, Pinhole, Pose, Selection};

use crate::error::SelectError;

/// Centers as double precision.
pub(crate) fn mean(gaussians: &Gaussians, i: usize) -> DVec3 {
    DVec3::from_array(gaussians.means[i].map(f64::from))
}

/// Centers for which `inside` holds; those that are not finite never do.
pub(crate) fn centers(gaussians: &Gaussians, inside: impl Fn(DVec3) -> bool) -> Selection {
    Selection::where_true(gaussians.len(), |i| {
        let p = mean(gaussians, i);
        p.is_finite() && inside(p)
    })
}

/// Centers in a box that may be turned.
pub(crate) fn turned_box(
    gaussians: &Gaussians,
    center: [f64; 3],
    half_size: [f64; 3],
    [w, x, y, z]: [f64; 4],
) -> Result<Selection, SelectError> {
    let rotation = DQuat::from_xyzw(x, y, z, w);
    if !(rotation.length() > 1e-9 && rotation.is_finite()) {
        return Err(SelectError::BadValue("the rotation of the box has no direction".into()));
    }
    let (rotation, center) = (rotation.normalize().conjugate(), DVec3::from_array(center));
    let half = DVec3::from_array(half_size);
    Ok(centers(gaussians, |p| (rotation * (p - center)).abs().cmple(half).all()))
}

/// Centers on the side of a plane that its normal points to.
pub(crate) fn half_space(
    gaussians: &Gaussians,
    normal: [f64; 3],
    point: [f64; 3],
) -> Result<Selection, SelectError> {
    let normal = DVec3::from_array(normal);
    let Some(normal) = normal.try_normalize() else {
        return Err(SelectError::BadValue("the normal of the half-space has no direction".into()));
    };
    let point = DVec3::from_array(point);
    Ok(centers(gaussians, |p| normal.dot(p - point) >= 0.0))
}

/// Centers that project inside a polygon of a view (even-odd), at any depth in front of the camera.
pub(crate) fn polygon(
    gaussians: &Gaussians,
    camera: &Pinhole,
    camera_from_world: &Pose,
    corners: &[[f64; 2]],
) -> Selection {
    centers(gaussians, |p| {
        let p = camera_from_world.transform_point(p);
        let (x, y) = (camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy);
        p.z > 0.0 && is_inside(corners, x, y)
    })
}

fn is_inside(corners: &[[f64; 2]], x: f64, y: f64) -> bool {
    let mut inside = false;
    for (i, &[x1, y1]) in corners.iter().enumerate() {
        let [x0, y0] = corners[(i + corners.len() - 1) % corners.len()];
        if (y1 > y) != (y0 > y) && x < (x0 - x1) * (y - y1) / (y0 - y1) + x1 {
            inside = !inside;
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Gaussians {
        let means: Vec<[f32; 3]> =
            (0..10).map(|i| [i as f32, 0.0, 0.0]).chain([[f32::NAN; 3]]).collect();
        Gaussians { means, ..Gaussians::empty(0) }
    }

    #[test]
    fn boxes_turn() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let flat = turned_box(&line(), [4.0, 0.0, 0.0], [2.0, 0.5, 0.5], [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(flat.unwrap().rows(), [2, 3, 4, 5, 6]);
        // A quarter turn about z: the long side points along y.
        let turned = turned_box(&line(), [4.0, 0.0, 0.0], [2.0, 0.5, 0.5], [half, 0.0, 0.0, half]);
        assert_eq!(turned.unwrap().rows(), [4]);
        assert!(turned_box(&line(), [0.0; 3], [1.0; 3], [0.0; 4]).is_err());
    }

    #[test]
    fn half_spaces_have_a_side() {
        let rows = |n: f64| half_space(&line(), [n, 0.0, 0.0], [7.0, 5.0, 5.0]).unwrap().rows();
        assert_eq!(rows(2.0), [7, 8, 9]);
        assert_eq!(rows(-0.1).len(), 8);
        assert!(half_space(&line(), [0.0; 3], [0.0; 3]).is_err());
    }

    #[test]
    fn polygons_may_be_concave() {
        let corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [5.0, 2.0], [0.0, 10.0]];
        assert!(is_inside(&corners, 1.0, 5.0) && is_inside(&corners, 9.0, 5.0));
        assert!(!is_inside(&corners, 5.0, 5.0) && !is_inside(&corners, 11.0, 1.0));
    }
}
