//! World Gaussians to projected Gaussians of one view.
//!
//! With `p = W (mean - center)` in the camera frame and `J` the Jacobian of the pinhole
//! projection at `p`, the projected covariance is `Σ' = J W Σ Wᵀ Jᵀ + blur I` (Zwicker et al.
//! 2001). `Σ = R diag(σ² + filter²) Rᵀ`, where `filter` is the per-Gaussian 3D smoothing scale of
//! Mip-Splatting (Yu et al. 2024), which also lowers the opacity by
//! `Π sqrt(σ² / (σ² + filter²))`.

use glam::{Mat3, Quat, Vec3};
use motes_math::sh::{sh_basis, sh_coefficients};
use motes_math::sigmoid::sigmoid;
use motes_scene::{Gaussians, Pinhole, Pose};

use crate::options::{Antialias, BLUR_VARIANCE_PX2, Modifiers, RenderOptions};
use crate::parameters::Sorting;
use crate::splat::{Cutoffs, Splat};

/// One view in single precision, with the camera center kept apart from the rotation so that
/// `mean - center` cancels before anything is rounded.
#[derive(Clone, Debug)]
pub struct ViewTransform {
    /// Rotation world to camera.
    pub rotation: Mat3,
    /// Camera center in world.
    pub center: Vec3,
    /// What single precision leaves of it: a Gaussian close to a camera far from the origin would
    /// otherwise be off by the rounding of the camera.
    center_rest: Vec3,
    /// Focal lengths, pixels.
    pub focal: [f32; 2],
    /// Principal point, pixels.
    pub principal: [f32; 2],
    /// Image size, pixels.
    pub size: [usize; 2],
    /// Bounds of `x/z` and `y/z` inside which the Jacobian is evaluated: the field of view and
    /// 30 % of its half width around it, where the linearization still holds.
    slope_min: [f32; 2],
    slope_max: [f32; 2],
}

impl ViewTransform {
    /// From intrinsics and pose.
    pub fn new(camera: &Pinhole, camera_from_world: &Pose) -> Self {
        let (w, h) = (camera.width as f64, camera.height as f64);
        let exact = camera_from_world.center_in_world();
        let center = exact.as_vec3();
        let margin = [0.15 * w / camera.fx, 0.15 * h / camera.fy];
        Self {
            rotation: camera_from_world.rotation_matrix().as_mat3(),
            center,
            center_rest: (exact - center.as_dvec3()).as_vec3(),
            focal: [camera.fx as f32, camera.fy as f32],
            principal: [camera.cx as f32, camera.cy as f32],
            size: [camera.width, camera.height],
            slope_min: [
                (-camera.cx / camera.fx - margin[0]) as f32,
                (-camera.cy / camera.fy - margin[1]) as f32,
            ],
            slope_max: [
                ((w - camera.cx) / camera.fx + margin[0]) as f32,
                ((h - camera.cy) / camera.fy + margin[1]) as f32,
            ],
        }
    }

    /// From the camera center to a point, world axes.
    #[inline]
    pub fn offset_to(&self, point: [f32; 3]) -> Vec3 {
        (Vec3::from(point) - self.center) - self.center_rest
    }
}

/// What projecting one Gaussian computes before the conic; shared by forward and backward.
pub(crate) struct Footprint {
    /// Center in the camera frame.
    pub(crate) p: Vec3,
    /// Unit rotation, local axes to world.
    pub(crate) rotation: Mat3,
    /// Squared norm of the stored quaternion.
    pub(crate) quaternion_norm2: f32,
    /// `σ²` and `σ² + filter²` per local axis.
    pub(crate) variance: Vec3,
    pub(crate) smoothed_variance: Vec3,
    /// Rows of `J W`, each a vector in world axes.
    pub(crate) jw: [Vec3; 2],
    /// `x/z`, `y/z` where the Jacobian was evaluated, and whether each was inside its bounds.
    pub(crate) slope: [f32; 2],
    pub(crate) slope_free: [bool; 2],
    /// Projected covariance with blur: xx, xy, yy, px².
    pub(crate) covariance: [f32; 3],
    /// Its determinant over yy, px²: with blur, and without it.
    pub(crate) schur: f32,
    pub(crate) sharp_schur: f32,
    /// Opacity after the 3D filter.
    pub(crate) opacity: f32,
}

