//! Where the page looks from when no photo says it.

use glam::DVec3;
use motes_scene::Pinhole;

/// A camera of 50 degrees across, four parts wide and three high.
pub(super) fn pinhole() -> Pinhole {
    let (width, height) = (960, 720);
    let focal = 480.0 / 25f64.to_radians().tan();
    Pinhole { fx: focal, fy: focal, cx: 480.0, cy: 360.0, width, height }
}

/// An eye 25 degrees above the center that sees a ball of `radius` round it.
pub(super) fn eye(center: DVec3, radius: f64, up: DVec3) -> DVec3 {
    let up = up.try_normalize().unwrap_or(DVec3::Z);
    let side = if up.z.abs() < 0.9 { DVec3::Z } else { DVec3::X };
    let ahead = up.cross(side).normalize();
    let (sin, cos) = 25f64.to_radians().sin_cos();
    // Half the height of the frame is 19 degrees.
    center + (ahead * cos + up * sin) * (radius / 19f64.to_radians().sin())
}
