//! The image formation in double precision, one loop per equation: slow, plain, the oracle.
//!
//! No tiles, no SIMD, no bounding boxes: every pixel asks every Gaussian. The cut-offs are the
//! same constants as on the fast path, because they are part of the model.

use glam::{DMat3, DQuat, DVec3};
use motes_math::sh::{sh_basis_f64, sh_coefficients};
use motes_scene::{Gaussians, Pinhole, Pose};

use crate::options::{ALPHA_MAX, ALPHA_MIN, Antialias, BLUR_VARIANCE_PX2, TRANSMITTANCE_MIN};

/// All parameters of a set of Gaussians in double precision, in the stored space of
/// [`Gaussians`], plus the modifiers of fitting.
#[derive(Clone, Debug)]
#[expect(missing_docs, reason = "fields mirror `Gaussians` and `Modifiers`")]
pub struct ReferenceGaussians {
    pub means: Vec<[f64; 3]>,
    pub rotations: Vec<[f64; 4]>,
    pub log_scales: Vec<[f64; 3]>,
    pub opacity_logits: Vec<f64>,
    pub sh_degree: u8,
    pub sh: Vec<f64>,
    pub filter_3d: Vec<f64>,
    pub opacity_gain: Vec<f64>,
}

impl ReferenceGaussians {
    /// Widens single-precision Gaussians; no filter, no gain.
    pub fn new(g: &Gaussians) -> Self {
        Self {
            means: g.means.iter().map(|v| v.map(f64::from)).collect(),
            rotations: g.rotations.iter().map(|v| v.map(f64::from)).collect(),
            log_scales: g.log_scales.iter().map(|v| v.map(f64::from)).collect(),
            opacity_logits: g.opacity_logits.iter().map(|&v| f64::from(v)).collect(),
            sh_degree: g.sh_degree,
            sh: g.sh.iter().map(|&v| f64::from(v)).collect(),
            filter_3d: vec![0.0; g.len()],
            opacity_gain: vec![1.0; g.len()],
        }
    }
}

/// Where contributions stop counting. Those of the model, or moved a little: a test that compares
/// two implementations leaves out the pixels that a cut-off passes between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutoffs {
    /// Fainter contributions are dropped.
    pub alpha: f64,
    /// A pixel is finished below this.
    pub transmittance: f64,
    /// Nothing beyond this many standard deviations.
    pub sigmas: f64,
}

impl Default for Cutoffs {
    fn default() -> Self {
        Self {
            alpha: f64::from(ALPHA_MIN),
            transmittance: f64::from(TRANSMITTANCE_MIN),
            sigmas: f64::INFINITY,
        }
    }
}

/// In which order pixels composite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// By depth of the centers.
    Centers,
    /// By depth on the ray through the center of the square of this many pixels around a pixel.
    Squares(usize),
}

struct Projected {
    center: [f64; 2],
    /// Inverse of the blurred projected covariance: A, B, C.
    conic: [f64; 3],
    opacity: f64,
    color: [f64; 3],
    depth: f64,
    depth_slope: [f64; 2],
    covariance: [f64; 3],
}

impl Projected {
    /// Depth of the densest point on the ray through `pixel`; see `Splat::depth_at`.
    fn depth_at(&self, pixel: [f64; 2], cutoffs: &Cutoffs) -> f64 {
        let [xx, xy, yy] = self.covariance;
        let radius2 =
            (2.0 * (self.opacity / cutoffs.alpha).ln()).max(0.0).min(cutoffs.sigmas.powi(2));
        let half_height = (radius2 * yy).sqrt();
        let half_width = (radius2 * (xx - xy * xy / yy)).sqrt() + (xy / yy * half_height).abs();
        let dx = (pixel[0] - self.center[0]).clamp(-half_width, half_width);
        let dy = (pixel[1] - self.center[1]).clamp(-half_height, half_height);
        let depth = self.depth + self.depth_slope[0] * dx + self.depth_slope[1] * dy;
        depth.max(1e-3 * self.depth)
    }
}

/// Color over `background` (3 values) and transmittance (1 value) per pixel, row-major.
pub fn render_reference(
    gaussians: &ReferenceGaussians,
    camera: &Pinhole,
    camera_from_world: &Pose,
    background: [f64; 3],
    antialias: Antialias,
) -> Vec<[f64; 4]> {
    let cutoffs = Cutoffs::default();
    render_reference_with(gaussians, camera, camera_from_world, background, antialias, cutoffs)
}

/// [`render_reference`] with other cut-offs.
pub fn render_reference_with(
    gaussians: &ReferenceGaussians,
    camera: &Pinhole,
    camera_from_world: &Pose,
    background: [f64; 3],
    antialias: Antialias,
    cutoffs: Cutoffs,
) -> Vec<[f64; 4]> {
    let order = Order::Centers;
    render_reference_in(gaussians, camera, camera_from_world, background, antialias, cutoffs, order)
}

