//! Projection and chain of one Gaussian at a time, in plain single precision: the reference of the
//! tests of the lanes.

use glam::{Mat3, Quat, Vec3};
use motes_math::sh::{sh_basis, sh_basis_gradient, sh_coefficients};
use motes_math::sigmoid::sigmoid;
use motes_scene::Gaussians;

use crate::backward::MOMENTS;
use crate::options::{Antialias, BLUR_VARIANCE_PX2, Modifiers, RenderOptions};
use crate::parameters::Sorting;
use crate::splat::{Cutoffs, MAHALANOBIS, Splat};
use crate::view::ViewTransform;

/// What projecting one Gaussian computes before the conic; shared by forward and backward.
struct Footprint {
    /// Center in the camera frame.
    p: Vec3,
    /// Unit rotation, local axes to world.
    rotation: Mat3,
    /// Squared norm of the stored quaternion.
    quaternion_norm2: f32,
    /// `σ²` and `σ² + filter²` per local axis.
    variance: Vec3,
    smoothed_variance: Vec3,
    /// Rows of `J W`, each a vector in world axes.
    jw: [Vec3; 2],
    /// `x/z`, `y/z` where the Jacobian was evaluated, and whether each was inside its bounds.
    slope: [f32; 2],
    slope_free: [bool; 2],
    /// Projected covariance with blur: xx, xy, yy, px².
    covariance: [f32; 3],
    /// Its determinant over yy, px²: with blur, and without it.
    schur: f32,
    sharp_schur: f32,
    /// Opacity after the 3D filter.
    opacity: f32,
}

