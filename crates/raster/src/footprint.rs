//! What projecting a Gaussian computes before the conic, one Gaussian per lane; shared by forward
//! and backward.

use fearless_simd::{Simd, prelude::*};
use motes_scene::Gaussians;

use crate::lanes::{
    MAX_LANES, Vec3s, cross, dot, exp, from_axes, in_axes, load_columns, product, scaled, sigmoid,
    three,
};
use crate::options::{BLUR_VARIANCE_PX2, Modifiers};
use crate::view::ViewTransform;

/// Stored parameters of some Gaussians, without the colors.
pub(crate) struct Rows<S: Simd> {
    pub(crate) mean: Vec3s<S>,
    /// `w, x, y, z`
    pub(crate) quaternion: [S::f32s; 4],
    log_scale: Vec3s<S>,
    opacity_logit: S::f32s,
    pub(crate) filter: S::f32s,
    opacity_gain: S::f32s,
}

impl<S: Simd> Rows<S> {
    /// Those of `first + rows[lane]`.
    #[inline(always)]
    pub(crate) fn gather(
        simd: S,
        gaussians: &Gaussians,
        modifiers: &Modifiers<'_>,
        first: usize,
        rows: &[u32],
    ) -> Self {
        let mut columns = [[0.0f32; MAX_LANES]; 13];
        for (lane, &row) in rows[..S::f32s::LEN].iter().enumerate() {
            let i = first + row as usize;
            let (mean, scale) = (&gaussians.means[i], &gaussians.log_scales[i]);
            for (column, value) in columns[..3].iter_mut().zip(mean) {
                column[lane] = *value;
            }
            for (column, value) in columns[3..7].iter_mut().zip(&gaussians.rotations[i]) {
                column[lane] = *value;
            }
            for (column, value) in columns[7..10].iter_mut().zip(scale) {
                column[lane] = *value;
            }
            columns[10][lane] = gaussians.opacity_logits[i];
            columns[11][lane] = modifiers.filter_3d(i);
            columns[12][lane] = modifiers.opacity_gain(i);
        }
        let [a, b, c, d, e, f, g, h, i, j, k, l, m] = load_columns(simd, &columns);
        Self {
            mean: [a, b, c],
            quaternion: [d, e, f, g],
            log_scale: [h, i, j],
            opacity_logit: k,
            filter: l,
            opacity_gain: m,
        }
    }
}

/// Lanes of Gaussians in front of the camera; the others hold anything.
pub(crate) struct Footprint<S: Simd> {
    /// Lanes that are neither behind the camera, nor around it, nor broken.
    pub(crate) alive: S::mask32s,
    /// Center in the camera frame.
    pub(crate) p: Vec3s<S>,
    pub(crate) inverse_z: S::f32s,
    /// Local axes in world, unit.
    pub(crate) axes: [Vec3s<S>; 3],
    /// One over the norm of the stored quaternion.
    pub(crate) inverse_norm: S::f32s,
    /// `σ²` and `σ² + filter²` per local axis.
    pub(crate) variance: Vec3s<S>,
    pub(crate) smoothed_variance: Vec3s<S>,
    /// Rows of `J W`, each a vector in world axes, and in local axes.
    pub(crate) jw: [Vec3s<S>; 2],
    pub(crate) local: [Vec3s<S>; 2],
    /// `x/z`, `y/z`: as they are, and where the Jacobian was evaluated.
    pub(crate) raw_slope: [S::f32s; 2],
    pub(crate) slope: [S::f32s; 2],
    /// Projected covariance with blur: xx, xy, yy, px².
    pub(crate) covariance: [S::f32s; 3],
    /// Its determinant over yy, px²: with blur, and without it.
    pub(crate) schur: S::f32s,
    pub(crate) sharp_schur: S::f32s,
    /// Logistic of the stored logit, and opacity after gain and 3D filter.
    pub(crate) sigmoid: S::f32s,
    pub(crate) opacity: S::f32s,
}

