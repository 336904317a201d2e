//! From gradients of one projected Gaussian to gradients of its stored parameters.
//!
//! The chain of [`crate::project`], backwards. The moments are those of `v` with `(E, D) = L offset`
//! and `Σ'⁻¹ = κ LᵀL`, κ = 16 ln 2; then `∂L/∂center = Σ v Σ'⁻¹ offset` and `∂L/∂Σ' = ½ κ² Lᵀ M L`
//! with `M` the second moments. Sums of rows with `shear = sb / sa` are formed first, because that is
//! where the length of a needle cancels.

use glam::{Mat3, Vec3};
use motes_math::sh::{sh_basis, sh_basis_gradient, sh_coefficients};
use motes_scene::Gaussians;

use crate::backward::MOMENTS;
use crate::options::{Modifiers, RenderOptions};
use crate::project::{Footprint, ViewTransform, raw_color};
use crate::splat::{MAHALANOBIS, Splat};

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
#[inline(always)]
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
    let sigmoid = motes_math::sigmoid::sigmoid(gaussians.opacity_logits[i]);
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
#[inline(always)]
fn outer(u: Vec3, v: Vec3) -> Mat3 {
    Mat3::from_cols(u * v.x, u * v.y, u * v.z)
}

/// Gradient by the camera-frame center, through the pixel position and through `J`.
#[inline(always)]
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
#[inline(always)]
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
#[inline(always)]
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