impl Footprint {
    /// `None` when the Gaussian is behind the camera, around it, or not finite.
    fn new(
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
    fn depth_slope(&self, view: &ViewTransform) -> [f32; 2] {
        let [_, xy, yy] = self.covariance;
        let along = self.rotation.transpose() * view.rotation.row(2) * self.smoothed_variance;
        let [zx, zy] = self.jw.map(|row| along.dot(self.rotation.transpose() * row));
        let x = (zx - zy * (xy / yy)) / self.schur;
        [x, (zy - xy * x) / yy]
    }
}

/// Unclamped color `0.5 + Σ Y_k sh_k` of Gaussian `i` seen along `direction` (unit).
fn raw_color(gaussians: &Gaussians, i: usize, degree: u8, basis: &[f32; 25]) -> [f32; 3] {
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

/// Gradients of one Gaussian; SH gradients go straight to their array.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RowGradient {
    pub(crate) mean: [f32; 3],
    pub(crate) rotation: [f32; 4],
    pub(crate) log_scale: [f32; 3],
    pub(crate) opacity_logit: f32,
    pub(crate) center_norm: f32,
}

/// Chains `moments` (summed over all tiles) of Gaussian `i`; writes `sh` (`[K, 3]`).
pub(crate) fn project_backward(
    view: &ViewTransform,
    gaussians: &Gaussians,
    i: usize,
    modifiers: &Modifiers<'_>,
    options: &RenderOptions,
    splat: &Splat,
    moments: &[f32; MOMENTS],
    sh: &mut [f32],
) -> RowGradient {
    let Some(f) = Footprint::new(view, gaussians, i, modifiers, options.near) else {
        sh.fill(0.0);
        return RowGradient::default();
    };
    let [v0, ve, vd, vee, ved, vdd, ..] = *moments;
    let (sa, sd, shear) = (MAHALANOBIS * splat.sa, MAHALANOBIS * splat.sd, splat.shear());
    let d_center = [sa * ve, shear * (sa * ve) + sd * vd];
    let (alpha, beta, gamma) = (sa * sa * vee, sa * sd * ved, sd * sd * vdd);

    // Σ' = (JW) Σ (JW)ᵀ with Σ = R diag(s) Rᵀ; work in local axes, where Σ is diagonal.
    let local = f.jw.map(|row| f.rotation.transpose() * row);
    let sheared = local[0] + local[1] * shear;
    let s = f.smoothed_variance;
    // ∂L/∂(JW rows) = 2 ∂L/∂Σ' (JW) Σ
    let d_local0 = (sheared * alpha + local[1] * beta) * s;
    let d_local1 = d_local0 * shear + (sheared * beta + local[1] * gamma) * s;
    let d_local = [d_local0, d_local1];
    let d_jw = d_local.map(|row| f.rotation * row);
    // ∂L/∂s_k, twice
    let d_s =
        sheared * sheared * alpha + sheared * local[1] * (2.0 * beta) + local[1] * local[1] * gamma;
    // ∂L/∂R: Σ' depends on R through local = Rᵀ jw, so ∂L/∂R = Σ_r jw_r (∂L/∂local_r)ᵀ, and
    // ∂L/∂local_r is 2 G local Σ, the same as d_local.
    let d_rotation = outer(f.jw[0], d_local[0]) + outer(f.jw[1], d_local[1]);

    // Opacity and the 3D filter: ln o = ln sigmoid + Σ (ln σ_k - ½ ln s_k).
    let sigmoid = sigmoid(gaussians.opacity_logits[i]);
    let mut d_log_scale = d_s * f.variance;
    if modifiers.filter_3d(i) > 0.0 {
        d_log_scale += v0 * (Vec3::ONE - f.variance / f.smoothed_variance);
    }

    let d_mean_camera = mean_through_projection(view, &f, d_center, d_jw);
    let d_mean_color = color_backward(view, gaussians, i, options, moments, sh);
    let d_mean = view.rotation.transpose() * d_mean_camera + d_mean_color;
    let half = [view.size[0] as f32 * 0.5, view.size[1] as f32 * 0.5];
    let row = RowGradient {
        mean: d_mean.to_array(),
        rotation: quaternion_gradient(gaussians.rotations[i], f.quaternion_norm2, &d_rotation),
        log_scale: d_log_scale.to_array(),
        opacity_logit: v0 * (1.0 - sigmoid),
        center_norm: (d_center[0] * half[0]).hypot(d_center[1] * half[1]),
    };
    // A Gaussian whose numbers overflow cannot be improved by a step; it must not spoil the others.
    if row.is_finite() && sh.iter().all(|v| v.is_finite()) {
        return row;
    }
    sh.fill(0.0);
    RowGradient::default()
}

impl RowGradient {
    fn is_finite(&self) -> bool {
        let rest = [self.opacity_logit, self.center_norm];
        let all = self.mean.iter().chain(&self.rotation).chain(&self.log_scale).chain(&rest);
        all.fold(0.0, |sum, v| sum + v * 0.0) == 0.0
    }
}

/// `u vᵀ`
fn outer(u: Vec3, v: Vec3) -> Mat3 {
    Mat3::from_cols(u * v.x, u * v.y, u * v.z)
}

/// Gradient by the camera-frame center, through the pixel position and through `J`.
fn mean_through_projection(
    view: &ViewTransform,
    f: &Footprint,
    d_center: [f32; 2],
    d_jw: [Vec3; 2],
) -> Vec3 {
    let inverse_z = f.p.z.recip();
    let r = view.rotation;
    let row2 = r.row(2);
    let mut d = Vec3::ZERO;
    for axis in 0..2 {
        let focal = view.focal[axis];
        let exact_slope = f.p[axis] * inverse_z;
        // pixel = focal p_axis / z
        d[axis] += d_center[axis] * focal * inverse_z;
        d.z -= d_center[axis] * focal * exact_slope * inverse_z;
        // jw = (row_axis - row2 slope) focal / z
        let row = r.row(axis) - row2 * f.slope[axis];
        d.z -= d_jw[axis].dot(row) * focal * inverse_z * inverse_z;
        if f.slope_free[axis] {
            let d_slope = -d_jw[axis].dot(row2) * focal * inverse_z;
            d[axis] += d_slope * inverse_z;
            d.z -= d_slope * exact_slope * inverse_z;
        }
    }
    d
}

/// Writes the SH gradients; returns the gradient by the mean through the viewing direction.
fn color_backward(
    view: &ViewTransform,
    gaussians: &Gaussians,
    i: usize,
    options: &RenderOptions,
    moments: &[f32; MOMENTS],
    sh: &mut [f32],
) -> Vec3 {
    let degree = options.sh_degree_limit.unwrap_or(4).min(gaussians.sh_degree);
    let offset = view.offset_to(gaussians.means[i]);
    let distance = offset.length();
    let direction = offset.normalize_or_zero();
    let mut basis = [0.0; 25];
    sh_basis(degree, direction.to_array(), &mut basis);
    let raw = raw_color(gaussians, i, degree, &basis);
    let d_color: [f32; 3] =
        std::array::from_fn(|c| if raw[c] > 0.0 { moments[6 + c] } else { 0.0 });
    let k = sh_coefficients(degree);
    let (used, unused) = sh.split_at_mut(3 * k);
    for (out, y) in used.chunks_exact_mut(3).zip(&basis[..k]) {
        for (out, d) in out.iter_mut().zip(d_color) {
            *out = y * d;
        }
    }
    unused.fill(0.0);
    if degree == 0 || !(distance > 0.0) {
        return Vec3::ZERO;
    }
    let mut gradient = [[0.0; 3]; 25];
    sh_basis_gradient(degree, direction.to_array(), &mut gradient);
    let mut d_direction = Vec3::ZERO;
    for (g, c) in gradient[1..k].iter().zip(gaussians.sh_of(i)[3..].chunks_exact(3)) {
        let weight = c[0] * d_color[0] + c[1] * d_color[1] + c[2] * d_color[2];
        d_direction += Vec3::from(*g) * weight;
    }
    // Normalizing projects on the tangent plane.
    let tangent = d_direction - direction * direction.dot(d_direction);
    tangent / distance
}

/// `∂L/∂q` of the stored quaternion `w x y z` from `∂L/∂R` of `R(q / |q|)`.
fn quaternion_gradient(stored: [f32; 4], norm2: f32, d: &Mat3) -> [f32; 4] {
    let inverse_norm = norm2.sqrt().recip();
    let [w, x, y, z] = stored.map(|q| q * inverse_norm);
    // d.col(j)[i] is ∂L/∂R_ij.
    let e = |i: usize, j: usize| d.col(j)[i];
    let unit = [
        2.0 * (x * (e(2, 1) - e(1, 2)) + y * (e(0, 2) - e(2, 0)) + z * (e(1, 0) - e(0, 1))),
        2.0 * (y * (e(0, 1) + e(1, 0)) + z * (e(0, 2) + e(2, 0)) + w * (e(2, 1) - e(1, 2)))
            - 4.0 * x * (e(1, 1) + e(2, 2)),
        2.0 * (x * (e(0, 1) + e(1, 0)) + z * (e(1, 2) + e(2, 1)) + w * (e(0, 2) - e(2, 0)))
            - 4.0 * y * (e(0, 0) + e(2, 2)),
        2.0 * (x * (e(0, 2) + e(2, 0)) + y * (e(1, 2) + e(2, 1)) + w * (e(1, 0) - e(0, 1)))
            - 4.0 * z * (e(0, 0) + e(1, 1)),
    ];
    let q = [w, x, y, z];
    let along: f32 = q.iter().zip(unit).map(|(q, u)| q * u).sum();
    std::array::from_fn(|k| (unit[k] - q[k] * along) * inverse_norm)
}

#[cfg(test)]
mod tests;