/// [`render_reference`] with other cut-offs, in another order.
pub fn render_reference_in(
    gaussians: &ReferenceGaussians,
    camera: &Pinhole,
    camera_from_world: &Pose,
    background: [f64; 3],
    antialias: Antialias,
    cutoffs: Cutoffs,
    order: Order,
) -> Vec<[f64; 4]> {
    let mut projected: Vec<Projected> = (0..gaussians.means.len())
        .filter_map(|i| project(gaussians, i, camera, camera_from_world, antialias))
        .collect();
    projected.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    let mut image = Vec::with_capacity(camera.width * camera.height);
    for y in 0..camera.height {
        for x in 0..camera.width {
            let pixel = [x as f64 + 0.5, y as f64 + 0.5];
            let mut color = [0.0; 3];
            let mut transmittance = 1.0;
            if let Order::Squares(side) = order {
                let middle = |p: usize| (p / side * side) as f64 + side as f64 / 2.0;
                let ray = [middle(x), middle(y)];
                let depth = |g: &Projected| g.depth_at(ray, &cutoffs);
                projected.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
            }
            for g in &projected {
                let (dx, dy) = (pixel[0] - g.center[0], pixel[1] - g.center[1]);
                let [a, b, c] = g.conic;
                let q = a * dx * dx + 2.0 * b * dx * dy + c * dy * dy;
                let alpha = (g.opacity * (-0.5 * q).exp()).min(f64::from(ALPHA_MAX));
                if !(alpha >= cutoffs.alpha && q <= cutoffs.sigmas.powi(2)) {
                    continue;
                }
                if transmittance < cutoffs.transmittance {
                    break;
                }
                for (out, c) in color.iter_mut().zip(g.color) {
                    *out += alpha * transmittance * c;
                }
                transmittance *= 1.0 - alpha;
            }
            let c = |k: usize| color[k] + transmittance * background[k];
            image.push([c(0), c(1), c(2), transmittance]);
        }
    }
    image
}

fn project(
    gaussians: &ReferenceGaussians,
    i: usize,
    camera: &Pinhole,
    camera_from_world: &Pose,
    antialias: Antialias,
) -> Option<Projected> {
    let mean = DVec3::from(gaussians.means[i]);
    let p = camera_from_world.transform_point(mean);
    if !(p.z > 0.0 && p.z > 1e-3 * p.length()) {
        return None;
    }
    let [w, x, y, z] = gaussians.rotations[i];
    // A quaternion without a direction is not a rotation; the bounds are those of single precision.
    if !(1e-20..=1e20).contains(&(w * w + x * x + y * y + z * z)) {
        return None;
    }
    let axes = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
    let variance = DVec3::from(gaussians.log_scales[i].map(|s| (2.0 * s).exp()));
    let smoothed = variance + gaussians.filter_3d[i].powi(2);
    let view_offset = mean - camera_from_world.center_in_world();
    let local = axes.transpose() * view_offset;
    if (local * local / smoothed).element_sum() <= 1.0 {
        return None;
    }
    let covariance = axes * DMat3::from_diagonal(smoothed) * axes.transpose();

    // The Jacobian is taken inside the field of view plus 15 % of the image on each side.
    let (width, height) = (camera.width as f64, camera.height as f64);
    let slope_x = (p.x / p.z).clamp(
        (-camera.cx - 0.15 * width) / camera.fx,
        (width - camera.cx + 0.15 * width) / camera.fx,
    );
    let slope_y = (p.y / p.z).clamp(
        (-camera.cy - 0.15 * height) / camera.fy,
        (height - camera.cy + 0.15 * height) / camera.fy,
    );
    let jacobian = [
        DVec3::new(camera.fx / p.z, 0.0, -camera.fx * slope_x / p.z),
        DVec3::new(0.0, camera.fy / p.z, -camera.fy * slope_y / p.z),
    ];
    let rotation = camera_from_world.rotation_matrix();
    let covariance_camera = rotation * covariance * rotation.transpose();
    let sigma = |r: usize, s: usize| jacobian[r].dot(covariance_camera * jacobian[s]);
    let (sharp_xx, xy, sharp_yy) = (sigma(0, 0), sigma(0, 1), sigma(1, 1));
    let blur = f64::from(BLUR_VARIANCE_PX2);
    let (xx, yy) = (sharp_xx + blur, sharp_yy + blur);
    let determinant = xx * yy - xy * xy;
    let with_depth = jacobian.map(|row| row.dot(covariance_camera * DVec3::Z));

    let mut opacity = gaussians.opacity_gain[i] / (1.0 + (-gaussians.opacity_logits[i]).exp());
    opacity *=
        (variance.x * variance.y * variance.z / (smoothed.x * smoothed.y * smoothed.z)).sqrt();
    if antialias == Antialias::Mip {
        opacity *= ((sharp_xx * sharp_yy - xy * xy) / determinant).max(0.0).sqrt();
    }

    let mut basis = [0.0; 25];
    sh_basis_f64(gaussians.sh_degree, view_offset.normalize().to_array(), &mut basis);
    let k = sh_coefficients(gaussians.sh_degree);
    let color = std::array::from_fn(|c| {
        let sum: f64 = (0..k).map(|j| basis[j] * gaussians.sh[(i * k + j) * 3 + c]).sum();
        (0.5 + sum).max(0.0)
    });
    Some(Projected {
        center: [camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy],
        conic: [yy / determinant, -xy / determinant, xx / determinant],
        opacity,
        color,
        depth: p.z,
        depth_slope: [
            (with_depth[0] * yy - with_depth[1] * xy) / determinant,
            (with_depth[1] * xx - with_depth[0] * xy) / determinant,
        ],
        covariance: [xx, xy, yy],
    })
}