impl<S: Simd> Footprint<S> {
    /// `None` when no lane is in front of the camera.
    #[inline(always)]
    pub(crate) fn new(simd: S, view: &ViewTransform, rows: &Rows<S>, near: f32) -> Option<Self> {
        let one = S::f32s::simd_from(simd, 1.0);
        let offset = view.lanes_to::<S>(rows.mean);
        let r = view.rotation;
        let p = three!(k => dot_constant::<S>(offset, r.row(k)));
        // The second bound keeps directions at a right angle to the axis from exploding.
        let in_front = p[2].simd_gt(near) & p[2].simd_gt(dot(p, p).sqrt() * 1e-3);
        if !in_front.any_true() {
            return None;
        }
        let [w, x, y, z] = rows.quaternion;
        let norm2 = w * w + x * x + y * y + z * z;
        let turned = norm2.simd_gt(1e-20) & norm2.simd_lt(1e20);
        let inverse_norm = one / norm2.sqrt();
        let axes = axes_of::<S>(
            one,
            [w * inverse_norm, x * inverse_norm, y * inverse_norm, z * inverse_norm],
        );
        let variance = three!(k => exp(simd, rows.log_scale[k] * 2.0));
        let filter2 = rows.filter * rows.filter;
        let smoothed_variance = three!(k => variance[k] + filter2);
        // A camera inside the 1σ ellipsoid sees no ellipse.
        let at = in_axes(axes, offset);
        let distance2 = three!(k => at[k] * at[k] / smoothed_variance[k].max(1e-37));
        let outside = (distance2[0] + distance2[1] + distance2[2]).simd_gt(1.0);
        let sigmoid = sigmoid(simd, rows.opacity_logit);
        let mut opacity = rows.opacity_gain * sigmoid;
        let filtered = rows.filter.simd_gt(0.0);
        if filtered.any_true() {
            let ratio = three!(k => variance[k] / smoothed_variance[k]);
            let faded = opacity * (ratio[0] * ratio[1] * ratio[2]).sqrt();
            opacity = filtered.select(faded, opacity);
        }
        let inverse_z = one / p[2];
        let raw_slope = [p[0] * inverse_z, p[1] * inverse_z];
        let (low, high) = (view.slope_min, view.slope_max);
        let slope = [raw_slope[0].max(low[0]).min(high[0]), raw_slope[1].max(low[1]).min(high[1])];
        let jw = [
            row_of_jw::<S>(view, 0, slope[0], inverse_z),
            row_of_jw::<S>(view, 1, slope[1], inverse_z),
        ];
        let local = [in_axes(axes, jw[0]), in_axes(axes, jw[1])];
        let (covariance, schur, sharp_schur) = covariance_of::<S>(one, local, smoothed_variance);
        Some(Self {
            alive: in_front & turned & outside,
            p,
            inverse_z,
            axes,
            inverse_norm,
            variance,
            smoothed_variance,
            jw,
            local,
            raw_slope,
            slope,
            covariance,
            schur,
            sharp_schur,
            sigmoid,
            opacity,
        })
    }

    /// Change of depth per pixel along the ridge of the Gaussian: the mean of z given the pixel,
    /// `z + cov(z, pixel) Σ'⁻¹ offset`, which is where the density along a ray is largest when the
    /// projection is taken as affine (Radl et al. 2024 sort by that depth).
    #[inline(always)]
    pub(crate) fn depth_slope(&self, view: &ViewTransform) -> [S::f32s; 2] {
        let [_, xy, yy] = self.covariance;
        let row2 = view.rotation.row(2);
        let along =
            product(three!(k => dot_constant::<S>(self.axes[k], row2)), self.smoothed_variance);
        let [zx, zy] = [dot(along, self.local[0]), dot(along, self.local[1])];
        let x = (zx - zy * (xy / yy)) / self.schur;
        [x, (zy - xy * x) / yy]
    }

    /// A vector in local axes, in world axes.
    #[inline(always)]
    pub(crate) fn in_world(&self, local: Vec3s<S>) -> Vec3s<S> {
        from_axes(self.axes, local)
    }
}

/// Row `k` of `J W`, where the Jacobian is evaluated at `slope`.
#[inline(always)]
fn row_of_jw<S: Simd>(
    view: &ViewTransform,
    k: usize,
    slope: S::f32s,
    inverse_z: S::f32s,
) -> Vec3s<S> {
    let (row, row2) = (view.rotation.row(k).to_array(), view.rotation.row(2).to_array());
    let scale = inverse_z * view.focal[k];
    three!(c => (slope * -row2[c] + row[c]) * scale)
}

/// Covariance with blur, and its determinant over yy with blur and without, from the rows of `J W`
/// in local axes.
#[inline(always)]
fn covariance_of<S: Simd>(
    one: S::f32s,
    local: [Vec3s<S>; 2],
    variance: Vec3s<S>,
) -> ([S::f32s; 3], S::f32s, S::f32s) {
    // Rows of the Gaussian's own axes in pixels; Σ' is their Gram matrix plus blur.
    let sigma = three!(k => variance[k].sqrt());
    let [u, v] = [product(local[0], sigma), product(local[1], sigma)];
    let (sharp_xx, sharp_yy) = (dot(u, u), dot(v, v));
    let yy = sharp_yy + BLUR_VARIANCE_PX2;
    // det = |u × v|² + blur (|u|² + |v|²) + blur² has no difference in it, unlike xx yy - xy²,
    // and divided by yy it cannot overflow before the footprint does.
    let area = scaled(cross(u, v), one / yy.sqrt());
    let sharp_schur = dot(area, area);
    let inverse_yy = one / yy;
    let schur = sharp_schur
        + (sharp_xx * inverse_yy) * BLUR_VARIANCE_PX2
        + (sharp_yy + BLUR_VARIANCE_PX2) * inverse_yy * BLUR_VARIANCE_PX2;
    ([sharp_xx + BLUR_VARIANCE_PX2, dot(u, v), yy], schur, sharp_schur)
}

/// Local axes in world of unit quaternions.
#[inline(always)]
fn axes_of<S: Simd>(one: S::f32s, [w, x, y, z]: [S::f32s; 4]) -> [Vec3s<S>; 3] {
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let (xx, xy, xz) = (x * x2, x * y2, x * z2);
    let (yy, yz, zz) = (y * y2, y * z2, z * z2);
    let (wx, wy, wz) = (w * x2, w * y2, w * z2);
    [
        [one - (yy + zz), xy + wz, xz - wy],
        [xy - wz, one - (xx + zz), yz + wx],
        [xz + wy, yz - wx, one - (xx + yy)],
    ]
}

#[inline(always)]
fn dot_constant<S: Simd>(v: Vec3s<S>, c: glam::Vec3) -> S::f32s {
    v[0] * c.x + v[1] * c.y + v[2] * c.z
}
