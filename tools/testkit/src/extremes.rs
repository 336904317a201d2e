//! Random scenes at the ends of what a file may hold, for property tests.

use glam::{DQuat, DVec3};
use motes_math::sh::sh_coefficients;
use motes_scene::{Gaussians, Pinhole, Pose};
use proptest::prelude::*;

/// One Gaussian relative to a camera, in quantities that shrink toward the ordinary.
#[derive(Clone, Debug)]
pub struct ExtremeGaussian {
    /// Pixel of the center over the image size; the image is 0 to 1.
    pub at: [f64; 2],
    /// Depth in world units before scaling; negative behind the camera.
    pub depth: f64,
    /// Decimal logarithm of the largest standard deviation over one pixel at that depth.
    pub log10_pixels: f64,
    /// Decimal logarithms of the largest over the other two.
    pub log10_ratios: [f64; 2],
    /// Stored quaternion, any norm.
    pub rotation: [f32; 4],
    /// Opacity logit.
    pub opacity_logit: f32,
    /// Factor on the SH coefficients.
    pub sh_factor: f32,
}

/// A camera and what it sees.
#[derive(Clone, Debug)]
pub struct ExtremeScene {
    /// Decimal logarithm of the size of the world.
    pub log10_scale: f64,
    /// Focal length over the image width.
    pub focal: f64,
    /// Principal point over the image size.
    pub principal: [f64; 2],
    /// Rotation angles of the camera.
    pub angles: [f64; 3],
    /// Image size, pixels.
    pub size: [usize; 2],
    /// Degree of the spherical harmonics.
    pub sh_degree: u8,
    /// What the camera sees.
    pub gaussians: Vec<ExtremeGaussian>,
}

fn gaussian() -> impl Strategy<Value = ExtremeGaussian> {
    let depth = prop_oneof![
        6 => (0.0..2.0f64).prop_map(|e| 10f64.powf(e)),
        2 => (-4.0..8.0f64).prop_map(|e| 10f64.powf(e)),
        1 => (-4.0..4.0f64).prop_map(|e| -10f64.powf(e)),
        1 => Just(0.0),
    ];
    let log10_pixels = prop_oneof![6 => -1.0..1.3f64, 2 => -9.0..9.0f64];
    let ratio = || prop_oneof![4 => 0.0..1.0f64, 1 => 0.0..6.0f64];
    let quaternion = prop::array::uniform4(-1.0..1.0f32);
    let rotation = prop_oneof![
        6 => quaternion.clone(),
        1 => (quaternion, -4.0..4.0f32).prop_map(|(q, e)| q.map(|v| v * 10f32.powf(e))),
        1 => Just([0.0; 4]),
    ];
    let opacity_logit = prop_oneof![6 => -4.0..6.0f32, 1 => -1e4..1e4f32];
    let sh_factor = prop_oneof![6 => Just(1.0f32), 1 => Just(1e4f32)];
    (
        [-0.3..1.3f64, -0.3..1.3f64],
        depth,
        log10_pixels,
        [ratio(), ratio()],
        rotation,
        opacity_logit,
        sh_factor,
    )
        .prop_map(
            |(at, depth, log10_pixels, log10_ratios, rotation, opacity_logit, sh_factor)| {
                ExtremeGaussian {
                    at,
                    depth,
                    log10_pixels,
                    log10_ratios,
                    rotation,
                    opacity_logit,
                    sh_factor,
                }
            },
        )
}

/// Scenes of 0 to `most` Gaussians with world sizes of 1e-6 to 1e6, focal lengths of 0.1 to 50
/// image widths, principal points off the image, Gaussians behind and at the camera, needles of
/// 1:1e6, quaternions of any norm, logits and coefficients up to 1e4.
pub fn extreme_scenes(most: usize) -> impl Strategy<Value = ExtremeScene> {
    let log10_scale = prop_oneof![2 => Just(0.0), 3 => -6.0..6.0f64];
    let focal = prop_oneof![2 => Just(1.1), 3 => (-1.0..1.7f64).prop_map(|e| 10f64.powf(e))];
    let principal = prop_oneof![3 => [0.4..0.6f64, 0.4..0.6f64], 1 => [-3.0..3.0f64, -3.0..3.0f64]];
    (
        log10_scale,
        focal,
        principal,
        prop::array::uniform3(-3.0..3.0f64),
        [1usize..40, 1usize..30],
        0u8..=2,
        prop::collection::vec(gaussian(), 0..=most),
    )
        .prop_map(|(log10_scale, focal, principal, angles, size, sh_degree, gaussians)| {
            ExtremeScene { log10_scale, focal, principal, angles, size, sh_degree, gaussians }
        })
}

impl ExtremeScene {
    /// The camera.
    pub fn camera(&self) -> Pinhole {
        let [width, height] = self.size;
        let (w, h) = (width as f64, height as f64);
        Pinhole {
            fx: self.focal * w,
            fy: 0.95 * self.focal * w,
            cx: self.principal[0] * w,
            cy: self.principal[1] * h,
            width,
            height,
        }
    }

    /// `camera_from_world`: the camera stands about one unit from the origin of the scaled world.
    pub fn pose(&self) -> Pose {
        let [a, b, c] = self.angles;
        let rotation = DQuat::from_euler(glam::EulerRot::XYZ, a, b, c);
        Pose { rotation, translation: DVec3::new(0.3, -0.7, 0.5) * self.scale() }
    }

    fn scale(&self) -> f64 {
        10f64.powf(self.log10_scale)
    }

    /// The Gaussians as a file would hold them.
    pub fn gaussians(&self) -> Gaussians {
        let (camera, world_from_camera) = (self.camera(), self.pose().inverse());
        let mut out = Gaussians::empty(self.sh_degree);
        for (i, g) in self.gaussians.iter().enumerate() {
            let z = g.depth * self.scale();
            let x = (g.at[0] * camera.width as f64 - camera.cx) / camera.fx * z;
            let y = (g.at[1] * camera.height as f64 - camera.cy) / camera.fy * z;
            let mean = world_from_camera.transform_point(DVec3::new(x, y, z));
            out.means.push(mean.as_vec3().to_array());
            let pixel = (z.abs() / camera.fx).max(1e-9 * self.scale());
            let largest = pixel.ln() + g.log10_pixels * std::f64::consts::LN_10;
            let below = |ratio: f64| (largest - ratio * std::f64::consts::LN_10) as f32;
            let [b, c] = g.log10_ratios;
            out.log_scales.push([largest as f32, below(b), below(c)]);
            out.rotations.push(g.rotation);
            out.opacity_logits.push(g.opacity_logit);
            let wave = |k: usize| ((i * 31 + k * 17) as f32).sin();
            out.sh.extend(
                (0..3 * sh_coefficients(self.sh_degree)).map(|k| g.sh_factor * 0.4 * wave(k)),
            );
        }
        out
    }
}
