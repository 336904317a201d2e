//! Random scenes drawn from a seed.

use glam::DVec3;
use motes_math::rng::keyed_rng;
use motes_math::sh::sh_coefficients;
use motes_scene::{Gaussians, Pinhole, Pose};
use rand::RngExt;

/// `n` Gaussians in the unit ball with scales of 2 to 30 % and every parameter away from its limits.
pub fn random_gaussians(seed: u64, n: usize, sh_degree: u8) -> Gaussians {
    let mut rng = keyed_rng(seed, 0x7e57, n as u64);
    let mut uniform =
        move |low: f32, high: f32| -> f32 { low + (high - low) * rng.random::<f32>() };
    let mut g = Gaussians::empty(sh_degree);
    for _ in 0..n {
        g.means.push(std::array::from_fn(|_| uniform(-0.6, 0.6)));
        g.rotations.push(std::array::from_fn(|_| uniform(-1.0, 1.0) + 0.05));
        g.log_scales.push(std::array::from_fn(|_| uniform(-3.9, -1.2)));
        g.opacity_logits.push(uniform(-2.0, 3.0));
        for k in 0..sh_coefficients(sh_degree) {
            let size = if k == 0 { 1.5 } else { 0.3 };
            g.sh.extend((0..3).map(|_| uniform(-size, size)));
        }
    }
    g
}

/// A camera with unequal focal lengths and an off-center principal point.
pub fn small_camera(width: usize, height: usize) -> Pinhole {
    let size = width as f64;
    Pinhole {
        fx: 1.1 * size,
        fy: 1.05 * size,
        cx: 0.47 * size,
        cy: 0.52 * height as f64,
        width,
        height,
    }
}

/// `camera_from_world` on an orbit of radius 3 at `angle` radians, looking at the origin.
pub fn orbit_pose(angle: f64) -> Pose {
    let eye = DVec3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 0.8);
    Pose::look_at(eye, DVec3::ZERO, DVec3::Z).unwrap_or(Pose::IDENTITY)
}