impl Footprint {
    /// `None` when the Gaussian is behind the camera, around it, or not finite.
    #[inline(always)]
    pub(crate) fn new(
        view: &ViewTransform,
        gaussians: &Gaussians,
        i: usize,
        modifiers: &Modifiers<'_>,
        near: f32,
    ) -> Option<Self> {
        let offset = view.offset_to(gaussians.means[i]);
        let p = view.rotation * offset;
        // The second bound keeps directions at a right angle to the axis from exploding.
        if !(p.z > near && p.z > 1e-3 * p.length()) {
            return None;
        }
        let [w, x, y, z] = gaussians.rotations[i];
        let quaternion_norm2 = w * w + x * x + y * y + z * z;
        if !(quaternion_norm2 > 1e-20 && quaternion_norm2 < 1e20) {
            return None;
        }
        let rotation =
            Mat3::from_quat(Quat::from_xyzw(x, y, z, w) * quaternion_norm2.sqrt().recip());
        let variance = (Vec3::from(gaussians.log_scales[i]) * 2.0).exp();
        let filter = modifiers.filter_3d(i);
        let smoothed_variance = variance + filter * filter;
        // A camera inside the 1σ ellipsoid sees no ellipse.
        let local = rotation.transpose() * offset;
        if !((local * local / smoothed_variance.max(Vec3::splat(1e-37))).element_sum() > 1.0) {
            return None;
        }
        let mut opacity = modifiers.opacity_gain(i) * sigmoid(gaussians.opacity_logits[i]);
        if filter > 0.0 {
            let ratio = variance / smoothed_variance;
            opacity *= (ratio.x * ratio.y * ratio.z).sqrt();
        }
        let inverse_z = p.z.recip();
        let raw = [p.x * inverse_z, p.y * inverse_z];
        let slope = [
            // Not `clamp`, which panics on the bounds of a camera that is none.
            raw[0].max(view.slope_min[0]).min(view.slope_max[0]),
            raw[1].max(view.slope_min[1]).min(view.slope_max[1]),
        ];
        let r = view.rotation;
        let (row0, row1, row2) = (r.row(0), r.row(1), r.row(2));
        let jw = [
            (row0 - row2 * slope[0]) * (view.focal[0] * inverse_z),
            (row1 - row2 * slope[1]) * (view.focal[1] * inverse_z),
        ];
        // Rows of the Gaussian's own axes in pixels; Σ' is their Gram matrix plus blur.
        let sigma = Vec3::from(smoothed_variance.to_array().map(f32::sqrt));
        let [u, v] = jw.map(|row| (rotation.transpose() * row) * sigma);
        let (sharp_xx, sharp_yy) = (u.dot(u), v.dot(v));
        let yy = sharp_yy + BLUR_VARIANCE_PX2;
        // det = |u × v|² + blur (|u|² + |v|²) + blur² has no difference in it, unlike xx yy - xy²,
        // and divided by yy it cannot overflow before the footprint does.
        let sharp_schur = (u.cross(v) * yy.sqrt().recip()).length_squared();
        let schur = sharp_schur
            + BLUR_VARIANCE_PX2 * (sharp_xx / yy)
            + BLUR_VARIANCE_PX2 * (sharp_yy + BLUR_VARIANCE_PX2) / yy;
        Some(Self {
            p,
            rotation,
            quaternion_norm2,
            variance,
            smoothed_variance,
            jw,
            slope,
            slope_free: [raw[0] == slope[0], raw[1] == slope[1]],
            covariance: [sharp_xx + BLUR_VARIANCE_PX2, u.dot(v), yy],
            schur,
            sharp_schur,
            opacity,
        })
    }

    /// Change of depth per pixel along the ridge of the Gaussian: the mean of z given the pixel,
    /// `z + cov(z, pixel) Σ'⁻¹ offset`, which is where the density along a ray is largest when the
    /// projection is taken as affine (Radl et al. 2024 sort by that depth).
    #[inline(always)]
    fn depth_slope(&self, view: &ViewTransform) -> [f32; 2] {
        let [_, xy, yy] = self.covariance;
        let along = self.rotation.transpose() * view.rotation.row(2) * self.smoothed_variance;
        let [zx, zy] = self.jw.map(|row| along.dot(self.rotation.transpose() * row));
        let x = (zx - zy * (xy / yy)) / self.schur;
        [x, (zy - xy * x) / yy]
    }
}

/// Unclamped color `0.5 + Σ Y_k sh_k` of Gaussian `i` seen along `direction` (unit).
#[inline(always)]
pub(crate) fn raw_color(
    gaussians: &Gaussians,
    i: usize,
    degree: u8,
    basis: &[f32; 25],
) -> [f32; 3] {
    let sh = gaussians.sh_of(i);
    let mut color = [0.5f32; 3];
    for (y, c) in basis[..sh_coefficients(degree)].iter().zip(sh.chunks_exact(3)) {
        for (color, c) in color.iter_mut().zip(c) {
            *color += y * c;
        }
    }
    color
}

/// Projects Gaussian `i`; [`Splat::INVISIBLE`] when it cannot touch the image.
#[inline(always)]
pub(crate) fn project(
    view: &ViewTransform,
    gaussians: &Gaussians,
    i: usize,
    modifiers: &Modifiers<'_>,
    options: &RenderOptions,
    cutoffs: &Cutoffs,
) -> Splat {
    project_visible(view, gaussians, i, modifiers, options, cutoffs).unwrap_or(Splat::INVISIBLE)
}

#[inline(always)]
fn project_visible(
    view: &ViewTransform,
    gaussians: &Gaussians,
    i: usize,
    modifiers: &Modifiers<'_>,
    options: &RenderOptions,
    cutoffs: &Cutoffs,
) -> Option<Splat> {
    let f = Footprint::new(view, gaussians, i, modifiers, options.near)?;
    let mut opacity = f.opacity;
    if options.antialias == Antialias::Mip {
        opacity *= (f.sharp_schur / f.schur).sqrt();
    }
    let x = view.focal[0] * (f.p.x / f.p.z) + view.principal[0];
    let y = view.focal[1] * (f.p.y / f.p.z) + view.principal[1];
    let (splat, half_width) = Splat::new([x, y], f.covariance, f.schur, opacity, cutoffs)?;
    let [w, h] = view.size.map(|s| s as f32);
    let on_image = x + half_width > 0.0
        && x - half_width < w
        && y + splat.half_height > 0.0
        && y - splat.half_height < h;
    if !on_image {
        return None;
    }
    let degree = options.sh_degree_limit.unwrap_or(4).min(gaussians.sh_degree);
    let direction = view.offset_to(gaussians.means[i]).normalize_or_zero();
    let mut basis = [0.0; 25];
    sh_basis(degree, direction.to_array(), &mut basis);
    let color = raw_color(gaussians, i, degree, &basis).map(|v| v.max(0.0));
    if !color.iter().all(|v| v.is_finite()) {
        return None;
    }
    let depth_slope = match options.parameters.sort {
        Sorting::Global => [0.0; 2],
        Sorting::Tile | Sorting::Pixel => f.depth_slope(view),
    };
    Some(Splat { color, depth: f.p.z, depth_slope, ..splat })
}
